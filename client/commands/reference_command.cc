#include "client/commands/reference_command.h"

#include <array>
#include <cstdint>

#include "absl/strings/str_format.h"

#include "client/checkpoints.h"
#include "client/exit_code.h"
#include "client/job_run.h"
#include "client/scene_reading.h"
#include "client/view/report.h"
#include "render/base/console.h"
#include "render/base/files.h"
#include "render/film/reference.h"
#include "render/image/exr_file.h"

namespace lucerna {
namespace {

std::string MetadataOf(const Image& image, const std::string& key) {
  const auto found = image.metadata.find(key);
  return found == image.metadata.end() ? std::string() : found->second;
}

// The settings of both halves, but for the seed, and the scene. `request` has an end.
StatusOr<SceneOfJobs> ReadHalves(const ReferenceRequest& request, RenderOverrides& overrides,
                                 bool is_quiet) {
  if (overrides.passes) overrides.passes = (*overrides.passes + 1) / 2;
  if (overrides.time_s) overrides.time_s = *overrides.time_s / 2;
  if (!overrides.radius_controller) overrides.radius_controller = kReferenceController;
  if (!overrides.initial_radius) {
    overrides.initial_radius = 0;
    overrides.initial_footprints = kReferenceFootprints;
  }
  LUCERNA_ASSIGN_OR_RETURN(SceneOfJobs scene,
                           ReadSceneOfJobs({request.scene_path}, {&overrides, 1}, is_quiet));
  if (!overrides.photons_per_pass) {
    const RenderSettings& settings = scene.settings.front();
    overrides.photons_per_pass = kReferencePhotonsPerPixel * std::int64_t{settings.crop_width()} *
                                 std::int64_t{settings.crop_height()};
  }
  return scene;
}

// Renders what is not in the cluster's state yet.
StatusOr<std::array<Image, 2>> RenderHalves(LocalRuns& runs, const ReferenceRequest& request,
                                            const SceneOfJobs& scene, RenderOverrides overrides,
                                            const OutputOptions& output_options) {
  const std::array<std::uint64_t, 2> seeds = SeedsOfHalves(scene.settings.front().seed);
  LUCERNA_ASSIGN_OR_RETURN(const std::size_t begun, runs.CountJobs());
  std::array<Image, 2> halves;
  for (std::size_t half = 0; half < halves.size(); ++half) {
    overrides.seed = seeds[half];
    if (!output_options.quiet) {
      PrintError(absl::StrCat("half ", half + 1, " of 2, seed ", *overrides.seed, "\n"));
    }
    LUCERNA_ASSIGN_OR_RETURN(
        const v1::Job job,
        half < begun ? runs.Resume({scene.manifest, overrides}, output_options, half)
                     : runs.Run(request.scene_path, scene.manifest, overrides, "", output_options));
    LUCERNA_ASSIGN_OR_RETURN(halves[half], runs.ImageOf(job));
  }
  return halves;
}

}  // namespace

Status RenderReference(const ReferenceRequest& request, const ClusterOptions& cluster_options,
                       const OutputOptions& output_options) {
  RenderOverrides overrides = request.overrides;
  if (overrides.passes.has_value() == overrides.time_s.has_value()) {
    return Failure(ExitCode::kUsage, "say how long to render, with --time SECONDS or --passes N");
  }
  if (overrides.passes && *overrides.passes < 2) {
    return Failure(ExitCode::kUsage, "--passes must be at least 2: a reference has two halves");
  }
  if (IsSameFile(request.output_path, request.scene_path)) {
    return Failure(ExitCode::kUsage,
                   absl::StrCat(request.output_path, " is the scene; name another file with -o"));
  }
  LUCERNA_RETURN_IF_ERROR(CheckWritable(request.output_path));
  LUCERNA_ASSIGN_OR_RETURN(const SceneOfJobs scene,
                           ReadHalves(request, overrides, output_options.quiet));

  ClusterOptions cluster = cluster_options;
  if (request.keeps_checkpoints) cluster.state_folder = CheckpointFolderOf(request.output_path);
  LUCERNA_RETURN_IF_ERROR(OpenCheckpoints(cluster.state_folder, request.resumes, "reference"));
  StatusOr<std::array<Image, 2>> halves;
  {
    LUCERNA_ASSIGN_OR_RETURN(const auto runs, LocalRuns::Start(cluster));
    halves = RenderHalves(*runs, request, scene, overrides, output_options);
  }
  if (ExitCodeOf(halves.status()) == ExitCode::kInterrupted) {
    return Failure(ExitCode::kInterrupted, cluster.state_folder.empty()
                                               ? "interrupted"
                                               : "interrupted; the same command with --resume "
                                                 "goes on");
  }
  if (!halves.ok()) {
    return CloseCheckpoints(cluster.state_folder, request.resumes, halves.status());
  }
  LUCERNA_ASSIGN_OR_RETURN(const Image reference, MakeReference((*halves)[0], (*halves)[1]));
  LUCERNA_ASSIGN_OR_RETURN(const std::string bytes, EncodeExr(reference));
  // What cannot be written now is still in the folder.
  LUCERNA_RETURN_IF_ERROR(WriteFile(request.output_path, bytes));
  LUCERNA_RETURN_IF_ERROR(
      CloseCheckpoints(cluster.state_folder, request.resumes, absl::OkStatus()));
  if (output_options.json) {
    PrintData(ReferenceReport(reference, request.output_path));
  } else if (!output_options.quiet) {
    const auto value = [&](const char* name) {
      return MetadataOf(reference, absl::StrCat("lucerna.reference.", name));
    };
    PrintText(absl::StrCat(value("passes"), " passes, ", value("photons"),
                           " photons, noise: relMSE trimmed ", value("rel_mse_trimmed"),
                           ", untrimmed ", value("rel_mse"), "; RMSE ", value("rmse"), ": ",
                           request.output_path, "\n"));
  }
  return absl::OkStatus();
}

}  // namespace lucerna
