// Squares of two other textures.
#include <cmath>

#include "render/scene/texture_lookup.h"

namespace lucerna {

TextureStep LookUpCheckerboard(const Texture& texture, Vec2 uv) {
  const Vec2 place = texture.mapping.Map(uv);
  const float squares = std::floor(place.x) + std::floor(place.y);
  return {.next = texture.parts[std::fmod(squares, 2.0F) == 0 ? 0 : 1], .color = {}};
}

}  // namespace lucerna
