// A sheet of glass so thin that light leaves it where it came in, and as it came in: `ior`, and
// what it multiplies light by that goes through, `transmission_tint`, or a texture in its place.
#include "render/math/color_space.h"
#include "render/scene/material.h"

namespace lucerna {

MaterialProperties ThinDielectricKind::Properties(const MaterialNumbers& /*material*/) {
  MaterialProperties properties;
  properties.is_smooth = true;
  properties.scatters_smoothly = true;
  properties.transmits = true;
  properties.lobe_width = 0;
  return properties;
}

Rgb ThinDielectricKind::Textured(const MaterialNumbers& material) {
  return material.transmission_tint;
}

void ThinDielectricKind::SetTextured(MaterialNumbers& material, Rgb value) {
  material.transmission_tint = value;
  material.is_tinted = true;
}

Rgb ThinDielectricKind::TexturedValue(Rgb color) {
  return ToWorking(color);
}

}  // namespace lucerna
