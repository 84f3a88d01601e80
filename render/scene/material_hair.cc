// A fibre of hair or fur, as a cylinder of dielectric whose scales are tilted: `ior`, `beta_m`,
// `beta_n`, `scale_tilt` and `absorption`, which is given or follows from `reflectance`. It stands
// on tubes alone, of which one event models all that happens within (transport/bsdf_hair.cc).
//
// Source: Chiang et al. 2016, "A Practical and Controllable Hair and Fur Model for Production Path
// Tracing".
#include <algorithm>
#include <cmath>

#include "render/scene/material.h"

namespace lucerna {
namespace {

// Section 4: how far the logarithm of the reflectance follows the root of the
// absorption.
float ReflectanceSlope(float beta_n) {
  const float b = beta_n;
  return 5.969F + b * (-0.215F + b * (2.532F + b * (-10.73F + b * (5.574F + b * 0.245F))));
}

}  // namespace

MaterialProperties HairKind::Properties(const MaterialNumbers& material) {
  MaterialProperties properties;
  properties.transmits = true;
  properties.ior = material.ior;
  // However narrow the lobes are along the fibre, its round surface sends light to all sides
  // (Marschner et al. 2003, "Light Scattering from Human Hair Fibers": a smooth fibre has a cone of
  // directions for each one that light comes from). One width for all directions is therefore
  // that of broad scattering, whatever beta_m is.
  properties.lobe_width = HUGE_VALF;
  return properties;
}

Rgb HairKind::Textured(const MaterialNumbers& material) {
  return material.absorbs_for_reflectance ? material.reflectance : material.absorption;
}

void HairKind::SetTextured(MaterialNumbers& material, Rgb value) {
  if (!material.absorbs_for_reflectance) {
    material.absorption = value;
    return;
  }
  material.reflectance = value;
  material.absorption = HairAbsorption(value, material.beta_n);
}

Rgb HairKind::TexturedValue(Rgb color) {
  return DiffuseKind::TexturedValue(color);
}

Rgb HairAbsorption(Rgb reflectance, float beta_n) {
  const float slope = ReflectanceSlope(beta_n);
  const auto channel = [&](float c) {
    // Black would absorb without end; of this reflectance one fibre lets nothing through.
    constexpr float kBlack = 1e-6F;
    const float root = std::log(std::clamp(c, kBlack, 1.0F)) / slope;
    return root * root;
  };
  return {channel(reflectance.r), channel(reflectance.g), channel(reflectance.b)};
}

Rgb HairReflectance(Rgb absorption, float beta_n) {
  const float slope = ReflectanceSlope(beta_n);
  const auto channel = [&](float sigma) { return std::exp(-std::sqrt(sigma) * slope); };
  return {channel(absorption.r), channel(absorption.g), channel(absorption.b)};
}

}  // namespace lucerna
