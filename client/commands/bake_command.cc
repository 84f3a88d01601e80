#include "client/commands/bake_command.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <numbers>
#include <utility>

#include "client/bake/irradiance_plan.h"
#include "client/bake/mesh_file.h"
#include "client/bake/surface_figures.h"
#include "client/connection.h"
#include "client/exit_code.h"
#include "client/job_run.h"
#include "client/scene_reading.h"
#include "client/view/report.h"
#include "render/base/files.h"
#include "render/formats/sensors/sensors_reader.h"
#include "render/report/convergence.h"
#include "render/scene/scene_extent.h"

namespace lucerna {
namespace {

// The main file of the jobs, beside the scene's own in their manifest. A file of the scene that has
// this name is not seen.
constexpr const char* kSensorsPath = "lucerna-sensors.ply";
constexpr std::int64_t kPasses = 64;
// Which side of a shape receives more shows at once.
constexpr std::int64_t kPassesForSides = 8;
// Few points need as many photons as many do.
constexpr std::int64_t kFewestPhotons = 1 << 16;
constexpr double kSpacingsOfDiagonal = 512;
// Edges of the first mesh in spacings. What lies between its vertices and the middles of its edges
// is not seen.
constexpr double kCoarsest = 16;

// The files of a scene on disk, and the sensors.
class FilesWithSensors final : public SceneFiles {
 public:
  FilesWithSensors(const SceneSource& scene, std::string sensors)
      : files_(FilesOf(scene)), sensors_(std::move(sensors)) {}
  [[nodiscard]] StatusOr<std::string> Read(const std::string& logical_path) override {
    if (logical_path == kSensorsPath) return sensors_;
    return files_.Read(logical_path);
  }

 private:
  DirectoryFiles files_;
  std::string sensors_;
};

// Runs jobs on a coordinator, or on one of its own.
class Jobs {
 public:
  [[nodiscard]] static StatusOr<Jobs> Open(const ClusterOptions& cluster,
                                           const std::optional<Endpoint>& server) {
    Jobs jobs;
    if (server) {
      LUCERNA_ASSIGN_OR_RETURN(jobs.connection_, ClientConnection::Open(*server));
    } else {
      LUCERNA_ASSIGN_OR_RETURN(jobs.runs_, LocalRuns::Start(cluster));
    }
    return jobs;
  }

  struct Result {
    v1::Job job;
    Image image;
  };
  [[nodiscard]] StatusOr<Result> Run(SceneFiles& files, const SceneManifest& manifest,
                                     const RenderOverrides& overrides,
                                     const OutputOptions& output_options) {
    Result result;
    if (runs_) {
      LUCERNA_ASSIGN_OR_RETURN(result.job,
                               runs_->Run(files, manifest, overrides, "", output_options));
      LUCERNA_ASSIGN_OR_RETURN(result.image, runs_->ImageOf(result.job));
      return result;
    }
    LUCERNA_ASSIGN_OR_RETURN(const v1::SubmitResponse submitted,
                             SendJob(*connection_, files, manifest, overrides, ""));
    StatusOr<v1::Job> job = FollowToEnd(*connection_, submitted.job_id(), true, output_options,
                                        [](const v1::Job& /*newest*/) { return absl::OkStatus(); });
    if (ExitCodeOf(job.status()) == ExitCode::kInterrupted) {
      connection_->Cancel(submitted.job_id()).IgnoreError();
    }
    LUCERNA_RETURN_IF_ERROR(job.status());
    LUCERNA_RETURN_IF_ERROR(CheckSucceeded(*job));
    LUCERNA_ASSIGN_OR_RETURN(const std::string bytes, connection_->GetImage(job->job_id()));
    LUCERNA_ASSIGN_OR_RETURN(result.image, DecodeImageOf(job->job_id(), bytes));
    result.job = *std::move(job);
    return result;
  }

 private:
  Jobs() = default;

  std::unique_ptr<LocalRuns> runs_;
  std::unique_ptr<ClientConnection> connection_;
};

// What was measured at each of `count` sensors.
// Errors: DATA_LOSS when the image does not have what is asked for.
StatusOr<std::vector<Irradiance>> MeasuredIn(const Image& image, std::size_t count,
                                             bool indirect_only) {
  const std::string layer = indirect_only ? "photons." : "";
  const ImageChannel* const r = image.Find(layer + "R");
  const ImageChannel* const g = image.Find(layer + "G");
  const ImageChannel* const b = image.Find(layer + "B");
  // Absent after a single pass.
  const ImageChannel* const noise = image.Find("noise");
  if (r == nullptr || g == nullptr || b == nullptr || r->pixels.size() < count) {
    return absl::DataLossError("the image of a job has not a pixel for each sensor");
  }
  // From the radiance of a white diffuse surface.
  const auto irradiance_of = [](float radiance) { return std::numbers::pi_v<float> * radiance; };
  std::vector<Irradiance> measured(count);
  for (std::size_t i = 0; i < count; ++i) {
    measured[i].value = {irradiance_of(r->pixels[i]), irradiance_of(g->pixels[i]),
                         irradiance_of(b->pixels[i])};
    if (noise != nullptr) measured[i].noise = irradiance_of(noise->pixels[i]);
  }
  return measured;
}

bool IsPly(const std::string& path) {
  return path.ends_with(".ply");
}

Status CheckRequest(const BakeRequest& request) {
  if (!IsPly(request.output_path) && !request.output_path.ends_with(".glb")) {
    return Failure(ExitCode::kUsage, absl::StrCat("-o ", request.output_path,
                                                  ": the name must end with .ply or .glb"));
  }
  if (request.is_ascii && !IsPly(request.output_path)) {
    return Failure(ExitCode::kUsage, "--ascii is for .ply files");
  }
  const bool is_chosen = request.overrides.radius_controller || request.overrides.kernel;
  if (request.estimator == BakeEstimator::kHistogram &&
      (is_chosen || request.overrides.initial_radius)) {
    return Failure(ExitCode::kUsage,
                   "a histogram has no kernel and no radius: its triangles are its buckets");
  }
  if (request.overrides.width) {
    return Failure(ExitCode::kUsage, "--size has no meaning here: --spacing says how fine to be");
  }
  if (IsSameFile(request.output_path, request.scene.path)) {
    return Failure(ExitCode::kUsage,
                   absl::StrCat(request.output_path, " is the scene; name another file with -o"));
  }
  if (!request.plan_path.empty()) {
    if (!request.plan_path.ends_with(".svg")) {
      return Failure(ExitCode::kUsage,
                     absl::StrCat("--plan ", request.plan_path, ": the name must end with .svg"));
    }
    LUCERNA_RETURN_IF_ERROR(CheckWritable(request.plan_path));
  }
  return CheckWritable(request.output_path);
}

}  // namespace

Status Bake(const BakeRequest& request, const ClusterOptions& cluster,
            const std::optional<Endpoint>& server, const OutputOptions& output_options) {
  LUCERNA_RETURN_IF_ERROR(CheckRequest(request));
  RenderOverrides overrides = request.overrides;
  const bool has_end = overrides.passes || overrides.time_s || overrides.error || overrides.photons;
  if (!has_end) overrides.passes = kPasses;
  const bool is_histogram = request.estimator == BakeEstimator::kHistogram;
  if (request.estimator != BakeEstimator::kKernel) {
    if (!overrides.kernel) overrides.kernel = KernelKind::kConstant;
    if (!overrides.radius_controller) {
      overrides.radius_controller =
          is_histogram ? RadiusControllerKind::kFixed : RadiusControllerKind::kNearest;
    }
  }
  if (is_histogram) {
    overrides.initial_radius = 0;
    overrides.initial_footprints = 1;
  }
  Scene scene;
  LUCERNA_ASSIGN_OR_RETURN(const SceneOfJobs read, ReadSceneOfJobs(request.scene, {&overrides, 1},
                                                                   output_options.quiet, &scene));
  const double diagonal = ExtentOf(scene).size * scene.unit;
  SurfaceMesh::Options options;
  options.sides = request.sides;
  options.names = request.materials;
  options.spacing = request.spacing.value_or(diagonal / kSpacingsOfDiagonal);
  LUCERNA_ASSIGN_OR_RETURN(SurfaceMesh mesh, SurfaceMesh::FromScene(scene, options));
  LUCERNA_RETURN_IF_ERROR(mesh.SplitLongEdges((is_histogram ? 1 : kCoarsest) * options.spacing));

  LUCERNA_ASSIGN_OR_RETURN(Jobs jobs, Jobs::Open(cluster, server));
  std::vector<BakeRound> rounds;
  const auto measure = [&](const std::vector<Sensor>& sensors,
                           const std::vector<std::array<Vec3, 2>>& borders,
                           const RenderOverrides& of_job) -> StatusOr<Jobs::Result> {
    const std::string bytes = SensorsFile(read.manifest.main_path, sensors, borders);
    SceneManifest manifest = read.manifest;
    manifest.entries[kSensorsPath] = {Sha256(bytes), bytes.size()};
    manifest.main_path = kSensorsPath;
    FilesWithSensors files(request.scene, bytes);
    RenderOverrides with_photons = of_job;
    if (!of_job.photons_per_pass && !scene.integrator.photons_per_pass) {
      with_photons.photons_per_pass =
          std::max(kFewestPhotons, static_cast<std::int64_t>(sensors.size()));
    }
    return jobs.Run(files, manifest, with_photons, output_options);
  };
  const auto measure_round =
      [&](const std::vector<Sensor>& sensors,
          const std::vector<std::array<Vec3, 2>>& borders) -> StatusOr<std::vector<Irradiance>> {
    if (!output_options.quiet) {
      std::fprintf(stderr, "round %zu: %zu points\n", rounds.size() + 1, sensors.size());
    }
    LUCERNA_ASSIGN_OR_RETURN(const Jobs::Result result, measure(sensors, borders, overrides));
    rounds.push_back({sensors.size(), result.job});
    return MeasuredIn(result.image, sensors.size(), request.indirect_only);
  };
  const auto measure_mesh = [&](bool with_edges) -> Status {
    const std::vector<Sensor> sensors = mesh.NextSensors(with_edges);
    if (sensors.empty()) return absl::OkStatus();
    LUCERNA_ASSIGN_OR_RETURN(const std::vector<Irradiance> measured, measure_round(sensors, {}));
    mesh.SetMeasured(measured);
    return absl::OkStatus();
  };

  if (request.sides == MeasuredSides::kBrighter) {
    // Apart from what is kept, whose estimated error would be too good with dark sides among it.
    const std::vector<Sensor> sensors = mesh.NextSensors(false);
    RenderOverrides few_passes = overrides;
    few_passes.passes = kPassesForSides;
    few_passes.time_s.reset();
    few_passes.error.reset();
    few_passes.photons.reset();
    if (!output_options.quiet) {
      std::fprintf(stderr, "which sides are lit: %zu points\n", sensors.size());
    }
    LUCERNA_ASSIGN_OR_RETURN(const Jobs::Result result, measure(sensors, {}, few_passes));
    LUCERNA_ASSIGN_OR_RETURN(const std::vector<Irradiance> measured,
                             MeasuredIn(result.image, sensors.size(), request.indirect_only));
    mesh.SetMeasured(measured);
    mesh.DropDarkerSides();
  }
  if (is_histogram) {
    LUCERNA_ASSIGN_OR_RETURN(const std::vector<Irradiance> measured,
                             measure_round(mesh.BucketSensors(), mesh.BucketBorders()));
    mesh.SetBuckets(measured);
  } else {
    LUCERNA_RETURN_IF_ERROR(measure_mesh(true));
    for (;;) {
      LUCERNA_ASSIGN_OR_RETURN(const std::size_t split, mesh.Refine(request.tolerance));
      if (split == 0) break;
      LUCERNA_RETURN_IF_ERROR(measure_mesh(true));
    }
    LUCERNA_RETURN_IF_ERROR(measure_mesh(false));
  }

  BakedMesh baked = BakedMeshOf(mesh);
  baked.scene = read.manifest.main_path;
  baked.spacing = options.spacing;
  // Its points are spread evenly over the surfaces.
  const std::optional<RelativeError> error = NewestError(rounds.front().job);
  if (error) baked.estimate = error->value;
  LUCERNA_RETURN_IF_ERROR(WriteFile(request.output_path, IsPly(request.output_path)
                                                             ? MeshPly(baked, request.is_ascii)
                                                             : MeshGlb(baked)));
  if (!request.plan_path.empty()) {
    LUCERNA_RETURN_IF_ERROR(WriteFile(request.plan_path, IrradiancePlan(baked, request.in_lux)));
  }
  const std::vector<SurfaceFigures> figures = FiguresOf(baked);
  if (output_options.json) {
    std::fputs(BakeReport(rounds, figures, mesh.InterpolationError(), request.output_path).c_str(),
               stdout);
  } else if (!output_options.quiet) {
    std::fputs(FiguresTable(figures, request.in_lux).c_str(), stdout);
    if (error) {
      std::printf("estimated error %.2g %% (95 %%: %.2g %% to %.2g %%)", 100 * error->value,
                  100 * error->low, 100 * error->high);
    } else {
      std::printf("no estimate of the error");
    }
    if (!is_histogram) {
      std::printf("; between vertices the mesh differs by %.2g %% of the mean",
                  100 * mesh.InterpolationError());
    }
    std::printf(": %s\n", request.output_path.c_str());
  }
  return absl::OkStatus();
}

}  // namespace lucerna
