#include "render/scene/texture.h"

#include <algorithm>
#include <cmath>

namespace lucerna {
namespace {

// Into [0, 1]. What is not a number, as no colour times an infinite scale, becomes 0.
float Held(float value) {
  return value > 0 ? std::min(value, 1.0F) : 0.0F;
}

Rgb Held(Rgb color) {
  return {Held(color.r), Held(color.g), Held(color.b)};
}

float Bounded(float place) {
  constexpr float kFarthest = 1e9F;
  return std::abs(place) <= kFarthest ? place : 0.0F;
}

TextureStep LookUp(const Texture& texture, Vec2 uv) {
  switch (texture.kind) {
#define LUCERNA_CASE(Name, name) \
  case Texture::Kind::k##Name:   \
    return LookUp##Name(texture, uv);
    LUCERNA_TEXTURES(LUCERNA_CASE)
#undef LUCERNA_CASE
  }
  return {};
}

}  // namespace

float Picture::Largest() const {
  if (!linear.empty()) return *std::max_element(linear.begin(), linear.end());
  float largest = 0;
  for (const std::uint8_t value : coded)
    largest = std::max(largest, decoded[value]);
  return largest;
}

Vec2 UvMapping::Map(Vec2 uv) const {
  return {Bounded(scale_u * uv.x + delta_u), Bounded(scale_v * uv.y + delta_v)};
}

TextureStep TextureStep::To(Rgb color) {
  return {.color = Held(color)};
}

Rgb TextureColor(std::span<const Texture> textures, std::int32_t number, Vec2 uv) {
  float factor = 1;
  while (true) {
    const TextureStep step = LookUp(textures[static_cast<std::size_t>(number)], uv);
    if (step.next == kNoTexture) return Held(step.color * factor);
    factor *= step.factor;
    number = step.next;
  }
}

}  // namespace lucerna
