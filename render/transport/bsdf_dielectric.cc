// Reflection and refraction by glass, smooth or rough. Equations as in transport/microfacet.h.
#include <algorithm>
#include <cmath>

#include "render/transport/bsdf_kinds.h"
#include "render/transport/microfacet.h"

namespace lucerna {
namespace {

// Refracts wo at a facet m (on wo's side): `eta` = where the light goes over where wo is.
Vec3 RefractAt(Vec3 wo, Vec3 m, float eta, float cos_t) {
  return wo * (-1 / eta) + m * (Dot(wo, m) / eta - cos_t);
}

// What evaluation and density of a rough dielectric share.
struct DielectricHalf {
  Vec3 m;  // on the outside (z > 0)
  bool reflects = false;
  float eta = 1;  // wi's side over wo's side
  float reflectance = 0;
};

bool MakeDielectricHalf(const Material& material, Vec3 wo, Vec3 wi, DielectricHalf& half) {
  if (HasNoFacets(material) || wo.z == 0 || wi.z == 0) return false;
  half.reflects = wo.z * wi.z > 0;
  const float eta = wo.z > 0 ? material.ior : 1 / material.ior;
  half.eta = half.reflects ? 1.0F : eta;
  Vec3 m = wo + wi * half.eta;
  const float squared = LengthSquared(m);
  if (squared == 0) return false;
  m = m / std::sqrt(squared);
  half.m = m.z < 0 ? -m : m;
  // Facets seen from behind scatter nothing.
  if (Dot(half.m, wi) * wi.z <= 0 || Dot(half.m, wo) * wo.z <= 0) return false;
  float cos_t = 0;
  half.reflectance = FresnelDielectric(std::abs(Dot(wo, half.m)), eta, cos_t);
  return true;
}

Rgb TintOf(const Material& material, Vec3 wo, Vec3 wi) {
  return wo.z * wi.z > 0 ? material.reflection_tint : material.transmission_tint;
}

// Of clear glass.
bool SampleClear(const Material& material, Vec3 wo, float u_lobe, float u1, float u2,
                 Carried carried, BsdfSample& sample) {
  if (wo.z == 0) return false;
  const bool smooth = HasNoFacets(material);
  const Ggx ggx(material);
  const float side = wo.z < 0 ? -1.0F : 1.0F;
  const float eta = wo.z < 0 ? 1 / material.ior : material.ior;  // across the surface from wo
  const Vec3 m = smooth ? Vec3{0, 0, side} : ggx.SampleVisible(wo * side, u1, u2) * side;
  const float cos_m = Dot(wo, m);
  if (!(cos_m > 0)) return false;
  float cos_t = 0;
  const float reflectance = FresnelDielectric(cos_m, eta, cos_t);

  sample.is_delta = smooth;
  sample.pdf = 0;
  // Each lobe is chosen with its own share, so both weights are free of Fresnel's factor.
  if (u_lobe < reflectance) {
    sample.wi = ReflectAt(wo, m);
    if (!(sample.wi.z * wo.z > 0)) return false;
    sample.weight = Gray(1);
    if (smooth) return true;
    sample.weight = Gray(ggx.G2(wo * side, sample.wi * side) / ggx.G1(wo * side));
    sample.pdf = reflectance * ggx.PdfVisible(wo * side, m * side) / (4 * cos_m);
  } else {
    sample.wi = RefractAt(wo, m, eta, cos_t);
    if (!(sample.wi.z * wo.z < 0)) return false;
    // Radiance is compressed by the square of the index where it enters.
    const float compression = carried == Carried::kRadiance ? 1 / (eta * eta) : 1.0F;
    sample.weight = Gray(compression);
    if (smooth) return true;
    sample.weight = Gray(compression * ggx.G2(wo * side, sample.wi * -side) / ggx.G1(wo * side));
    // W07 eq. (17): the Jacobian of the half vector of refraction.
    const float denominator = Square(Dot(sample.wi, m) + cos_m / eta);
    sample.pdf = (1 - reflectance) * ggx.PdfVisible(wo * side, m * side) *
                 std::abs(Dot(sample.wi, m)) / std::max(1e-20F, denominator);
  }
  return sample.pdf > 0;
}

}  // namespace

bool DielectricBsdf::Sample(const Material& material, Vec3 wo, float u_lobe, float u1, float u2,
                            Carried carried, BsdfSample& sample) {
  if (!SampleClear(material, wo, u_lobe, u1, u2, carried, sample)) return false;
  if (material.is_tinted) sample.weight = sample.weight * TintOf(material, wo, sample.wi);
  return true;
}

Rgb DielectricBsdf::Evaluate(const Material& material, Vec3 wo, Vec3 wi, Carried carried) {
  DielectricHalf half;
  if (!MakeDielectricHalf(material, wo, wi, half)) return {};
  const Ggx ggx(material);
  const float shape = ggx.D(half.m) * ggx.G2(wo, wi);
  if (half.reflects) {
    return Gray(half.reflectance * shape / std::abs(4 * wo.z * wi.z)) * TintOf(material, wo, wi);
  }
  // W07 eq. (21), for flux; radiance is compressed besides.
  const float cos_o = Dot(wo, half.m);
  const float cos_i = Dot(wi, half.m);
  const float denominator = Square(cos_i + cos_o / half.eta) * std::abs(wo.z * wi.z);
  float f =
      (1 - half.reflectance) * shape * std::abs(cos_i * cos_o) / std::max(1e-20F, denominator);
  if (carried == Carried::kRadiance) f /= half.eta * half.eta;
  return Gray(f) * TintOf(material, wo, wi);
}

float DielectricBsdf::Pdf(const Material& material, Vec3 wo, Vec3 wi) {
  DielectricHalf half;
  if (!MakeDielectricHalf(material, wo, wi, half)) return 0;
  const Ggx ggx(material);
  const float side = wo.z < 0 ? -1.0F : 1.0F;
  const Vec3 up = wo * side;
  // The distribution is symmetric about the plane of the surface's normal, so the facet as seen
  // from wo's side is m turned with wo.
  const float visible = ggx.G1(up) / up.z * ggx.D(half.m) * std::abs(Dot(wo, half.m));
  if (half.reflects) {
    return half.reflectance * visible / (4 * std::abs(Dot(wo, half.m)));
  }
  const float cos_i = Dot(wi, half.m);
  const float denominator = Square(cos_i + Dot(wo, half.m) / half.eta);
  return (1 - half.reflectance) * visible * std::abs(cos_i) / std::max(1e-20F, denominator);
}

Rgb DielectricBsdf::Albedo(const Material& /*material*/) {
  return Gray(1);
}

float DielectricBsdf::ReflectedShare(const Material& material, float cos_o) {
  float cos_t = 0;
  return FresnelDielectric(cos_o, material.ior, cos_t);
}

float DielectricBsdf::ShareOfFirst(const Material& /*material*/, Vec3 /*wo*/) {
  return 1;
}

Rgb DielectricBsdf::EyeFactor(const Material& /*material*/, Vec3 /*wo*/) {
  return {};
}

float DielectricBsdf::PhotonFactor(const Material& /*material*/, Vec3 /*wi*/) {
  return 1;
}

float FresnelDielectric(float cos_i, float eta, float& cos_t) {
  if (cos_i < 0) {
    eta = 1 / eta;
    cos_i = -cos_i;
  }
  cos_i = std::min(cos_i, 1.0F);
  // eta² cos²_t, by a sum that does not cancel: at grazing incidence 1 - cos²_i would be 1 in
  // float, and a surface between equal media would reflect all light.
  const float squared = (eta - 1) * (eta + 1) + cos_i * cos_i;
  if (!(squared > 0)) {
    cos_t = 0;
    return 1;
  }
  cos_t = std::sqrt(squared) / eta;
  const float parallel = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
  const float perpendicular = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
  return 0.5F * (parallel * parallel + perpendicular * perpendicular);
}

}  // namespace lucerna
