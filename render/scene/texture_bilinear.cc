// Four constants, interpolated between the corners of the unit square, and beyond it.
#include "render/scene/texture_lookup.h"

namespace lucerna {

Rgb LookUpBilinear(std::span<const Texture> textures, const Texture& texture,
                   const TexturePlace& place) {
  const Vec2 at = texture.mapping.Map(place);
  const auto corner = [&](std::size_t i) { return ValueAt(textures, texture.parts[i], place); };
  return corner(0) * ((1 - at.x) * (1 - at.y)) + corner(1) * ((1 - at.x) * at.y) +
         corner(2) * (at.x * (1 - at.y)) + corner(3) * (at.x * at.y);
}

}  // namespace lucerna
