// The colour between the vertices of a mesh, times that of another texture.
#include "render/scene/texture_lookup.h"

namespace lucerna {

Rgb LookUpVertexColor(std::span<const Texture> textures, const Texture& texture,
                      const TexturePlace& place) {
  const Rgb color = place.vertex_color * texture.tint;
  if (texture.parts[0] == kNoTexture) return color;
  return color * TextureColor(textures, texture.parts[0], place);
}

}  // namespace lucerna
