// Points, directions and normals: three floats, world space unless the name says `_local`.
#pragma once

#include <algorithm>
#include <cmath>

namespace lucerna {

// A place on a texture.
struct Vec2 {
  float x = 0, y = 0;

  constexpr bool operator==(const Vec2&) const = default;
};

struct Vec3 {
  float x = 0, y = 0, z = 0;

  constexpr float operator[](int axis) const { return axis == 0 ? x : axis == 1 ? y : z; }
  constexpr bool operator==(const Vec3&) const = default;
};

constexpr Vec3 operator+(Vec3 a, Vec3 b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
constexpr Vec3 operator-(Vec3 a, Vec3 b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
constexpr Vec3 operator*(Vec3 a, float s) {
  return {a.x * s, a.y * s, a.z * s};
}
constexpr Vec3 operator*(float s, Vec3 a) {
  return a * s;
}
constexpr Vec3 operator/(Vec3 a, float s) {
  return a * (1.0F / s);
}
constexpr Vec3 operator-(Vec3 a) {
  return {-a.x, -a.y, -a.z};
}

constexpr float Dot(Vec3 a, Vec3 b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
constexpr Vec3 Cross(Vec3 a, Vec3 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
constexpr float LengthSquared(Vec3 a) {
  return Dot(a, a);
}
inline float Length(Vec3 a) {
  return std::sqrt(LengthSquared(a));
}
// Requires a non-zero vector whose squared length neither overflows nor vanishes.
inline Vec3 Normalize(Vec3 a) {
  return a * (1.0F / Length(a));
}
inline float MaxAbs(Vec3 a) {
  return std::max(std::abs(a.x), std::max(std::abs(a.y), std::abs(a.z)));
}
// Zero times a number is zero, unless the number is infinite or none: one comparison for all three.
constexpr bool IsFinite(Vec3 a) {
  return a.x * 0 + a.y * 0 + a.z * 0 == 0;
}
// `n`, turned to the side that `towards` points to.
constexpr Vec3 FaceForward(Vec3 n, Vec3 towards) {
  return Dot(n, towards) < 0 ? -n : n;
}

// An orthonormal frame around a unit normal. Local z is the normal.
// Source: Duff et al. 2017, "Building an Orthonormal Basis, Revisited".
struct Frame {
  Vec3 s, t, n;

  explicit Frame(Vec3 normal) : n(normal) {
    const float sign = std::copysign(1.0F, n.z);
    const float a = -1.0F / (sign + n.z);
    const float b = n.x * n.y * a;
    s = {1.0F + sign * n.x * n.x * a, sign * b, -sign * n.x};
    t = {b, sign + n.y * n.y * a, -n.y};
  }
  // With local x along `along`, which is not zero and at right angles to the unit normal.
  Frame(Vec3 along, Vec3 normal) : s(along), t(Cross(normal, along)), n(normal) {}
  [[nodiscard]] Vec3 ToLocal(Vec3 world) const {
    return {Dot(world, s), Dot(world, t), Dot(world, n)};
  }
  [[nodiscard]] Vec3 ToWorld(Vec3 local) const { return s * local.x + t * local.y + n * local.z; }
};

// An axis-aligned box; empty until a point is added.
struct Bounds {
  Vec3 low{HUGE_VALF, HUGE_VALF, HUGE_VALF};
  Vec3 high{-HUGE_VALF, -HUGE_VALF, -HUGE_VALF};

  void Add(Vec3 p) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  [[nodiscard]] bool empty() const { return !(low.x <= high.x); }
  // Half of each addend first, so that a box as wide as the float range has a centre.
  [[nodiscard]] Vec3 Center() const { return low * 0.5F + high * 0.5F; }
  [[nodiscard]] float Diagonal() const { return empty() ? 0.0F : Length(high - low); }
};

}  // namespace lucerna
