#include "client/view/report.h"

#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include <google/protobuf/util/time_util.h>
#include <nlohmann/json.hpp>

#include "render/report/convergence.h"
#include "render/report/photon_view.h"
#include "render/report/progress_view.h"
#include "render/scene/setting_table.h"
#include "render/wire/messages.h"

namespace lucerna {
namespace {

using Json = nlohmann::ordered_json;

// Text that came from a file may be anything; what is not UTF-8 is shown as such.
std::string ToText(const Json& json) {
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string HexOf(const std::string& bytes) {
  const StatusOr<Digest> digest = Digest::FromBytes(bytes);
  return digest.ok() ? digest->Hex() : std::string();
}

Json RelativeErrorJson(const RelativeError& error) {
  Json json = {{"estimate", error.value}, {"low", error.low}, {"high", error.high}};
  if (error.truth) json["true"] = *error.truth;
  json["untrimmed"] = error.untrimmed;
  if (error.true_untrimmed) json["true_untrimmed"] = *error.true_untrimmed;
  return json;
}

// Names as in the table of settings; two values that are given as one keep a name each.
Json SettingsJson(const RenderSettings& settings) {
  Json json;
  for (const Setting& setting : AllSettings()) {
    const std::string name(setting.name);
    if (const auto* size = std::get_if<SizeFields>(&setting.type)) {
      json["width"] = settings.*size->width.value;
      json["height"] = settings.*size->height.value;
      json["crop"] = {settings.crop_x0, settings.crop_y0, settings.crop_x1, settings.crop_y1};
    } else if (const auto* radius = std::get_if<RadiusFields>(&setting.type)) {
      json[name] = settings.*radius->scene_units.value;
      json["initial_footprints"] = settings.*radius->footprints.value;
    } else {
      std::visit(
          [&]<typename Field>(const Field& field) {
            if constexpr (requires { NameOf(settings.*field.value); }) {
              json[name] = std::string(NameOf(settings.*field.value));
            } else if constexpr (requires { field.value; }) {
              json[name] = settings.*field.value;
            }
          },
          setting.type);
    }
  }
  return json;
}

// As shares of what was emitted. `balance` is the imbalance in the smallest unit.
Json EnergyOf(const v1::Energy& message) {
  const EnergyCounters energy = FromProto(message);
  Json json;
  for (const auto& counter : kEnergyCounters) {
    if (counter.value == &EnergyCounters::emitted) continue;
    json[std::string(counter.name)] =
        static_cast<double>(energy.*counter.value) / static_cast<double>(energy.emitted);
  }
  json["balance"] = energy.Imbalance();
  return json;
}

Json TallyOf(const v1::Tally& message) {
  const BatchTally tally = FromProto(message);
  Json json;
  for (const auto& counter : kBatchCounters)
    json[std::string(counter.name)] = tally.*counter.value;
  return json;
}

// What a script needs to go on: whose job it is, whether it goes on and if not why, how far it is,
// how good the image is, and what is wrong. In this order.
constexpr std::array kShortJob = {
    "job_id",        "name",          "state",          "stop_reason",    "failure",
    "owner",         "no_workers",    "condition",      "pause_cause",    "passes",
    "photons",       "running_s",     "warnings",       "relative_error", "denoised_error",
    "nothing_found", "missing_light", "dropped_photons"};

Json FullJobOf(const v1::Job& job) {
  const v1::Progress& progress = job.progress();
  Json json = {{"job_id", job.job_id()}, {"name", job.name()}, {"state", NameOf(job.state())}};
  if (job.state() == v1::JOB_STATE_SUCCEEDED) json["stop_reason"] = NameOf(job.stop_reason());
  if (job.state() == v1::JOB_STATE_FAILED) json["failure"] = job.failure();
  if (!job.owner().empty()) json["owner"] = job.owner();
  if (job.no_workers()) json["no_workers"] = true;
  if (!job.condition().empty()) json["condition"] = job.condition();
  if (job.pause_cause() != v1::PAUSE_CAUSE_UNSPECIFIED) {
    json["pause_cause"] = v1::PauseCause_Name(job.pause_cause()).substr(sizeof("PAUSE_CAUSE"));
  }
  json["priority"] = job.priority();
  if (job.has_submitted_at()) {
    json["submitted_at"] = google::protobuf::util::TimeUtil::ToString(job.submitted_at());
  }
  json["passes"] = progress.passes();
  json["photons"] = progress.photons();
  json["running_s"] = Seconds(FromProto(progress.running()));
  if (progress.has_to_first_photons()) {
    json["to_first_photons_s"] = Seconds(FromProto(progress.to_first_photons()));
  }
  json["coordinator_cpu_s"] = Seconds(FromProto(progress.coordinator_cpu()));
  json["worker_cpu_s"] = Seconds(FromProto(progress.worker_cpu()));
  json["photons_per_second"] = progress.photons_per_second();
  json["workers"] = progress.workers();
  json["tally"] = TallyOf(progress.tally());
  if (progress.tally().energy().emitted() != 0)
    json["energy"] = EnergyOf(progress.tally().energy());
  json["energy_of_passes"] = Json::array();
  for (const v1::PassEnergy& part : job.energy_of_passes()) {
    if (part.energy().emitted() == 0) continue;
    Json item = EnergyOf(part.energy());
    item["first_pass"] = part.first_pass();
    item["passes"] = part.passes();
    json["energy_of_passes"].push_back(std::move(item));
  }
  json["sent_bytes"] = progress.bytes_sent();
  json["received_bytes"] = progress.bytes_received();
  json["hitpoints_sent"] = progress.hitpoints_sent();
  json["hitpoints_returned"] = progress.hitpoints_returned();
  json["audits"] = {{"agreed", progress.audits_agreed()},
                    {"not_audited", progress.not_audited()},
                    {"disputed", progress.audits_disputed()}};
  if (job.has_settings()) json["settings"] = SettingsJson(SettingsOf(job));
  if (!job.scene_digest().empty()) json["scene_digest"] = HexOf(job.scene_digest());
  json["warnings"] = Json::array();
  for (const std::string& warning : job.warnings())
    json["warnings"].push_back(warning);
  json["events"] = Json::array();
  for (const v1::JobEvent& event : job.events()) {
    json["events"].push_back(
        {{"at", google::protobuf::util::TimeUtil::ToString(event.at())}, {"what", event.what()}});
  }
  json["parts"] = Json::array();
  for (const v1::PartUse& use : job.parts()) {
    json["parts"].push_back(
        {{"part", use.part()}, {"is_used", use.is_used()}, {"reason", use.reason()}});
  }
  if (const auto error = NewestError(job)) {
    json["relative_error"] = RelativeErrorJson(*error);
    json["relative_error"]["left_out_pixels"] = job.convergence().rbegin()->left_out_pixels();
  }
  if (const auto denoised = DenoisedErrorOf(job))
    json["denoised_error"] = RelativeErrorJson(*denoised);
  if (FoundNothing(job)) json["nothing_found"] = true;
  if (const auto far = FindFarTarget(job)) {
    json["far_target"] = {{"in_sight", far->left.has_value()}, {"message", far->sentence}};
    if (far->left) json["far_target"]["left_s"] = Seconds(*far->left);
  }
  if (const std::string missing = MissingLightSentence(job); !missing.empty()) {
    json["missing_light"] = missing;
  }
  json["lights"] = Json::array();
  for (const v1::LightFinding& light : job.lights()) {
    // What is infinite becomes null.
    json["lights"].push_back({{"light", light.name()},
                              {"power_share", light.power_share()},
                              {"photons_sent", light.photons_sent()},
                              {"in_view_caustic", light.in_view_caustic()},
                              {"in_view_other", light.in_view_other()},
                              {"missing_share", light.missing_share()}});
  }
  if (job.dropped_photons_size() > 0) json["dropped_photons"] = Json::array();
  for (const v1::PhotonKey& key : job.dropped_photons())
    json["dropped_photons"].push_back({{"pass", key.pass()}, {"index", key.index()}});
  return json;
}

Json JobOf(const v1::Job& job, JsonDetail detail) {
  Json all = FullJobOf(job);
  if (detail == JsonDetail::kFull) return all;
  Json json;
  for (const char* name : kShortJob) {
    if (all.contains(name)) json[name] = std::move(all[name]);
  }
  return json;
}

Json TripleOf(const v1::Triple& triple) {
  return {triple.x(), triple.y(), triple.z()};
}

std::string WordOf(v1::PhotonEnd end) {
  return v1::PhotonEnd_Name(end).substr(std::string("PHOTON_END_").size());
}
std::string WordOf(v1::DepositFate fate) {
  return v1::DepositFate_Name(fate).substr(std::string("DEPOSIT_FATE_").size());
}

Json LandingOf(const v1::PhotonPath::Landing& landing) {
  Json json = {{"shape", landing.shape()},
               {"material", landing.material()},
               {"distance", landing.distance()},
               {"position", TripleOf(landing.position())},
               {"geometric_normal", TripleOf(landing.geometric_normal())},
               {"shading_normal", TripleOf(landing.shading_normal())},
               {"flux_arriving_w", TripleOf(landing.flux_arriving())}};
  if (landing.has_flux_landed()) {
    json["flux_landed_w"] = TripleOf(landing.flux_landed());
    json["deposit"] = WordOf(landing.deposit());
  }
  if (landing.has_scattering()) {
    const v1::PhotonPath::Landing::Scattering& scattering = landing.scattering();
    json["scattering"] = {{"chosen", scattering.chosen()},
                          {"direction", TripleOf(scattering.direction())},
                          {"flux_w", TripleOf(scattering.flux())},
                          {"survival", scattering.survival()},
                          {"survived", scattering.survived()},
                          {"flux_leaving_w", TripleOf(scattering.flux_leaving())}};
  }
  return json;
}

Json MeanJson(const MeanOfRuns& mean) {
  Json json = {{"mean", mean.value}};
  if (mean.standard_error) json["standard_error"] = *mean.standard_error;
  return json;
}

Json SquaredErrorOf(const v1::SquaredError& error) {
  return {{"mse", error.noise() + error.bias()},
          {"noise", error.noise()},
          {"bias", error.bias()},
          {"low", error.low()},
          {"high", error.high()}};
}

Json SampleOf(const v1::ErrorSample& sample) {
  Json json = {{"passes", sample.passes()},
               {"photons", sample.photons()},
               {"running_s", Seconds(FromProto(sample.running()))},
               {"cpu_s", Seconds(FromProto(sample.cpu()))},
               {"relative", SquaredErrorOf(sample.relative())},
               {"absolute", SquaredErrorOf(sample.absolute())},
               {"missing_relative", sample.missing_relative()}};
  if (sample.nothing_found()) json["nothing_found"] = true;
  if (sample.has_true_relative()) json["true_relative_mse"] = sample.true_relative();
  if (sample.has_true_absolute()) json["true_absolute_mse"] = sample.true_absolute();
  json["relative_mse_untrimmed"] = sample.relative_untrimmed();
  if (sample.has_true_relative_untrimmed())
    json["true_relative_mse_untrimmed"] = sample.true_relative_untrimmed();
  json["left_out_pixels"] = sample.left_out_pixels();
  return json;
}

Json ShareOf(const v1::WorkerShare& share) {
  return {{"worker_id", share.worker_id()},
          {"name", share.name()},
          {"photons", share.photons()},
          {"batches", share.batches()},
          {"cpu_s", Seconds(FromProto(share.cpu()))}};
}

// A cell of a table: quoted when it has to be.
std::string Cell(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"') quoted += '"';
    quoted += c;
  }
  return quoted + "\"";
}

// All digits, so that a program reads the same number.
std::string Cell(double number) {
  return absl::StrFormat("%.17g", number);
}

void AppendSquaredError(std::vector<std::string>& cells, const v1::SquaredError& error) {
  for (const double number :
       {error.noise() + error.bias(), error.noise(), error.bias(), error.low(), error.high()}) {
    cells.push_back(Cell(number));
  }
}

void AddSaved(Json& json, const SavedImage& saved) {
  json["paths"] = saved.paths;
  json["image_digest"] = saved.digest.Hex();
}

}  // namespace

std::string JobReport(const v1::Job& job, JsonDetail detail) {
  return ToText(JobOf(job, detail));
}

std::string JobReport(const v1::Job& job, const SavedImage& saved, JsonDetail detail) {
  Json json = JobOf(job, detail);
  AddSaved(json, saved);
  return ToText(json);
}

std::string ConvergenceReport(const v1::Job& job) {
  Json json = FullJobOf(job);
  json["has_reference"] = job.has_reference();
  for (const auto& [name, against] : {std::pair{"mse_exponent_time", ErrorAgainst::kTime},
                                      std::pair{"mse_exponent_photons", ErrorAgainst::kPhotons}}) {
    if (const auto law = FitOfSquaredError(job, against)) json[name] = law->exponent;
  }
  json["convergence"] = Json::array();
  for (const v1::ErrorSample& sample : job.convergence())
    json["convergence"].push_back(SampleOf(sample));
  json["worker_shares"] = Json::array();
  for (const v1::WorkerShare& share : job.worker_shares())
    json["worker_shares"].push_back(ShareOf(share));
  return ToText(json);
}

std::string ConvergenceCsv(const v1::Job& job) {
  const std::vector<std::string> head = {"row",
                                         "worker_id",
                                         "name",
                                         "passes",
                                         "batches",
                                         "photons",
                                         "running_s",
                                         "cpu_s",
                                         "relative_mse",
                                         "relative_noise",
                                         "relative_bias",
                                         "relative_low",
                                         "relative_high",
                                         "absolute_mse",
                                         "absolute_noise",
                                         "absolute_bias",
                                         "absolute_low",
                                         "absolute_high",
                                         "true_relative_mse",
                                         "true_absolute_mse",
                                         "relative_mse_untrimmed",
                                         "true_relative_mse_untrimmed",
                                         "left_out_pixels"};
  std::string csv = absl::StrJoin(head, ",") + "\r\n";
  for (const v1::ErrorSample& sample : job.convergence()) {
    std::vector<std::string> cells = {"sample",
                                      "",
                                      "",
                                      std::to_string(sample.passes()),
                                      "",
                                      std::to_string(sample.photons()),
                                      Cell(Seconds(FromProto(sample.running()))),
                                      Cell(Seconds(FromProto(sample.cpu())))};
    AppendSquaredError(cells, sample.relative());
    AppendSquaredError(cells, sample.absolute());
    cells.push_back(sample.has_true_relative() ? Cell(sample.true_relative()) : "");
    cells.push_back(sample.has_true_absolute() ? Cell(sample.true_absolute()) : "");
    cells.push_back(Cell(sample.relative_untrimmed()));
    cells.push_back(sample.has_true_relative_untrimmed() ? Cell(sample.true_relative_untrimmed())
                                                         : "");
    cells.push_back(std::to_string(sample.left_out_pixels()));
    absl::StrAppend(&csv, absl::StrJoin(cells, ","), "\r\n");
  }
  for (const v1::WorkerShare& share : job.worker_shares()) {
    std::vector<std::string> cells = {"worker",
                                      Cell(share.worker_id()),
                                      Cell(share.name()),
                                      "",
                                      std::to_string(share.batches()),
                                      std::to_string(share.photons()),
                                      "",
                                      Cell(Seconds(FromProto(share.cpu())))};
    cells.resize(head.size());
    absl::StrAppend(&csv, absl::StrJoin(cells, ","), "\r\n");
  }
  return csv;
}

std::string JobsReport(const std::vector<v1::Job>& jobs, JsonDetail detail) {
  Json json = Json::array();
  for (const v1::Job& job : jobs)
    json.push_back(JobOf(job, detail));
  return ToText(json);
}

std::string SavedReport(const std::string& job_id, const SavedImage& saved) {
  Json json = {{"job_id", job_id}};
  AddSaved(json, saved);
  return ToText(json);
}

std::string MeshRenderReport(std::int64_t passes, double share_unknown, const SavedImage& saved) {
  Json json = {{"passes", passes}, {"share_unknown", share_unknown}};
  AddSaved(json, saved);
  return ToText(json);
}

std::string SubmittedReport(const v1::SubmitResponse& submitted) {
  Json json = {{"job_id", submitted.job_id()}, {"warnings", Json::array()}};
  for (const std::string& warning : submitted.warnings())
    json["warnings"].push_back(warning);
  return ToText(json);
}

std::string SceneReport(const std::vector<Diagnostic>& diagnostics, bool is_ok) {
  Json list = Json::array();
  for (const Diagnostic& diagnostic : diagnostics) {
    const char* severity = "note";
    if (diagnostic.severity == Diagnostic::Severity::kError) severity = "error";
    if (diagnostic.severity == Diagnostic::Severity::kWarning) severity = "warning";
    list.push_back({{"severity", severity},
                    {"file", diagnostic.file},
                    {"line", diagnostic.line},
                    {"column", diagnostic.column},
                    {"message", diagnostic.message}});
  }
  return ToText({{"ok", is_ok}, {"diagnostics", list}});
}

std::string MetricsReport(const ImageMetrics& metrics) {
  Json json = {{"pixels", metrics.pixels},
               {"rmse", metrics.rmse},
               {"rel_mse", metrics.rel_mse},
               {"rel_mse_trimmed", metrics.rel_mse_trimmed},
               {"rel_mse_untrimmed", metrics.rel_mse_untrimmed},
               {"floor", metrics.floor},
               {"mean_a", metrics.mean_a},
               {"mean_b", metrics.mean_b},
               {"mean_ratio", metrics.mean_ratio},
               {"channel_mean_ratio", metrics.channel_mean_ratio}};
  if (metrics.reference_rel_mse && metrics.reference_mse) {
    json["reference_rel_mse"] = *metrics.reference_rel_mse;
    json["reference_rmse"] = std::sqrt(*metrics.reference_mse);
    json["corrected_rel_mse"] = metrics.rel_mse - *metrics.reference_rel_mse;
    json["corrected_rel_mse_trimmed"] = metrics.rel_mse_trimmed - metrics.reference_rel_mse_trimmed;
    json["corrected_rel_mse_untrimmed"] =
        metrics.rel_mse_untrimmed - metrics.reference_rel_mse_untrimmed;
  }
  return ToText(json);
}

std::string ComparisonReport(const Comparison& comparison, const ComparisonSubject& subject,
                             const std::vector<ComparedRun>& runs, JsonDetail detail) {
  Json json = {{"scene", subject.scene},
               {"reference", subject.reference},
               {"cores", subject.cores},
               {"repetitions", subject.repetitions}};
  if (subject.reference_noise) json["reference_rel_mse"] = *subject.reference_noise;
  if (!subject.left_out.empty()) json["left_out"] = subject.left_out;
  json["times_s"] = comparison.times;
  json["settings"] = Json::array();
  for (std::size_t i = 0; i < comparison.settings.size(); ++i) {
    const ComparedSetting& setting = comparison.settings[i];
    Json one = {{"name", setting.name}};
    if (i < subject.flags.size()) one["flags"] = subject.flags[i];
    if (setting.slope_photons) one["exponent_photons"] = MeanJson(*setting.slope_photons);
    if (setting.slope_seconds) one["exponent_time"] = MeanJson(*setting.slope_seconds);
    if (setting.theory) {
      one["theory"] = {{"noise", setting.theory->noise},
                       {"squared_bias", setting.theory->squared_bias}};
    }
    one["at"] = Json::array();
    for (const std::optional<ComparedCell>& cell : setting.cells) {
      if (!cell) continue;
      Json at = {{"time_s", cell->seconds},
                 {"wall_s", cell->wall_s},
                 {"photons", cell->photons},
                 {"rel_mse", MeanJson(cell->rel_mse)},
                 {"rel_mse_untrimmed", MeanJson(cell->untrimmed)},
                 {"mostly_reference_noise", cell->is_mostly_reference}};
      if (std::isfinite(cell->ratio.value)) at["ratio"] = MeanJson(cell->ratio);
      one["at"].push_back(std::move(at));
    }
    if (detail == JsonDetail::kFull) one["runs"] = Json::array();
    for (const ComparedRun& run : runs) {
      if (detail == JsonDetail::kShort || run.setting != i) continue;
      Json points = Json::array();
      for (const ErrorPoint& point : run.points) {
        points.push_back({{"time_s", point.seconds},
                          {"wall_s", point.wall_s},
                          {"photons", point.photons},
                          {"measured_rel_mse", point.rel_mse},
                          {"reference_rel_mse", point.reference_noise},
                          {"measured_rel_mse_untrimmed", point.untrimmed},
                          {"reference_rel_mse_untrimmed", point.untrimmed_reference_noise}});
      }
      one["runs"].push_back({{"seed", run.seed}, {"points", std::move(points)}});
    }
    json["settings"].push_back(std::move(one));
  }
  return ToText(json);
}

std::string ComparisonCsvHead() {
  return "scene,reference,setting,flags,seed,cores,cpu_s_over_cores,wall_s,photons,relative_mse,"
         "reference_noise,relative_mse_untrimmed,reference_noise_untrimmed\r\n";
}

std::string ComparisonCsvRows(const Comparison& comparison, const ComparisonSubject& subject,
                              const std::vector<ComparedRun>& runs) {
  std::string csv;
  for (const ComparedRun& run : runs) {
    for (const ErrorPoint& point : run.points) {
      const std::vector<std::string> cells = {Cell(subject.scene),
                                              Cell(subject.reference),
                                              Cell(comparison.settings[run.setting].name),
                                              Cell(subject.flags[run.setting]),
                                              std::to_string(run.seed),
                                              std::to_string(subject.cores),
                                              Cell(point.seconds),
                                              Cell(point.wall_s),
                                              Cell(point.photons),
                                              Cell(point.rel_mse),
                                              Cell(point.reference_noise),
                                              Cell(point.untrimmed),
                                              Cell(point.untrimmed_reference_noise)};
      absl::StrAppend(&csv, absl::StrJoin(cells, ","), "\r\n");
    }
  }
  return csv;
}

std::string ReferenceReport(const Image& reference, const std::string& path) {
  return ToText({{"path", path},
                 {"image_digest", reference.PixelDigest().Hex()},
                 {"width", reference.width},
                 {"height", reference.height},
                 {"metadata", reference.metadata}});
}

namespace {

Json IntervalOf(const RelativeError& error) {
  return {{"estimate", error.value}, {"low", error.low}, {"high", error.high}};
}

}  // namespace

std::string BakeReport(const v1::Job& job, const std::string& path) {
  const v1::Bake& bake = job.bake();
  Json json;
  json["job_id"] = job.job_id();
  json["rounds"] = Json::array();
  for (const v1::BakeRound& round : bake.rounds()) {
    Json item = {{"name", round.name()},
                 {"points", round.points()},
                 {"passes", round.passes()},
                 {"photons", round.photons()},
                 {"cpu_s", Seconds(FromProto(round.cpu()))}};
    if (round.has_error() && !round.error().nothing_found()) {
      item["relative_error"] = IntervalOf(ErrorOf(round.error()));
    }
    json["rounds"].push_back(std::move(item));
  }
  json["surfaces"] = Json::array();
  for (const v1::SurfaceFigures& message : bake.surfaces()) {
    const SurfaceFigures of = FromProto(message);
    json["surfaces"].push_back({{"name", of.name},
                                {"triangles", of.triangles},
                                {"area_m2", of.area},
                                {"min_w_m2", of.lowest},
                                {"mean_w_m2", of.mean},
                                {"max_w_m2", of.highest},
                                {"min_lx", of.lowest * kLumensPerWatt},
                                {"mean_lx", of.mean * kLumensPerWatt},
                                {"max_lx", of.highest * kLumensPerWatt},
                                {"uniformity", of.uniformity()},
                                {"min_over_max", of.diversity()}});
  }
  if (const auto error = NewestError(job)) json["relative_error"] = IntervalOf(*error);
  if (bake.has_interpolation_error()) json["interpolation_error"] = bake.interpolation_error();
  json["path"] = path;
  return ToText(json);
}

std::string PhotonReport(const v1::PhotonPath& path) {
  Json json = {{"pass", path.key().pass()}, {"index", path.key().index()}};
  if (path.wavelength_nm() > 0) json["wavelength_nm"] = path.wavelength_nm();
  if (path.has_emission()) {
    json["emission"] = {{"light", path.emission().light()},
                        {"position", TripleOf(path.emission().position())},
                        {"direction", TripleOf(path.emission().direction())},
                        {"flux_w", TripleOf(path.emission().flux())}};
  }
  json["landings"] = Json::array();
  for (const v1::PhotonPath::Landing& landing : path.landings())
    json["landings"].push_back(LandingOf(landing));
  json["end"] = WordOf(path.end());
  return ToText(json);
}

std::string DigestReport(const Image& image) {
  Json channels = Json::array();
  for (const ImageChannel& channel : image.channels)
    channels.push_back(channel.name);
  return ToText({{"digest", image.PixelDigest().Hex()},
                 {"width", image.width},
                 {"height", image.height},
                 {"channels", channels},
                 {"metadata", image.metadata}});
}

std::string PlanReport(const SceneNeeds& needs, const ExpectedCost& cost,
                       const SceneMemory& memory) {
  Json parts = Json::array();
  for (const Part part : AllParts()) {
    parts.push_back(
        {{"part", NameOf(part)}, {"is_used", needs.Uses(part)}, {"reason", needs.ReasonOf(part)}});
  }
  return ToText({{"parts", parts},
                 {"eye_sample_sets", needs.eye_sample_sets()},
                 {"expected",
                  {{"coordinator_bytes", cost.coordinator},
                   {"worker_bytes", cost.worker},
                   {"first_pass_bytes_sent", cost.first_pass_sent},
                   {"pass_bytes_sent", cost.pass_sent}}},
                 {"scene_memory",
                  {{"files_bytes", memory.files},
                   {"shapes_bytes", memory.shapes},
                   {"textures_bytes", memory.textures},
                   {"acceleration_bytes", memory.acceleration},
                   {"instances_bytes", memory.instances},
                   {"lights_bytes", memory.lights},
                   {"edges_bytes", memory.edges},
                   {"coordinator_bytes", memory.PeakOfCoordinator()},
                   {"worker_bytes", memory.PeakOfWorker()}}}});
}

std::string SelfcheckReport(const std::vector<SelfcheckResult>& results) {
  Json cases = Json::array();
  bool all_hold = true;
  for (const SelfcheckResult& result : results) {
    all_hold = all_hold && result.outcome.holds;
    // A figure that is not a number becomes null.
    cases.push_back({{"name", result.name},
                     {"claim", result.claim},
                     {"figure", result.outcome.figure},
                     {"bound", result.outcome.bound},
                     {"note", result.outcome.note},
                     {"holds", result.outcome.holds},
                     {"wall_s", result.wall_s}});
  }
  return ToText({{"holds", all_hold}, {"cases", cases}});
}

}  // namespace lucerna
