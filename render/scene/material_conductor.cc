// A metal: `eta` and `k`, or with a texture of its reflectance at right angles eta = 1 and a k that
// follows from it; `alpha_u` and `alpha_v`, or textures of roughness in their places.
#include "render/scene/material.h"

namespace lucerna {

MaterialProperties ConductorKind::Properties(const MaterialNumbers& material) {
  MaterialProperties properties;
  properties.is_smooth = material.alpha_u == 0 && material.alpha_v == 0;
  properties.scatters_smoothly = properties.is_smooth || material.may_be_smooth;
  properties.lobe_width = std::max(material.alpha_u, material.alpha_v);
  // Where a texture decides on lobe or colour paths go on, however rough the surface is.
  properties.gathers = material.texture == kNoTexture && !material.HasRoughnessTexture() &&
                       properties.lobe_width >= kGatherAlpha;
  return properties;
}

Rgb ConductorKind::Textured(const MaterialNumbers& material) {
  return material.k;
}

void ConductorKind::SetTextured(MaterialNumbers& material, Rgb value) {
  material.eta = Gray(1);
  material.k = value;
}

// Like the indices of all metals, it stays in Rec. 709.
Rgb ConductorKind::TexturedValue(Rgb color) {
  return {AbsorptionFor(color.r), AbsorptionFor(color.g), AbsorptionFor(color.b)};
}

}  // namespace lucerna
