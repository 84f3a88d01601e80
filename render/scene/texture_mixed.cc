// Two other textures, mixed by a texture of numbers.
#include "render/scene/texture_lookup.h"

namespace lucerna {

Rgb LookUpMixed(std::span<const Texture> textures, const Texture& texture,
                const TexturePlace& place) {
  const float share = TextureNumber(textures, texture.parts[2], place);
  Rgb mixed;
  if (share != 1) mixed += ValueAt(textures, texture.parts[0], place) * (1 - share);
  if (share != 0) mixed += ValueAt(textures, texture.parts[1], place) * share;
  return mixed;
}

}  // namespace lucerna
