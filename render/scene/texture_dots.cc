// Round dots of one texture on another: in about half of the unit squares one, anywhere in it.
#include <cmath>

#include "render/scene/noise.h"
#include "render/scene/texture_lookup.h"

namespace lucerna {
namespace {

// The dots of pbrt-v4, section 10.4.1 of its third edition: which squares have one, and where,
// follows from noise at places of each square's own.
bool IsInDot(Vec2 at) {
  const float column = std::floor(at.x + 0.5F);
  const float row = std::floor(at.y + 0.5F);
  constexpr float kMiddle = 0.5F;
  if (!(NoiseAt({column + 0.5F, row + 0.5F, kMiddle}) > 0)) return false;
  constexpr float kRadius = 0.35F;
  constexpr float kMostShift = 0.5F - kRadius;
  const float x = at.x - column - kMostShift * NoiseAt({column + 1.5F, row + 2.8F, kMiddle});
  const float y = at.y - row - kMostShift * NoiseAt({column + 4.5F, row + 9.8F, kMiddle});
  return x * x + y * y < kRadius * kRadius;
}

}  // namespace

Rgb LookUpDots(std::span<const Texture> textures, const Texture& texture,
               const TexturePlace& place) {
  const std::size_t part = IsInDot(texture.mapping.Map(place)) ? 0 : 1;
  return ValueAt(textures, texture.parts[part], place);
}

}  // namespace lucerna
