// Noise of many scales.
#include "render/scene/noise.h"
#include "render/scene/texture_lookup.h"

namespace lucerna {

Rgb LookUpFbm(std::span<const Texture> /*textures*/, const Texture& texture,
              const TexturePlace& place) {
  return Gray(FbmAt(texture.mapping.MapToSpace(place), texture.roughness, texture.octaves));
}

}  // namespace lucerna
