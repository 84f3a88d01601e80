#include "render/bake/bake_rounds.h"

#include <algorithm>
#include <array>
#include <numbers>
#include <utility>

#include "render/bake/mesh_file.h"
#include "render/image/exr_file.h"
#include "render/math/rgb.h"
#include "render/scene/scene_extent.h"

namespace lucerna {
namespace {

constexpr std::int64_t kPasses = 64;
// Which side of a shape receives more shows at once, and a bright spot within a face nearly so.
constexpr std::int64_t kPassesOfSurvey = 16;
// Few points need as many photons as many do.
constexpr std::int64_t kFewestPhotons = 1 << 16;
constexpr double kSpacingsOfDiagonal = 512;
// Edges of the first mesh in spacings. What lies between its vertices and the middles of its edges
// is seen as far as it changes the mean of a face.
constexpr double kCoarsest = 16;

// For each face at most, while a mesh is made; for each vertex after that: it and what names it,
// and the three edges and two faces that come with it in a closed mesh; an edge that is refined has
// its middle, of quadratic elements two points more.
constexpr std::uint64_t kBytesOfVertex = 4 * sizeof(MeshVertex) + 2 * sizeof(MeshFace) + 4 * 96;
// A sensor, its line in a file, and what is measured at it.
constexpr std::uint64_t kBytesOfSensor = sizeof(Sensor) + sizeof(ChartAtlas::Texel) + 128;

// Photons are counted in buckets.
RenderOverrides OfHistogram(RenderOverrides overrides) {
  overrides.kernel = KernelKind::kConstant;
  overrides.radius_controller = RadiusControllerKind::kFixed;
  overrides.alpha.reset();
  overrides.initial_radius = 0;
  overrides.initial_footprints = 1;
  return overrides;
}

void SetEnd(std::int64_t passes, RenderOverrides& overrides) {
  overrides.passes = passes;
  overrides.time_s.reset();
  overrides.error.reset();
  overrides.photons.reset();
}

RenderOverrides OfEstimator(BakeEstimator estimator, RenderOverrides overrides) {
  const bool has_end = overrides.passes || overrides.time_s || overrides.error || overrides.photons;
  if (!has_end) overrides.passes = kPasses;
  if (estimator == BakeEstimator::kHistogram) return OfHistogram(std::move(overrides));
  if (estimator == BakeEstimator::kNearest) {
    if (!overrides.kernel) overrides.kernel = KernelKind::kConstant;
    if (!overrides.radius_controller) overrides.radius_controller = RadiusControllerKind::kNearest;
  }
  return overrides;
}

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
    return absl::DataLossError("the image of a round has not a pixel for each sensor");
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

SurfaceMesh::Options OptionsFor(const Scene& scene, const BakeSettings& settings,
                                std::uint64_t max_bytes) {
  const double diagonal = ExtentOf(scene).size * scene.unit;
  SurfaceMesh::Options options;
  options.sides = settings.sides;
  options.names = settings.materials;
  options.spacing = settings.spacing.value_or(diagonal / kSpacingsOfDiagonal);
  options.elements = settings.elements;
  options.max_faces = std::min<std::uint64_t>(SurfaceMesh::kMostFaces, max_bytes / kBytesOfVertex);
  return options;
}

}  // namespace

Status BakeRounds::Check(const Scene& scene, const BakeSettings& settings,
                         std::uint64_t max_bytes) {
  const SurfaceMesh::Options options = OptionsFor(scene, settings, max_bytes);
  LUCERNA_ASSIGN_OR_RETURN(const SurfaceMesh mesh, SurfaceMesh::FromScene(scene, options));
  return settings.is_light_map ? absl::OkStatus()
                               : mesh.CheckLongEdges(kCoarsest * options.spacing);
}

StatusOr<BakeRounds> BakeRounds::Begin(const Scene& scene, const BakeSettings& settings,
                                       const RenderOverrides& overrides, std::uint64_t max_bytes) {
  const SurfaceMesh::Options options = OptionsFor(scene, settings, max_bytes);
  LUCERNA_ASSIGN_OR_RETURN(SurfaceMesh mesh, SurfaceMesh::FromScene(scene, options));
  // A light map's charts are of the scene's own triangles.
  if (!settings.is_light_map) {
    LUCERNA_RETURN_IF_ERROR(mesh.SplitLongEdges(kCoarsest * options.spacing));
  }
  BakeRounds rounds(settings, OfEstimator(settings.estimator, overrides), std::move(mesh));
  rounds.spacing_ = options.spacing;
  rounds.max_texels_ = std::min<std::uint64_t>(kMostTexels, max_bytes / kBytesOfSensor);
  rounds.chooses_photons_ = !overrides.photons_per_pass && !scene.integrator.photons_per_pass;
  const bool is_refined = settings.estimator != BakeEstimator::kHistogram &&
                          !settings.is_light_map && settings.tolerance > 0;
  const bool is_surveyed = is_refined || settings.sides == MeasuredSides::kBrighter;
  LUCERNA_RETURN_IF_ERROR(rounds.Prepare(is_surveyed ? Next::kSurvey : rounds.AfterSurvey()));
  return rounds;
}

BakeRounds::Next BakeRounds::AfterSurvey() const {
  if (settings_.is_light_map) return Next::kTexels;
  return settings_.estimator == BakeEstimator::kHistogram ? Next::kBuckets : Next::kPoints;
}

void BakeRounds::Ask(std::string name, SensorSet set, RenderOverrides overrides) {
  if (chooses_photons_) {
    overrides.photons_per_pass =
        std::max(kFewestPhotons, static_cast<std::int64_t>(set.sensors.size()));
  }
  round_ = BakeRound{std::move(name), std::move(set), std::move(overrides)};
}

Status BakeRounds::Prepare(Next next) {
  round_.reset();
  asked_ = next;
  SensorSet set;
  switch (next) {
    case Next::kSurvey: {
      RenderOverrides few_passes = OfHistogram(overrides_);
      SetEnd(kPassesOfSurvey, few_passes);
      Ask(kSurveyName, mesh_.Buckets(), std::move(few_passes));
      return absl::OkStatus();
    }
    case Next::kTexels: {
      LUCERNA_ASSIGN_OR_RETURN(atlas_, ChartAtlasOf(mesh_, spacing_, max_texels_));
      for (const ChartAtlas::Texel& texel : atlas_->texels)
        set.sensors.push_back(texel.sensor);
      break;
    }
    case Next::kBuckets:
      LUCERNA_RETURN_IF_ERROR(mesh_.SplitLongEdges(spacing_));
      set = mesh_.Buckets();
      break;
    case Next::kPoints:
      set.sensors = mesh_.NextSensors(/*with_edges=*/true);
      if (set.sensors.empty()) return Prepare(Next::kRest);
      break;
    case Next::kRest:
      set.sensors = mesh_.NextSensors(/*with_edges=*/false);
      if (set.sensors.empty()) return Prepare(Next::kNothing);
      break;
    case Next::kNothing:
      return absl::OkStatus();
  }
  Ask(absl::StrCat("round ", ++measured_rounds_), std::move(set), overrides_);
  return absl::OkStatus();
}

Status BakeRounds::TakeIn(const Image& image, std::int64_t passes) {
  LUCERNA_ASSIGN_OR_RETURN(std::vector<Irradiance> measured,
                           MeasuredIn(image, round_->set.sensors.size(), settings_.indirect_only));
  if (asked_ != Next::kSurvey) SetEnd(passes, overrides_);
  switch (asked_) {
    case Next::kSurvey:
      mesh_.SetBuckets(measured);
      if (settings_.sides == MeasuredSides::kBrighter) mesh_.DropDarkerSides();
      mesh_.KeepAsSurvey();
      return Prepare(AfterSurvey());
    case Next::kTexels:
      texels_ = std::move(measured);
      return Prepare(Next::kNothing);
    case Next::kBuckets:
      mesh_.SetBuckets(measured);
      return Prepare(Next::kNothing);
    case Next::kPoints: {
      mesh_.SetMeasured(measured);
      if (!is_refined_) return Prepare(Next::kRest);
      LUCERNA_ASSIGN_OR_RETURN(const std::size_t split, mesh_.Refine(settings_.tolerance));
      return Prepare(split > 0 ? Next::kPoints : Next::kRest);
    }
    case Next::kRest:
      mesh_.SetMeasured(measured);
      return Prepare(Next::kNothing);
    case Next::kNothing:
      break;
  }
  return absl::InternalError("no round was asked for");
}

StatusOr<BakeResult> BakeRounds::Finish(
    const std::string& scene_path, double estimate,
    const std::vector<std::pair<std::string, std::string>>& metadata) {
  BakeResult result;
  if (settings_.is_light_map) {
    Image image = AtlasImage(*atlas_, texels_);
    for (const auto& [name, value] : metadata)
      image.metadata[name] = value;
    image.metadata["lucerna.spacing"] = absl::StrCat(spacing_);
    image.metadata["lucerna.unit"] = "W/m^2";
    LUCERNA_ASSIGN_OR_RETURN(result.file, EncodeExr(image));
    BakedMesh uv_mesh = AtlasMesh(mesh_, *atlas_, image);
    uv_mesh.scene = scene_path;
    uv_mesh.spacing = spacing_;
    uv_mesh.is_indirect = settings_.indirect_only;
    result.uv_mesh = MeshGlb(uv_mesh);
    result.figures = FiguresOf(mesh_, *atlas_, texels_);
    return result;
  }
  if (settings_.estimator != BakeEstimator::kHistogram) {
    // With a tolerance of 0 the mesh is to be even.
    if (settings_.decimates && settings_.tolerance > 0 &&
        settings_.elements == MeshElements::kLinear) {
      (void)mesh_.Decimate(settings_.tolerance, kCoarsest * spacing_);
    }
    result.interpolation_error = mesh_.InterpolationError();
  }
  BakedMesh baked = BakedMeshOf(mesh_);
  baked.scene = scene_path;
  baked.spacing = spacing_;
  baked.is_indirect = settings_.indirect_only;
  baked.estimate = estimate;
  result.file = MeshGlb(baked);
  result.figures = FiguresOf(baked);
  return result;
}

std::uint64_t BakeRounds::MemoryBytes() const {
  const std::uint64_t sensors = round_ ? round_->set.sensors.size() : texels_.size();
  return mesh_.vertices().size() * kBytesOfVertex + sensors * kBytesOfSensor;
}

}  // namespace lucerna
