#include "render/analysis/enclosures.h"

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <utility>

#include "render/analysis/line_crossing.h"
#include "render/math/union_find.h"
#include "render/scene/mesh_edges.h"
#include "render/scene/shape_lists.h"

namespace lucerna {
namespace {

// True when all points lie farther than `distance` from the triangle's plane, on one side of it.
bool LieOnOneSide(const Triangle& triangle, std::span<const Vec3> points, double distance) {
  const Double3 origin(triangle[0]);
  const Double3 cross = TriangleCross(triangle[0], triangle[1], triangle[2]);
  const double limit = distance * Length(cross);
  double lowest = HUGE_VAL;
  double highest = -HUGE_VAL;
  for (const Vec3& point : points) {
    const double height = Dot(Double3(point) - origin, cross);
    lowest = std::min(lowest, height);
    highest = std::max(highest, height);
  }
  return lowest > limit || highest < -limit;
}

Triangle TriangleAt(const WeldedTriangles& walls, std::uint32_t number) {
  const std::uint32_t* const corner = &walls.corners[std::size_t{3} * number];
  return {walls.positions[corner[0]], walls.positions[corner[1]], walls.positions[corner[2]]};
}

// Triangles of all meshes that count, each once.
WeldedTriangles WallsOf(const Scene& scene, const MaterialPredicate& is_wall) {
  WeldedTriangles walls = WeldMeshes(scene.meshes, [&](const TriangleMesh& mesh) {
    return IsWhole(mesh.traits) && mesh.traits.motion == kNoMotion &&
           is_wall(scene.materials[static_cast<std::size_t>(mesh.traits.material)]);
  });
  const std::vector<std::uint32_t> corners = std::exchange(walls.corners, {});
  // The same triangle twice is one wall.
  std::vector<std::pair<std::array<std::uint32_t, 3>, std::uint32_t>> sorted;
  sorted.reserve(corners.size() / 3);
  for (std::uint32_t t = 0; t < corners.size() / 3; ++t) {
    std::array<std::uint32_t, 3> key = {corners[3 * t], corners[3 * t + 1], corners[3 * t + 2]};
    std::ranges::sort(key);
    sorted.emplace_back(key, t);
  }
  std::ranges::sort(sorted);
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    const auto& [key, t] = sorted[i];
    if (i > 0 && sorted[i - 1].first == key) continue;
    if (key[0] == key[1] || key[1] == key[2]) continue;
    for (std::size_t k = 0; k < 3; ++k)
      walls.corners.push_back(corners[3 * t + k]);
  }
  return walls;
}

// Side 2t is the front of triangle t, 2t + 1 its back. Sides that face each other around an edge,
// with no triangle between them, look into the same region.
UnionFind RegionsOf(const WeldedTriangles& walls, const std::vector<TriangleSide>& sides) {
  UnionFind regions(2 * walls.size());
  struct Around {
    double angle;
    std::uint32_t towards, away;  // its side that looks where angles grow, and the other
  };
  std::vector<Around> around;
  ForEachEdge(sides, [&](std::span<const TriangleSide> at_edge) {
    const Double3 low(walls.positions[at_edge[0].low]);
    const Double3 axis = Double3(walls.positions[at_edge[0].high]) - low;
    const Axes frame(axis.x, axis.y, axis.z);
    around.clear();
    for (const TriangleSide& side : at_edge) {
      const std::uint32_t triangle = side.triangle();
      const Double3 out = Double3(walls.positions[walls.corners[side.opposite]]) - low;
      const std::uint32_t next = 3 * triangle + (side.opposite + 1) % 3;
      // Wound from low to high, a triangle has its front where angles grow.
      const bool is_front = walls.corners[next] == side.low;
      around.push_back({std::atan2(Dot(out, frame.y), Dot(out, frame.x)),
                        2 * triangle + (is_front ? 0U : 1U), 2 * triangle + (is_front ? 1U : 0U)});
    }
    std::ranges::sort(around, {}, &Around::angle);
    for (std::size_t i = 0; i < around.size(); ++i)
      regions.Unite(around[i].towards, around[(i + 1) % around.size()].away);
  });
  return regions;
}

}  // namespace

ClosedSurface::ClosedSurface(std::vector<Triangle> triangles) : triangles_(std::move(triangles)) {
  for (const Triangle& triangle : triangles_) {
    for (const Vec3& corner : triangle)
      bounds_.Add(corner);
  }
  near_ = kNear * LargestCoordinate(bounds_);
}

ClosedSurface::ClosedSurface(Vec3 center, float reach,
                             std::function<double(Double3)> signed_distance)
    : signed_distance_(std::move(signed_distance)),
      center_(center),
      reach_(static_cast<double>(reach)),
      bounds_(BoxAround(center, reach)),
      near_(kNear * LargestCoordinate(bounds_)) {}

std::optional<bool> ClosedSurface::Contains(Vec3 point) const {
  if (AreDisjoint(BoxAround({&point, 1}), bounds_, near_)) return false;
  const Double3 origin(point);
  if (triangles_.empty()) {
    const double off = signed_distance_(origin);
    if (std::abs(off) <= near_) return std::nullopt;
    return off < 0;
  }
  for (const Axes& line : kParityRayDirections) {
    bool is_inside = false;
    bool is_clear = true;
    for (const Triangle& triangle : triangles_) {
      double along = 0;
      const Crossing crossing = CrossingOf(
          {line.In(Double3(triangle[0]) - origin), line.In(Double3(triangle[1]) - origin),
           line.In(Double3(triangle[2]) - origin)},
          along);
      if (crossing == Crossing::kNone) continue;
      is_clear = crossing == Crossing::kOnce && std::abs(along) > near_;
      if (!is_clear) break;
      if (along > 0) is_inside = !is_inside;
    }
    if (is_clear) return is_inside;
  }
  return std::nullopt;
}

bool ClosedSurface::IsOff(const Triangle& triangle, std::span<const Vec3> points,
                          const Bounds& box) const {
  if (AreDisjoint(BoxAround(triangle), box, near_)) return true;
  if (LieOnOneSide(triangle, points, near_)) return true;
  return points.size() == 3 && LieOnOneSide({points[0], points[1], points[2]}, triangle, near_);
}

bool ClosedSurface::IsApartFrom(std::span<const Vec3> points) const {
  const Bounds box = BoxAround(points);
  if (AreDisjoint(box, bounds_, near_)) return true;
  if (triangles_.empty()) {
    double nearest = 0;  // from the centre to the box, squared
    for (int axis = 0; axis < 3; ++axis) {
      const double c = axis == 0 ? center_.x : axis == 1 ? center_.y : center_.z;
      const double off = std::max(
          {0.0, static_cast<double>(box.low[axis]) - c, c - static_cast<double>(box.high[axis])});
      nearest += off * off;
    }
    if (std::sqrt(nearest) > reach_ + near_) return true;
    // The body is convex: what holds the points holds all between them.
    return std::ranges::all_of(
        points, [&](const Vec3& point) { return signed_distance_(Double3(point)) < -near_; });
  }
  return std::ranges::all_of(
      triangles_, [&](const Triangle& triangle) { return IsOff(triangle, points, box); });
}

std::vector<ClosedSurface> ClosedSurfacesOf(const Scene& scene, const MaterialPredicate& is_wall) {
  std::vector<ClosedSurface> surfaces;
  const WeldedTriangles walls = WallsOf(scene, is_wall);
  const std::vector<TriangleSide> sides = SidesByEdge(walls.corners, walls.positions.size());
  UnionFind regions = RegionsOf(walls, sides);
  // A region is bounded by the triangles that have one side in it; those that have both are
  // surrounded by it. Around an edge one enters the region as often as one leaves it, so its
  // boundary has an even number of triangles there: it is closed.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> faces;  // region, triangle
  for (std::uint32_t t = 0; t < walls.size(); ++t) {
    const std::uint32_t front = regions.Find(2 * t);
    const std::uint32_t back = regions.Find(2 * t + 1);
    if (front == back) continue;
    faces.emplace_back(front, t);
    faces.emplace_back(back, t);
  }
  std::ranges::sort(faces);
  std::vector<std::vector<std::uint32_t>> boundaries;
  for (std::size_t begin = 0, end = 0; begin < faces.size(); begin = end) {
    std::vector<std::uint32_t> triangles;
    while (end < faces.size() && faces[end].first == faces[begin].first)
      triangles.push_back(faces[end++].second);
    boundaries.push_back(std::move(triangles));
  }
  // The same surface from within and from without.
  std::ranges::sort(boundaries);
  boundaries.erase(std::unique(boundaries.begin(), boundaries.end()), boundaries.end());
  for (const std::vector<std::uint32_t>& triangles : boundaries) {
    std::vector<Triangle> placed;
    placed.reserve(triangles.size());
    for (const std::uint32_t t : triangles)
      placed.push_back(TriangleAt(walls, t));
    surfaces.emplace_back(std::move(placed));
  }
  ForEachAnalyticShape(scene, [&](const auto& shape) {
    using Shape = std::decay_t<decltype(shape)>;
    if constexpr (Shape::kIsClosed && !Shape::kIsThin) {
      if (IsWhole(shape.traits) && shape.traits.motion == kNoMotion &&
          is_wall(scene.materials[static_cast<std::size_t>(shape.traits.material)])) {
        surfaces.emplace_back(shape.center, shape.Reach(),
                              [shape](Double3 point) { return shape.SignedDistance(point); });
      }
    }
  });
  return surfaces;
}

}  // namespace lucerna
