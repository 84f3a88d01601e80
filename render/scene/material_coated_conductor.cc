// A metal under a dielectric coat: `eta` and `k`, as against vacuum, or a texture in their place as
// for a conductor; `base_alpha_u` and `base_alpha_v` of the metal, `ior`, `alpha_u` and `alpha_v`
// of the coat's surface, `thickness` of what lies between. Under a smooth coat a rough metal is the
// second of two parts. A smooth metal under a smooth coat is a mirror, and under a rough coat all
// is scattered broadly: one part each.
#include "render/scene/material.h"

namespace lucerna {

MaterialProperties CoatedConductorKind::Properties(const MaterialNumbers& material) {
  const float coat_width = std::max(material.alpha_u, material.alpha_v);
  const float base_width =
      std::max(BaseWidthSeen(material.base_alpha_u, material.alpha_u, material.ior, 0.5F),
               BaseWidthSeen(material.base_alpha_v, material.alpha_v, material.ior, 0.5F));
  const bool is_coat_smooth = coat_width == 0;
  // Of either surface a texture may make places smooth, and so have the parts of another kind.
  const bool may_have_parts = material.may_be_smooth && material.parts == Parts::kAll;
  MaterialProperties properties;
  if (base_width == 0 || (is_coat_smooth && material.parts == Parts::kFirst)) {
    properties.is_smooth = true;
    properties.scatters_smoothly = true;
    properties.lobe_width = 0;
    return properties;
  }
  const bool is_second = material.parts == Parts::kSecond;
  properties.lobe_width = is_second ? base_width : std::min(coat_width, base_width);
  properties.has_parts = (is_coat_smooth || may_have_parts) && !is_second;
  properties.scatters_smoothly =
      properties.has_parts || (is_coat_smooth && material.base_may_be_smooth && !is_second);
  // The narrower lobe decides, but where it is the smooth part; textures as for conductors.
  const float narrower = is_coat_smooth ? base_width : std::min(coat_width, base_width);
  properties.gathers =
      material.texture == kNoTexture && !material.HasRoughnessTexture() && narrower >= kGatherAlpha;
  return properties;
}

Rgb CoatedConductorKind::Textured(const MaterialNumbers& material) {
  return ConductorKind::Textured(material);
}

void CoatedConductorKind::SetTextured(MaterialNumbers& material, Rgb value) {
  ConductorKind::SetTextured(material, value);
}

Rgb CoatedConductorKind::TexturedValue(Rgb color) {
  return ConductorKind::TexturedValue(color);
}

}  // namespace lucerna
