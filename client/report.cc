#include "client/report.h"

#include <google/protobuf/util/time_util.h>
#include <nlohmann/json.hpp>

#include "client/progress_view.h"
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

Json SettingsOf(const v1::RenderSettings& settings) {
  return {
      {"width", settings.width()},
      {"height", settings.height()},
      {"crop", {settings.crop_x0(), settings.crop_y0(), settings.crop_x1(), settings.crop_y1()}},
      {"passes", settings.passes()},
      {"time_s", settings.time_s()},
      {"photons_per_pass", settings.photons_per_pass()},
      {"seed", settings.seed()},
      {"radius_controller", settings.radius_controller()},
      {"alpha", settings.alpha()},
      {"kernel", settings.kernel()},
      {"bias", settings.bias()},
      {"frequency_share", settings.frequency_share()},
      {"initial_radius", settings.initial_radius()},
      {"max_depth", settings.max_depth()},
  };
}

Json JobOf(const v1::Job& job) {
  const v1::Progress& progress = job.progress();
  Json json = {{"job_id", job.job_id()}, {"name", job.name()}, {"state", NameOf(job.state())}};
  if (job.state() == v1::JOB_STATE_SUCCEEDED) json["stop_reason"] = NameOf(job.stop_reason());
  if (job.state() == v1::JOB_STATE_FAILED) json["failure"] = job.failure();
  if (job.no_workers()) json["no_workers"] = true;
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
  json["tally"] = {{"photons", progress.tally().photons()},
                   {"rays", progress.tally().rays()},
                   {"deposits", progress.tally().deposits()},
                   {"pairs", progress.tally().pairs()},
                   {"dropped", progress.tally().dropped()}};
  json["sent_bytes"] = progress.bytes_sent();
  json["received_bytes"] = progress.bytes_received();
  json["hitpoints_sent"] = progress.hitpoints_sent();
  json["hitpoints_returned"] = progress.hitpoints_returned();
  if (job.has_settings()) json["settings"] = SettingsOf(job.settings());
  if (!job.scene_digest().empty()) json["scene_digest"] = HexOf(job.scene_digest());
  json["warnings"] = Json::array();
  for (const std::string& warning : job.warnings())
    json["warnings"].push_back(warning);
  return json;
}

void AddSaved(Json& json, const SavedImage& saved) {
  json["paths"] = saved.paths;
  json["image_digest"] = saved.digest.Hex();
}

}  // namespace

std::string JobReport(const v1::Job& job) {
  return ToText(JobOf(job));
}

std::string JobReport(const v1::Job& job, const SavedImage& saved) {
  Json json = JobOf(job);
  AddSaved(json, saved);
  return ToText(json);
}

std::string JobsReport(const std::vector<v1::Job>& jobs) {
  Json json = Json::array();
  for (const v1::Job& job : jobs)
    json.push_back(JobOf(job));
  return ToText(json);
}

std::string SavedReport(const std::string& job_id, const SavedImage& saved) {
  Json json = {{"job_id", job_id}};
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
  return ToText({{"pixels", metrics.pixels},
                 {"rmse", metrics.rmse},
                 {"rel_mse", metrics.rel_mse},
                 {"mean_a", metrics.mean_a},
                 {"mean_b", metrics.mean_b},
                 {"mean_ratio", metrics.mean_ratio},
                 {"channel_mean_ratio", metrics.channel_mean_ratio}});
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

}  // namespace lucerna
