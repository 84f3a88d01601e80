// Glass, water: `ior`; `alpha_u` and `alpha_v`, or textures of roughness in their places.
#include "render/scene/material.h"

namespace lucerna {

MaterialProperties DielectricKind::Properties(const MaterialNumbers& material) {
  MaterialProperties properties;
  properties.is_smooth = material.alpha_u == 0 && material.alpha_v == 0;
  properties.scatters_smoothly = properties.is_smooth || material.may_be_smooth;
  properties.transmits = true;
  properties.lobe_width = std::max(material.alpha_u, material.alpha_v);
  properties.gathers =
      !material.HasRoughnessTexture() && properties.lobe_width >= kGatherAlphaDielectric;
  properties.ior = material.ior;
  return properties;
}

Rgb DielectricKind::Textured(const MaterialNumbers& /*material*/) {
  return {};
}

void DielectricKind::SetTextured(MaterialNumbers& /*material*/, Rgb /*value*/) {}

Rgb DielectricKind::TexturedValue(Rgb color) {
  return color;
}

}  // namespace lucerna
