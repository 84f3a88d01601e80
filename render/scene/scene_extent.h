// Where does a scene lie, and how large is it?
#pragma once

#include "render/scene/scene.h"

namespace lucerna {

struct SceneExtent {
  double size = 0;         // the diagonal of the box around all shapes; 0: no shapes, or a point
  double from_origin = 0;  // of the middle of that box
  double largest = 0;      // |coordinate| of any corner of that box
};

[[nodiscard]] SceneExtent ExtentOf(const Scene& scene);

}  // namespace lucerna
