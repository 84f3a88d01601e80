// Texture "windy": waves under a wind.
#include "render/formats/pbrt/texture_readers.h"

namespace lucerna {

NamedTexture ReadWindyTexture(const TextureInput& input) {
  if (!input.is_number) return OnlyNumbers();
  Texture texture;
  texture.kind = Texture::Kind::kWindy;
  texture.mapping = SpaceMapping(input);
  // Two sums of octaves whose amplitudes halve.
  constexpr float kLargest = 4;
  return AppendTexture(texture, {-kLargest, kLargest}, {}, input);
}

}  // namespace lucerna
