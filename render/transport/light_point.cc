// Light from a point.
#include <cmath>

#include "render/math/warp.h"
#include "render/transport/light_kinds.h"

namespace lucerna {

Rgb PointEmission::Power(const PointLight& light, const BoundingSphere& /*scene*/) {
  return light.intensity * (4 * kPi);
}

bool PointEmission::SampleEmission(const PointLight& light, const Emitter& /*emitter*/,
                                   const BoundingSphere& /*scene*/, const EmissionNumbers& u,
                                   Emission& emission) {
  emission.ray.origin = light.position;
  emission.ray.direction = SquareToSphere(u.direction1, u.direction2);
  return true;
}

void PointEmission::FindNumbers(const PointLight& /*light*/, const BoundingSphere& /*scene*/,
                                const Ray& ray, EmissionNumbers& u) {
  const Vec2 direction = SphereToSquare(Normalize(ray.direction));
  u.direction1 = direction.x;
  u.direction2 = direction.y;
}

bool PointEmission::SampleDirect(const PointLight& light, const Emitter& emitter, float choice,
                                 Vec3 from, LightSample& sample) {
  const Vec3 to = light.position - from;
  const float distance2 = LengthSquared(to);
  sample.is_distant = false;
  sample.target = light.position;
  sample.wi = to / std::sqrt(distance2);
  sample.radiance_over_pdf = emitter.radiance / (distance2 * choice);
  sample.pdf = 0;
  return distance2 > 0;
}

TreeLight PointEmission::InTree(const PointLight& light, const Emitter& emitter) {
  TreeLight in_tree;
  in_tree.intensity = static_cast<double>(Luminance(emitter.radiance));
  in_tree.center = light.position;
  return in_tree;
}

Spectrum PointEmission::Source(const PointLight& /*light*/, const Emitter& /*emitter*/,
                               const Emission& /*emission*/, double /*edge_strength*/,
                               const SpectrumLimits& limits) {
  return PointSource(limits);
}

}  // namespace lucerna
