// Light from a point into a cone.
#include <algorithm>
#include <cmath>

#include "render/math/warp.h"
#include "render/transport/light_kinds.h"

namespace lucerna {
namespace {

// Smoothstep of the cosine between the two cones, as pbrt has it.
float SpotFalloff(const SpotLight& spot, float cosine) {
  if (cosine >= spot.cos_falloff_start) return 1;
  if (cosine <= spot.cos_total_width) return 0;
  const float x = (cosine - spot.cos_total_width) / (spot.cos_falloff_start - spot.cos_total_width);
  return x * x * (3 - 2 * x);
}

}  // namespace

Rgb SpotEmission::Power(const SpotLight& spot, const BoundingSphere& /*scene*/) {
  // The smoothstep's mean is one half.
  return spot.intensity *
         (2 * kPi *
          ((1 - spot.cos_falloff_start) + 0.5F * (spot.cos_falloff_start - spot.cos_total_width)));
}

bool SpotEmission::SampleEmission(const SpotLight& spot, const Emitter& emitter,
                                  const BoundingSphere& /*scene*/, const EmissionNumbers& u,
                                  Emission& emission) {
  emission.ray.origin = spot.position;
  // Uniform in the outer cone, weighted by the falloff over its mean.
  const float cone = 1 - spot.cos_total_width;
  const Vec3 local = SquareToCone(u.direction1, u.direction2, cone);
  emission.ray.direction = Frame(spot.direction).ToWorld(local);
  const float falloff = SpotFalloff(spot, local.z);
  emission.flux = emitter.radiance * (falloff * 2 * kPi * cone / emitter.choice);
  return falloff > 0;
}

void SpotEmission::FindNumbers(const SpotLight& spot, const BoundingSphere& /*scene*/,
                               const Ray& ray, EmissionNumbers& u) {
  const Vec3 local = Frame(spot.direction).ToLocal(Normalize(ray.direction));
  const Vec2 direction = ConeToSquare(local, 1 - spot.cos_total_width);
  u.direction1 = direction.x;
  u.direction2 = direction.y;
}

bool SpotEmission::SampleDirect(const SpotLight& spot, const Emitter& emitter, float choice,
                                Vec3 from, LightSample& sample) {
  const Vec3 to = spot.position - from;
  const float distance2 = LengthSquared(to);
  sample.is_distant = false;
  sample.target = spot.position;
  sample.wi = to / std::sqrt(distance2);
  const float falloff = SpotFalloff(spot, -Dot(sample.wi, spot.direction));
  sample.radiance_over_pdf = emitter.radiance * (falloff / (distance2 * choice));
  sample.pdf = 0;
  return distance2 > 0 && falloff > 0;
}

TreeLight SpotEmission::InTree(const SpotLight& spot, const Emitter& emitter) {
  TreeLight in_tree;
  in_tree.intensity = static_cast<double>(Luminance(emitter.radiance));
  in_tree.center = spot.position;
  in_tree.axis = spot.direction;
  in_tree.cos_facing = spot.cos_total_width;
  // It ends at its cone.
  in_tree.cos_reach = 1 - 1e-4F;
  return in_tree;
}

Spectrum SpotEmission::Source(const SpotLight& spot, const Emitter& emitter,
                              const Emission& emission, double edge_strength,
                              const SpectrumLimits& limits) {
  const Vec3 direction = emission.ray.direction;
  const double width = std::acos(static_cast<double>(spot.cos_total_width)) -
                       std::acos(static_cast<double>(spot.cos_falloff_start));
  const double relative = static_cast<double>(Luminance(emission.flux)) /
                          std::max(1e-30, static_cast<double>(Luminance(emitter.power)));
  // Inside the cone the light is even, but ends at the rim: as an edge seen from the light, and
  // no harder than the falloff is.
  double curvature = SmoothFalloffCurvature(width);
  if (Dot(direction, spot.direction) >= spot.cos_falloff_start) {
    const double to_rim =
        std::acos(static_cast<double>(spot.cos_total_width)) -
        std::acos(std::min(1.0, static_cast<double>(Dot(direction, spot.direction))));
    curvature = std::min(curvature, edge_strength / std::max(to_rim * to_rim, 1e-12));
  }
  return SpotSource(std::min(relative, 1.0), curvature, limits);
}

}  // namespace lucerna
