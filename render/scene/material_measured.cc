// A surface that scatters as its `measured` table says, on both of its sides.
#include "render/scene/material.h"
#include "render/scene/measured_table.h"

namespace lucerna {

MaterialProperties MeasuredKind::Properties(const MaterialNumbers& material) {
  MaterialProperties properties;
  properties.is_black = material.measured->is_black();
  properties.lobe_width = material.measured->lobe_width();
  properties.gathers = !properties.is_black && properties.lobe_width >= kGatherAlpha;
  return properties;
}

// It has no parameter in whose place a texture could be.
Rgb MeasuredKind::Textured(const MaterialNumbers& /*material*/) {
  return {};
}

void MeasuredKind::SetTextured(MaterialNumbers& /*material*/, Rgb /*value*/) {}

Rgb MeasuredKind::TexturedValue(Rgb color) {
  return DiffuseKind::TexturedValue(color);
}

}  // namespace lucerna
