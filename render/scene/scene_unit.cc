#include "render/scene/scene_unit.h"

#include <cmath>

#include "render/scene/scene_extent.h"

namespace lucerna {
namespace {

// The largest coordinate is left alone within these powers of two, where scaling a scene keeps its
// bits (lucerna selfcheck, scale-bits), and is else brought to the last of them: half-way down from
// there to the finest detail that positions of 24 bits can have.
constexpr int kLowest = -16;
constexpr int kHighest = 20;
constexpr int kChosen = 10;

Vec3 Times(Vec3 v, double factor) {
  return {static_cast<float>(static_cast<double>(v.x) * factor),
          static_cast<float>(static_cast<double>(v.y) * factor),
          static_cast<float>(static_cast<double>(v.z) * factor)};
}

float Times(float value, double factor) {
  return static_cast<float>(static_cast<double>(value) * factor);
}

// [W·sr⁻¹] is radiance times an area.
Status ScaleIntensity(Rgb& intensity, double factor) {
  for (float* channel : {&intensity.r, &intensity.g, &intensity.b})
    *channel = Times(*channel, factor * factor);
  if (std::isfinite(MaxChannel(intensity))) return absl::OkStatus();
  return absl::OutOfRangeError(
      "a point or spot light is too strong for the size of the scene: its light has no number in "
      "single precision; scale the scene up or the intensity down");
}

}  // namespace

Status ChooseUnit(Scene& scene) {
  const double largest = ExtentOf(scene).largest;
  if (!(largest > 0)) return absl::OkStatus();
  const int exponent = std::ilogb(largest);
  if (exponent >= kLowest && exponent <= kHighest) return absl::OkStatus();
  scene.unit = std::ldexp(1.0, exponent - kChosen);
  const double factor = 1 / scene.unit;

  for (TriangleMesh& mesh : scene.meshes) {
    for (Vec3& position : mesh.positions)
      position = Times(position, factor);
  }
  for (Sphere& sphere : scene.spheres) {
    sphere.center = Times(sphere.center, factor);
    sphere.radius = Times(sphere.radius, factor);
  }
  for (Disk& disk : scene.disks) {
    disk.center = Times(disk.center, factor);
    disk.radius = Times(disk.radius, factor);
    disk.inner_radius = Times(disk.inner_radius, factor);
  }
  for (PointLight& light : scene.point_lights) {
    light.position = Times(light.position, factor);
    LUCERNA_RETURN_IF_ERROR(ScaleIntensity(light.intensity, factor));
  }
  for (SpotLight& light : scene.spot_lights) {
    light.position = Times(light.position, factor);
    LUCERNA_RETURN_IF_ERROR(ScaleIntensity(light.intensity, factor));
  }
  Camera& camera = scene.camera;
  camera.camera_to_world = Transform::Scale(factor, factor, factor) * camera.camera_to_world *
                           Transform::Scale(scene.unit, scene.unit, scene.unit);
  camera.lens_radius *= factor;
  camera.focal_distance *= factor;
  return absl::OkStatus();
}

}  // namespace lucerna
