// Light from a point that throws a picture.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "render/math/warp.h"
#include "render/transport/light_kinds.h"

namespace lucerna {
namespace {

// Of the plane at distance 1.
double AreaOfCell(const ProjectionLight& light) {
  return 4 * static_cast<double>(light.half_width) * static_cast<double>(light.half_height) /
         (static_cast<double>(light.columns()) * static_cast<double>(light.rows()));
}

}  // namespace

Rgb ProjectionEmission::Power(const ProjectionLight& light, const BoundingSphere& /*scene*/) {
  std::array<double, 3> sum{};
  for (int y = 0; y < light.rows(); ++y) {
    for (int x = 0; x < light.columns(); ++x) {
      const Rgb through = light.LightOf(x, y);
      for (int c = 0; c < 3; ++c)
        sum[static_cast<std::size_t>(c)] += static_cast<double>(through[c]);
    }
  }
  const double area = AreaOfCell(light);
  return light.intensity * Rgb{static_cast<float>(sum[0] * area), static_cast<float>(sum[1] * area),
                               static_cast<float>(sum[2] * area)};
}

bool ProjectionEmission::SampleEmission(const ProjectionLight& light, const Emitter& emitter,
                                        const BoundingSphere& /*scene*/, const EmissionNumbers& u,
                                        Emission& emission) {
  const Vec2 place = light.cells->Sample(u.direction1, u.direction2);
  const Vec3 local = light.TowardsPlace(place);
  emission.ray.origin = light.position;
  emission.ray.direction =
      Normalize(light.axes.x * local.x + light.axes.y * local.y + light.axes.z * local.z);
  const int x = std::min(static_cast<int>(place.x), light.columns() - 1);
  const int y = std::min(static_cast<int>(place.y), light.rows() - 1);
  const double share = static_cast<double>(light.WeightOf(x, y)) / light.cells->sum();
  if (!(share > 0)) return false;
  // The density over the plane is the cell's share over its area.
  emission.flux = emitter.radiance * light.ColorOf(x, y, emitter.uplift) *
                  (ProjectionLight::SolidAngleOverArea(local) *
                   static_cast<float>(AreaOfCell(light) / share) / emitter.choice);
  return true;
}

void ProjectionEmission::FindNumbers(const ProjectionLight& light, const BoundingSphere& /*scene*/,
                                     const Ray& ray, EmissionNumbers& u) {
  const float z = Dot(ray.direction, light.axes.z);
  if (!(z > 0)) return;
  const Vec2 numbers = light.cells->NumbersAt(
      light.PlaceOf(Dot(ray.direction, light.axes.x) / z, Dot(ray.direction, light.axes.y) / z));
  u.direction1 = numbers.x;
  u.direction2 = numbers.y;
}

bool ProjectionEmission::SampleDirect(const ProjectionLight& light, const Emitter& emitter,
                                      float choice, Vec3 from, LightSample& sample) {
  const Vec3 to = light.position - from;
  const float distance2 = LengthSquared(to);
  if (!(distance2 > 0)) return false;
  sample.is_distant = false;
  sample.target = light.position;
  sample.wi = to / std::sqrt(distance2);
  const Rgb factor = light.FactorAt(-sample.wi, emitter.uplift);
  sample.radiance_over_pdf = emitter.radiance * factor * (1 / (distance2 * choice));
  sample.pdf = 0;
  return !IsBlack(factor);
}

TreeLight ProjectionEmission::InTree(const ProjectionLight& light, const Emitter& emitter) {
  // As bright as if all its power went evenly into the cone around its picture.
  const double corner2 =
      static_cast<double>(light.half_width) * static_cast<double>(light.half_width) +
      static_cast<double>(light.half_height) * static_cast<double>(light.half_height);
  const double cos_corner = 1 / std::sqrt(1 + corner2);
  TreeLight in_tree;
  in_tree.intensity =
      static_cast<double>(Luminance(emitter.power)) / (2 * std::numbers::pi * (1 - cos_corner));
  in_tree.center = light.position;
  in_tree.axis = light.axes.z;
  in_tree.cos_facing = static_cast<float>(cos_corner);
  in_tree.cos_reach = 1 - 1e-4F;
  return in_tree;
}

// The picture's own detail is not looked at.
Spectrum ProjectionEmission::Source(const ProjectionLight& /*light*/, const Emitter& /*emitter*/,
                                    const Emission& /*emission*/, double /*edge_strength*/,
                                    const SpectrumLimits& limits) {
  return PointSource(limits);
}

}  // namespace lucerna
