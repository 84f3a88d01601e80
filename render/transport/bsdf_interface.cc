// The border between two media: paths pass it before they could scatter (transport/media.h).
#include "render/transport/bsdf_kinds.h"

namespace lucerna {

bool InterfaceBsdf::Sample(const Material& /*material*/, Vec3 /*wo*/, float /*u_lobe*/,
                           float /*u1*/, float /*u2*/, Carried /*carried*/,
                           BsdfSample& /*sample*/) {
  return false;
}

Rgb InterfaceBsdf::Evaluate(const Material& /*material*/, Vec3 /*wo*/, Vec3 /*wi*/,
                            Carried /*carried*/) {
  return {};
}

float InterfaceBsdf::Pdf(const Material& /*material*/, Vec3 /*wo*/, Vec3 /*wi*/) {
  return 0;
}

Rgb InterfaceBsdf::Albedo(const Material& /*material*/) {
  return {};
}

float InterfaceBsdf::ReflectedShare(const Material& /*material*/, float /*cos_o*/) {
  return 0;
}

float InterfaceBsdf::ShareOfFirst(const Material& /*material*/, Vec3 /*wo*/) {
  return 1;
}

Rgb InterfaceBsdf::EyeFactor(const Material& /*material*/, Vec3 /*wo*/) {
  return {};
}

float InterfaceBsdf::PhotonFactor(const Material& /*material*/, Vec3 /*wi*/) {
  return 1;
}

}  // namespace lucerna
