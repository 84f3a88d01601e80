// A thin sheet of glass: reflection, and transmission straight on, with all inner reflections.
#include <cmath>

#include "render/transport/bsdf_kinds.h"

namespace lucerna {

bool ThinDielectricBsdf::Sample(const Material& material, Vec3 wo, float u_lobe, float /*u1*/,
                                float /*u2*/, Carried /*carried*/, BsdfSample& sample) {
  if (wo.z == 0) return false;
  // Each lobe is chosen with its own share. Both sides are in one medium.
  const bool reflects = u_lobe < ReflectedShare(material, wo.z);
  sample = {reflects ? Vec3{-wo.x, -wo.y, wo.z} : -wo,
            reflects ? material.reflection_tint : material.transmission_tint, 0, true};
  return true;
}

Rgb ThinDielectricBsdf::Evaluate(const Material& /*material*/, Vec3 /*wo*/, Vec3 /*wi*/,
                                 Carried /*carried*/) {
  return {};
}

float ThinDielectricBsdf::Pdf(const Material& /*material*/, Vec3 /*wo*/, Vec3 /*wi*/) {
  return 0;
}

Rgb ThinDielectricBsdf::Albedo(const Material& /*material*/) {
  return Gray(1);
}

float ThinDielectricBsdf::ReflectedShare(const Material& material, float cos_o) {
  float cos_t = 0;
  const float r = FresnelDielectric(std::abs(cos_o), material.ior, cos_t);
  // R + T²R + T²R³ + ..., with T = 1 - R.
  return r < 1 ? 2 * r / (1 + r) : 1.0F;
}

float ThinDielectricBsdf::ShareOfFirst(const Material& /*material*/, Vec3 /*wo*/) {
  return 1;
}

Rgb ThinDielectricBsdf::EyeFactor(const Material& /*material*/, Vec3 /*wo*/) {
  return {};
}

float ThinDielectricBsdf::PhotonFactor(const Material& /*material*/, Vec3 /*wi*/) {
  return 1;
}

}  // namespace lucerna
