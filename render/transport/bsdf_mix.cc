// A mix scatters as the material that is chosen from it before paths scatter
// (transport/material_at.h).
#include "render/transport/bsdf_kinds.h"

namespace lucerna {

bool MixBsdf::Sample(const Material& /*material*/, Vec3 /*wo*/, float /*u_lobe*/, float /*u1*/,
                     float /*u2*/, Carried /*carried*/, BsdfSample& /*sample*/) {
  return false;
}

Rgb MixBsdf::Evaluate(const Material& /*material*/, Vec3 /*wo*/, Vec3 /*wi*/, Carried /*carried*/) {
  return {};
}

float MixBsdf::Pdf(const Material& /*material*/, Vec3 /*wo*/, Vec3 /*wi*/) {
  return 0;
}

Rgb MixBsdf::Albedo(const Material& /*material*/) {
  return {};
}

float MixBsdf::ReflectedShare(const Material& /*material*/, float /*cos_o*/) {
  return 0;
}

float MixBsdf::ShareOfFirst(const Material& /*material*/, Vec3 /*wo*/) {
  return 1;
}

Rgb MixBsdf::EyeFactor(const Material& /*material*/, Vec3 /*wo*/) {
  return {};
}

float MixBsdf::PhotonFactor(const Material& /*material*/, Vec3 /*wi*/) {
  return 1;
}

}  // namespace lucerna
