// Which triangles meet at an edge?
//
// Real meshes repeat vertices along seams of their texture coordinates and between their parts, so
// a vertex is known by its place (and its normal, where that matters), not by its index.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "render/math/vector.h"

namespace lucerna {

// For each vertex the first one that equals it exactly, in position and (when given) normal.
// -0 equals 0. Requires as many normals as positions, or none; fewer than 2^32.
[[nodiscard]] std::vector<std::uint32_t> WeldVertices(std::span<const Vec3> positions,
                                                      std::span<const Vec3> normals);

// For each triangle the number of the surface it belongs to, from 0 in order of their first
// triangles: triangles that share a welded vertex are of one surface. `corners` [triangles × 3] as
// for SidesByEdge.
[[nodiscard]] std::vector<std::uint32_t> ConnectedSurfaces(std::span<const std::uint32_t> corners,
                                                           std::size_t vertex_count);

// One side of a triangle.
struct TriangleSide {
  std::uint32_t low = 0, high = 0;  // the vertices at its ends, low < high
  std::uint32_t opposite = 0;       // the corner across from it: an index into `corners`

  [[nodiscard]] std::uint32_t triangle() const { return opposite / 3; }
};

// All sides of the triangles whose welded vertices are `corners` [triangles × 3], ordered by low,
// high, opposite: the triangles that meet at an edge are neighbours in the list. Sides without
// length are left out. Requires fewer than 2^32 corners, each below `vertex_count`.
[[nodiscard]] std::vector<TriangleSide> SidesByEdge(std::span<const std::uint32_t> corners,
                                                    std::size_t vertex_count);

// Calls visit(sides) once for each edge, in order, with the sides that lie on it.
template <typename Visit>
void ForEachEdge(std::span<const TriangleSide> sides, const Visit& visit) {
  for (std::size_t begin = 0, end = 0; begin < sides.size(); begin = end) {
    while (end < sides.size() && sides[end].low == sides[begin].low &&
           sides[end].high == sides[begin].high) {
      ++end;
    }
    visit(sides.subspan(begin, end - begin));
  }
}

}  // namespace lucerna
