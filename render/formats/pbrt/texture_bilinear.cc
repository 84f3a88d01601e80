// Texture "bilerp": four constants at the corners of the unit square.
#include <cmath>

#include "render/base/text.h"
#include "render/formats/pbrt/texture_readers.h"

namespace lucerna {

NamedTexture ReadBilinearTexture(const TextureInput& input) {
  Texture texture;
  texture.kind = Texture::Kind::kBilinear;
  texture.mapping = ReadMapping(input);
  for (const std::string_view name : {"v00", "v01", "v10", "v11"}) {
    if (!input.parameters.IsTexture(name)) continue;
    input.parameters.Error(name, "must be a constant");
    return FaultyTexture();
  }
  const std::array<NamedTexture, 4> parts = {ReadPart("v00", 0, input), ReadPart("v01", 1, input),
                                             ReadPart("v10", 0, input), ReadPart("v11", 1, input)};
  // Coordinates may leave the unit square by any distance.
  const ValueRange range = input.is_number ? ValueRange{-HUGE_VALF, HUGE_VALF} : ValueRange{0, 1};
  return AppendMade(texture, range, parts, input);
}

}  // namespace lucerna
