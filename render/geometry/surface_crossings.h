// Where do surfaces pass through each other?
//
// An object that is sunk into the floor has no edge where it meets it; the segments of this file
// stand in for one. Surfaces are those of ConnectedSurfaces (triangles that share a corner) and
// analytic shapes; a surface that passes through itself is not seen.
#pragma once

#include <vector>

#include "render/geometry/shape_geometry.h"
#include "render/scene/mesh_edges.h"
#include "render/scene/scene.h"

namespace lucerna {

// The segments in which triangles cross triangles of other surfaces and flat shapes, and the curves
// in which curved shapes cross triangles and flat shapes, as polygons. Surfaces that lie in one
// plane do not cross; nor do two curved shapes, or two flat ones. Empty when there are more than a
// few million, or too many pairs that come near each other: foliage. Depends on the scene alone.
// Time: proportional to the shapes, times the logarithm of their number, and the pairs of surfaces
// whose boxes overlap. Memory: 44 bytes a shape while it works, and 100 more for each to which the
// box of another surface comes near. `triangles` are those of all meshes of the scene.
[[nodiscard]] std::vector<FeatureSegment> SurfaceCrossings(const Scene& scene,
                                                           const WeldedTriangles& triangles);

}  // namespace lucerna
