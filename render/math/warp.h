// Maps from the unit square to the distributions that light transport needs, each with its
// density. All are area-preserving enough to keep a stratified sample stratified. Inverses return
// places in [0, 1]², up to rounding; of what no place is mapped to, one nearby.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "render/math/vector.h"

namespace lucerna {

inline constexpr float kPi = std::numbers::pi_v<float>;
inline constexpr double kPi64 = std::numbers::pi;
inline constexpr float kInversePi = 1 / kPi;

// Uniform on the unit disc. Source: Shirley & Chiu 1997.
inline Vec3 SquareToDisk(float u1, float u2) {
  const float a = 2 * u1 - 1;
  const float b = 2 * u2 - 1;
  if (a == 0 && b == 0) return {};
  const bool wide = std::abs(a) > std::abs(b);
  const float radius = wide ? a : b;
  const float angle = wide ? (kPi / 4) * (b / a) : (kPi / 2) - (kPi / 4) * (a / b);
  return {radius * std::cos(angle), radius * std::sin(angle), 0};
}

// The inverse of SquareToDisk.
inline Vec2 DiskToSquare(float x, float y) {
  const float length = std::sqrt(x * x + y * y);
  if (!(length > 0)) return {0.5F, 0.5F};
  float a = 0;
  float b = 0;
  if (std::abs(x) > std::abs(y)) {
    a = std::copysign(length, x);
    b = a * (4 / kPi) * std::atan(y / x);
  } else {
    b = std::copysign(length, y);
    a = b * (4 / kPi) * std::atan(x / y);
  }
  return {std::clamp(0.5F * (a + 1), 0.0F, 1.0F), std::clamp(0.5F * (b + 1), 0.0F, 1.0F)};
}

// Cosine-weighted on the upper hemisphere (local z): density cosθ/π [sr⁻¹].
inline Vec3 SquareToCosineHemisphere(float u1, float u2) {
  const Vec3 d = SquareToDisk(u1, u2);
  return {d.x, d.y, std::sqrt(std::max(0.0F, 1 - d.x * d.x - d.y * d.y))};
}

// Uniform on the unit sphere: density 1/(4π) [sr⁻¹].
inline Vec3 SquareToSphere(float u1, float u2) {
  const float z = 1 - 2 * u1;
  const float radius = std::sqrt(std::max(0.0F, 1 - z * z));
  const float angle = 2 * kPi * u2;
  return {radius * std::cos(angle), radius * std::sin(angle), z};
}

// How far around from x towards y a direction lies, in turns, in [0, 1); 0 where there is none.
inline float TurnOf(float x, float y) {
  if (x == 0 && y == 0) return 0;
  const float turn = std::atan2(y, x) * (0.5F * kInversePi);
  return turn < 0 ? std::min(turn + 1, 0x1.fffffep-1F) : turn;
}

// The inverse of SquareToSphere, of a unit vector.
inline Vec2 SphereToSquare(Vec3 v) {
  return {std::clamp(0.5F * (1 - v.z), 0.0F, 1.0F), TurnOf(v.x, v.y)};
}

// Uniform in the cone of directions around local z whose 1 - cosine is below `one_minus_cos`:
// density 1/(2π·one_minus_cos) [sr⁻¹]. The complement keeps narrow cones exact in float.
inline Vec3 SquareToCone(float u1, float u2, float one_minus_cos) {
  const float height = u1 * one_minus_cos;  // 1 - cosθ
  const float radius = std::sqrt(std::max(0.0F, height * (2 - height)));
  const float angle = 2 * kPi * u2;
  return {radius * std::cos(angle), radius * std::sin(angle), 1 - height};
}

// The inverse of SquareToCone, of a unit vector.
inline Vec2 ConeToSquare(Vec3 v, float one_minus_cos) {
  return {std::clamp((1 - v.z) / one_minus_cos, 0.0F, 1.0F), TurnOf(v.x, v.y)};
}

// Barycentric coordinates (of the second and third corner) uniform over a triangle.
// Source: Heitz 2019, "A Low-Distortion Map Between Triangle and Square".
inline void SquareToTriangle(float u1, float u2, float& b1, float& b2) {
  if (u2 > u1) {
    b1 = u1 * 0.5F;
    b2 = u2 - b1;
  } else {
    b2 = u2 * 0.5F;
    b1 = u1 - b2;
  }
}

// The inverse of SquareToTriangle.
inline Vec2 TriangleToSquare(float b1, float b2) {
  const Vec2 u = b2 > b1 ? Vec2{2 * b1, b1 + b2} : Vec2{b1 + b2, 2 * b2};
  return {std::clamp(u.x, 0.0F, 1.0F), std::clamp(u.y, 0.0F, 1.0F)};
}

}  // namespace lucerna
