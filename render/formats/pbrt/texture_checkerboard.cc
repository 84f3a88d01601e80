// Texture "checkerboard": squares of two other textures or colours.
#include <algorithm>

#include "render/base/text.h"
#include "render/formats/pbrt/texture_readers.h"

namespace lucerna {

NamedTexture ReadCheckerboardTexture(const TextureInput& input) {
  ParameterList& parameters = input.parameters;
  if (parameters.FindInteger("dimension", {2, 3}).value_or(2) != 2) {
    parameters.Error("dimension", "must be 2: checkerboards in space are not supported");
  }
  Texture texture;
  texture.kind = Texture::Kind::kCheckerboard;
  texture.mapping = ReadMapping(parameters);
  const NamedTexture even = ReadPart("tex1", 1, input);
  const NamedTexture odd = ReadPart("tex2", 0, input);
  if (even.number == kNoTexture) return even;
  if (odd.number == kNoTexture) return odd;
  texture.parts = {even.number, odd.number};
  return AppendTexture(texture, std::max(even.largest, odd.largest),
                       std::max(even.depth, odd.depth) + 1, input.textures);
}

}  // namespace lucerna
