// Texture "vertexcolor", which pbrt-v4 does not have: the colours of a mesh's vertices, as PLY
// files bring them, times a colour or another texture. For textures of colours alone.
#include <vector>

#include "render/formats/pbrt/texture_readers.h"

namespace lucerna {

NamedTexture ReadVertexColorTexture(const TextureInput& input) {
  if (input.is_number) {
    input.parameters.Error("vertexcolor is a texture of colours, not of numbers");
    return FaultyTexture();
  }
  const std::vector<NamedTexture> parts = {ReadPart("tex", 1, input)};
  Texture texture;
  texture.kind = Texture::Kind::kVertexColor;
  return AppendMade(texture, RangeOf(parts[0]) * ValueRange{0, 1}, parts, input);
}

}  // namespace lucerna
