// Vectors in double, where float would lose the result: differences of nearly equal points
// and normals.
#pragma once

#include <cmath>

#include "render/math/vector.h"

namespace lucerna {

struct Double3 {
  double x = 0, y = 0, z = 0;

  Double3() = default;
  constexpr Double3(double x_in, double y_in, double z_in) : x(x_in), y(y_in), z(z_in) {}
  explicit constexpr Double3(Vec3 v) : x(v.x), y(v.y), z(v.z) {}
};

constexpr Double3 operator+(Double3 a, Double3 b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
constexpr Double3 operator-(Double3 a, Double3 b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
constexpr Double3 operator*(Double3 a, double s) {
  return {a.x * s, a.y * s, a.z * s};
}
constexpr double Dot(Double3 a, Double3 b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
constexpr Double3 Cross(Double3 a, Double3 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double Length(Double3 a) {
  return std::sqrt(Dot(a, a));
}
inline Vec3 ToFloat(Double3 a) {
  return {static_cast<float>(a.x), static_cast<float>(a.y), static_cast<float>(a.z)};
}

// The outward normal of a triangle, as long as twice its area: a needle's too, whose sides are
// nearly parallel, and at all sizes that floats have.
inline Double3 TriangleCross(Vec3 p0, Vec3 p1, Vec3 p2) {
  const Double3 origin(p0);
  return Cross(Double3(p1) - origin, Double3(p2) - origin);
}
// Requires a triangle that has an area.
inline Vec3 TriangleNormal(Vec3 p0, Vec3 p1, Vec3 p2) {
  const Double3 cross = TriangleCross(p0, p1, p2);
  return ToFloat(cross * (1 / Length(cross)));
}

}  // namespace lucerna
