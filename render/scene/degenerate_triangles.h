// Triangles without an area: they can neither be seen nor lit.
#pragma once

#include <cstddef>

#include "render/scene/scene.h"

namespace lucerna {

// Drops the triangles of a smaller area, and those whose area is not finite. Returns how many.
std::size_t DropTriangles(TriangleMesh& mesh, double least_area);

}  // namespace lucerna
