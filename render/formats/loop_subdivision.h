// The smooth surface that a mesh of triangles controls.
//
// Loop's subdivision surface, with boundaries that are cubic B-splines, as pbrt-v4's "loopsubdiv"
// has it. pbrt-v4 takes limits at boundaries and normals a little otherwise; after three levels
// nobody sees it.
//
// Source: Loop 1987, "Smooth Subdivision Surfaces Based on Triangles"; Hoppe et al. 1994,
// "Piecewise Smooth Surface Reconstruction" (limits, boundaries).
#pragma once

#include "render/base/status.h"
#include "render/scene/scene.h"

namespace lucerna {

// Splits every triangle `levels` times in four, and moves the vertices to where they end when that
// goes on. The normals are those of the limit surface, on the side of the cross product of the
// triangles' edges. Requires indices in range and levels >= 0; the result has 4^levels times as
// many triangles.
// Errors: INVALID_ARGUMENT when more than two triangles share an edge, when two that share one are
// wound against each other, or when a vertex joins surfaces that share no edge there.
[[nodiscard]] StatusOr<TriangleMesh> LoopSubdivide(const TriangleMesh& control, int levels);

}  // namespace lucerna
