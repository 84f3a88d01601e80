// A dielectric surface over a medium that scatters light so densely that it comes out near where it
// entered: `reflectance`, or a texture in its place, and `extinction`; or `absorption` and
// `scattering`, from which they follow; `ior`, `alpha_u` and `alpha_v` of the surface, or textures
// of roughness in their places; `phase_g` of the medium. The first part is what the surface
// reflects, the second what comes out of it.
#include <algorithm>

#include "render/math/color_space.h"
#include "render/scene/material.h"

namespace lucerna {

MaterialProperties SubsurfaceKind::Properties(const MaterialNumbers& material) {
  const bool is_smooth = material.alpha_u == 0 && material.alpha_v == 0;
  const bool is_dark_below = material.texture == kNoTexture && IsBlack(material.reflectance);
  MaterialProperties properties;
  properties.weighs_photons = material.parts != Parts::kFirst;
  properties.scatters_below = material.parts != Parts::kFirst;
  if (material.parts == Parts::kSecond) {
    properties.is_black = is_dark_below;
    properties.gathers = !is_dark_below;
    properties.is_separable = true;
    return properties;
  }
  properties.lobe_width = std::max(material.alpha_u, material.alpha_v);
  properties.scatters_smoothly = is_smooth || material.may_be_smooth;
  properties.has_rough_coat = !is_smooth;
  if (material.parts == Parts::kFirst) {
    properties.is_smooth = is_smooth;
    return properties;
  }
  properties.has_parts = true;
  properties.is_smooth = is_smooth && is_dark_below;
  properties.gathers = !is_dark_below;
  return properties;
}

Rgb SubsurfaceKind::Textured(const MaterialNumbers& material) {
  return material.reflectance;
}

void SubsurfaceKind::SetTextured(MaterialNumbers& material, Rgb value) {
  material.reflectance = value;
}

Rgb SubsurfaceKind::TexturedValue(Rgb color) {
  return ToWorking(color);
}

}  // namespace lucerna
