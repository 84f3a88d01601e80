#include "render/scene/texture.h"

#include <algorithm>

#include "render/scene/texture_lookup.h"

namespace lucerna {
namespace {

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

Rgb TextureColor(std::span<const Texture> textures, std::int32_t number, Vec2 uv) {
  float factor = 1;
  while (true) {
    const TextureStep step = LookUp(textures[static_cast<std::size_t>(number)], uv);
    if (step.next == kNoTexture) return HeldInUnit(step.color * factor);
    factor *= step.factor;
    number = step.next;
  }
}

}  // namespace lucerna
