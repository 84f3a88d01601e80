// Texture "checkerboard": squares of two other textures or constants, or cubes in space.
#include "render/formats/pbrt/texture_readers.h"

namespace lucerna {

NamedTexture ReadCheckerboardTexture(const TextureInput& input) {
  Texture texture;
  texture.kind = Texture::Kind::kCheckerboard;
  texture.is_in_space = input.parameters.FindInteger("dimension", {2, 3}).value_or(2) == 3;
  texture.mapping = texture.is_in_space ? SpaceMapping(input) : ReadMapping(input);
  const std::array<NamedTexture, 2> parts = {ReadPart("tex1", 1, input),
                                             ReadPart("tex2", 0, input)};
  return AppendMade(texture, RangeOf(parts[0]).Joined(RangeOf(parts[1])), parts, input);
}

}  // namespace lucerna
