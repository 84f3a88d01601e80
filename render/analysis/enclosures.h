// Closed surfaces of a scene: what lies inside them and what outside.
//
// A closed surface cuts space in two: whatever way light takes from one side to the other, it
// crosses the surface an odd number of times. So light never passes an opaque closed surface, and
// never passes one of any kind in a straight line. Both are proofs: what cannot be proved (a crack
// in the wall, a light that touches it) counts as open.
//
// Triangles bound a closed surface when each of their edges belongs to an even number of them;
// vertices are the same when they lie in the same place exactly. The surfaces found are
// the faces of every region that triangles enclose, found by walking from each side of a
// triangle to the next one around their common edge, and every closed analytic shape.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "render/math/double3.h"
#include "render/math/vector.h"
#include "render/scene/scene.h"

namespace lucerna {

class ClosedSurface {
 public:
  explicit ClosedSurface(std::vector<std::array<Vec3, 3>> triangles);
  // Of a closed analytic shape within this ball (scene/analytic_shapes.h).
  ClosedSurface(Vec3 center, float reach, std::function<double(Double3)> signed_distance);

  [[nodiscard]] const Bounds& bounds() const { return bounds_; }
  [[nodiscard]] std::size_t triangle_count() const { return triangles_.size(); }
  // Whether the point lies inside; absent when it is too near to the surface to tell.
  [[nodiscard]] std::optional<bool> Contains(Vec3 point) const;
  // True when nothing of the convex hull of `points` comes near the surface. False may also mean
  // that it could not be told.
  [[nodiscard]] bool IsApartFrom(std::span<const Vec3> points) const;

 private:
  [[nodiscard]] bool IsOff(const std::array<Vec3, 3>& triangle, std::span<const Vec3> points,
                           const Bounds& box) const;

  std::vector<std::array<Vec3, 3>> triangles_;  // empty: the analytic shape
  std::function<double(Double3)> signed_distance_;
  Double3 center_;
  double reach_ = 0;
  Bounds bounds_;
  double near_ = 0;  // closer than this is too near
};

// The closed surfaces among the triangles and shapes of the materials that `is_wall` accepts and
// that do not move.
using MaterialPredicate = std::function<bool(const Material&)>;
[[nodiscard]] std::vector<ClosedSurface> ClosedSurfacesOf(const Scene& scene,
                                                          const MaterialPredicate& is_wall);

}  // namespace lucerna
