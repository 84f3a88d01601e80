// A sheet of glass so thin that light leaves it where it came in, and as it came in: `ior`. No
// textures.
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

Rgb ThinDielectricKind::Textured(const MaterialNumbers& /*material*/) {
  return {};
}

void ThinDielectricKind::SetTextured(MaterialNumbers& /*material*/, Rgb /*value*/) {}

Rgb ThinDielectricKind::TexturedValue(Rgb color) {
  return color;
}

}  // namespace lucerna
