// Maps from the unit square to the distributions that light transport needs, each with its
// density. All are area-preserving enough to keep a stratified sample stratified.
#pragma once

#include <cmath>
#include <numbers>

#include "render/math/vector.h"

namespace lucerna {

inline constexpr float kPi = std::numbers::pi_v<float>;
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

// Uniform in the cone of directions around local z whose 1 - cosine is below `one_minus_cos`:
// density 1/(2π·one_minus_cos) [sr⁻¹]. The complement keeps narrow cones exact in float.
inline Vec3 SquareToCone(float u1, float u2, float one_minus_cos) {
  const float height = u1 * one_minus_cos;  // 1 - cosθ
  const float radius = std::sqrt(std::max(0.0F, height * (2 - height)));
  const float angle = 2 * kPi * u2;
  return {radius * std::cos(angle), radius * std::sin(angle), 1 - height};
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

}  // namespace lucerna
