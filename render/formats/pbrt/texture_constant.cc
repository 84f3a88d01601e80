// Texture "constant": one colour, or another texture.
#include "render/formats/pbrt/texture_readers.h"

namespace lucerna {

NamedTexture ReadConstantTexture(const TextureInput& input) {
  return ReadPart("value", 1, input);
}

}  // namespace lucerna
