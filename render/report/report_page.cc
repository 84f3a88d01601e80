#include "render/report/report_page.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "absl/strings/escaping.h"
#include "absl/strings/str_format.h"
#include <google/protobuf/util/time_util.h>

#include "render/base/text.h"
#include "render/report/chart.h"
#include "render/report/convergence.h"
#include "render/report/photon_view.h"
#include "render/report/progress_view.h"
#include "render/wire/messages.h"

namespace lucerna {
namespace {

constexpr char kPageCss[] = R"css(
:root{color-scheme:light dark;--paper:#ffffff;--card:#f6f7f9;--muted:#5b636c;--rule:#dfe3e8;--bar:#b9d6ea;
  --warn:#8a5300}
@media(prefers-color-scheme:dark){:root{--paper:#14171a;--card:#1c2025;--muted:#9aa3ad;--rule:#30363d;
  --bar:#234a63;--warn:#f0c244}}
*{box-sizing:border-box}
body{margin:0;background:var(--paper);color:var(--ink);font:15px/1.5 system-ui,sans-serif}
main{max-width:1240px;margin:0 auto;padding:28px 24px 48px}
h1{font-size:27px;line-height:1.2;margin:0;overflow-wrap:anywhere}
h2{font-size:18px;margin:40px 0 12px}
p{margin:6px 0}
.muted,figcaption,caption{color:var(--muted)}
figcaption,caption{font-size:13px;text-align:left}
.top{display:grid;grid-template-columns:minmax(0,3fr) minmax(300px,2fr);gap:28px;margin-top:20px}
.pair{display:grid;grid-template-columns:repeat(2,minmax(0,1fr));gap:24px}
@media(max-width:860px){.top,.pair{grid-template-columns:minmax(0,1fr)}}
.pair+p{margin-top:16px}
figure{margin:0}
.picture img{display:block;width:100%;height:auto;border-radius:6px;background:#000}
.picture figcaption{margin-top:8px}
.none{display:grid;place-items:center;min-height:220px;border:1px dashed var(--rule);border-radius:6px;
  color:var(--muted)}
.card{background:var(--card);border:1px solid var(--rule);border-radius:8px;padding:16px 18px}
.card figcaption{margin-top:10px}
.headline{margin-bottom:16px}
.headline .figure{display:block;font-size:42px;line-height:1.15;font-weight:650;letter-spacing:-.5px}
dl{display:grid;grid-template-columns:max-content minmax(0,1fr);gap:4px 16px;margin:0}
dt{color:var(--muted)}
dd{margin:0;overflow-wrap:anywhere}
code{font:12.5px/1.4 ui-monospace,monospace;overflow-wrap:anywhere}
.scroll{overflow:auto;max-height:460px;border:1px solid var(--rule);border-radius:8px}
table{border-collapse:collapse;width:100%;font-size:13.5px;font-variant-numeric:tabular-nums}
caption{padding:10px 12px}
th,td{padding:5px 12px;text-align:right;white-space:nowrap;border-top:1px solid var(--rule)}
thead th{position:sticky;top:0;background:var(--card);font-weight:600;border-top:0}
th.name,td.name{text-align:left;min-width:150px;font-weight:400;white-space:normal;overflow-wrap:anywhere}
thead th.name{font-weight:600}
.share{width:26%;min-width:110px;text-align:left}
.share svg{display:block;width:100%;height:12px}
.share rect{fill:var(--bar)}
.warnings{margin:0;padding:0;list-style:none}
.warnings li{padding:6px 12px;border-left:3px solid var(--warn);background:var(--card);margin-bottom:6px;
  overflow-wrap:anywhere}
footer{margin-top:44px;font-size:13px;color:var(--muted)}
@media print{.scroll{max-height:none}main{max-width:none}.card,figure,tr{break-inside:avoid}}
)css";

std::string Passes(std::int64_t count) {
  return Concat(count, count == 1 ? " pass" : " passes");
}

std::string CountText(std::uint64_t count) {
  return ShortCount(static_cast<double>(count));
}

// "−0.67", with the sign that print has for it.
std::string Exponent(double exponent) {
  return Concat(exponent < 0 ? "−" : "", absl::StrFormat("%.2f", std::abs(exponent)));
}

std::string InLowerCase(std::string text) {
  for (char& c : text) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return text;
}

std::string EndInWords(const v1::Job& job) {
  if (job.state() == v1::JOB_STATE_FAILED) return Concat("failed: ", job.failure());
  if (job.state() != v1::JOB_STATE_SUCCEEDED) return InLowerCase(NameOf(job.state()));
  return StopInWords(job.stop_reason());
}

std::string EndsInWords(const RenderSettings& settings) {
  std::vector<std::string> ends;
  if (settings.error > 0) ends.push_back(Concat("error ≤ ", ShortPercent(settings.error)));
  if (settings.passes > 0) ends.push_back(Passes(settings.passes));
  if (settings.photons > 0) ends.push_back(Concat(CountText(settings.photons), " photons"));
  if (settings.time_s > 0) ends.push_back(absl::StrFormat("%g s", settings.time_s));
  return ends.empty() ? "none" : Listed(ends, " or ");
}

// Rows of a description list; all texts are escaped here.
class Facts {
 public:
  void Add(std::string_view term, std::string_view value) {
    absl::StrAppend(&rows_, "<dt>", EscapeMarkup(term), "</dt><dd>", EscapeMarkup(value),
                    "</dd>\n");
  }
  void AddCode(std::string_view term, std::string_view value) {
    absl::StrAppend(&rows_, "<dt>", EscapeMarkup(term), "</dt><dd><code>", EscapeMarkup(value),
                    "</code></dd>\n");
  }
  [[nodiscard]] bool empty() const { return rows_.empty(); }
  [[nodiscard]] std::string Html() const { return Concat("<dl>\n", rows_, "</dl>\n"); }

 private:
  std::string rows_;
};

std::string RunFacts(const v1::Job& job) {
  const v1::Progress& progress = job.progress();
  Facts facts;
  facts.Add("State", EndInWords(job));
  facts.Add("Passes", Concat(progress.passes()));
  facts.Add("Photons", CountText(progress.photons()));
  facts.Add("Time", ShortTime(FromProto(progress.running())));
  const Duration coordinator = FromProto(progress.coordinator_cpu());
  const Duration workers = FromProto(progress.worker_cpu());
  facts.Add("Processor time",
            Concat(ShortTime(coordinator + workers), " (workers ", ShortTime(workers),
                   ", coordinator ", ShortTime(coordinator), ")"));
  const double running_s = Seconds(FromProto(progress.running()));
  if (running_s > 0) {
    facts.Add("Photons per second",
              ShortCount(static_cast<double>(progress.photons()) / running_s));
  }
  if (progress.has_to_first_photons()) {
    facts.Add("To the first photons", ShortTime(FromProto(progress.to_first_photons())));
  }
  if (job.worker_shares_size() > 0) facts.Add("Workers", Concat(job.worker_shares_size()));
  if (const std::string energy = EnergyInWords(progress.tally().energy()); !energy.empty()) {
    facts.Add("Energy", energy);
  }
  return facts.Html();
}

std::string SettingFacts(const v1::Job& job, const std::optional<PageImage>& image) {
  const RenderSettings settings = SettingsOf(job);
  Facts facts;
  if (job.has_settings()) {
    facts.Add("Size", Concat(settings.width, " × ", settings.height, " pixels"));
    facts.Add("Stops at", EndsInWords(settings));
    facts.Add("Photons per pass", CountText(static_cast<std::uint64_t>(
                                      std::max<std::int64_t>(0, settings.photons_per_pass))));
    const bool has_frequency = UsesFrequency(settings.radius_controller);
    facts.Add(
        "Radius controller",
        Concat(NameOf(settings.radius_controller), absl::StrFormat(", alpha %.3g", settings.alpha),
               has_frequency ? Concat(", bias ", ShortPercent(settings.bias), ", ",
                                      ShortPercent(settings.frequency_share), " frequency photons")
                             : ""));
    facts.Add("First radius", settings.initial_radius > 0
                                  ? absl::StrFormat("%g scene units", settings.initial_radius)
                                  : "auto");
    facts.Add("Kernel", NameOf(settings.kernel));
    facts.Add("Depth", Concat("at most ", settings.max_depth, " scattering events"));
    facts.Add("Seed", Concat(settings.seed));
  }
  if (const auto digest = Digest::FromBytes(job.scene_digest()); digest.ok()) {
    facts.AddCode("Scene digest", digest->Hex());
  }
  if (image) facts.AddCode("Image digest", image->digest.Hex());
  return facts.empty() ? ""
                       : Concat("<section>\n<h2>Settings</h2>\n", facts.Html(), "</section>\n");
}

// The estimate in large figures, or why there is none.
std::string Headline(const v1::Job& job) {
  if (FoundNothing(job)) {
    return "<p class=\"headline\"><span class=\"muted\">Estimated relative error</span>"
           "<span class=\"figure\">unknown</span>Nothing found yet: no light has reached the "
           "view.</p>\n";
  }
  const auto error = NewestError(job);
  if (!error) {
    return "<p class=\"headline muted\">The error is not known: it has not been estimated "
           "yet.</p>\n";
  }
  std::string html =
      Concat("<p class=\"headline\"><span class=\"muted\">Estimated relative error</span>",
             "<span class=\"figure\">", ShortPercent(error->value), "</span>95 % interval ",
             ShortPercent(error->low), " to ", ShortPercent(error->high), "; untrimmed ",
             ShortPercent(error->untrimmed));
  if (const double target = SettingsOf(job).error; target > 0) {
    absl::StrAppend(&html, "; target ", ShortPercent(target));
  }
  if (error->truth) absl::StrAppend(&html, "; true error ", ShortPercent(*error->truth));
  if (error->true_untrimmed) {
    absl::StrAppend(&html, ", untrimmed ", ShortPercent(*error->true_untrimmed));
  }
  if (const auto denoised = DenoisedErrorOf(job)) {
    absl::StrAppend(&html, ". Denoised ", ErrorWithInterval(*denoised), "; untrimmed ",
                    ShortPercent(denoised->untrimmed));
    if (denoised->truth) {
      absl::StrAppend(&html, "; true error ", ShortPercent(*denoised->truth), ", untrimmed ",
                      ShortPercent(denoised->true_untrimmed.value_or(0)));
    }
  }
  return html + "</p>\n";
}

std::string ImageFigure(const v1::Job& job, const std::optional<PageImage>& image) {
  if (!image) {
    return "<figure class=\"picture\"><div class=\"none\">There is no image.</div></figure>\n";
  }
  return Concat("<figure class=\"picture\"><img alt=\"Rendered image of ", EscapeMarkup(job.name()),
                " after ", Passes(job.progress().passes()), "\" src=\"data:image/png;base64,",
                absl::Base64Escape(image->png), "\"></figure>\n");
}

std::string SlopeSentence(const v1::Job& job, ErrorAgainst against) {
  const auto law = FitOfSquaredError(job, against);
  if (!law) return "A slope needs three samples at least.";
  return Concat("Over the later half of the samples the squared error falls as ",
                against == ErrorAgainst::kTime ? "time" : "photons", "<sup>",
                Exponent(law->exponent),
                "</sup>. In theory the exponent tends to −2/3 for ppm with alpha 2/3, and is −1 "
                "for a fixed radius while noise prevails.");
}

std::string ErrorChart(const v1::Job& job, ErrorAgainst against) {
  const bool is_time = against == ErrorAgainst::kTime;
  ChartSeries estimate{.name = "estimate, 95 % interval"};
  ChartSeries noise{.name = "noise", .style = ChartStyle::kThinLine, .color = 2};
  ChartSeries bias{.name = "bias", .style = ChartStyle::kThinLine, .color = 3};
  ChartSeries truth{.name = "true error", .style = ChartStyle::kPoints, .color = 1};
  for (const v1::ErrorSample& sample : job.convergence()) {
    const double x = Abscissa(sample, against);
    const RelativeError error = ErrorOf(sample);
    estimate.points.push_back({x, 100 * error.value, 100 * error.low, 100 * error.high});
    noise.points.push_back({x, 100 * error.noise});
    bias.points.push_back({x, 100 * error.bias});
    if (error.truth) truth.points.push_back({x, 100 * *error.truth});
  }
  ChartSeries fitted{.style = ChartStyle::kDottedLine, .color = 6};
  if (const auto law = FitOfSquaredError(job, against)) {
    fitted.name = Concat("slope of squared error ", Exponent(law->exponent));
    for (const int i : {FirstFitted(job), job.convergence_size() - 1}) {
      const double x = Abscissa(job.convergence(i), against);
      fitted.points.push_back({x, 100 * std::sqrt(law->At(x))});
    }
  }
  Chart chart{.title = is_time ? "Error against time" : "Error against photons",
              .description = "No estimate of the error yet.",
              .x_label = is_time ? "time since the job began to run [s]" : "photons",
              .y_label = "relative error [%]",
              .series = {estimate, noise, bias, fitted, truth}};
  if (const auto newest = NewestError(job)) {
    const RelativeError first = ErrorOf(job.convergence(0));
    chart.description = Concat("The estimated relative error goes from ", ShortPercent(first.value),
                               " to ", ShortPercent(newest->value), ".");
  }
  if (const double target = SettingsOf(job).error; target > 0) {
    chart.levels.push_back({Concat("target ", ShortPercent(target)), 100 * target});
  }
  return Concat("<figure class=\"card\">", DrawChart(chart), "<figcaption>",
                SlopeSentence(job, against), "</figcaption></figure>\n");
}

std::string Convergence(const v1::Job& job) {
  std::string html = "<section>\n<h2>How the error fell</h2>\n";
  if (job.convergence().empty()) {
    return html + "<p class=\"muted\">There are no samples of the error yet.</p>\n</section>\n";
  }
  absl::StrAppend(&html, "<div class=\"pair\">\n", ErrorChart(job, ErrorAgainst::kTime),
                  ErrorChart(job, ErrorAgainst::kPhotons), "</div>\n");
  html +=
      "<p class=\"muted\">The relative error is the root of relMSE, the mean of error² / (value² + "
      "floor) over pixels and channels, without the worst 0.1 % of pixels. The floor is a "
      "hundredth "
      "of the squared mean luminance of the image without its brightest 1 %. Squared, noise and "
      "bias add up to it. The untrimmed error is that of all pixels.";
  if (job.has_reference()) {
    html += " The true error is that against the job's reference image.";
  }
  return html + "</p>\n</section>\n";
}

struct Column {
  const char* name;
  const char* css_class = "";
};

std::string TableTop(const std::string& caption, const std::vector<Column>& columns) {
  // Narrow windows and long tables scroll, so the keyboard must be able to get there.
  std::string html = Concat("<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"",
                            EscapeMarkup(caption), "\">\n");
  absl::StrAppend(&html, "<table><caption>", EscapeMarkup(caption), "</caption>\n<thead><tr>");
  for (const Column& column : columns) {
    absl::StrAppend(&html, "<th scope=\"col\" class=\"", column.css_class, "\">", column.name,
                    "</th>");
  }
  return html + "</tr></thead>\n<tbody>\n";
}

std::string Samples(const v1::Job& job) {
  if (job.convergence().empty()) return {};
  const bool has_truth =
      std::any_of(job.convergence().begin(), job.convergence().end(),
                  [](const v1::ErrorSample& sample) { return sample.has_true_relative(); });
  std::vector<Column> columns = {{"passes"}, {"photons"},   {"time"},     {"processor time"},
                                 {"error"},  {"95 % from"}, {"to"},       {"noise"},
                                 {"bias"},   {"RMSE"},      {"untrimmed"}};
  if (has_truth) {
    columns.push_back({"true error"});
    columns.push_back({"true untrimmed"});
  }
  std::string html =
      Concat("<section>\n<h2>Samples</h2>\n",
             TableTop("Errors are relative; RMSE is the estimated root of the mean squared error.",
                      columns));
  for (const v1::ErrorSample& sample : job.convergence()) {
    const RelativeError error = ErrorOf(sample);
    const double squared = sample.absolute().noise() + sample.absolute().bias();
    std::vector<std::string> cells = {CountText(sample.photons()),
                                      ShortTime(FromProto(sample.running())),
                                      ShortTime(FromProto(sample.cpu())),
                                      ShortPercent(error.value),
                                      ShortPercent(error.low),
                                      ShortPercent(error.high),
                                      ShortPercent(error.noise),
                                      ShortPercent(error.bias),
                                      absl::StrFormat("%.3g", std::sqrt(std::max(0.0, squared))),
                                      ShortPercent(error.untrimmed)};
    if (has_truth) {
      for (const std::optional<double> truth : {error.truth, error.true_untrimmed})
        cells.push_back(truth ? ShortPercent(*truth) : "–");
    }
    absl::StrAppend(&html, "<tr><th scope=\"row\">", sample.passes(), "</th>");
    for (const std::string& cell : cells)
      absl::StrAppend(&html, "<td>", EscapeMarkup(cell), "</td>");
    html += "</tr>\n";
  }
  return html + "</tbody></table></div>\n</section>\n";
}

std::string Workers(const v1::Job& job) {
  std::string html = "<section>\n<h2>Who rendered it</h2>\n";
  if (job.worker_shares().empty()) {
    return html + "<p class=\"muted\">No worker has delivered photons yet.</p>\n</section>\n";
  }
  double photons = 0;
  double most = 1;
  for (const v1::WorkerShare& share : job.worker_shares()) {
    photons += static_cast<double>(share.photons());
    most = std::max(most, static_cast<double>(share.photons()));
  }
  html += TableTop("Photons that were merged into the image, by worker.",
                   {{"worker", "name"},
                    {"photons"},
                    {"of all"},
                    {"share of photons", "share"},
                    {"batches"},
                    {"processor time"},
                    {"photons per processor second"}});
  for (const v1::WorkerShare& share : job.worker_shares()) {
    const double own = static_cast<double>(share.photons());
    const double cpu_s = Seconds(FromProto(share.cpu()));
    const std::string percent = photons > 0 ? absl::StrFormat("%.1f %%", 100 * own / photons) : "–";
    absl::StrAppend(&html, "<tr><th scope=\"row\" class=\"name\">",
                    EscapeMarkup(share.name().empty() ? share.worker_id() : share.name()),
                    "</th><td>", CountText(share.photons()), "</td><td>", percent,
                    "</td><td class=\"share\"><svg viewBox=\"0 0 100 12\" "
                    "preserveAspectRatio=\"none\" aria-hidden=\"true\"><rect height=\"12\" "
                    "width=\"");
    absl::StrAppend(&html, absl::StrFormat("%.2f", 100 * own / most), "\"/></svg></td><td>",
                    share.batches(), "</td><td>", ShortTime(FromProto(share.cpu())), "</td><td>",
                    cpu_s > 0 ? ShortCount(own / cpu_s) : "–", "</td></tr>\n");
  }
  return html + "</tbody></table></div>\n</section>\n";
}

std::string Energy(const v1::Job& job) {
  std::string rows;
  bool is_balanced = true;
  for (const v1::PassEnergy& part : job.energy_of_passes()) {
    const v1::Energy& energy = part.energy();
    if (energy.emitted() <= 0) continue;
    is_balanced = is_balanced && EnergyImbalance(energy) == 0;
    const std::int64_t last = part.first_pass() + part.passes() - 1;
    absl::StrAppend(&rows, "<tr><th scope=\"row\">", part.first_pass());
    if (part.passes() > 1) absl::StrAppend(&rows, " to ", last);
    rows += "</th>";
    for (const std::int64_t share :
         {energy.roulette_gain(), energy.absorbed(), energy.escaped(), energy.roulette_loss(),
          energy.smoothing(), energy.cut_off(), energy.dropped(), EnergyImbalance(energy)}) {
      absl::StrAppend(&rows, "<td>",
                      absl::StrFormat("%.2f %%", 100 * static_cast<double>(share) /
                                                     static_cast<double>(energy.emitted())),
                      "</td>");
    }
    rows += "</tr>\n";
  }
  if (rows.empty()) return {};
  return Concat(
      "<section>\n<h2>Energy</h2>\n<details><summary>",
      is_balanced ? "The counters of every pass balance to the last unit."
                  : "The counters of some passes do not balance.",
      "</summary>\n",
      TableTop("Of the power that photons of a pass were emitted with.", {{"pass"},
                                                                          {"given by roulette"},
                                                                          {"absorbed"},
                                                                          {"escaped"},
                                                                          {"taken by roulette"},
                                                                          {"shading normals"},
                                                                          {"cut off"},
                                                                          {"dropped"},
                                                                          {"missing"}}),
      rows, "</tbody></table></div>\n</details>\n</section>\n");
}

std::string Lights(const v1::Job& job) {
  if (job.lights().empty()) return {};
  std::string html = Concat(
      "<section>\n<h2>Lights</h2>\n",
      TableTop(
          "Photons of each light that hitpoints found, and what may be missing, at 95 %, because "
          "too few have reached the view.",
          {{"light", "name"},
           {"of the power"},
           {"photons sent"},
           {"in view through smooth surfaces alone"},
           {"in view otherwise"},
           {"may be missing of the image"}}));
  for (const v1::LightFinding& light : job.lights()) {
    absl::StrAppend(&html, "<tr><th scope=\"row\" class=\"name\">", EscapeMarkup(light.name()),
                    "</th><td>", ShortPercent(light.power_share()), "</td><td>",
                    CountText(light.photons_sent()), "</td><td>",
                    CountText(light.in_view_caustic()), "</td><td>",
                    CountText(light.in_view_other()), "</td><td>",
                    ShortPercent(light.missing_share()), "</td></tr>\n");
  }
  return html + "</tbody></table></div>\n</section>\n";
}

std::string Warnings(const v1::Job& job) {
  const std::string dropped = DroppedLine(job);
  const std::vector<std::string> notes = ErrorNotes(job);
  if (job.warnings().empty() && dropped.empty() && notes.empty()) return {};
  std::string html = "<section>\n<h2>Warnings</h2>\n<ul class=\"warnings\">\n";
  if (!dropped.empty()) absl::StrAppend(&html, "<li>", EscapeMarkup(dropped), "</li>\n");
  for (const std::string& note : notes)
    absl::StrAppend(&html, "<li>", EscapeMarkup(note), "</li>\n");
  for (const std::string& warning : job.warnings())
    absl::StrAppend(&html, "<li>", EscapeMarkup(warning), "</li>\n");
  return html + "</ul>\n</section>\n";
}

std::string Events(const v1::Job& job) {
  if (job.events().empty()) return {};
  std::string html = "<section>\n<h2>Events</h2>\n<ul class=\"warnings\">\n";
  for (const v1::JobEvent& event : job.events()) {
    absl::StrAppend(&html, "<li>",
                    EscapeMarkup(google::protobuf::util::TimeUtil::ToString(event.at())), ": ",
                    EscapeMarkup(event.what()), "</li>\n");
  }
  return html + "</ul>\n</section>\n";
}

std::string PartsUsed(const v1::Job& job) {
  if (job.parts().empty()) return {};
  std::string html = "<section>\n<h2>What was left out</h2>\n" +
                     TableTop("What this job used of the machine, what it left out, and why.",
                              {{"part", "name"}, {"used"}, {"reason", "name"}});
  for (const bool is_used : {false, true}) {
    for (const v1::PartUse& use : job.parts()) {
      if (use.is_used() != is_used) continue;
      absl::StrAppend(&html, "<tr><th scope=\"row\" class=\"name\">", EscapeMarkup(use.part()),
                      "</th><td>", is_used ? "yes" : "no", "</td><td class=\"name\">",
                      EscapeMarkup(use.reason()), "</td></tr>\n");
    }
  }
  return html + "</tbody></table></div>\n</section>\n";
}

}  // namespace

std::string ReportPage(const v1::Job& job, const std::optional<PageImage>& image) {
  const std::string name = EscapeMarkup(job.name().empty() ? job.job_id() : job.name());
  std::string subtitle = Concat("Job ", EscapeMarkup(job.job_id()));
  if (job.has_submitted_at()) {
    absl::StrAppend(&subtitle, ", submitted ",
                    EscapeMarkup(google::protobuf::util::TimeUtil::ToString(job.submitted_at())));
  }
  return Concat(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; "
      "style-src 'unsafe-inline'\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<meta name=\"color-scheme\" content=\"light dark\">\n"
      // Without an icon of its own a browser would request one.
      "<link rel=\"icon\" href=\"data:,\">\n"
      "<title>",
      name, ": Lucerna report</title>\n<style>\n", ChartCss(), kPageCss,
      "</style>\n</head>\n<body>\n<main>\n<header>\n<h1>", name, "</h1>\n<p class=\"muted\">",
      subtitle, "</p>\n</header>\n<div class=\"top\">\n", ImageFigure(job, image), "<div>\n",
      Headline(job), RunFacts(job), "</div>\n</div>\n", Convergence(job), Workers(job),
      Samples(job), Warnings(job), Events(job), Lights(job), Energy(job), PartsUsed(job),
      SettingFacts(job, image),
      "<footer>Made by <code>lucerna report</code>. Time is wall time since the job "
      "began to run.</footer>\n</main>\n</body>\n</html>\n");
}

}  // namespace lucerna
