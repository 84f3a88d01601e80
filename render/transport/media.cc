#include "render/transport/media.h"

#include <algorithm>
#include <cmath>

#include "render/math/warp.h"
#include "render/scene/shape_lists.h"

namespace lucerna {

float PhaseHenyeyGreenstein(float cosine, float g) {
  const float denominator = std::max(1 + g * g - 2 * g * cosine, 1e-7F);
  return (1 - g * g) / (4 * kPi * denominator * std::sqrt(denominator));
}

Vec3 SamplePhase(Vec3 direction, float g, float u1, float u2) {
  float cosine = 1 - 2 * u1;
  if (std::abs(g) > 1e-3F) {
    const float part = (1 - g * g) / (1 - g + 2 * g * u1);
    cosine = std::clamp((1 + g * g - part * part) / (2 * g), -1.0F, 1.0F);
  }
  const float sine = std::sqrt(std::max(0.0F, 1 - cosine * cosine));
  const float angle = 2 * kPi * u2;
  return Normalize(
      Frame(direction).ToWorld({sine * std::cos(angle), sine * std::sin(angle), cosine}));
}

Media::Media(const Scene& scene, const Intersector& intersector)
    : scene_(scene), intersector_(intersector) {
  if (scene.media.empty()) return;
  for (const Material& material : scene.materials) {
    const MaterialProperties properties = PropertiesOf(material);
    is_interface_.push_back(properties.is_interface ? 1 : 0);
    transmits_.push_back(properties.transmits ? 1 : 0);
  }
  ForEachShapeTraits(scene, [&](const ShapeTraits& traits) {
    has_interfaces_ |= is_interface_[static_cast<std::size_t>(traits.material)] != 0;
  });
  at_camera_ = AtLight(scene.camera.camera_to_world.Point({}), scene.camera.medium);
}

std::int32_t Media::Beyond(const SurfacePoint& surface, Vec3 direction, std::int32_t medium) const {
  const ShapeTraits& traits = TraitsOf(scene_, surface);
  if (!traits.SeparatesMedia()) return medium;
  return Dot(direction, surface.geometric_normal) > 0 ? traits.medium_outside
                                                      : traits.medium_inside;
}

bool Media::FindAlong(Ray ray, std::int32_t& medium) const {
  for (int i = 0; i < kMostInterfaces; ++i) {
    Hit hit;
    if (!intersector_.Intersect(ray, hit)) return false;
    const SurfacePoint surface = intersector_.SurfaceAt(ray, hit);
    const ShapeTraits& traits = TraitsOf(scene_, surface);
    if (traits.SeparatesMedia() && transmits_[surface.material] != 0) {
      medium = Dot(ray.direction, surface.geometric_normal) > 0 ? traits.medium_inside
                                                                : traits.medium_outside;
      return true;
    }
    ray = {LeavingPoint(surface, ray.direction), ray.direction, HUGE_VALF};
  }
  return false;
}

std::int32_t Media::AtLight(Vec3 position, std::int32_t named) const {
  if (named != kNoMedium || scene_.media.empty()) return named;
  std::int32_t medium = kNoMedium;
  // No direction along which scenes are built.
  constexpr Vec3 kDirection = {0.4082483F, 0.2672612F, 0.8728716F};
  const Vec3 direction = Normalize(kDirection);
  if (FindAlong({position, direction, HUGE_VALF}, medium)) return medium;
  if (FindAlong({position, -direction, HUGE_VALF}, medium)) return medium;
  return kNoMedium;
}

Rgb Media::Transmittance(const Ray& ray, std::int32_t medium, int& rays) const {
  const float scale = Length(ray.direction);
  if (!has_interfaces_) {
    ++rays;
    if (intersector_.Occluded(ray)) return {};
    return medium == kNoMedium
               ? Gray(1)
               : TransmittanceOf(medium, {ray.origin, ray.direction / scale}, ray.t_max * scale);
  }
  Rgb transmittance = Gray(1);
  Ray rest = {ray.origin, ray.direction / scale, ray.t_max * scale};
  for (int i = 0; i < kMostInterfaces; ++i) {
    Hit hit;
    ++rays;
    const bool is_met = intersector_.Intersect(rest, hit);
    if (medium != kNoMedium)
      transmittance *= TransmittanceOf(medium, rest, is_met ? hit.t : rest.t_max);
    if (!is_met) return transmittance;
    const SurfacePoint surface = intersector_.SurfaceAt(rest, hit);
    if (!IsInterface(surface) || IsBlack(transmittance)) return {};
    medium = Beyond(surface, rest.direction, medium);
    rest = {LeavingPoint(surface, rest.direction), rest.direction, rest.t_max - hit.t};
    if (!(rest.t_max > 0)) return transmittance;
  }
  return {};
}

}  // namespace lucerna
