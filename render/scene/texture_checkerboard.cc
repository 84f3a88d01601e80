// Squares of two other textures, or cubes in space.
#include <cmath>

#include "render/scene/texture_lookup.h"

namespace lucerna {

Rgb LookUpCheckerboard(std::span<const Texture> textures, const Texture& texture,
                       const TexturePlace& place) {
  float squares = 0;
  if (texture.is_in_space) {
    const Vec3 at = texture.mapping.MapToSpace(place);
    // Each coordinate's parity alone: their sum may leave the whole numbers of float.
    for (const float coordinate : {at.x, at.y, at.z})
      squares += std::fmod(std::floor(coordinate), 2.0F);
  } else {
    const Vec2 at = texture.mapping.Map(place);
    squares = std::floor(at.x) + std::floor(at.y);
  }
  return ValueAt(textures, texture.parts[std::fmod(squares, 2.0F) == 0 ? 0 : 1], place);
}

}  // namespace lucerna
