// A thin sheet that scatters light diffusely to both sides: `reflectance` and `transmittance`, or
// textures in their places. The first part is the reflection, the second the transmission.
#include "render/math/color_space.h"
#include "render/scene/material.h"

namespace lucerna {

MaterialProperties DiffuseTransmissionKind::Properties(const MaterialNumbers& material) {
  const bool reflects = material.texture != kNoTexture || !IsBlack(material.reflectance);
  const bool transmits = material.second_texture != kNoTexture || !IsBlack(material.transmittance);
  MaterialProperties properties;
  const bool is_first = material.parts == Parts::kFirst;
  const bool is_second = material.parts == Parts::kSecond;
  properties.has_parts = material.parts == Parts::kAll;
  properties.is_separable = !properties.has_parts;
  properties.transmits = transmits && !is_first;
  properties.gathers = is_first ? reflects : is_second ? transmits : reflects || transmits;
  properties.is_black = !properties.gathers;
  return properties;
}

Rgb DiffuseTransmissionKind::Textured(const MaterialNumbers& material) {
  return material.reflectance;
}

void DiffuseTransmissionKind::SetTextured(MaterialNumbers& material, Rgb value) {
  material.reflectance = value;
}

Rgb DiffuseTransmissionKind::TexturedValue(Rgb color) {
  return ToWorking(color);
}

}  // namespace lucerna
