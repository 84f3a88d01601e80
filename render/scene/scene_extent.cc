#include "render/scene/scene_extent.h"

#include <algorithm>
#include <cmath>

#include "render/scene/shape_lists.h"

namespace lucerna {
namespace {

Vec3 Everywhere(float length) {
  return {length, length, length};
}

}  // namespace

Bounds BoundsOf(const Scene& scene, const Instance& instance) {
  const Bounds& own = scene.objects[instance.object].box;
  Bounds box;
  for (int corner = 0; corner < 8; ++corner) {
    box.Add(instance.to_world.Point({(corner & 1) != 0 ? own.high.x : own.low.x,
                                     (corner & 2) != 0 ? own.high.y : own.low.y,
                                     (corner & 4) != 0 ? own.high.z : own.low.z}));
  }
  return box;
}

Bounds BoundsOf(const Scene& scene) {
  Bounds box;
  for (const TriangleMesh& mesh : scene.meshes) {
    for (const Vec3& position : mesh.positions)
      box.Add(position);
  }
  for (const Instance& instance : scene.instances) {
    const Bounds around = BoundsOf(scene, instance);
    box.Add(around.low);
    box.Add(around.high);
  }
  // An analytic shape may reach beyond the floats.
  ForEachAnalyticShape(scene, [&](const auto& shape) {
    box.Add(shape.center - Everywhere(shape.Reach()));
    box.Add(shape.center + Everywhere(shape.Reach()));
  });
  if (const Bounds& swept = scene.motion.swept; !swept.empty()) {
    box.Add(swept.low);
    box.Add(swept.high);
  }
  return box;
}

bool FacesAway(Vec3 point, Vec3 normal, const Bounds& box) {
  double farthest = 0;  // of any corner in front of the plane
  for (int axis = 0; axis < 3; ++axis) {
    const float corner = normal[axis] > 0 ? box.high[axis] : box.low[axis];
    farthest += static_cast<double>(normal[axis]) *
                (static_cast<double>(corner) - static_cast<double>(point[axis]));
  }
  return farthest <= 0;
}

SceneExtent ExtentOf(const Scene& scene) {
  const Bounds box = BoundsOf(scene);
  SceneExtent extent;
  if (box.empty()) return extent;
  double size_square = 0;
  double middle_square = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto low = static_cast<double>(box.low[axis]);
    const auto high = static_cast<double>(box.high[axis]);
    size_square += (high - low) * (high - low);
    middle_square += (high + low) * (high + low) / 4;
    extent.largest = std::max({extent.largest, std::abs(low), std::abs(high)});
  }
  extent.size = std::sqrt(size_square);
  extent.from_origin = std::sqrt(middle_square);
  return extent;
}

}  // namespace lucerna
