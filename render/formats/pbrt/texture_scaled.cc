// Texture "scale": another texture times a number or a texture of numbers.
#include <vector>

#include "render/formats/pbrt/texture_readers.h"

namespace lucerna {

NamedTexture ReadScaledTexture(const TextureInput& input) {
  ParameterList& parameters = input.parameters;
  std::vector<NamedTexture> parts = {ReadPart("tex", 1, input)};
  ValueRange range = RangeOf(parts[0]);
  Texture texture;
  texture.kind = Texture::Kind::kScaled;
  if (parameters.IsTexture("scale")) {
    parts.push_back(ReadNumberPart("scale", 1, input));
    range = range * RangeOf(parts[1]);
  } else {
    texture.scale = static_cast<float>(
        parameters.Float("scale", 1, input.is_number ? kAnyNumber : kZeroOrMore));
    range = range * ValueRange{texture.scale, texture.scale};
  }
  NamedTexture made = AppendMade(texture, range, parts, input);
  if (made.number != kNoTexture && !input.is_number) WarnOfBright(range.largest, parameters);
  return made;
}

}  // namespace lucerna
