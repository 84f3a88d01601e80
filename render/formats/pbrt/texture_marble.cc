// Texture "marble": layers of colours, disturbed by noise.
#include "render/formats/pbrt/texture_readers.h"

namespace lucerna {

NamedTexture ReadMarbleTexture(const TextureInput& input) {
  if (input.is_number) return OnlyColors();
  Texture texture;
  texture.kind = Texture::Kind::kMarble;
  texture.mapping = SpaceMapping(input);
  ReadNoise(input.parameters, texture);
  texture.scale = static_cast<float>(input.parameters.Float("scale", 1));
  texture.variation = static_cast<float>(input.parameters.Float("variation", 0.2));
  return AppendTexture(texture, {0, 1}, {}, input);
}

}  // namespace lucerna
