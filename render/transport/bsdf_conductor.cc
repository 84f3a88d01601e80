// Reflection by metals, smooth or rough. Equations as in transport/microfacet.h.
#include <algorithm>
#include <cmath>

#include "render/math/color_space.h"
#include "render/transport/bsdf_kinds.h"
#include "render/transport/microfacet.h"

namespace lucerna {
namespace {

// What a metal reflects, in the working space, or at the pass's wavelengths: elsewhere its indices
// are those of Rec. 709's channels.
Rgb MetalReflectance(const Material& material, float cos_i) {
  const Rgb reflected = FresnelConductor(cos_i, material.eta, material.k);
  const Rgb working = material.is_at_wavelengths ? reflected : ToWorking(reflected);
  return material.is_tinted ? working * material.reflection_tint : working;
}

// The half vector of reflection, turned to z > 0; false when wo and wi have none.
bool ReflectionHalf(Vec3 wo, Vec3 wi, Vec3& m) {
  if (!(wo.z * wi.z > 0)) return false;
  m = wo + wi;
  const float squared = LengthSquared(m);
  if (squared == 0) return false;
  m = m * ((wo.z < 0 ? -1.0F : 1.0F) / std::sqrt(squared));
  return true;
}

}  // namespace

bool ConductorBsdf::Sample(const Material& material, Vec3 wo, float /*u_lobe*/, float u1, float u2,
                           Carried /*carried*/, BsdfSample& sample) {
  const float side = wo.z < 0 ? -1.0F : 1.0F;  // a metal reflects on both of its sides
  if (wo.z == 0) return false;
  if (HasNoFacets(material)) {
    sample = {{-wo.x, -wo.y, wo.z}, MetalReflectance(material, std::abs(wo.z)), 0, true};
    return true;
  }
  const Ggx ggx(material);
  const Vec3 up = wo * side;
  const Vec3 m = ggx.SampleVisible(up, u1, u2);
  const Vec3 wi = ReflectAt(up, m);
  if (!(wi.z > 0)) return false;
  const float cos_m = Dot(up, m);
  sample.wi = wi * side;
  sample.pdf = ggx.PdfVisible(up, m) / (4 * cos_m);
  sample.weight = MetalReflectance(material, cos_m) * (ggx.G2(up, wi) / ggx.G1(up));
  sample.is_delta = false;
  return sample.pdf > 0;
}

Rgb ConductorBsdf::Evaluate(const Material& material, Vec3 wo, Vec3 wi, Carried /*carried*/) {
  Vec3 m;
  if (HasNoFacets(material) || !ReflectionHalf(wo, wi, m)) return {};
  const Ggx ggx(material);
  return MetalReflectance(material, std::abs(Dot(wo, m))) *
         (ggx.D(m) * ggx.G2(wo, wi) / std::abs(4 * wo.z * wi.z));
}

float ConductorBsdf::Pdf(const Material& material, Vec3 wo, Vec3 wi) {
  Vec3 m;
  if (HasNoFacets(material) || !ReflectionHalf(wo, wi, m)) return 0;
  const Ggx ggx(material);
  const Vec3 up = wo.z < 0 ? -wo : wo;
  return ggx.PdfVisible(up, m) / (4 * std::max(1e-12F, Dot(up, m)));
}

Rgb ConductorBsdf::Albedo(const Material& material) {
  return MetalReflectance(material, 1);
}

float ConductorBsdf::ReflectedShare(const Material& /*material*/, float /*cos_o*/) {
  return 1;
}

float ConductorBsdf::ShareOfFirst(const Material& /*material*/, Vec3 /*wo*/) {
  return 1;
}

Rgb ConductorBsdf::EyeFactor(const Material& /*material*/, Vec3 /*wo*/) {
  return {};
}

float ConductorBsdf::PhotonFactor(const Material& /*material*/, Vec3 /*wi*/) {
  return 1;
}

Rgb FresnelConductor(float cos_i, Rgb eta, Rgb k) {
  const float c = std::clamp(cos_i, 0.0F, 1.0F);
  const float c2 = c * c;
  const float s2 = 1 - c2;
  // Born & Wolf, section 14.2, with the squared modulus of the complex cosine as a² + b².
  const auto channel = [&](float n, float kappa) {
    const float n2 = n * n;
    const float k2 = kappa * kappa;
    const float t = n2 - k2 - s2;
    const float a2_plus_b2 = std::sqrt(std::max(0.0F, t * t + 4 * n2 * k2));
    const float a = std::sqrt(std::max(0.0F, 0.5F * (a2_plus_b2 + t)));
    // Both denominators vanish only together with their numerators.
    constexpr float kLeast = 1e-30F;
    const float rs = (a2_plus_b2 + c2 - 2 * c * a) / std::max(kLeast, a2_plus_b2 + c2 + 2 * c * a);
    const float rp = rs * (c2 * a2_plus_b2 + s2 * s2 - 2 * c * a * s2) /
                     std::max(kLeast, c2 * a2_plus_b2 + s2 * s2 + 2 * c * a * s2);
    return std::clamp(0.5F * (rs + rp), 0.0F, 1.0F);
  };
  return {channel(eta.r, k.r), channel(eta.g, k.g), channel(eta.b, k.b)};
}

}  // namespace lucerna
