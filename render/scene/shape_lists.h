// All shapes of a scene, for code that asks only for their traits.
#pragma once

#include <cstddef>

#include "render/scene/scene.h"

namespace lucerna {

// Calls `visit` for the list of each kind of shape, in their order. `Shapes`: a Scene, or anything
// with the same members.
template <typename Shapes, typename Visit>
void ForEachShapeList(Shapes& shapes, const Visit& visit) {
  visit(shapes.meshes);
  visit(shapes.spheres);
  visit(shapes.disks);
}

// Calls `visit` for the traits of each shape.
template <typename Shapes, typename Visit>
void ForEachShapeTraits(Shapes& shapes, const Visit& visit) {
  ForEachShapeList(shapes, [&](auto& list) {
    for (auto& shape : list)
      visit(shape.traits);
  });
}

[[nodiscard]] inline std::size_t ShapeCount(const Scene& scene) {
  std::size_t count = 0;
  ForEachShapeList(scene, [&](const auto& list) { count += list.size(); });
  return count;
}

}  // namespace lucerna
