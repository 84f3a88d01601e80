// Another texture times a number, and times a texture of numbers.
#include "render/scene/texture_lookup.h"

namespace lucerna {

Rgb LookUpScaled(std::span<const Texture> textures, const Texture& texture,
                 const TexturePlace& place) {
  const Rgb color = ValueAt(textures, texture.parts[0], place) * texture.scale;
  if (texture.parts[1] == kNoTexture) return color;
  return color * TextureNumber(textures, texture.parts[1], place);
}

}  // namespace lucerna
