// Boxes, and lines that cross triangles, in double precision: for proofs about closed surfaces.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>

#include "render/math/double3.h"
#include "render/math/vector.h"
#include "render/scene/scene.h"

namespace lucerna {

using Triangle = std::array<Vec3, 3>;

// Of the largest coordinate: closer to a surface than this a point may lie on either side of it.
// Some eight units in the last place of a float.
inline constexpr double kNear = 1e-6;

inline Bounds BoxAround(std::span<const Vec3> points) {
  Bounds box;
  for (const Vec3& point : points)
    box.Add(point);
  return box;
}

inline Bounds BoxAround(Vec3 center, float radius) {
  const Vec3 reach = {radius, radius, radius};
  Bounds box;
  box.Add(center - reach);
  box.Add(center + reach);
  return box;
}

inline std::array<Vec3, 8> CornersOf(const Bounds& box) {
  std::array<Vec3, 8> corners;
  for (std::size_t i = 0; i < 8; ++i) {
    corners[i] = {(i & 1) != 0 ? box.high.x : box.low.x, (i & 2) != 0 ? box.high.y : box.low.y,
                  (i & 4) != 0 ? box.high.z : box.low.z};
  }
  return corners;
}

inline bool AreDisjoint(const Bounds& a, const Bounds& b, double distance) {
  for (int axis = 0; axis < 3; ++axis) {
    const auto gap = std::max(static_cast<double>(a.low[axis]) - static_cast<double>(b.high[axis]),
                              static_cast<double>(b.low[axis]) - static_cast<double>(a.high[axis]));
    if (gap > distance) return true;
  }
  return false;
}

inline double LargestCoordinate(const Bounds& box) {
  return static_cast<double>(std::max(MaxAbs(box.low), MaxAbs(box.high)));
}

inline Triangle TriangleOf(const TriangleMesh& mesh, std::size_t number) {
  const std::uint32_t* corner = &mesh.indices[3 * number];
  return {mesh.positions[corner[0]], mesh.positions[corner[1]], mesh.positions[corner[2]]};
}

// Whether a line crosses a triangle.
enum class Crossing : std::uint8_t { kNone, kOnce, kAtTheEdge };

// The line goes along the third axis of a frame, through its origin; the triangle is given in that
// frame. `along` is where it passes.
inline Crossing CrossingOf(const std::array<Double3, 3>& corner, double& along) {
  std::array<double, 3> side{};
  bool is_positive = true;
  bool is_negative = true;
  double size = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const Double3& a = corner[i];
    const Double3& b = corner[(i + 1) % 3];
    side[i] = a.x * b.y - a.y * b.x;
    size = std::max({size, std::abs(a.x), std::abs(a.y)});
    is_positive = is_positive && side[i] > 0;
    is_negative = is_negative && side[i] < 0;
  }
  // A corner's coordinates are as exact as the floats they are computed from.
  const double doubt = 1e-12 * size * size;
  if (std::ranges::any_of(side, [&](double s) { return std::abs(s) <= doubt; })) {
    // Only where all three may have one sign does the line come near the triangle.
    const bool may_be_positive = std::ranges::all_of(side, [&](double s) { return s >= -doubt; });
    const bool may_be_negative = std::ranges::all_of(side, [&](double s) { return s <= doubt; });
    return may_be_positive || may_be_negative ? Crossing::kAtTheEdge : Crossing::kNone;
  }
  if (!is_positive && !is_negative) return Crossing::kNone;
  // Barycentric, opposite to the sides.
  const double sum = side[0] + side[1] + side[2];
  along = (side[1] * corner[0].z + side[2] * corner[1].z + side[0] * corner[2].z) / sum;
  return Crossing::kOnce;
}

// Three axes at right angles; lines go along the third.
struct Axes {
  Double3 x, y, z;
  Axes(double a, double b, double c) {
    z = Double3(a, b, c) * (1 / std::sqrt(a * a + b * b + c * c));
    const Double3 side = Cross(z, std::abs(z.x) < 0.5 ? Double3(1, 0, 0) : Double3(0, 1, 0));
    x = side * (1 / Length(side));
    y = Cross(z, x);
  }
  [[nodiscard]] Double3 In(Double3 v) const { return {Dot(v, x), Dot(v, y), Dot(v, z)}; }
};

// Lines along which crossings are counted. None is parallel to anything people build.
inline const std::array<Axes, 4> kParityRayDirections = {
    Axes(0.5377, 0.8341, 0.1271), Axes(-0.3119, 0.2713, 0.9103), Axes(0.7717, -0.5231, 0.3613),
    Axes(-0.6871, -0.1931, -0.7013)};

}  // namespace lucerna
