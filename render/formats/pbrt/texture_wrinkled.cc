// Texture "wrinkled": noise of many scales with creases.
#include "render/formats/pbrt/texture_readers.h"

namespace lucerna {

NamedTexture ReadWrinkledTexture(const TextureInput& input) {
  if (!input.is_number) return OnlyNumbers();
  Texture texture;
  texture.kind = Texture::Kind::kWrinkled;
  texture.mapping = SpaceMapping(input);
  ReadNoise(input.parameters, texture);
  // With a roughness below 0, octaves are taken away.
  const float least = texture.roughness < 0 ? -LargestNoise(texture) : 0;
  return AppendTexture(texture, {least, LargestNoise(texture)}, {}, input);
}

}  // namespace lucerna
