#include "render/scene/mesh_edges.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <tuple>

#include "render/base/status.h"
#include "render/math/rng.h"
#include "render/math/union_find.h"

namespace lucerna {
namespace {

constexpr std::uint32_t kEmpty = std::numeric_limits<std::uint32_t>::max();

std::uint64_t KeyOf(Vec3 v) {
  // Adding 0 turns -0 into 0, which are equal and must have equal keys.
  const auto bits = [](float c) { return std::uint64_t{std::bit_cast<std::uint32_t>(c + 0.0F)}; };
  return Mix64(Mix64(bits(v.x) << 32 | bits(v.y)) ^ bits(v.z));
}

}  // namespace

std::vector<std::uint32_t> WeldVertices(std::span<const Vec3> positions,
                                        std::span<const Vec3> normals) {
  LUCERNA_CHECK(positions.size() < kEmpty);
  LUCERNA_CHECK(normals.empty() || normals.size() == positions.size());
  // Open addressing, at most half full.
  const std::size_t slots = std::bit_ceil(2 * positions.size() + 1);
  std::vector<std::uint32_t> table(slots, kEmpty);
  std::vector<std::uint32_t> first(positions.size());
  for (std::uint32_t i = 0; i < positions.size(); ++i) {
    std::uint64_t key = KeyOf(positions[i]);
    if (!normals.empty()) key = CombineKeys(key, KeyOf(normals[i]));
    std::size_t slot = key & (slots - 1);
    const auto is_other = [&](std::uint32_t j) {
      return j != kEmpty &&
             !(positions[j] == positions[i] && (normals.empty() || normals[j] == normals[i]));
    };
    while (is_other(table[slot]))
      slot = (slot + 1) & (slots - 1);
    if (table[slot] == kEmpty) table[slot] = i;
    first[i] = table[slot];
  }
  return first;
}

WeldedTriangles WeldMeshes(const std::vector<TriangleMesh>& meshes,
                           const std::function<bool(const TriangleMesh&)>& is_wanted) {
  WeldedTriangles triangles;
  std::size_t vertex_count = 0;
  std::size_t corner_count = 0;
  for (const TriangleMesh& mesh : meshes) {
    if (!is_wanted(mesh)) continue;
    vertex_count += mesh.positions.size();
    corner_count += mesh.indices.size();
  }
  LUCERNA_CHECK(vertex_count < kEmpty);
  triangles.positions.reserve(vertex_count);
  triangles.corners.reserve(corner_count);
  for (const TriangleMesh& mesh : meshes) {
    if (!is_wanted(mesh)) continue;
    const auto first = static_cast<std::uint32_t>(triangles.positions.size());
    triangles.positions.insert(triangles.positions.end(), mesh.positions.begin(),
                               mesh.positions.end());
    for (const std::uint32_t index : mesh.indices)
      triangles.corners.push_back(first + index);
  }
  const std::vector<std::uint32_t> welded = WeldVertices(triangles.positions, {});
  for (std::uint32_t& corner : triangles.corners)
    corner = welded[corner];
  return triangles;
}

std::vector<std::uint32_t> ConnectedSurfaces(std::span<const std::uint32_t> corners,
                                             std::size_t vertex_count) {
  UnionFind surfaces(vertex_count);
  for (std::size_t i = 0; i + 2 < corners.size(); i += 3) {
    surfaces.Unite(corners[i], corners[i + 1]);
    surfaces.Unite(corners[i], corners[i + 2]);
  }
  constexpr std::uint32_t kNone = 0xFFFFFFFFU;
  std::vector<std::uint32_t> number(vertex_count, kNone);
  std::vector<std::uint32_t> surface_of;
  std::uint32_t count = 0;
  for (std::size_t i = 0; i + 2 < corners.size(); i += 3) {
    std::uint32_t& surface = number[surfaces.Find(corners[i])];
    if (surface == kNone) surface = count++;
    surface_of.push_back(surface);
  }
  return surface_of;
}

std::vector<TriangleSide> SidesByEdge(std::span<const std::uint32_t> corners,
                                      std::size_t vertex_count) {
  LUCERNA_CHECK(corners.size() < kEmpty);
  const auto side_at = [&](std::size_t corner) {
    const std::size_t first = corner / 3 * 3;
    const std::uint32_t a = corners[first + (corner + 1) % 3];
    const std::uint32_t b = corners[first + (corner + 2) % 3];
    return TriangleSide{std::min(a, b), std::max(a, b), static_cast<std::uint32_t>(corner)};
  };
  // A counting sort by the lower end, then a sort of the few sides at each: several times faster
  // than one sort of all.
  std::vector<std::uint32_t> begin(vertex_count + 1, 0);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const TriangleSide side = side_at(i);
    if (side.low != side.high) ++begin[side.low + 1];
  }
  for (std::size_t v = 0; v < vertex_count; ++v)
    begin[v + 1] += begin[v];
  std::vector<TriangleSide> sides(begin[vertex_count]);
  std::vector<std::uint32_t> next(begin.begin(), begin.end() - 1);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const TriangleSide side = side_at(i);
    if (side.low != side.high) sides[next[side.low]++] = side;
  }
  for (std::size_t v = 0; v < vertex_count; ++v) {
    std::sort(sides.begin() + begin[v], sides.begin() + begin[v + 1],
              [](const TriangleSide& a, const TriangleSide& b) {
                return std::tie(a.high, a.opposite) < std::tie(b.high, b.opposite);
              });
  }
  return sides;
}

std::vector<std::size_t> CutBetweenEdges(std::span<const TriangleSide> sides, std::size_t most) {
  std::vector<std::size_t> borders = {0};
  for (std::size_t piece = 1; piece <= most; ++piece) {
    std::size_t border = std::max(borders.back(), sides.size() / most * piece);
    if (piece == most) border = sides.size();
    while (border > 0 && border < sides.size() && sides[border].low == sides[border - 1].low &&
           sides[border].high == sides[border - 1].high) {
      ++border;
    }
    if (border > borders.back()) borders.push_back(border);
  }
  return borders;
}

}  // namespace lucerna
