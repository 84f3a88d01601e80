// Texture "dots": round dots of one texture on another.
#include <utility>

#include "render/formats/pbrt/texture_readers.h"

namespace lucerna {

NamedTexture ReadDotsTexture(const TextureInput& input) {
  Texture texture;
  texture.kind = Texture::Kind::kDots;
  texture.mapping = ReadMapping(input);
  const NamedTexture inside = ReadPart("inside", 1, input);
  const NamedTexture outside = ReadPart("outside", 0, input);
  // pbrt-v4 shows `outside` in dots and `inside` between them.
  const std::array<NamedTexture, 2> parts = {outside, inside};
  return AppendMade(texture, RangeOf(inside).Joined(RangeOf(outside)), parts, input);
}

}  // namespace lucerna
