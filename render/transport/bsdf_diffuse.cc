// Diffuse reflection, on both sides of a surface.
#include <cmath>

#include "render/transport/bsdf_kinds.h"

namespace lucerna {

bool DiffuseBsdf::Sample(const Material& material, Vec3 wo, float /*u_lobe*/, float u1, float u2,
                         Carried /*carried*/, BsdfSample& sample) {
  return SampleDiffuse(material, wo, u1, u2, sample);
}

Rgb DiffuseBsdf::Evaluate(const Material& material, Vec3 wo, Vec3 wi, Carried /*carried*/) {
  return wo.z * wi.z > 0 ? material.reflectance * kInversePi : Rgb{};
}

float DiffuseBsdf::Pdf(const Material& /*material*/, Vec3 wo, Vec3 wi) {
  return wo.z * wi.z > 0 ? std::abs(wi.z) * kInversePi : 0.0F;
}

Rgb DiffuseBsdf::Albedo(const Material& material) {
  return material.reflectance;
}

float DiffuseBsdf::ReflectedShare(const Material& /*material*/, float /*cos_o*/) {
  return 1;
}

float DiffuseBsdf::ShareOfFirst(const Material& /*material*/, Vec3 /*wo*/) {
  return 1;
}

Rgb DiffuseBsdf::EyeFactor(const Material& material, Vec3 /*wo*/) {
  return material.reflectance * kInversePi;
}

float DiffuseBsdf::PhotonFactor(const Material& /*material*/, Vec3 /*wi*/) {
  return 1;
}

}  // namespace lucerna
