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

// The box around an instance.
[[nodiscard]] Bounds BoundsOf(const Scene& scene, const Instance& instance);

// The box around all shapes, at all times while the shutter is open; that of an analytic shape is
// that of the ball that holds it.
[[nodiscard]] Bounds BoundsOf(const Scene& scene);

// Whether all of `box` lies behind, or on, the plane through `point` with `normal`: light that
// leaves the plane's front meets nothing in the box.
[[nodiscard]] bool FacesAway(Vec3 point, Vec3 normal, const Bounds& box);

}  // namespace lucerna
