// Diffuse reflection: `reflectance`, or a texture in its place.
#include "render/math/color_space.h"
#include "render/scene/material.h"

namespace lucerna {

MaterialProperties DiffuseKind::Properties(const MaterialNumbers& material) {
  MaterialProperties properties;
  properties.is_diffuse = true;
  properties.is_separable = true;
  properties.is_black = material.texture == kNoTexture && IsBlack(material.reflectance);
  // Black surfaces need no photons.
  properties.gathers = !IsBlack(material.reflectance);
  return properties;
}

Rgb DiffuseKind::Textured(const MaterialNumbers& material) {
  return material.reflectance;
}

void DiffuseKind::SetTextured(MaterialNumbers& material, Rgb value) {
  material.reflectance = value;
}

Rgb DiffuseKind::TexturedValue(Rgb color) {
  return ToWorking(color);
}

}  // namespace lucerna
