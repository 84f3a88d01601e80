// The border between two media, at which light passes unchanged. No numbers, no textures.
#include "render/scene/material.h"

namespace lucerna {

MaterialProperties InterfaceKind::Properties(const MaterialNumbers& /*material*/) {
  MaterialProperties properties;
  properties.is_interface = true;
  properties.transmits = true;
  return properties;
}

Rgb InterfaceKind::Textured(const MaterialNumbers& /*material*/) {
  return {};
}

void InterfaceKind::SetTextured(MaterialNumbers& /*material*/, Rgb /*value*/) {}

Rgb InterfaceKind::TexturedValue(Rgb color) {
  return color;
}

}  // namespace lucerna
