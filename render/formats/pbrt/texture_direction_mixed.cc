// Texture "directionmix": two other textures or constants, mixed by how far a surface faces along
// a direction.
#include "render/formats/pbrt/texture_readers.h"

namespace lucerna {

NamedTexture ReadDirectionMixedTexture(const TextureInput& input) {
  Texture texture;
  texture.kind = Texture::Kind::kDirectionMixed;
  const Vec3 direction = input.to_world.Vector(input.parameters.Vector("dir", {0, 1, 0}));
  if (!(LengthSquared(direction) > 0) || !IsFinite(direction)) {
    input.parameters.Error("dir", "must not be zero");
    return FaultyTexture();
  }
  texture.direction = Normalize(direction / MaxAbs(direction));
  const std::array<NamedTexture, 2> parts = {ReadPart("tex1", 0, input),
                                             ReadPart("tex2", 1, input)};
  return AppendMade(texture, RangeOf(parts[0]).Joined(RangeOf(parts[1])), parts, input);
}

}  // namespace lucerna
