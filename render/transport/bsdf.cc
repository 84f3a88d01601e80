#include "render/transport/bsdf.h"

#include <algorithm>
#include <cmath>

#include "render/math/color_space.h"
#include "render/math/warp.h"

namespace lucerna {
namespace {

constexpr float Square(float v) {
  return v * v;
}

Vec3 Mirror(Vec3 wo, Vec3 m) {
  return m * (2 * Dot(wo, m)) - wo;
}

// The GGX distribution with widths alpha_u, alpha_v along local x and y.
struct Ggx {
  float au, av;

  explicit Ggx(const Material& material)
      : au(std::max(material.alpha_u, 1e-4F)), av(std::max(material.alpha_v, 1e-4F)) {}

  // D(m) [sr⁻¹], W07 eq. (33) stretched to two widths.
  [[nodiscard]] float D(Vec3 m) const {
    const float e = Square(m.x / au) + Square(m.y / av) + Square(m.z);
    return 1 / (kPi * au * av * e * e);
  }
  // Smith's Λ(w).
  [[nodiscard]] float Lambda(Vec3 w) const {
    const float z2 = Square(w.z);
    if (z2 == 0) return HUGE_VALF;
    return (std::sqrt(1 + (Square(au * w.x) + Square(av * w.y)) / z2) - 1) * 0.5F;
  }
  [[nodiscard]] float G1(Vec3 w) const { return 1 / (1 + Lambda(w)); }
  [[nodiscard]] float G2(Vec3 wo, Vec3 wi) const { return 1 / (1 + Lambda(wo) + Lambda(wi)); }

  // The density of SampleVisible [sr⁻¹], H18 eq. (3). Requires w.z > 0.
  [[nodiscard]] float PdfVisible(Vec3 w, Vec3 m) const {
    return G1(w) / w.z * D(m) * std::max(0.0F, Dot(w, m));
  }
  // A normal as seen from w (w.z > 0), H18 appendix A.
  [[nodiscard]] Vec3 SampleVisible(Vec3 w, float u1, float u2) const {
    const Vec3 v = Normalize(Vec3{au * w.x, av * w.y, w.z});
    const float squared = v.x * v.x + v.y * v.y;
    const Vec3 t1 = squared > 0 ? Vec3{-v.y, v.x, 0} / std::sqrt(squared) : Vec3{1, 0, 0};
    const Vec3 t2 = Cross(v, t1);
    const float radius = std::sqrt(u1);
    const float angle = 2 * kPi * u2;
    const float p1 = radius * std::cos(angle);
    const float s = 0.5F * (1 + v.z);
    const float p2 =
        (1 - s) * std::sqrt(std::max(0.0F, 1 - p1 * p1)) + s * (radius * std::sin(angle));
    const float p3 = std::sqrt(std::max(0.0F, 1 - p1 * p1 - p2 * p2));
    const Vec3 m = t1 * p1 + t2 * p2 + v * p3;
    return Normalize(Vec3{au * m.x, av * m.y, std::max(1e-6F, m.z)});
  }
};

// --- conductor -------------------------------------------------------------------------------

// What a metal reflects, in the working space: its indices are those of Rec. 709's channels.
Rgb MetalReflectance(const Material& material, float cos_i) {
  return ToWorking(FresnelConductor(cos_i, material.eta, material.k));
}

bool SampleConductor(const Material& material, Vec3 wo, float u1, float u2, BsdfSample& sample) {
  const float side = wo.z < 0 ? -1.0F : 1.0F;  // a metal reflects on both of its sides
  if (wo.z == 0) return false;
  if (IsSmooth(material)) {
    sample = {{-wo.x, -wo.y, wo.z}, MetalReflectance(material, std::abs(wo.z)), 0, true};
    return true;
  }
  const Ggx ggx(material);
  const Vec3 up = wo * side;
  const Vec3 m = ggx.SampleVisible(up, u1, u2);
  const Vec3 wi = Mirror(up, m);
  if (!(wi.z > 0)) return false;
  const float cos_m = Dot(up, m);
  sample.wi = wi * side;
  sample.pdf = ggx.PdfVisible(up, m) / (4 * cos_m);
  sample.weight = MetalReflectance(material, cos_m) * (ggx.G2(up, wi) / ggx.G1(up));
  sample.is_delta = false;
  return sample.pdf > 0;
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

Rgb EvaluateConductor(const Material& material, Vec3 wo, Vec3 wi) {
  Vec3 m;
  if (IsSmooth(material) || !ReflectionHalf(wo, wi, m)) return {};
  const Ggx ggx(material);
  return MetalReflectance(material, std::abs(Dot(wo, m))) *
         (ggx.D(m) * ggx.G2(wo, wi) / std::abs(4 * wo.z * wi.z));
}

float PdfConductor(const Material& material, Vec3 wo, Vec3 wi) {
  Vec3 m;
  if (IsSmooth(material) || !ReflectionHalf(wo, wi, m)) return 0;
  const Ggx ggx(material);
  const Vec3 up = wo.z < 0 ? -wo : wo;
  return ggx.PdfVisible(up, m) / (4 * std::max(1e-12F, Dot(up, m)));
}

// --- dielectric ------------------------------------------------------------------------------

// Refracts wo at a facet m (on wo's side): `eta` = where the light goes over where wo is.
Vec3 RefractAt(Vec3 wo, Vec3 m, float eta, float cos_t) {
  return wo * (-1 / eta) + m * (Dot(wo, m) / eta - cos_t);
}

bool SampleDielectric(const Material& material, Vec3 wo, float u_lobe, float u1, float u2,
                      Carried carried, BsdfSample& sample) {
  if (wo.z == 0) return false;
  const bool smooth = IsSmooth(material);
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
    sample.wi = Mirror(wo, m);
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

// What evaluation and density of a rough dielectric share.
struct DielectricHalf {
  Vec3 m;  // on the outside (z > 0)
  bool reflects = false;
  float eta = 1;  // wi's side over wo's side
  float reflectance = 0;
};

bool MakeDielectricHalf(const Material& material, Vec3 wo, Vec3 wi, DielectricHalf& half) {
  if (IsSmooth(material) || wo.z == 0 || wi.z == 0) return false;
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

Rgb EvaluateDielectric(const Material& material, Vec3 wo, Vec3 wi, Carried carried) {
  DielectricHalf half;
  if (!MakeDielectricHalf(material, wo, wi, half)) return {};
  const Ggx ggx(material);
  const float shape = ggx.D(half.m) * ggx.G2(wo, wi);
  if (half.reflects) {
    return Gray(half.reflectance * shape / std::abs(4 * wo.z * wi.z));
  }
  // W07 eq. (21), for flux; radiance is compressed besides.
  const float cos_o = Dot(wo, half.m);
  const float cos_i = Dot(wi, half.m);
  const float denominator = Square(cos_i + cos_o / half.eta) * std::abs(wo.z * wi.z);
  float f =
      (1 - half.reflectance) * shape * std::abs(cos_i * cos_o) / std::max(1e-20F, denominator);
  if (carried == Carried::kRadiance) f /= half.eta * half.eta;
  return Gray(f);
}

float PdfDielectric(const Material& material, Vec3 wo, Vec3 wi) {
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

}  // namespace

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

bool SampleBsdf(const Material& material, Vec3 wo, float u_lobe, float u1, float u2,
                Carried carried, BsdfSample& sample) {
  switch (material.kind) {
    case Material::Kind::kDiffuse:
      return SampleDiffuse(material, wo, u1, u2, sample);
    case Material::Kind::kConductor:
      return SampleConductor(material, wo, u1, u2, sample);
    case Material::Kind::kDielectric:
      return SampleDielectric(material, wo, u_lobe, u1, u2, carried, sample);
  }
  return false;
}

Rgb EvaluateBsdf(const Material& material, Vec3 wo, Vec3 wi, Carried carried) {
  switch (material.kind) {
    case Material::Kind::kDiffuse:
      return wo.z * wi.z > 0 ? material.reflectance * kInversePi : Rgb{};
    case Material::Kind::kConductor:
      return EvaluateConductor(material, wo, wi);
    case Material::Kind::kDielectric:
      return EvaluateDielectric(material, wo, wi, carried);
  }
  return {};
}

float PdfBsdf(const Material& material, Vec3 wo, Vec3 wi) {
  switch (material.kind) {
    case Material::Kind::kDiffuse:
      return wo.z * wi.z > 0 ? std::abs(wi.z) * kInversePi : 0.0F;
    case Material::Kind::kConductor:
      return PdfConductor(material, wo, wi);
    case Material::Kind::kDielectric:
      return PdfDielectric(material, wo, wi);
  }
  return 0;
}

Rgb AlbedoOf(const Material& material) {
  switch (material.kind) {
    case Material::Kind::kDiffuse:
      return material.reflectance;
    case Material::Kind::kConductor:
      return MetalReflectance(material, 1);
    case Material::Kind::kDielectric:
      return Gray(1);
  }
  return {};
}

}  // namespace lucerna
