// Which triangles meet at an edge?
//
// Real meshes repeat vertices along seams of their texture coordinates and between their parts, so
// a vertex is known by its place (and its normal, where that matters), not by its index.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "render/math/vector.h"
#include "render/scene/scene.h"

namespace lucerna {

// For each vertex the first one that equals it exactly, in position and (when given) normal.
// -0 equals 0. Requires as many normals as positions, or none; fewer than 2^32.
[[nodiscard]] std::vector<std::uint32_t> WeldVertices(std::span<const Vec3> positions,
                                                      std::span<const Vec3> normals);

// Triangles of several meshes as those of one.
struct WeldedTriangles {
  std::vector<Vec3> positions;         // of all vertices of all meshes, in order
  std::vector<std::uint32_t> corners;  // [triangles × 3] WeldVertices by place of all of them

  [[nodiscard]] std::size_t size() const { return corners.size() / 3; }
};
// Of the meshes that `is_wanted` accepts. Requires fewer than 2^32 vertices.
[[nodiscard]] WeldedTriangles WeldMeshes(
    const std::vector<TriangleMesh>& meshes,
    const std::function<bool(const TriangleMesh&)>& is_wanted = [](const auto&) { return true; });

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

// At most `most` pieces of about equal lengths into which no edge is cut: where they begin, in
// order, and sides.size().
[[nodiscard]] std::vector<std::size_t> CutBetweenEdges(std::span<const TriangleSide> sides,
                                                       std::size_t most);

}  // namespace lucerna
