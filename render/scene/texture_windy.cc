// Waves of water under a wind that is stronger at some places than at others.
#include <cmath>

#include "render/scene/noise.h"
#include "render/scene/texture_lookup.h"

namespace lucerna {

Rgb LookUpWindy(std::span<const Texture> /*textures*/, const Texture& texture,
                const TexturePlace& place) {
  const Vec3 at = texture.mapping.MapToSpace(place);
  constexpr float kRoughness = 0.5F;
  const float strength = FbmAt(at * 0.1F, kRoughness, 3);
  return Gray(std::abs(strength) * FbmAt(at, kRoughness, 6));
}

}  // namespace lucerna
