// Light from a point whose intensity is a picture over the directions.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "render/math/equal_area_square.h"
#include "render/math/warp.h"
#include "render/transport/light_kinds.h"

namespace lucerna {
namespace {

// Over all directions.
float MeanFactor(const GoniometricLight& light) {
  const double pixels =
      static_cast<double>(light.map->width) * static_cast<double>(light.map->height);
  return static_cast<float>(light.directions->sum() / pixels);
}

// The pixel [pixels] that a unit direction away from the light meets.
Vec2 PlaceOf(const GoniometricLight& light, Vec3 direction) {
  const Vec2 place = EqualAreaPlace(
      {Dot(direction, light.axes.x), Dot(direction, light.axes.y), Dot(direction, light.axes.z)});
  const auto side = static_cast<float>(light.map->width);
  return {place.x * side, place.y * side};
}

float FactorAt(const GoniometricLight& light, Vec3 direction) {
  const Vec2 place = PlaceOf(light, direction);
  const int last = light.map->width - 1;
  return GoniometricLight::GrayOf(*light.map, std::min(static_cast<int>(place.x), last),
                                  std::min(static_cast<int>(place.y), last));
}

Vec3 ToWorld(const GoniometricLight& light, Vec3 local) {
  return light.axes.x * local.x + light.axes.y * local.y + light.axes.z * local.z;
}

}  // namespace

Rgb GoniometricEmission::Power(const GoniometricLight& light, const BoundingSphere& /*scene*/) {
  return light.intensity * (4 * kPi * MeanFactor(light));
}

bool GoniometricEmission::SampleEmission(const GoniometricLight& light, const Emitter& emitter,
                                         const BoundingSphere& /*scene*/, const EmissionNumbers& u,
                                         Emission& emission) {
  const Vec2 place = light.directions->Sample(u.direction1, u.direction2);
  const auto side = static_cast<float>(light.map->width);
  emission.ray.origin = light.position;
  emission.ray.direction = ToWorld(light, EqualAreaDirection({place.x / side, place.y / side}));
  // Drawn in proportion to the intensity: all photons are alike.
  return !IsBlack(emitter.power);
}

void GoniometricEmission::FindNumbers(const GoniometricLight& light,
                                      const BoundingSphere& /*scene*/, const Ray& ray,
                                      EmissionNumbers& u) {
  const Vec2 numbers = light.directions->NumbersAt(PlaceOf(light, Normalize(ray.direction)));
  u.direction1 = numbers.x;
  u.direction2 = numbers.y;
}

bool GoniometricEmission::SampleDirect(const GoniometricLight& light, const Emitter& emitter,
                                       float choice, Vec3 from, LightSample& sample) {
  const Vec3 to = light.position - from;
  const float distance2 = LengthSquared(to);
  if (!(distance2 > 0)) return false;
  sample.is_distant = false;
  sample.target = light.position;
  sample.wi = to / std::sqrt(distance2);
  const float factor = FactorAt(light, -sample.wi);
  sample.radiance_over_pdf = emitter.radiance * (factor / (distance2 * choice));
  sample.pdf = 0;
  return factor > 0;
}

TreeLight GoniometricEmission::InTree(const GoniometricLight& light, const Emitter& emitter) {
  TreeLight in_tree;
  in_tree.intensity = static_cast<double>(Luminance(emitter.power)) / (4 * std::numbers::pi);
  in_tree.center = light.position;
  return in_tree;
}

// The picture's own detail is not looked at.
Spectrum GoniometricEmission::Source(const GoniometricLight& /*light*/, const Emitter& /*emitter*/,
                                     const Emission& /*emission*/, double /*edge_strength*/,
                                     const SpectrumLimits& limits) {
  return PointSource(limits);
}

}  // namespace lucerna
