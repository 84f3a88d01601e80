#include "render/formats/scene_unit.h"

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <memory>

#include "render/scene/density_grid.h"
#include "render/scene/scaling.h"
#include "render/scene/scene_extent.h"
#include "render/scene/shape_lists.h"

namespace lucerna {
namespace {

// The largest coordinate is left alone within these powers of two, where scaling a scene keeps its
// bits (lucerna selfcheck, scale-bits), and is else brought to the last of them: half-way down from
// there to the finest detail that positions of 24 bits can have.
constexpr int kLowest = -16;
constexpr int kHighest = 20;
constexpr int kChosen = 10;
// Rays begin at cameras and lights too, and Embree ends the program for one that begins beyond
// 2^60. Whatever lies farther than this from a scene of common size neither sees nor lights it.
constexpr int kFarthest = 50;

double FarthestOf(const Scene& scene) {
  double farthest = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto& row = scene.camera.camera_to_world.rows()[axis];
    const double on_lens = std::abs(row[0]) + std::abs(row[1]) + std::abs(row[2]);
    farthest = std::max(farthest, std::abs(row[3]) + scene.camera.lens_radius * on_lens);
    if (const auto& moves = scene.motion.of_camera) {
      const double at_close = moves->At(scene.motion.shutter_close).rows()[axis][3];
      farthest = std::max(farthest, std::abs(at_close) + scene.camera.lens_radius * on_lens);
    }
  }
  for (const Sensor& sensor : scene.sensors)
    farthest = std::max(farthest, static_cast<double>(MaxAbs(sensor.position)));
  for (const InfiniteLight& light : scene.infinite_lights) {
    if (light.portal) {
      const Portal& portal = *light.portal;
      farthest = std::max({farthest, static_cast<double>(MaxAbs(portal.corner)),
                           static_cast<double>(MaxAbs(portal.along_x)),
                           static_cast<double>(MaxAbs(portal.along_y))});
    }
  }
  for (const SensorBucket& bucket : scene.sensor_buckets) {
    for (const Vec3 corner : bucket.corners)
      farthest = std::max(farthest, static_cast<double>(MaxAbs(corner)));
    farthest = std::max({farthest, static_cast<double>(MaxAbs(bucket.ball_center)),
                         std::abs(static_cast<double>(bucket.ball_radius))});
  }
  ForEachDeltaList(scene, [&](const auto& lights) {
    for (const auto& light : lights) {
      if (!light.kIsAtInfinity)
        farthest = std::max(farthest, static_cast<double>(MaxAbs(light.Place())));
    }
  });
  return farthest;
}

// Of the power of two that is to be the unit.
int ExponentFor(const Scene& scene) {
  int exponent = 0;
  if (const double largest = ExtentOf(scene).largest; largest > 0) {
    const int own = std::ilogb(largest);
    if (own < kLowest || own > kHighest) exponent = own - kChosen;
  }
  if (const double farthest = FarthestOf(scene); farthest > 0) {
    exponent = std::max(exponent, std::ilogb(farthest) - kFarthest);
  }
  return exponent;
}

}  // namespace

Status ChooseUnit(Scene& scene) {
  const int exponent = ExponentFor(scene);
  if (exponent == 0) return absl::OkStatus();
  scene.unit = std::ldexp(1.0, exponent);
  const double factor = 1 / scene.unit;

  for (TriangleMesh& mesh : scene.meshes) {
    for (Vec3& position : mesh.positions)
      position = ScaledBy(position, factor);
  }
  for (Instance& instance : scene.instances)
    instance.to_world = Transform::Scale(factor, factor, factor) * instance.to_world;
  ForEachAnalyticShape(scene, [&](auto& shape) { shape.Scale(factor); });
  const auto to_file = Transform::Scale(scene.unit, scene.unit, scene.unit);
  for (Texture& texture : scene.textures)
    texture.mapping.from_world = texture.mapping.from_world * to_file;
  // Coefficients are per length.
  for (Material& material : scene.materials) {
    if (material.kind != Material::Kind::kSubsurface) continue;
    for (Rgb* const coefficient :
         {&material.absorption, &material.scattering, &material.extinction})
      *coefficient *= static_cast<float>(scene.unit);
  }
  for (Medium& medium : scene.media) {
    medium.absorption *= static_cast<float>(scene.unit);
    medium.scattering *= static_cast<float>(scene.unit);
    medium.absorption_spectrum.factor *= static_cast<float>(scene.unit);
    medium.scattering_spectrum.factor *= static_cast<float>(scene.unit);
    if (medium.density != nullptr)
      medium.density = std::make_shared<const DensityGrid>(medium.density->ScaledBy(factor));
  }
  for (InfiniteLight& light : scene.infinite_lights) {
    if (!light.portal) continue;
    for (Vec3* const vector :
         {&light.portal->corner, &light.portal->along_x, &light.portal->along_y})
      *vector = ScaledBy(*vector, factor);
  }
  bool has_strengths = true;
  ForEachDeltaList(scene, [&](auto& lights) {
    for (auto& light : lights)
      has_strengths = light.Scale(factor) && has_strengths;
  });
  if (!has_strengths) {
    return absl::OutOfRangeError(
        "a point or spot light is too strong for the size of the scene: its light has no number in "
        "single precision; scale the scene up or the intensity down");
  }
  Camera& camera = scene.camera;
  camera.camera_to_world = Transform::Scale(factor, factor, factor) * camera.camera_to_world *
                           Transform::Scale(scene.unit, scene.unit, scene.unit);
  SceneMotion& motion = scene.motion;
  if (motion.of_camera) motion.of_camera = motion.of_camera->ScaledBy(factor);
  for (ShapeMotion& of_shapes : motion.of_shapes) {
    for (AnimatedTransform& transform : of_shapes.to_world)
      transform = transform.ScaledBy(factor);
    of_shapes.from_world = AnimatedTransform(of_shapes.from_world).ScaledBy(factor).start();
  }
  motion.swept.low = ScaledBy(motion.swept.low, factor);
  motion.swept.high = ScaledBy(motion.swept.high, factor);
  camera.window_scale *= factor;
  camera.lens_radius *= factor;
  camera.focal_distance *= factor;
  for (Sensor& sensor : scene.sensors) {
    sensor.position = ScaledBy(sensor.position, factor);
    // Above 0 however small it is beside the scene.
    sensor.spacing = std::max(ScaledBy(sensor.spacing, factor), FLT_MIN);
  }
  for (SensorBucket& bucket : scene.sensor_buckets) {
    for (Vec3& corner : bucket.corners)
      corner = ScaledBy(corner, factor);
    bucket.ball_center = ScaledBy(bucket.ball_center, factor);
    bucket.ball_radius = ScaledBy(bucket.ball_radius, factor);
  }
  for (auto& border : scene.sensor_borders) {
    for (Vec3& end : border)
      end = ScaledBy(end, factor);
  }
  return absl::OkStatus();
}

}  // namespace lucerna
