// Texture "scale": another texture times a number.
#include "render/base/text.h"
#include "render/formats/pbrt/texture_readers.h"

namespace lucerna {

NamedTexture ReadScaledTexture(const TextureInput& input) {
  ParameterList& parameters = input.parameters;
  if (parameters.IsTexture("scale")) {
    parameters.Ignore("tex");
    parameters.Ignore("scale");
    return UnusableTexture(
        "refers to a texture that is scaled by a float texture, which is not supported");
  }
  const NamedTexture part = ReadPart("tex", 1, input);
  Texture texture;
  texture.kind = Texture::Kind::kScaled;
  texture.scale = static_cast<float>(parameters.Float("scale", 1, kZeroOrMore));
  if (part.number == kNoTexture) return part;
  texture.parts[0] = part.number;
  const float largest = part.largest * texture.scale;
  if (largest > 1) {
    parameters.Warning("", Concat("is up to ", largest, " and is held at 1: no surface reflects ",
                                  "more light than it gets"));
  }
  return AppendTexture(texture, largest, part.depth + 1, input.textures);
}

}  // namespace lucerna
