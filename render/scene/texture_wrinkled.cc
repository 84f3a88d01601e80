// Noise of many scales, folded at zero: creases.
#include "render/scene/noise.h"
#include "render/scene/texture_lookup.h"

namespace lucerna {

Rgb LookUpWrinkled(std::span<const Texture> /*textures*/, const Texture& texture,
                   const TexturePlace& place) {
  return Gray(TurbulenceAt(texture.mapping.MapToSpace(place), texture.roughness, texture.octaves));
}

}  // namespace lucerna
