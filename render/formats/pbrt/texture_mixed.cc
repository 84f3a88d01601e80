// Texture "mix": two other textures or constants, mixed by a number or a texture of numbers.
#include <algorithm>

#include "render/formats/pbrt/texture_readers.h"

namespace lucerna {

NamedTexture ReadMixedTexture(const TextureInput& input) {
  Texture texture;
  texture.kind = Texture::Kind::kMixed;
  const std::array<NamedTexture, 3> parts = {ReadPart("tex1", 0, input), ReadPart("tex2", 1, input),
                                             ReadNumberPart("amount", 0.5F, input)};
  // The amount may leave [0, 1].
  const auto mixed = [&](float share) {
    const ValueRange first = RangeOf(parts[0]) * ValueRange{1 - share, 1 - share};
    const ValueRange second = RangeOf(parts[1]) * ValueRange{share, share};
    return ValueRange{first.least + second.least, first.largest + second.largest};
  };
  const ValueRange range = mixed(parts[2].least).Joined(mixed(parts[2].largest));
  return AppendMade(texture, range, parts, input);
}

}  // namespace lucerna
