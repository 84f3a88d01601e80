// Where on its texture does a point of a surface lie, and how fast does that change?
//
// Texture coordinates are pbrt-v4's: those of a mesh's corners; those of an analytic shape as in
// its geometry/shape_NAME.cc.
#pragma once

#include <array>
#include <cstdint>

#include "render/geometry/intersector.h"
#include "render/math/vector.h"
#include "render/scene/scene.h"

namespace lucerna {

[[nodiscard]] Vec2 UvAt(const Scene& scene, const SurfacePoint& point);
// Between the colours of the vertices; white where there are none.
[[nodiscard]] Rgb VertexColorAt(const Scene& scene, const SurfacePoint& point);
// Of the corners of a triangle, in their order.
[[nodiscard]] std::array<Vec2, 3> UvsOf(const TriangleMesh& mesh, std::uint32_t triangle);

// The squared lengths of the gradients of u and v along the surface [1/length²].
struct UvSlopes {
  double u = 0, v = 0;
};
// Zero where a triangle has no area.
[[nodiscard]] UvSlopes UvSlopesAt(const Scene& scene, const SurfacePoint& point);

}  // namespace lucerna
