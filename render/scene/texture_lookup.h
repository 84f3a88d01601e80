// What lookups of textures share: for render/scene/texture_NAME.cc alone.
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

// 0 for a coordinate beyond 1e9 either way, and for what is no number.
inline float HeldPlace(float place) {
  constexpr float kFarthest = 1e9F;
  return std::abs(place) <= kFarthest ? place : 0.0F;
}

// Of the texture with that number, not held in any range.
[[nodiscard]] Rgb ValueAt(std::span<const Texture> textures, std::int32_t number,
                          const TexturePlace& place);

}  // namespace lucerna
