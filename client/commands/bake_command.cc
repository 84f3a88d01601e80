#include "client/commands/bake_command.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <numbers>
#include <system_error>
#include <utility>

#include "absl/strings/str_format.h"

#include "client/bake/chart_atlas.h"
#include "client/bake/irradiance_plan.h"
#include "client/bake/mesh_file.h"
#include "client/bake/surface_figures.h"
#include "client/connection.h"
#include "client/exit_code.h"
#include "client/job_run.h"
#include "client/scene_reading.h"
#include "client/view/report.h"
#include "render/base/console.h"
#include "render/base/files.h"
#include "render/formats/sensors/sensors_reader.h"
#include "render/image/exr_file.h"
#include "render/report/convergence.h"
#include "render/scene/scene_extent.h"
#include "render/scene/setting_table.h"

namespace lucerna {
namespace {

// The main file of the jobs, beside the scene's own in their manifest. A file of the scene that has
// this name is not seen.
constexpr const char* kSensorsPath = "lucerna-sensors.ply";
constexpr std::int64_t kPasses = 64;
// Which side of a shape receives more shows at once, and a bright spot within a face nearly so.
constexpr std::int64_t kPassesOfSurvey = 16;
// Few points need as many photons as many do.
constexpr std::int64_t kFewestPhotons = 1 << 16;
constexpr double kSpacingsOfDiagonal = 512;
// Edges of the first mesh in spacings. What lies between its vertices and the middles of its edges
// is seen as far as it changes the mean of a face.
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
  const std::array<const ImageChannel*, 3> direct = {image.Find("direct.R"), image.Find("direct.G"),
                                                     image.Find("direct.B")};
  const bool has_direct = !indirect_only && !std::ranges::count(direct, nullptr);
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
    if (has_direct) {
      measured[i].direct =
          Luminance({irradiance_of(direct[0]->pixels[i]), irradiance_of(direct[1]->pixels[i]),
                     irradiance_of(direct[2]->pixels[i])});
    }
  }
  return measured;
}

bool IsPly(const std::string& path) {
  return path.ends_with(".ply");
}
bool IsLightMap(const BakeRequest& request) {
  return request.output_path.ends_with(".exr");
}

// Where rounds are kept.
std::string FolderOf(const BakeRequest& request) {
  return request.output_path + ".rounds";
}

Status CheckRequestOfLightMap(const BakeRequest& request) {
  if (request.estimator == BakeEstimator::kHistogram) {
    return Failure(ExitCode::kUsage,
                   "a histogram is of triangles, and a light map has none; leave --estimator away");
  }
  if (request.elements == MeshElements::kQuadratic) {
    return Failure(ExitCode::kUsage, "--elements is for meshes, and a light map is none");
  }
  if (!request.plan_path.empty()) {
    return Failure(ExitCode::kUsage, "--plan draws meshes; give -o a .glb or .ply file");
  }
  if (request.uv_mesh_path.empty()) return absl::OkStatus();
  if (!request.uv_mesh_path.ends_with(".glb")) {
    return Failure(ExitCode::kUsage, absl::StrCat("--uv-mesh ", request.uv_mesh_path,
                                                  ": the name must end with .glb"));
  }
  return CheckWritable(request.uv_mesh_path);
}

Status CheckRequest(const BakeRequest& request) {
  const bool is_light_map = IsLightMap(request);
  if (!IsPly(request.output_path) && !request.output_path.ends_with(".glb") && !is_light_map) {
    return Failure(ExitCode::kUsage,
                   absl::StrCat("-o ", request.output_path,
                                ": the name must end with .ply or .glb, or .exr for a light map"));
  }
  if (is_light_map) LUCERNA_RETURN_IF_ERROR(CheckRequestOfLightMap(request));
  if (!is_light_map && !request.uv_mesh_path.empty()) {
    return Failure(ExitCode::kUsage, "--uv-mesh is for light maps; give -o an .exr file");
  }
  if (request.is_ascii && !IsPly(request.output_path)) {
    return Failure(ExitCode::kUsage, "--ascii is for .ply files");
  }
  if (request.estimator == BakeEstimator::kHistogram &&
      request.elements == MeshElements::kQuadratic) {
    return Failure(ExitCode::kUsage,
                   "a histogram is constant on its triangles; leave --elements away");
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
  if (request.overrides.crop || request.overrides.coverage) {
    return Failure(ExitCode::kUsage,
                   absl::StrCat(request.overrides.crop ? "--crop" : "--coverage",
                                " has no meaning here: what is measured is no image; leave it "
                                "away"));
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

// Measures, and keeps what is reported of it.
class Bakery {
 public:
  Bakery(const BakeRequest& request, const OutputOptions& output_options, const Scene& scene,
         SceneManifest manifest, Jobs jobs)
      : request_(request),
        output_options_(output_options),
        scene_(scene),
        manifest_(std::move(manifest)),
        jobs_(std::move(jobs)) {}

  // What is not said otherwise: the settings of each round.
  void SetOverrides(const RenderOverrides& overrides) { overrides_ = overrides; }

  [[nodiscard]] StatusOr<std::vector<Irradiance>> MeasureRound(const SensorSet& set) {
    Say(absl::StrCat("round ", rounds_.size() + 1), set);
    LUCERNA_ASSIGN_OR_RETURN(const Jobs::Result result, Measure(set, overrides_));
    rounds_.push_back({set.sensors.size(), result.job});
    return MeasuredIn(result.image, set.sensors.size(), request_.indirect_only);
  }

  // Means over faces, from few passes.
  [[nodiscard]] StatusOr<std::vector<Irradiance>> Survey(const SensorSet& set) {
    RenderOverrides few_passes = OfHistogram(overrides_);
    few_passes.passes = kPassesOfSurvey;
    few_passes.time_s.reset();
    few_passes.error.reset();
    few_passes.photons.reset();
    Say("survey", set);
    LUCERNA_ASSIGN_OR_RETURN(const Jobs::Result result, Measure(set, few_passes));
    return MeasuredIn(result.image, set.sensors.size(), request_.indirect_only);
  }

  [[nodiscard]] static RenderOverrides OfHistogram(RenderOverrides overrides) {
    overrides.kernel = KernelKind::kConstant;
    overrides.radius_controller = RadiusControllerKind::kFixed;
    overrides.alpha.reset();
    overrides.initial_radius = 0;
    overrides.initial_footprints = 1;
    return overrides;
  }

  [[nodiscard]] const std::vector<BakeRound>& rounds() const { return rounds_; }

 private:
  void Say(const std::string& what, const SensorSet& set) const {
    if (output_options_.quiet) return;
    PrintError(absl::StrCat(what, ": ", set.sensors.size(), " points\n"));
  }

  // A job's name among those that are kept: of its scene, sensors included, and its settings.
  [[nodiscard]] std::string FileOf(const SceneManifest& manifest,
                                   const RenderOverrides& overrides) const {
    std::string text = manifest.SceneDigest().Hex();
    for (const Setting& setting : AllSettings()) {
      text += absl::StrCat(
          " ", SettingText(setting, overrides).value_or("-"));  // "-": the scene's or the default
    }
    return absl::StrCat(FolderOf(request_), "/", Sha256(text).Hex());
  }
  // A result that was kept; absent also where its files are damaged.
  [[nodiscard]] static std::optional<Jobs::Result> Kept(const std::string& file) {
    const StatusOr<std::string> image = ReadFile(file + ".exr");
    const StatusOr<std::string> job = ReadFile(file + ".job");
    if (!image.ok() || !job.ok()) return std::nullopt;
    Jobs::Result result;
    StatusOr<Image> decoded = DecodeExr(*image);
    if (!decoded.ok() || !result.job.ParseFromString(*job)) return std::nullopt;
    result.image = *std::move(decoded);
    return result;
  }
  [[nodiscard]] static Status Keep(const std::string& file, const Jobs::Result& result) {
    LUCERNA_ASSIGN_OR_RETURN(const std::string image, EncodeExr(result.image));
    LUCERNA_RETURN_IF_ERROR(WriteFile(file + ".job", result.job.SerializeAsString()));
    return WriteFile(file + ".exr", image);
  }

  [[nodiscard]] StatusOr<Jobs::Result> Measure(const SensorSet& set, RenderOverrides overrides) {
    const std::string bytes = SensorsFile(manifest_.main_path, set);
    SceneManifest manifest = manifest_;
    manifest.entries[kSensorsPath] = {Sha256(bytes), bytes.size()};
    manifest.main_path = kSensorsPath;
    FilesWithSensors files(request_.scene, bytes);
    if (!overrides.photons_per_pass && !scene_.integrator.photons_per_pass) {
      overrides.photons_per_pass =
          std::max(kFewestPhotons, static_cast<std::int64_t>(set.sensors.size()));
    }
    const std::string file = FileOf(manifest, overrides);
    if (request_.resumes) {
      if (std::optional<Jobs::Result> kept = Kept(file); kept) return *std::move(kept);
    }
    LUCERNA_ASSIGN_OR_RETURN(Jobs::Result result,
                             jobs_.Run(files, manifest, overrides, output_options_));
    LUCERNA_RETURN_IF_ERROR(Keep(file, result));
    return result;
  }

  const BakeRequest& request_;
  const OutputOptions& output_options_;
  const Scene& scene_;
  const SceneManifest manifest_;
  RenderOverrides overrides_;
  Jobs jobs_;
  std::vector<BakeRound> rounds_;
};

Status MeasureMesh(const BakeRequest& request, Bakery& bakery, SurfaceMesh& mesh, double spacing) {
  const auto measure = [&](bool with_edges) -> Status {
    SensorSet set;
    set.sensors = mesh.NextSensors(with_edges);
    if (set.sensors.empty()) return absl::OkStatus();
    LUCERNA_ASSIGN_OR_RETURN(const std::vector<Irradiance> measured, bakery.MeasureRound(set));
    mesh.SetMeasured(measured);
    return absl::OkStatus();
  };
  LUCERNA_RETURN_IF_ERROR(measure(true));
  for (;;) {
    LUCERNA_ASSIGN_OR_RETURN(const std::size_t split, mesh.Refine(request.tolerance));
    if (split == 0) break;
    LUCERNA_RETURN_IF_ERROR(measure(true));
  }
  LUCERNA_RETURN_IF_ERROR(measure(false));
  // With a tolerance of 0 the mesh is to be even.
  if (request.decimates && request.tolerance > 0 && request.elements == MeshElements::kLinear) {
    (void)mesh.Decimate(request.tolerance, kCoarsest * spacing);
  }
  return absl::OkStatus();
}

// As it is printed, after the figures.
void PrintFigures(const std::vector<SurfaceFigures>& figures, bool in_lux,
                  const std::optional<RelativeError>& error,
                  const std::optional<double>& interpolation_error, const std::string& path) {
  std::string text = FiguresTable(figures, in_lux);
  if (error) {
    absl::StrAppendFormat(&text, "estimated error %.2g %% (95 %%: %.2g %% to %.2g %%)",
                          100 * error->value, 100 * error->low, 100 * error->high);
  } else {
    text += "no estimate of the error";
  }
  if (interpolation_error) {
    absl::StrAppendFormat(&text, "; between vertices the mesh differs by %.2g %% of the mean",
                          100 * *interpolation_error);
  }
  PrintText(absl::StrCat(text, ": ", path, "\n"));
}

}  // namespace

Status Bake(const BakeRequest& request, const ClusterOptions& cluster,
            const std::optional<Endpoint>& server, const OutputOptions& output_options) {
  LUCERNA_RETURN_IF_ERROR(CheckRequest(request));
  RenderOverrides overrides = request.overrides;
  const bool has_end = overrides.passes || overrides.time_s || overrides.error || overrides.photons;
  if (!has_end) overrides.passes = kPasses;
  const bool is_histogram = request.estimator == BakeEstimator::kHistogram;
  const bool is_light_map = IsLightMap(request);
  if (is_histogram) {
    overrides = Bakery::OfHistogram(overrides);
  } else if (request.estimator == BakeEstimator::kNearest) {
    if (!overrides.kernel) overrides.kernel = KernelKind::kConstant;
    if (!overrides.radius_controller) overrides.radius_controller = RadiusControllerKind::kNearest;
  }
  Scene scene;
  LUCERNA_ASSIGN_OR_RETURN(const SceneOfJobs read, ReadSceneOfJobs(request.scene, {&overrides, 1},
                                                                   output_options.quiet, &scene));
  const double diagonal = ExtentOf(scene).size * scene.unit;
  SurfaceMesh::Options options;
  options.sides = request.sides;
  options.names = request.materials;
  options.spacing = request.spacing.value_or(diagonal / kSpacingsOfDiagonal);
  options.elements = request.elements;
  LUCERNA_ASSIGN_OR_RETURN(SurfaceMesh mesh, SurfaceMesh::FromScene(scene, options));
  // A light map's charts are of the scene's own triangles.
  if (!is_light_map) {
    LUCERNA_RETURN_IF_ERROR(mesh.SplitLongEdges(kCoarsest * options.spacing));
  }

  const std::string folder = FolderOf(request);
  std::error_code error_of_folder;
  if (!request.resumes) std::filesystem::remove_all(folder, error_of_folder);
  std::filesystem::create_directories(folder, error_of_folder);
  if (error_of_folder) {
    return absl::InvalidArgumentError(absl::StrCat(
        folder, ", for rounds that are finished, cannot be made: ", error_of_folder.message()));
  }
  LUCERNA_ASSIGN_OR_RETURN(Jobs jobs, Jobs::Open(cluster, server));
  Bakery bakery(request, output_options, scene, read.manifest, std::move(jobs));
  bakery.SetOverrides(overrides);
  const bool is_refined = !is_histogram && !is_light_map && request.tolerance > 0;
  if (is_refined || request.sides == MeasuredSides::kBrighter) {
    LUCERNA_ASSIGN_OR_RETURN(const std::vector<Irradiance> measured, bakery.Survey(mesh.Buckets()));
    mesh.SetBuckets(measured);
    if (request.sides == MeasuredSides::kBrighter) mesh.DropDarkerSides();
    mesh.KeepAsSurvey();
  }

  std::vector<SurfaceFigures> figures;
  std::optional<double> interpolation_error;
  if (is_light_map) {
    LUCERNA_ASSIGN_OR_RETURN(const ChartAtlas atlas, ChartAtlasOf(mesh, options.spacing));
    SensorSet set;
    for (const ChartAtlas::Texel& texel : atlas.texels)
      set.sensors.push_back(texel.sensor);
    LUCERNA_ASSIGN_OR_RETURN(const std::vector<Irradiance> measured, bakery.MeasureRound(set));
    Image image = AtlasImage(atlas, measured);
    image.metadata["lucerna.scene_digest"] = read.manifest.SceneDigest().Hex();
    image.metadata["lucerna.settings"] = SettingsText(read.settings.front());
    image.metadata["lucerna.spacing"] = absl::StrCat(options.spacing);
    image.metadata["lucerna.unit"] = "W/m^2";
    LUCERNA_ASSIGN_OR_RETURN(const std::string bytes, EncodeExr(image));
    LUCERNA_RETURN_IF_ERROR(WriteFile(request.output_path, bytes));
    if (!request.uv_mesh_path.empty()) {
      BakedMesh uv_mesh = AtlasMesh(mesh, atlas, image);
      uv_mesh.scene = read.manifest.main_path;
      uv_mesh.spacing = options.spacing;
      uv_mesh.is_indirect = request.indirect_only;
      LUCERNA_RETURN_IF_ERROR(WriteFile(request.uv_mesh_path, MeshGlb(uv_mesh)));
    }
    figures = FiguresOf(mesh, atlas, measured);
  } else {
    if (is_histogram) {
      LUCERNA_RETURN_IF_ERROR(mesh.SplitLongEdges(options.spacing));
      LUCERNA_ASSIGN_OR_RETURN(const std::vector<Irradiance> measured,
                               bakery.MeasureRound(mesh.Buckets()));
      mesh.SetBuckets(measured);
    } else {
      LUCERNA_RETURN_IF_ERROR(MeasureMesh(request, bakery, mesh, options.spacing));
      interpolation_error = mesh.InterpolationError();
    }
    BakedMesh baked = BakedMeshOf(mesh);
    baked.scene = read.manifest.main_path;
    baked.spacing = options.spacing;
    baked.is_indirect = request.indirect_only;
    // The points of the first round are spread evenly over the surfaces.
    if (const auto error = NewestError(bakery.rounds().front().job); error) {
      baked.estimate = error->value;
    }
    LUCERNA_RETURN_IF_ERROR(WriteFile(request.output_path, IsPly(request.output_path)
                                                               ? MeshPly(baked, request.is_ascii)
                                                               : MeshGlb(baked)));
    if (!request.plan_path.empty()) {
      LUCERNA_RETURN_IF_ERROR(WriteFile(request.plan_path, IrradiancePlan(baked, request.in_lux)));
    }
    figures = FiguresOf(baked);
  }
  std::filesystem::remove_all(folder, error_of_folder);
  if (output_options.json) {
    PrintData(BakeReport(bakery.rounds(), figures, interpolation_error, request.output_path));
  } else if (!output_options.quiet) {
    PrintFigures(figures, request.in_lux, NewestError(bakery.rounds().front().job),
                 interpolation_error, request.output_path);
  }
  return absl::OkStatus();
}

}  // namespace lucerna
