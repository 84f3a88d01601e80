// A diffuse base under a dielectric coat, on both sides of a surface: what the coat's surface
// reflects, and what comes out of the coat. Equations as in transport/coat.h.
#include <algorithm>
#include <cmath>

#include "render/transport/bsdf_kinds.h"
#include "render/transport/bsdf_parts.h"
#include "render/transport/coat.h"
#include "render/transport/dielectric_reflection.h"
#include "render/transport/microfacet.h"

namespace lucerna {
namespace {

// ρ · (1 + ρK + ... ), as many terms as light may meet the base.
Rgb BaseReflectance(const Material& material) {
  const Rgb inner = material.HasHaze() ? HazeInner(material) : Gray(CoatInner(material));
  const auto channel = [&](float reflectance, float returned) {
    float sum = 0;
    for (int i = 0; i < material.base_hits; ++i) {
      const float before = sum;
      sum = reflectance * (1 + returned * sum);
      if (sum == before) break;
    }
    return sum;
  };
  return {channel(material.reflectance.r, inner.r), channel(material.reflectance.g, inner.g),
          channel(material.reflectance.b, inner.b)};
}

// --- the base, as seen through it

Rgb EvaluateBase(const Material& material, Vec3 wo, Vec3 wi) {
  if (!(wo.z * wi.z > 0)) return {};
  if (!material.HasHaze()) {
    return CoatedDiffuseBsdf::EyeFactor(material, wo) *
           CoatedDiffuseBsdf::PhotonFactor(material, wi);
  }
  const Rgb base = BaseReflectance(material) * HazeEntering(material, Up(wo)) *
                   HazeEntering(material, Up(wi)) * (kInversePi / Square(material.ior));
  const Rgb mean = HazeMeanBack(material);
  const Rgb back = HazeBack(material, std::abs(wo.z)) * HazeBack(material, std::abs(wi.z));
  const auto of_mean = [](float product, float of) { return of > 0 ? product / of : 0.0F; };
  return base + Rgb{of_mean(back.r, mean.r), of_mean(back.g, mean.g), of_mean(back.b, mean.b)} *
                    kInversePi;
}

float PdfBase(Vec3 wo, Vec3 wi) {
  return wo.z * wi.z > 0 ? std::abs(wi.z) * kInversePi : 0.0F;
}

}  // namespace

bool CoatedDiffuseBsdf::Sample(const Material& material, Vec3 wo, float u_lobe, float u1, float u2,
                               Carried carried, BsdfSample& sample) {
  if (wo.z == 0) return false;
  switch (material.parts) {
    case Parts::kFirst:
      return SampleDielectricReflection(material, wo, u1, u2, sample);
    case Parts::kSecond:
      if (!SampleDiffuse(material, wo, u1, u2, sample)) return false;
      sample.weight = EvaluateBase(material, wo, sample.wi) * kPi;
      return true;
    case Parts::kAll:
      break;
  }
  return SampleParts<CoatedDiffuseBsdf>(material, ShareOfFirst(material, wo), wo, u_lobe, u1, u2,
                                        carried, sample);
}

Rgb CoatedDiffuseBsdf::Evaluate(const Material& material, Vec3 wo, Vec3 wi, Carried /*carried*/) {
  Rgb f;
  if (material.parts != Parts::kSecond) f += Gray(EvaluateDielectricReflection(material, wo, wi));
  if (material.parts != Parts::kFirst) f += EvaluateBase(material, wo, wi);
  return f;
}

float CoatedDiffuseBsdf::Pdf(const Material& material, Vec3 wo, Vec3 wi) {
  if (material.parts == Parts::kFirst) return PdfDielectricReflection(material, wo, wi);
  if (material.parts == Parts::kSecond) return PdfBase(wo, wi);
  const float share = ShareOfFirst(material, wo);
  return share * PdfDielectricReflection(material, wo, wi) + (1 - share) * PdfBase(wo, wi);
}

Rgb CoatedDiffuseBsdf::Albedo(const Material& material) {
  return material.parts == Parts::kFirst ? Gray(1) : material.reflectance;
}

float CoatedDiffuseBsdf::ReflectedShare(const Material& /*material*/, float /*cos_o*/) {
  return 1;
}

// About what each part scatters of the light that falls in: any share is right, and this one keeps
// weights even.
float CoatedDiffuseBsdf::ShareOfFirst(const Material& material, Vec3 wo) {
  // Facets that are turned away may reflect far more than the surface as a whole.
  constexpr float kLeastShare = 0.02F;
  float base = CoatEntering(material, Up(wo)) * CoatLeaving(material) *
               MaxChannel(BaseReflectance(material));
  if (material.HasHaze()) base += MaxChannel(HazeBack(material, std::abs(wo.z)));
  float cos_t = 0;
  const float coat = FresnelDielectric(std::abs(wo.z), material.ior, cos_t);
  if (!(base > 0)) return 1;
  const float share = coat / (coat + base);
  return HasNoFacets(material) ? share : std::max(kLeastShare, share);
}

Rgb CoatedDiffuseBsdf::EyeFactor(const Material& material, Vec3 wo) {
  return BaseReflectance(material) *
         (kInversePi * CoatEntering(material, Up(wo)) / Square(material.ior));
}

float CoatedDiffuseBsdf::PhotonFactor(const Material& material, Vec3 wi) {
  return CoatEntering(material, Up(wi));
}

}  // namespace lucerna
