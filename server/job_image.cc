#include "server/job_image.h"

#include <ctime>
#include <map>
#include <memory>
#include <utility>

#include "absl/strings/str_format.h"

#include "render/film/film.h"
#include "render/image/exr_file.h"
#include "render/scene/setting_table.h"

namespace lucerna {
namespace {

std::string UtcText(WallTime time) {
  const std::time_t seconds = std::chrono::system_clock::to_time_t(
      std::chrono::time_point_cast<std::chrono::system_clock::duration>(time));
  std::tm parts{};
  gmtime_r(&seconds, &parts);
  return absl::StrFormat("%04d-%02d-%02dT%02d:%02d:%02dZ", parts.tm_year + 1900, parts.tm_mon + 1,
                         parts.tm_mday, parts.tm_hour, parts.tm_min, parts.tm_sec);
}

}  // namespace

StatusOr<Blob> EncodeJobImage(const Job& job, RenderResult result, const RunRecord& run,
                              int threads) {
  std::map<std::string, std::string>& metadata = result.image.head.metadata;
  metadata["lucerna.scene_digest"] = job.scene_digest.Hex();
  metadata["lucerna.settings"] = SettingsText(job.settings);
  metadata["lucerna.seed"] = absl::StrCat(job.settings.seed);
  metadata["lucerna.passes"] = absl::StrCat(result.passes);
  metadata["lucerna.photons"] = absl::StrCat(result.photons);
  metadata[kProfileName] = run.numeric_profile;
  metadata["lucerna.run.seconds"] = absl::StrFormat("%.3f", Seconds(run.running));
  metadata["lucerna.run.cpu_seconds"] =
      absl::StrFormat("%.3f", Seconds(run.coordinator_cpu + job.counters.worker_cpu));
  metadata["lucerna.run.workers"] = absl::StrCat(job.most_workers);
  metadata["lucerna.run.finished_at"] = UtcText(run.finished_at);
  SetImageWindow(job.settings, result.image.head);
  LUCERNA_ASSIGN_OR_RETURN(std::string bytes, EncodeExr(result.image, threads));
  return std::make_shared<const std::string>(std::move(bytes));
}

}  // namespace lucerna
