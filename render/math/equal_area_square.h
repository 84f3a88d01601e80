// How is the sphere of directions laid out on a square, so that equal areas stay equal?
//
// The octahedral map with equal areas: the upper hemisphere (z > 0) is the square that stands on
// its corner, the lower one is folded out into the corners. A density over the square is 4π times
// that over the sphere. Places are in [0, 1]².
//
// Source: Clarberg 2008, "Fast Equal-Area Mapping of the (Hemi)Sphere using SIMD".
#pragma once

#include <algorithm>
#include <cmath>

#include "render/math/vector.h"
#include "render/math/warp.h"

namespace lucerna {

inline Vec3 EqualAreaDirection(Vec2 place) {
  const float u = 2 * place.x - 1;
  const float v = 2 * place.y - 1;
  const float au = std::abs(u);
  const float av = std::abs(v);
  // Negative beyond the diagonal that is the horizon.
  const float to_horizon = 1 - au - av;
  const float radius = 1 - std::abs(to_horizon);
  const float quarter = radius == 0 ? 1.0F : (av - au) / radius + 1;
  const float phi = quarter * (kPi / 4);
  const float across = radius * std::sqrt(std::max(0.0F, 2 - radius * radius));
  return {std::copysign(std::cos(phi), u) * across, std::copysign(std::sin(phi), v) * across,
          std::copysign(1 - radius * radius, to_horizon)};
}

// Requires a unit vector. EqualAreaDirection and this are inverse, up to rounding.
inline Vec2 EqualAreaPlace(Vec3 direction) {
  const float x = std::abs(direction.x);
  const float y = std::abs(direction.y);
  const float z = std::abs(direction.z);
  // sqrt(1 - z), by the sine where z is near 1 and the difference would have no digits left.
  const float sine2 = x * x + y * y;
  const float radius = std::sqrt(std::max(0.0F, z > 0.5F ? sine2 / (1 + z) : 1 - z));
  const float phi = x == 0 && y == 0 ? 0.0F : std::atan2(y, x) * (2 / kPi);
  float av = phi * radius;
  float au = radius - av;
  if (direction.z < 0) {
    const float folded = 1 - av;
    av = 1 - au;
    au = folded;
  }
  const auto place = [](float coordinate) {
    return std::min(std::max(0.5F * (coordinate + 1), 0.0F), 1.0F);
  };
  return {place(std::copysign(au, direction.x)), place(std::copysign(av, direction.y))};
}

}  // namespace lucerna
