#include "server/job_intake.h"

#include <algorithm>
#include <utility>

#include "render/formats/read_scene.h"
#include "server/memory_need.h"

namespace lucerna {
namespace {

// A small upload may hold a large scene: compressed meshes and pictures, a mesh that is read a
// thousand times. What is built of the shapes is counted when they have been read (CheckMemory).
SceneLimits LimitsFor(std::uint64_t max_job_bytes) {
  SceneLimits limits;
  limits.max_shape_bytes = std::min(limits.max_shape_bytes, max_job_bytes / 4);
  limits.max_picture_bytes = std::min(limits.max_picture_bytes, max_job_bytes / 4);
  return limits;
}

}  // namespace

StatusOr<JobIntake::ReadResult> JobIntake::ReadScene(const SceneManifest& manifest,
                                                     const StillNeeded& still_needed) const {
  ManifestFiles files(manifest, [&](const Digest& digest) -> StatusOr<std::string> {
    LUCERNA_RETURN_IF_ERROR(still_needed());
    LUCERNA_ASSIGN_OR_RETURN(const Blob blob, blobs_.Get(digest));
    return *blob;
  });
  ParsedScene parsed = lucerna::ReadScene(files, manifest.main_path, LimitsFor(max_job_bytes_));
  // Before the errors of a scene whose files were not all read.
  LUCERNA_RETURN_IF_ERROR(still_needed());
  LUCERNA_RETURN_IF_ERROR(parsed.ToStatus());
  ReadResult result;
  result.scene = std::move(parsed.scene);
  for (const Diagnostic& diagnostic : parsed.diagnostics)
    result.warnings.push_back(diagnostic.ToString());
  return result;
}

StatusOr<ReferenceImage> JobIntake::ReadReference(const Digest& digest,
                                                  const RenderSettings& settings) const {
  LUCERNA_ASSIGN_OR_RETURN(const Blob bytes, blobs_.Get(digest));
  return lucerna::ReadReference(*bytes, settings);
}

StatusOr<CheckedJob> JobIntake::Check(const Submission& submission,
                                      const StillNeeded& still_needed) const {
  CheckedJob job;
  job.submission = submission;
  // Pinned before the scene is read, so that nothing vanishes until the job has ended.
  std::size_t missing = 0;
  for (const auto& [path, file] : submission.manifest.entries) {
    if (auto pin = blobs_.Pin(file.digest); pin.ok()) {
      job.pinned.push_back(*std::move(pin));
    } else {
      ++missing;
    }
  }
  if (missing > 0) {
    return absl::FailedPreconditionError(
        absl::StrCat(missing, " of the scene's ", submission.manifest.entries.size(),
                     " files are not here yet; upload them and submit again"));
  }
  LUCERNA_ASSIGN_OR_RETURN(ReadResult read, ReadScene(submission.manifest, still_needed));
  job.scene = std::move(read.scene);
  job.warnings = std::move(read.warnings);
  LUCERNA_ASSIGN_OR_RETURN(job.settings, ResolveSettings(submission.overrides, job.scene));
  // Before it is analysed, which takes memory too.
  constexpr RayNeeds kMost = {
      .robust_rays = true, .split_triangles = true, .shading_normals = true};
  LUCERNA_RETURN_IF_ERROR(CheckSceneMemory(SceneMemoryOf(job.scene, kMost), max_job_bytes_));
  job.needs = NeedsOf(job.scene, job.settings);
  job.scene_memory = SceneMemoryOf(job.scene, job.needs.rays());
  LUCERNA_RETURN_IF_ERROR(CheckMemory(job.needs, job.settings, job.scene_memory, max_job_bytes_));
  if (submission.reference) {
    auto pin = blobs_.Pin(*submission.reference);
    if (!pin.ok()) {
      return absl::FailedPreconditionError(
          "the reference image is not here yet; upload it and submit again");
    }
    job.pinned.push_back(*std::move(pin));
    LUCERNA_RETURN_IF_ERROR(ReadReference(*submission.reference, job.settings).status());
  }
  return job;
}

}  // namespace lucerna
