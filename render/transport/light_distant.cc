// Parallel light from infinity.
#include "render/math/warp.h"
#include "render/transport/light_kinds.h"

namespace lucerna {

Rgb DistantEmission::Power(const DistantLight& light, const BoundingSphere& scene) {
  return light.irradiance * (kPi * scene.radius * scene.radius);
}

bool DistantEmission::SampleEmission(const DistantLight& light, const Emitter& /*emitter*/,
                                     const BoundingSphere& scene, const EmissionNumbers& u,
                                     Emission& emission) {
  const Frame frame(light.direction);
  const Vec3 disk = SquareToDisk(u.place1, u.place2) * scene.radius;
  emission.ray.origin =
      scene.center - light.direction * scene.radius + frame.s * disk.x + frame.t * disk.y;
  emission.ray.direction = light.direction;
  return true;
}

void DistantEmission::FindNumbers(const DistantLight& light, const BoundingSphere& scene,
                                  const Ray& ray, EmissionNumbers& u) {
  const Frame frame(light.direction);
  const Vec3 offset = ray.origin - scene.center;
  const Vec2 place =
      DiskToSquare(Dot(offset, frame.s) / scene.radius, Dot(offset, frame.t) / scene.radius);
  u.place1 = place.x;
  u.place2 = place.y;
}

bool DistantEmission::SampleDirect(const DistantLight& light, const Emitter& emitter, float choice,
                                   Vec3 /*from*/, LightSample& sample) {
  sample.wi = -light.direction;
  sample.is_distant = true;
  sample.radiance_over_pdf = emitter.radiance / choice;
  sample.pdf = 0;
  return true;
}

TreeLight DistantEmission::InTree(const DistantLight& /*light*/, const Emitter& emitter) {
  TreeLight in_tree;
  in_tree.is_at_infinity = true;
  in_tree.intensity = static_cast<double>(Luminance(emitter.radiance));
  return in_tree;
}

Spectrum DistantEmission::Source(const DistantLight& /*light*/, const Emitter& /*emitter*/,
                                 const Emission& /*emission*/, double /*edge_strength*/,
                                 const SpectrumLimits& limits) {
  return DirectionalSource(limits);
}

}  // namespace lucerna
