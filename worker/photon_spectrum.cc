#include "worker/photon_spectrum.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "render/geometry/surface_uv.h"
#include "render/math/kernel.h"
#include "render/scene/mesh_edges.h"

namespace lucerna {
namespace {

// As of a texture whose colours are in [0, 1].
TextureDetail PictureDetail(const AreaLight& light) {
  Texture texture;
  texture.kind = Texture::Kind::kPicture;
  texture.mapping = light.mapping;
  texture.wrap_u = light.wrap_u;
  texture.wrap_v = light.wrap_v;
  texture.picture = light.picture;
  if (light.largest_pixel > 0) texture.scale = 1 / light.largest_pixel;
  return TextureDetails({texture}).front();
}

// Twice the largest radius that a job begins with: edges farther from a photon's leg than that are
// farther than its kernel will ever reach. Follows from scene and settings alone, because every
// worker must search equally far. With automatic radii it is judged for the middle of the scene.
float ReachOf(const Scene& scene, const RenderSettings& settings, const Bounds& bounds) {
  if (settings.initial_radius > 0) {
    return 2 * static_cast<float>(settings.initial_radius / scene.unit);
  }
  const Window window = ScreenWindow(scene.camera, settings.width, settings.height);
  const auto pixel = static_cast<float>((window.high_x - window.low_x) / settings.width);
  const float distance = Length(scene.camera.camera_to_world.Point({}) - bounds.Center());
  const float to_scene = std::max(distance, 0.1F * bounds.Diagonal());
  if (scene.camera.kind != Camera::Kind::kPerspective) {
    return static_cast<float>(2 * settings.initial_footprints *
                              PixelFootprint(scene.camera, settings.width, settings.height,
                                             static_cast<double>(to_scene)));
  }
  return 2 * static_cast<float>(settings.initial_footprints) * pixel * to_scene;
}

}  // namespace

StatusOr<std::unique_ptr<SpectrumTracer>> SpectrumTracer::Create(const Scene& scene,
                                                                 const RenderSettings& settings,
                                                                 const SceneNeeds& needs,
                                                                 const Intersector& intersector,
                                                                 const LightSet& lights) {
  auto tracer = std::unique_ptr<SpectrumTracer>(
      new SpectrumTracer(scene, settings, needs, intersector.bounds(), lights));
  if (needs.Uses(Part::kOccluderEdges)) {
    LUCERNA_ASSIGN_OR_RETURN(tracer->edges_, SilhouetteEdges::Create(scene, tracer->reach_));
  }
  return tracer;
}

bool SpectrumTracer::Suits(const RenderSettings& settings) const {
  return edge_strength_ == EdgeStrength(settings.bias, Kernel{settings.kernel}.Moments().mu2) &&
         reach_ == ReachOf(scene_, settings, bounds_);
}

SpectrumTracer::SpectrumTracer(const Scene& scene, const RenderSettings& settings,
                               const SceneNeeds& needs, const Bounds& bounds,
                               const LightSet& lights)
    : scene_(scene),
      lights_(lights),
      bounds_(bounds),
      limits_(SpectrumLimits::ForDiagonal(static_cast<double>(bounds.Diagonal()))),
      edge_strength_(EdgeStrength(settings.bias, Kernel{settings.kernel}.Moments().mu2)),
      reach_(ReachOf(scene, settings, bounds)),
      sees_glossily_(needs.Uses(Part::kGlossyWindow)),
      curvature_(
          scene, [&](const Material&) { return needs.Uses(Part::kCurvature); },
          [&](const Material& material) {
            // Only mirrors and glass need it (BendAt).
            return needs.Uses(Part::kCurvedMirrors) && HasNarrowLobes(material);
          }) {
  if (needs.Uses(Part::kTextureDetail)) texture_details_ = TextureDetails(scene.textures);
  const auto has_picture = [](const AreaLight& light) { return light.picture != nullptr; };
  if (std::ranges::any_of(scene.area_lights, has_picture)) {
    for (const AreaLight& light : scene.area_lights)
      picture_details_.push_back(has_picture(light) ? PictureDetail(light) : TextureDetail());
  }
  for (const auto& light : lights.infinite_lights())
    infinite_spectra_.push_back(light->MeasureSpectrum());
  MeasureEmitters();
}

void SpectrumTracer::MeasureEmitters() {
  std::vector<Vec3> positions;
  std::vector<std::uint32_t> corners;
  for (const TriangleMesh& mesh : scene_.meshes) {
    first_of_mesh_.push_back(corners.size() / 3);
    if (mesh.traits.area_light == kNoAreaLight) continue;
    const auto first = static_cast<std::uint32_t>(positions.size());
    positions.insert(positions.end(), mesh.positions.begin(), mesh.positions.end());
    for (const std::uint32_t index : mesh.indices)
      corners.push_back(first + index);
  }
  const std::vector<std::uint32_t> welded = WeldVertices(positions, {});
  for (std::uint32_t& corner : corners)
    corner = welded[corner];
  surface_of_ = ConnectedSurfaces(corners, positions.size());
  for (std::size_t i = 0; i < surface_of_.size(); ++i) {
    if (surface_of_[i] == surface_moments_.size()) surface_moments_.emplace_back();
    EmitterMoments& moments = surface_moments_[surface_of_[i]];
    moments =
        Merge(moments, TriangleMoments(positions[corners[3 * i]], positions[corners[3 * i + 1]],
                                       positions[corners[3 * i + 2]]));
  }
}

SpectrumTracer::Carried SpectrumTracer::Leave(const Emission& emission) const {
  const Emitter& emitter = lights_.emitter(emission.emitter);
  const Vec3 direction = emission.ray.direction;
  switch (emitter.kind) {
    case EmitterKind::kTriangle:
      return {WithPicture(AreaSource(surface_moments_[surface_of_[first_of_mesh_[emitter.geometry] +
                                                                  emitter.primitive]],
                                     direction, limits_),
                          emitter, emission.ray.origin),
              false};
#define LUCERNA_CASE(Name, list, name)                                                           \
  case EmitterKind::k##Name:                                                                     \
    return {WithPicture(SpectrumOf(scene_.list[emitter.primitive], direction, limits_), emitter, \
                        emission.ray.origin),                                                    \
            false};
      LUCERNA_ANALYTIC_SHAPES(LUCERNA_CASE)
#undef LUCERNA_CASE
#define LUCERNA_CASE(Name, name) \
  case EmitterKind::k##Name:     \
    return {infinite_spectra_[emitter.primitive]->Source(-direction, limits_), false};
      LUCERNA_INFINITE_LIGHTS(LUCERNA_CASE)
#undef LUCERNA_CASE
    default:
      return {lights_.DeltaSource(emission, edge_strength_, limits_).value_or(Spectrum()), false};
  }
}

Spectrum SpectrumTracer::WithPicture(Spectrum source, const Emitter& emitter, Vec3 place) const {
  if (emitter.spread < 0) return source;
  SurfacePoint point;
  point.position = place;
  point.primitive = emitter.primitive;
  const ShapeTraits* traits = nullptr;
  switch (emitter.kind) {
#define LUCERNA_CASE(Name, list, name)                       \
  case EmitterKind::k##Name:                                 \
    point.geometry = GeometryOf(scene_, ShapeKind::k##Name); \
    traits = &scene_.list[emitter.primitive].traits;         \
    break;
    LUCERNA_ANALYTIC_SHAPES(LUCERNA_CASE)
#undef LUCERNA_CASE
    default:
      point.geometry = emitter.geometry;
      traits = &scene_.meshes[emitter.geometry].traits;
      break;
  }
  const TextureDetail& detail = picture_details_[static_cast<std::size_t>(traits->area_light)];
  const UvSlopes slopes = UvSlopesAt(scene_, point);
  source.s += detail.u * slopes.u + detail.v * slopes.v;
  return limits_.Clamp(source);
}

void SpectrumTracer::Fly(Carried& carried, const Ray& ray, float distance, Shadows shadows) const {
  const auto distance_m = static_cast<double>(distance);
  if (carried.left_diffusely) {
    carried.spectrum = LeaveDiffuse(carried.spectrum, distance_m, limits_);
    carried.left_diffusely = false;
  }
  if (!(distance > 0)) return;
  const NearbyEdges nearby = shadows == Shadows::kFound && edges_ != nullptr
                                 ? edges_->Find(ray.origin, ray.direction, distance)
                                 : NearbyEdges();
  std::array<PassedEdge, NearbyEdges::kCapacity> passed;
  std::size_t count = 0;
  for (const NearbyEdge& edge : nearby.all()) {
    passed[count++] = {static_cast<double>(edge.distance_along),
                       static_cast<double>(edge.distance_across)};
  }
  carried.spectrum = TravelPastEdges(carried.spectrum, distance_m, {passed.data(), count},
                                     edge_strength_, limits_);
}

float SpectrumTracer::Received(const Carried& carried, const SurfacePoint& surface,
                               const Material& material, Vec3 wo) const {
  const double cosine = static_cast<double>(std::abs(Dot(wo, surface.shading_normal)));
  Spectrum seen = carried.spectrum;
  // Of two parts, photons are gathered on the second.
  MaterialNumbers gathers = material;
  if (PropertiesOf(material).has_parts) gathers.parts = Parts::kSecond;
  if (const MaterialProperties properties = PropertiesOf(gathers);
      sees_glossily_ && properties.has_narrow_lobes()) {
    const double lobe = ReflectedLobe(static_cast<double>(properties.lobe_width));
    if (lobe < kDiffuseLobe) {
      seen = SeeGlossily(seen, cosine, BendAt(surface, wo), ObliqueLobe(lobe, cosine), limits_);
    }
  }
  // Two equal principal curvatures with the sum of squares that the surface has.
  const double bend = std::sqrt(0.5 * static_cast<double>(curvature_.SquaredPrincipals(surface)));
  const double trace = ReceivedTrace(seen, cosine, bend, bend, limits_);
  // Held in the range of float; a trace that large gives the smallest radius anyway.
  return std::isfinite(trace) ? static_cast<float>(std::min(trace, 1e37)) : -1.0F;
}

double SpectrumTracer::TextureDetailAt(const SurfacePoint& surface,
                                       const Material& material) const {
  if (material.texture == kNoTexture || texture_details_.empty()) return 0;
  const TextureDetail& detail = texture_details_[static_cast<std::size_t>(material.texture)];
  const UvSlopes slopes = UvSlopesAt(scene_, surface);
  return detail.u * slopes.u + detail.v * slopes.v;
}

SurfaceBend SpectrumTracer::BendAt(const SurfacePoint& surface, Vec3 wo) const {
  const Vec3 normal = surface.shading_normal;
  Vec3 tangential = wo - normal * Dot(wo, normal);
  const float squared = LengthSquared(tangential);
  tangential = squared > 1e-8F ? tangential * (1 / std::sqrt(squared)) : Frame(normal).s;
  const NormalCurvature in_plane = curvature_.Along(surface, tangential);
  const NormalCurvature across = curvature_.Along(surface, Cross(normal, tangential));
  // Convex towards the light that comes in.
  const double side = Dot(wo, surface.geometric_normal) < 0 ? -1 : 1;
  return {side * static_cast<double>(in_plane.curvature),
          side * static_cast<double>(across.curvature),
          static_cast<double>(std::max(in_plane.gradient, across.gradient)),
          static_cast<double>(std::max(in_plane.second_gradient, across.second_gradient))};
}

void SpectrumTracer::Scatter(Carried& carried, const SurfacePoint& surface,
                             const Material& material, Vec3 wo, Vec3 wi, Parts part) const {
  const Vec3 normal = surface.shading_normal;
  const auto diffuse = [&] {
    const double bend = std::sqrt(0.5 * static_cast<double>(curvature_.SquaredPrincipals(surface)));
    const double trace = ReceivedTrace(
        carried.spectrum, static_cast<double>(std::abs(Dot(wo, normal))), bend, bend, limits_);
    carried = {ScatterDiffusely(trace, TextureDetailAt(surface, material), limits_), true};
  };
  MaterialNumbers numbers = material;
  numbers.parts = part;
  const MaterialProperties properties = PropertiesOf(numbers);
  if (!properties.has_narrow_lobes()) {
    diffuse();
    return;
  }
  const bool transmits = Dot(wo, normal) * Dot(wi, normal) < 0;
  const bool from_outside = Dot(wo, normal) > 0;
  const double ior = static_cast<double>(properties.ior);
  const double ior_ratio = from_outside ? 1 / ior : ior;  // n1 / n2
  // A rough surface scatters at a facet; the lobe around it blurs.
  Vec3 facet = normal;
  if (!properties.is_smooth) {
    facet = transmits ? wo * static_cast<float>(ior_ratio) + wi : wo + wi;
    const float squared = LengthSquared(facet);
    if (!(squared > 0)) return diffuse();
    facet = facet * (1 / std::sqrt(squared));
  }
  const double cosine = static_cast<double>(std::abs(Dot(wo, facet)));
  double lobe = 0;
  if (!properties.is_smooth) {
    const auto alpha = static_cast<double>(properties.lobe_width);
    lobe = ObliqueLobe(transmits ? RefractedLobe(alpha, ior_ratio, cosine) : ReflectedLobe(alpha),
                       cosine);
    if (lobe > kDiffuseLobe) return diffuse();
  }
  const SurfaceBend bend = BendAt(surface, wo);
  carried.spectrum = transmits ? Refract(carried.spectrum, ior_ratio, cosine, bend, limits_)
                               : Mirror(carried.spectrum, cosine, bend, limits_);
  if (lobe > 0) carried.spectrum = Blur(carried.spectrum, lobe, limits_);
}

}  // namespace lucerna
