// Texture "fbm": noise of many scales.
#include "render/formats/pbrt/texture_readers.h"

namespace lucerna {

NamedTexture ReadFbmTexture(const TextureInput& input) {
  if (!input.is_number) return OnlyNumbers();
  Texture texture;
  texture.kind = Texture::Kind::kFbm;
  texture.mapping = SpaceMapping(input);
  ReadNoise(input.parameters, texture);
  const float largest = LargestNoise(texture);
  return AppendTexture(texture, {-largest, largest}, {}, input);
}

}  // namespace lucerna
