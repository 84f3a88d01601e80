#include "render/tracing/direct_light.h"

#include <algorithm>
#include <cmath>

#include "render/math/rng.h"

namespace lucerna {

namespace {

// Where a shadow ray ends, over the distance to the light. The target is clear of the light's
// surface by a few roundings of the light's own coordinates; those of a far receiver are larger,
// and the ray would meet the light itself: a small light lost a tenth of its light 2.5 m away.
constexpr float kShadowEnd = 1 - 0x1p-17F;

}  // namespace

float PowerHeuristic(float drawn, float other) {
  if (drawn >= other) {
    if (!(drawn > 0)) return 0;
    const float ratio = other / drawn;
    return 1 / (1 + ratio * ratio);
  }
  const float ratio = drawn / other;
  return ratio * ratio / (1 + ratio * ratio);
}

Ray ShadowRay(const SurfacePoint& surface, const LightSample& light) {
  const Vec3 origin = LeavingPoint(surface, light.wi);
  if (light.is_distant) return {origin, light.wi, HUGE_VALF};
  return {origin, light.target - origin, kShadowEnd};
}

LitPoint LitPointOf(const SurfacePoint& surface, const Material& material, Vec3 wo) {
  if (Transmits(material)) return {surface.position};
  return {surface.position, FaceForward(surface.shading_normal, wo)};
}

Rgb LightSampledRadiance(const Intersector& intersector, const LightSet& lights,
                         const ShadingPoint& point, const SobolPoint& u, int& rays) {
  LightSample light;
  if (!lights.SampleDirect(LitPointOf(point.surface, point.material, point.wo),
                           FineChoice(u[3], u[7]), u[4], u[5], light))
    return {};
  const Vec3 wo = point.frame.ToLocal(point.wo);
  const Vec3 wi = point.frame.ToLocal(light.wi);
  // `share`: the probability with which eye paths scatter by this material or part.
  const auto reflected_by = [&](const Material& material, float share) {
    const Rgb bsdf = EvaluateBsdf(material, wo, wi, Carried::kRadiance);
    if (IsBlack(bsdf)) return Rgb{};
    Rgb reflected = bsdf * light.radiance_over_pdf * std::abs(wi.z);
    if (light.pdf > 0) {
      reflected *= PowerHeuristic(light.pdf, share * PdfBsdf(material, wo, wi));
    }
    return reflected;
  };
  Rgb radiance;
  if (point.share_of_first < 0) {
    radiance = reflected_by(point.material, 1);
  } else {
    Material part;
    radiance = reflected_by(PartOf(point.material, Parts::kFirst, part), point.share_of_first);
    // What goes below is lit where it comes out.
    if (!point.material.ScattersBelow()) {
      radiance +=
          reflected_by(PartOf(point.material, Parts::kSecond, part), 1 - point.share_of_first);
    }
  }
  if (IsBlack(radiance)) return {};
  if (!point.sides.MayBeLit(point.surface, point.wo, light.wi, wo.z * wi.z < 0)) return {};
  const Ray shadow = ShadowRay(point.surface, light);
  if (point.media != nullptr) {
    const std::int32_t medium = point.media->After(point.surface, point.wo, light.wi, point.medium);
    return radiance * point.media->Transmittance(shadow, medium, rays);
  }
  ++rays;
  return intersector.Occluded(shadow) ? Rgb{} : radiance;
}

}  // namespace lucerna
