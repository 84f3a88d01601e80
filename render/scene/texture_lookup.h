// What lookups of textures share, inline for the loops over paths: for render/scene/texture_NAME.cc
// alone.
#pragma once

#include <algorithm>
#include <cmath>

#include "render/scene/texture.h"

namespace lucerna {

// Into [0, 1]. What is not a number, as no colour times an infinite scale, becomes 0.
inline Rgb HeldInUnit(Rgb color) {
  const auto held = [](float value) { return value > 0 ? std::min(value, 1.0F) : 0.0F; };
  return {held(color.r), held(color.g), held(color.b)};
}

inline Vec2 UvMapping::Map(Vec2 uv) const {
  const auto bounded = [](float place) {
    constexpr float kFarthest = 1e9F;
    return std::abs(place) <= kFarthest ? place : 0.0F;
  };
  return {bounded(scale_u * uv.x + delta_u), bounded(scale_v * uv.y + delta_v)};
}

inline TextureStep TextureStep::To(Rgb color) {
  return {.color = HeldInUnit(color)};
}

}  // namespace lucerna
