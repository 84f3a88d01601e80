// A thin sheet that scatters light evenly to both of its sides, each with a colour of its own.
#include <cmath>

#include "render/transport/bsdf_kinds.h"
#include "render/transport/bsdf_parts.h"

namespace lucerna {

bool DiffuseTransmissionBsdf::Sample(const Material& material, Vec3 wo, float u_lobe, float u1,
                                     float u2, Carried carried, BsdfSample& sample) {
  if (material.parts == Parts::kAll) {
    return SampleParts<DiffuseTransmissionBsdf>(material, ShareOfFirst(material, wo), wo, u_lobe,
                                                u1, u2, carried, sample);
  }
  if (!SampleDiffuse(material, wo, u1, u2, sample)) return false;
  if (material.parts == Parts::kSecond) {
    sample.wi.z = -sample.wi.z;
    sample.weight = material.transmittance;
  }
  return true;
}

Rgb DiffuseTransmissionBsdf::Evaluate(const Material& material, Vec3 wo, Vec3 wi,
                                      Carried /*carried*/) {
  const float side = wo.z * wi.z;
  if (side > 0 && material.parts != Parts::kSecond) return material.reflectance * kInversePi;
  if (side < 0 && material.parts != Parts::kFirst) return material.transmittance * kInversePi;
  return {};
}

float DiffuseTransmissionBsdf::Pdf(const Material& material, Vec3 wo, Vec3 wi) {
  const float side = wo.z * wi.z;
  const float density = std::abs(wi.z) * kInversePi;
  switch (material.parts) {
    case Parts::kFirst:
      return side > 0 ? density : 0.0F;
    case Parts::kSecond:
      return side < 0 ? density : 0.0F;
    case Parts::kAll:
      break;
  }
  const float share = ShareOfFirst(material, wo);
  return density * (side > 0 ? share : side < 0 ? 1 - share : 0.0F);
}

Rgb DiffuseTransmissionBsdf::Albedo(const Material& material) {
  return material.parts == Parts::kSecond ? material.transmittance : material.reflectance;
}

float DiffuseTransmissionBsdf::ReflectedShare(const Material& /*material*/, float /*cos_o*/) {
  return 1;
}

float DiffuseTransmissionBsdf::ShareOfFirst(const Material& material, Vec3 /*wo*/) {
  const float reflected = MaxChannel(material.reflectance);
  const float transmitted = MaxChannel(material.transmittance);
  return reflected > 0 ? reflected / (reflected + transmitted) : 0.0F;
}

Rgb DiffuseTransmissionBsdf::EyeFactor(const Material& material, Vec3 /*wo*/) {
  return (material.parts == Parts::kSecond ? material.transmittance : material.reflectance) *
         kInversePi;
}

float DiffuseTransmissionBsdf::PhotonFactor(const Material& /*material*/, Vec3 /*wi*/) {
  return 1;
}

}  // namespace lucerna
