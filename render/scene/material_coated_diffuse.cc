// A diffuse base under a dielectric coat: `reflectance`, or a texture in its place; `ior`,
// `alpha_u` and `alpha_v` of the coat's surface, or textures of roughness in their places;
// `thickness` of what lies between, or a texture in its place. The first part is what the coat's
// surface reflects, the second what comes out of the coat.
#include "render/math/color_space.h"
#include "render/scene/material.h"

namespace lucerna {

MaterialProperties CoatedDiffuseKind::Properties(const MaterialNumbers& material) {
  const bool is_smooth = material.alpha_u == 0 && material.alpha_v == 0;
  const bool has_haze = material.HasHaze();
  const bool is_base_black =
      material.texture == kNoTexture && IsBlack(material.reflectance) && !has_haze;
  MaterialProperties properties;
  if (material.parts == Parts::kSecond) {
    properties.is_black = is_base_black;
    properties.gathers = !is_base_black;
    // What a layer scatters before it meets the base has another form than what the base does.
    properties.is_separable = !has_haze;
    properties.weighs_photons = !has_haze;
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
  properties.is_smooth = is_smooth && is_base_black;
  properties.gathers = !is_base_black;
  properties.weighs_photons = !has_haze;
  return properties;
}

Rgb CoatedDiffuseKind::Textured(const MaterialNumbers& material) {
  return material.reflectance;
}

void CoatedDiffuseKind::SetTextured(MaterialNumbers& material, Rgb value) {
  material.reflectance = value;
}

Rgb CoatedDiffuseKind::TexturedValue(Rgb color) {
  return ToWorking(color);
}

}  // namespace lucerna
