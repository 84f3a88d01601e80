#include "client/commands/compare_command.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <memory>
#include <thread>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_split.h"

#include "client/commands/file_commands.h"
#include "client/exit_code.h"
#include "client/frames.h"
#include "client/job_run.h"
#include "client/render_flags.h"
#include "client/scene_reading.h"
#include "client/view/report.h"
#include "render/base/console.h"
#include "render/base/files.h"
#include "render/film/image_metrics.h"
#include "render/film/reference.h"
#include "render/report/chart.h"
#include "render/report/progress_view.h"
#include "render/wire/messages.h"

namespace lucerna {
namespace {

constexpr int kMostRepetitions = 1000;
// A job stops by wall time, in which the processors are not always busy with it. The share of the
// last run gives how long the next one needs; at first it is taken to be this.
constexpr double kFirstBusyShare = 0.9;
constexpr double kLeastBusyShare = 0.05;
// A run that ends farther from its time than this factor is made again, so often in all.
constexpr double kNear = 1.2;
constexpr int kAttempts = 4;
// Between two asked times the plot shows as many more, where curves have them.
constexpr int kPlotStepsBetween = 4;

Status Misuse(const std::string& message) {
  return Failure(ExitCode::kUsage, message);
}

int Cores() {
  return static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
}

std::string PlotPathOf(const CompareRequest& request, std::size_t scene) {
  return WithFrameNumber(request.plot_path, static_cast<int>(scene) + 1);
}

Status CheckFiles(const CompareRequest& request) {
  const std::size_t scenes = request.scene_paths.size();
  if (request.reference_paths.size() != scenes) {
    return Misuse(
        absl::StrCat("there are ", scenes, " scenes and ", request.reference_paths.size(),
                     " references; give --reference once for each scene, in their order"));
  }
  if (scenes > 1 && !request.plot_path.empty() && !HasFrameNumber(request.plot_path)) {
    return Misuse(
        absl::StrCat("--plot ", request.plot_path,
                     ": each scene has a plot of its own; put #### in its name, which the "
                     "number of the scene replaces"));
  }
  std::vector<std::string> taken = request.scene_paths;
  taken.insert(taken.end(), request.reference_paths.begin(), request.reference_paths.end());
  if (!request.mask_path.empty()) taken.push_back(request.mask_path);
  std::vector<std::string> results = {request.table_path, request.csv_path};
  for (std::size_t i = 0; i < scenes; ++i)
    results.push_back(PlotPathOf(request, i));
  for (const std::string& path : results) {
    if (path.empty()) continue;
    for (const std::string& other : taken) {
      if (IsSameFile(path, other)) {
        return Misuse(absl::StrCat(path, " would be replaced; give the result another name"));
      }
    }
    taken.push_back(path);
    LUCERNA_RETURN_IF_ERROR(CheckWritable(path));
  }
  return absl::OkStatus();
}

// The images that errors are measured with.
struct Yardstick {
  Image reference;
  Image mask;
  MetricsOptions options;
  std::optional<double> noise;  // relMSE of the reference itself, over the compared pixels
  double untrimmed_noise = 0;   // of all pixels; 0: not known
};

StatusOr<std::unique_ptr<Yardstick>> ReadYardstick(const CompareRequest& request,
                                                   const std::string& reference_path) {
  auto yardstick = std::make_unique<Yardstick>();
  LUCERNA_ASSIGN_OR_RETURN(yardstick->reference, ReadImage(reference_path));
  yardstick->options.trim_share = request.trim_share;
  if (!request.mask_path.empty()) {
    LUCERNA_ASSIGN_OR_RETURN(yardstick->mask, ReadImage(request.mask_path));
    yardstick->options.mask = &yardstick->mask;
  }
  // With itself: finds what is wrong with the files before anything is rendered.
  const auto metrics = Compare(yardstick->reference, yardstick->reference, yardstick->options);
  if (!metrics.ok()) {
    return absl::InvalidArgumentError(
        absl::StrCat(reference_path, ": ", metrics.status().message()));
  }
  yardstick->noise = metrics->reference_rel_mse;
  yardstick->untrimmed_noise = metrics->reference_rel_mse_untrimmed;
  return yardstick;
}

Status CheckSizes(const std::vector<NamedFlags>& settings, const SceneOfJobs& scene,
                  const Image& reference) {
  for (std::size_t i = 0; i < settings.size(); ++i) {
    const RenderSettings& of_one = scene.settings[i];
    if (of_one.crop_width() == reference.width && of_one.crop_height() == reference.height)
      continue;
    return Misuse(absl::StrCat("setting \"", settings[i].name, "\" renders ", of_one.crop_width(),
                               "x", of_one.crop_height(), " pixels and the reference has ",
                               reference.width, "x", reference.height, "; give --size"));
  }
  return absl::OkStatus();
}

double CpuSeconds(const v1::Progress& progress) {
  return Seconds(FromProto(progress.coordinator_cpu()) + FromProto(progress.worker_cpu()));
}

// Makes the runs, one after the other.
class Comparer {
 public:
  // `scene` is one of those of the request.
  Comparer(LocalRuns& runs, const SceneManifest& manifest, const Yardstick& yardstick,
           const CompareRequest& request, std::size_t scene, const OutputOptions& output_options)
      : runs_(runs),
        manifest_(manifest),
        yardstick_(yardstick),
        scene_path_(request.scene_paths[scene]),
        reference_path_(request.reference_paths[scene]),
        request_(request),
        voice_(output_options) {
    // Fetching images would take the time that is measured.
    voice_.previews = false;
  }

  // One job to the last time, whose record is the curve.
  StatusOr<std::vector<ErrorPoint>> Record(const RenderOverrides& overrides, double seconds) {
    LUCERNA_ASSIGN_OR_RETURN(const v1::Job job,
                             RunUntil(overrides, seconds, HUGE_VAL, reference_path_));
    std::vector<ErrorPoint> curve =
        CurveOf(job, Cores(), yardstick_.noise.value_or(0), yardstick_.untrimmed_noise);
    if (curve.empty()) {
      return absl::InternalError(absl::StrCat("job ", job.job_id(),
                                              " recorded no true errors; give it more time, or "
                                              "another --trim to compare images instead"));
    }
    return curve;
  }

  // One job to one time.
  StatusOr<ErrorPoint> Measure(const RenderOverrides& overrides, double seconds) {
    LUCERNA_ASSIGN_OR_RETURN(const v1::Job job, RunUntil(overrides, seconds, kNear, ""));
    LUCERNA_ASSIGN_OR_RETURN(const Image image, runs_.ImageOf(job));
    LUCERNA_ASSIGN_OR_RETURN(const ImageMetrics metrics,
                             Compare(image, yardstick_.reference, yardstick_.options));
    const v1::Progress& progress = job.progress();
    return ErrorPoint{.seconds = CpuSeconds(progress) / Cores(),
                      .wall_s = Seconds(FromProto(progress.running())),
                      .photons = static_cast<double>(progress.photons()),
                      .rel_mse = metrics.rel_mse,
                      .reference_noise = metrics.reference_rel_mse.value_or(0),
                      .untrimmed = metrics.rel_mse_untrimmed,
                      .untrimmed_reference_noise = metrics.reference_rel_mse_untrimmed};
  }

  void Announce(int repetition, const std::string& setting, double seconds) const {
    if (voice_.quiet) return;
    PrintError(absl::StrFormat("repetition %d of %d, %s, %g s\n", repetition + 1,
                               request_.repetitions, setting, seconds));
  }

 private:
  // Runs the job until it has had about `seconds` of processor time over cores, and not more than
  // `most_over` times as much.
  StatusOr<v1::Job> RunUntil(RenderOverrides overrides, double seconds, double most_over,
                             const std::string& reference_path) {
    for (int attempt = 1;; ++attempt) {
      overrides.time_s = seconds / busy_share_;
      LUCERNA_ASSIGN_OR_RETURN(
          const v1::Job job, runs_.Run(scene_path_, manifest_, overrides, reference_path, voice_));
      const double had_s = CpuSeconds(job.progress()) / Cores();
      const double wall_s = Seconds(FromProto(job.progress().running()));
      busy_share_ = wall_s > 0 ? std::clamp(had_s / wall_s, kLeastBusyShare, 1.0) : kFirstBusyShare;
      const bool is_near = had_s * kNear >= seconds && had_s <= most_over * seconds;
      if (is_near || attempt == kAttempts) return job;
      if (voice_.quiet) continue;
      PrintError(absl::StrFormat("  once more: it had %.2f s of processor time, not %g\n", had_s,
                                 seconds));
    }
  }

  double busy_share_ = kFirstBusyShare;
  LocalRuns& runs_;
  const SceneManifest& manifest_;
  const Yardstick& yardstick_;
  const std::string& scene_path_;
  const std::string& reference_path_;
  const CompareRequest& request_;
  OutputOptions voice_;
};

// Asked times with more between them, evenly on a logarithmic axis.
std::vector<double> Finer(const std::vector<double>& times) {
  std::vector<double> finer;
  for (std::size_t i = 0; i + 1 < times.size(); ++i) {
    for (int step = 0; step < kPlotStepsBetween; ++step) {
      const double share = static_cast<double>(step) / kPlotStepsBetween;
      finer.push_back(times[i] * std::pow(times[i + 1] / times[i], share));
    }
  }
  finer.push_back(times.back());
  return finer;
}

Chart ChartOf(const Comparison& comparison, const ComparisonSubject& subject) {
  Chart chart;
  chart.title = subject.scene;
  chart.description = "relMSE of each setting against time, with standard errors";
  chart.x_label = absl::StrCat("processor seconds over ", subject.cores, " cores");
  chart.y_label = "relMSE";
  for (std::size_t i = 0; i < comparison.settings.size(); ++i) {
    ChartSeries series;
    series.name = comparison.settings[i].name;
    series.color = static_cast<int>(i);
    // Beyond the colours there are, lines differ by their dashes.
    series.style = i < kChartColors ? ChartStyle::kLine : ChartStyle::kDashedLine;
    for (const std::optional<ComparedCell>& cell : comparison.settings[i].cells) {
      if (!cell) continue;
      ChartPoint point = {.x = cell->seconds, .y = cell->rel_mse.value};
      if (cell->rel_mse.standard_error) {
        point.low = point.y - *cell->rel_mse.standard_error;
        point.high = point.y + *cell->rel_mse.standard_error;
      }
      series.points.push_back(point);
    }
    chart.series.push_back(std::move(series));
  }
  if (subject.reference_noise && *subject.reference_noise > 0) {
    chart.levels.push_back({.name = "noise of the reference", .y = *subject.reference_noise});
  }
  return chart;
}

std::string LeftOut(const CompareRequest& request) {
  std::string text;
  if (!request.mask_path.empty())
    text = absl::StrCat("only where ", request.mask_path, " is not 0");
  if (request.trim_share > 0) {
    absl::StrAppendFormat(&text, "%swithout the worst %g %% of pixels", text.empty() ? "" : ", ",
                          100 * request.trim_share);
  }
  return text;
}

}  // namespace

StatusOr<std::vector<NamedFlags>> ParseSettings(const std::vector<std::string>& typed,
                                                const RenderOverrides& common) {
  std::vector<NamedFlags> settings;
  if (typed.empty()) {
    for (const std::string_view controller : RadiusControllerNames()) {
      NamedFlags one = {.name = std::string(controller), .words = "", .overrides = {}};
      one.words = absl::StrCat("--radius-controller ", one.name);
      LUCERNA_ASSIGN_OR_RETURN(one.overrides, WithImageFlags(common, one.words));
      settings.push_back(std::move(one));
    }
    return settings;
  }
  for (const std::string& text : typed) {
    const std::size_t colon = text.find(':');
    NamedFlags one;
    one.name = std::string(absl::StripAsciiWhitespace(text.substr(0, colon)));
    if (colon != std::string::npos) {
      one.words = std::string(absl::StripAsciiWhitespace(text.substr(colon + 1)));
    }
    if (one.name.empty() || one.name.starts_with('-') || colon == std::string::npos) {
      return Misuse(absl::StrCat("--settings \"", text,
                                 "\": give a name, a colon and flags, like \"wide: --alpha 0.9\""));
    }
    if (std::ranges::any_of(settings, [&](const auto& other) { return other.name == one.name; })) {
      return Misuse(absl::StrCat("--settings: two are called \"", one.name, "\""));
    }
    LUCERNA_ASSIGN_OR_RETURN(one.overrides, WithImageFlags(common, one.words));
    settings.push_back(std::move(one));
  }
  return settings;
}

StatusOr<std::vector<double>> ParseTimes(const std::string& typed) {
  std::vector<double> times;
  for (const std::string& word : std::vector<std::string>(absl::StrSplit(typed, ','))) {
    double seconds = 0;
    const char* end = word.data() + word.size();
    const auto [stopped, error] = std::from_chars(word.data(), end, seconds);
    const bool grows = times.empty() || seconds > times.back();
    if (error != std::errc() || stopped != end || !std::isfinite(seconds) || seconds <= 0 ||
        !grows) {
      return Misuse(
          absl::StrCat("--times ", typed, ": give growing numbers of seconds, like 1,2,5,10"));
    }
    times.push_back(seconds);
  }
  return times;
}

std::vector<ErrorPoint> CurveOf(const v1::Job& job, int cores, double reference_noise,
                                double untrimmed_reference_noise) {
  std::vector<ErrorPoint> curve;
  for (const v1::ErrorSample& sample : job.convergence()) {
    if (!sample.has_true_relative()) continue;
    curve.push_back({.seconds = Seconds(FromProto(sample.cpu())) / cores,
                     .wall_s = Seconds(FromProto(sample.running())),
                     .photons = static_cast<double>(sample.photons()),
                     .rel_mse = sample.true_relative(),
                     .reference_noise = reference_noise,
                     .untrimmed = sample.true_relative_untrimmed(),
                     .untrimmed_reference_noise = untrimmed_reference_noise});
  }
  return curve;
}

namespace {

// All that follows from one scene of the request.
struct ComparedScene {
  Comparison comparison;
  ComparisonSubject subject;
  std::vector<ComparedRun> runs;
  std::optional<Comparison> drawn;  // with more times, where curves have them
};

StatusOr<ComparedScene> CompareOne(LocalRuns& runs, const CompareRequest& request,
                                   std::size_t scene_number, std::vector<NamedFlags> settings,
                                   const std::vector<double>& times, const Yardstick& yardstick,
                                   const SceneOfJobs& scene, const OutputOptions& output_options) {
  // The coordinator's own record measures so.
  const bool has_record = request.mask_path.empty() && request.trim_share == kTrimmedShare;
  // One point makes no curve.
  std::vector<double> stops = times;
  if (stops.size() == 1) stops.insert(stops.begin(), stops[0] / 2);
  ComparedScene result;
  std::vector<ComparedRun>& measured = result.runs;
  Comparer comparer(runs, scene.manifest, yardstick, request, scene_number, output_options);
  for (int repetition = 0; repetition < request.repetitions; ++repetition) {
    const std::size_t first = measured.size();
    for (std::size_t i = 0; i < settings.size(); ++i) {
      const std::uint64_t seed = scene.settings[i].seed + static_cast<std::uint64_t>(repetition);
      measured.push_back({.setting = i, .seed = seed, .points = {}});
      settings[i].overrides.seed = seed;
      if (!has_record) continue;
      comparer.Announce(repetition, settings[i].name, times.back());
      LUCERNA_ASSIGN_OR_RETURN(measured.back().points,
                               comparer.Record(settings[i].overrides, times.back()));
    }
    if (has_record) continue;
    for (const double seconds : stops) {
      for (std::size_t i = 0; i < settings.size(); ++i) {
        comparer.Announce(repetition, settings[i].name, seconds);
        LUCERNA_ASSIGN_OR_RETURN(const ErrorPoint point,
                                 comparer.Measure(settings[i].overrides, seconds));
        measured[first + i].points.push_back(point);
      }
    }
  }
  std::vector<SettingToCompare> compared;
  result.subject = {.scene = request.scene_paths[scene_number],
                    .reference = request.reference_paths[scene_number],
                    .reference_noise = yardstick.noise,
                    .cores = Cores(),
                    .repetitions = request.repetitions,
                    .first_seed = scene.settings.front().seed,
                    .left_out = LeftOut(request),
                    .flags = {}};
  for (std::size_t i = 0; i < settings.size(); ++i) {
    compared.push_back({settings[i].name, TheoryOf(scene.settings[i])});
    result.subject.flags.push_back(settings[i].words);
  }
  result.comparison = CompareRuns(compared, measured, times);
  if (has_record) result.drawn = CompareRuns(compared, measured, Finer(times));
  return result;
}

}  // namespace

Status CompareSettings(const CompareRequest& request, const ClusterOptions& cluster,
                       const OutputOptions& output_options) {
  LUCERNA_ASSIGN_OR_RETURN(const std::vector<double> times, ParseTimes(request.times));
  if (request.repetitions < 1 || request.repetitions > kMostRepetitions) {
    return Misuse(absl::StrCat("--repetitions must be from 1 to ", kMostRepetitions, ", not ",
                               request.repetitions));
  }
  LUCERNA_ASSIGN_OR_RETURN(const std::vector<NamedFlags> settings,
                           ParseSettings(request.settings, request.common));
  std::vector<RenderOverrides> overrides;
  for (const NamedFlags& one : settings) {
    overrides.push_back(one.overrides);
    // Only for the check; each job gets its own time.
    overrides.back().time_s = times.back();
  }
  LUCERNA_RETURN_IF_ERROR(CheckFiles(request));
  // What is wrong with the last scene is found before the first is rendered.
  std::vector<std::unique_ptr<Yardstick>> yardsticks;
  std::vector<SceneOfJobs> scenes;
  for (std::size_t i = 0; i < request.scene_paths.size(); ++i) {
    LUCERNA_ASSIGN_OR_RETURN(auto yardstick, ReadYardstick(request, request.reference_paths[i]));
    LUCERNA_ASSIGN_OR_RETURN(SceneOfJobs scene, ReadSceneOfJobs({request.scene_paths[i]}, overrides,
                                                                output_options.quiet));
    LUCERNA_RETURN_IF_ERROR(CheckSizes(settings, scene, yardstick->reference));
    yardsticks.push_back(std::move(yardstick));
    scenes.push_back(std::move(scene));
  }
  LUCERNA_ASSIGN_OR_RETURN(const auto runs, LocalRuns::Start(cluster));

  std::string tables;
  std::string csv = ComparisonCsvHead();
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    LUCERNA_ASSIGN_OR_RETURN(
        const ComparedScene result,
        CompareOne(*runs, request, i, settings, times, *yardsticks[i], scenes[i], output_options));
    absl::StrAppend(&tables, i == 0 ? "" : "\n",
                    ComparisonTable(result.comparison, result.subject));
    absl::StrAppend(&csv, ComparisonCsvRows(result.comparison, result.subject, result.runs));
    if (!request.plot_path.empty()) {
      LUCERNA_RETURN_IF_ERROR(WriteFile(
          PlotPathOf(request, i),
          DrawChartFile(ChartOf(result.drawn.value_or(result.comparison), result.subject))));
    }
    // After each scene: hours of it are not lost with the next.
    if (!request.table_path.empty()) {
      LUCERNA_RETURN_IF_ERROR(WriteFile(request.table_path, tables));
    }
    if (!request.csv_path.empty()) LUCERNA_RETURN_IF_ERROR(WriteFile(request.csv_path, csv));
    if (output_options.json) {
      PrintData(
          ComparisonReport(result.comparison, result.subject, result.runs, output_options.detail));
    }
  }
  if (output_options.json) return absl::OkStatus();
  if (request.table_path.empty()) {
    PrintText(tables);
  } else if (!output_options.quiet) {
    PrintData(request.table_path + "\n");
  }
  return absl::OkStatus();
}

}  // namespace lucerna
