// A dielectric surface over a medium that light leaves near where it entered. What comes out at
// another point is given here as if it came out at the same one (transport/subsurface.h).
#include <algorithm>
#include <cmath>

#include "render/transport/bsdf_kinds.h"
#include "render/transport/coat.h"
#include "render/transport/dielectric_reflection.h"
#include "render/transport/microfacet.h"

namespace lucerna {
namespace {

float PdfBelow(Vec3 wo, Vec3 wi) {
  return wo.z * wi.z > 0 ? std::abs(wi.z) * kInversePi : 0.0F;
}

}  // namespace

// The two parts are never weighed against each other: the light of one arrives where the other's
// does not.
bool SubsurfaceBsdf::Sample(const Material& material, Vec3 wo, float u_lobe, float u1, float u2,
                            Carried /*carried*/, BsdfSample& sample) {
  if (wo.z == 0) return false;
  Parts part = material.parts;
  float chosen = 1;
  if (part == Parts::kAll) {
    const float share = ShareOfFirst(material, wo);
    const bool is_first = u_lobe < share;
    part = is_first ? Parts::kFirst : Parts::kSecond;
    chosen = is_first ? share : 1 - share;
    if (!(chosen > 0)) return false;
  }
  sample.part = part;
  if (part == Parts::kFirst) {
    if (!SampleDielectricReflection(material, wo, u1, u2, sample)) return false;
  } else {
    if (!SampleDiffuse(material, wo, u1, u2, sample)) return false;
    sample.weight = EyeFactor(material, wo) * (PhotonFactor(material, sample.wi) * kPi);
  }
  sample.weight *= 1 / chosen;
  sample.pdf *= chosen;
  return true;
}

Rgb SubsurfaceBsdf::Evaluate(const Material& material, Vec3 wo, Vec3 wi, Carried /*carried*/) {
  Rgb f;
  if (material.parts != Parts::kSecond) f += Gray(EvaluateDielectricReflection(material, wo, wi));
  if (material.parts != Parts::kFirst && wo.z * wi.z > 0) {
    f += EyeFactor(material, wo) * PhotonFactor(material, wi);
  }
  return f;
}

float SubsurfaceBsdf::Pdf(const Material& material, Vec3 wo, Vec3 wi) {
  if (material.parts == Parts::kFirst) return PdfDielectricReflection(material, wo, wi);
  if (material.parts == Parts::kSecond) return PdfBelow(wo, wi);
  const float share = ShareOfFirst(material, wo);
  return share * PdfDielectricReflection(material, wo, wi) + (1 - share) * PdfBelow(wo, wi);
}

Rgb SubsurfaceBsdf::Albedo(const Material& material) {
  return material.parts == Parts::kFirst ? Gray(1) : material.reflectance;
}

float SubsurfaceBsdf::ReflectedShare(const Material& /*material*/, float /*cos_o*/) {
  return 1;
}

// About what each part scatters of the light that falls in.
float SubsurfaceBsdf::ShareOfFirst(const Material& material, Vec3 wo) {
  // Facets that are turned away may reflect far more than the surface as a whole.
  constexpr float kLeastShare = 0.02F;
  const float below = CoatEntering(material, Up(wo)) * MaxChannel(material.reflectance);
  float cos_t = 0;
  const float reflected = FresnelDielectric(std::abs(wo.z), material.ior, cos_t);
  if (!(below > 0)) return 1;
  const float share = reflected / (reflected + below);
  return HasNoFacets(material) ? share : std::max(kLeastShare, share);
}

Rgb SubsurfaceBsdf::EyeFactor(const Material& material, Vec3 wo) {
  // By reciprocity, the mean of what enters is what leaves of light inside times the squared index.
  const float mean_entering = CoatLeaving(material) * Square(material.ior);
  return material.reflectance * (kInversePi * CoatEntering(material, Up(wo)) / mean_entering);
}

float SubsurfaceBsdf::PhotonFactor(const Material& material, Vec3 wi) {
  return CoatEntering(material, Up(wi));
}

}  // namespace lucerna
