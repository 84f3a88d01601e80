// Where do surfaces pass through each other?
//
// An object that is sunk into the floor has no edge where it meets it; the segments of this file
// stand in for one. Surfaces are those of ConnectedSurfaces (triangles that share a corner),
// spheres and disks; a surface that passes through itself is not seen.
#pragma once

#include <array>
#include <vector>

#include "render/math/vector.h"
#include "render/scene/scene.h"

namespace lucerna {

struct FeatureSegment {
  std::array<Vec3, 2> ends;
};

// The segments in which triangles cross triangles of other surfaces and disks, and the circles in
// which spheres cross triangles and disks, as polygons around them. Surfaces that lie in one plane
// do not cross. Empty when there are more than a few million, or too many pairs that come near each
// other: foliage. Depends on the scene alone.
// Time: proportional to the shapes, times the logarithm of their number, and the pairs of surfaces
// whose boxes overlap. Memory: about 100 bytes a shape while it works.
[[nodiscard]] std::vector<FeatureSegment> SurfaceCrossings(const Scene& scene);

}  // namespace lucerna
