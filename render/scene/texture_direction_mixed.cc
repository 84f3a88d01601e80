// Two other textures, mixed by how far the surface faces along a direction.
#include <cmath>

#include "render/scene/texture_lookup.h"

namespace lucerna {

Rgb LookUpDirectionMixed(std::span<const Texture> textures, const Texture& texture,
                         const TexturePlace& place) {
  const float along = std::abs(Dot(place.normal, texture.direction));
  Rgb mixed;
  if (along != 0) mixed += ValueAt(textures, texture.parts[0], place) * along;
  if (along != 1) mixed += ValueAt(textures, texture.parts[1], place) * (1 - along);
  return mixed;
}

}  // namespace lucerna
