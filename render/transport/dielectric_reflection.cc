#include "render/transport/dielectric_reflection.h"

#include <algorithm>
#include <cmath>

#include "render/transport/coat.h"
#include "render/transport/microfacet.h"

namespace lucerna {
namespace {

bool ReflectionHalf(const Material& material, Vec3 wo, Vec3 wi, Vec3& m) {
  if (HasNoFacets(material) || !(wo.z * wi.z > 0)) return false;
  m = Up(wo) + Up(wi);
  const float squared = LengthSquared(m);
  if (squared == 0) return false;
  m = m / std::sqrt(squared);
  return true;
}

}  // namespace

bool SampleDielectricReflection(const Material& material, Vec3 wo, float u1, float u2,
                                BsdfSample& sample) {
  const float side = wo.z < 0 ? -1.0F : 1.0F;
  const Vec3 up = wo * side;
  float cos_t = 0;
  if (HasNoFacets(material)) {
    const float reflected = FresnelDielectric(up.z, material.ior, cos_t);
    sample = {{-wo.x, -wo.y, wo.z}, Gray(reflected), 0, true};
    return reflected > 0;
  }
  const Ggx ggx(material);
  const Vec3 m = ggx.SampleVisible(up, u1, u2);
  const Vec3 wi = ReflectAt(up, m);
  if (!(wi.z > 0)) return false;
  const float cos_m = Dot(up, m);
  const float reflected = FresnelDielectric(cos_m, material.ior, cos_t);
  sample.wi = wi * side;
  sample.pdf = ggx.PdfVisible(up, m) / (4 * cos_m);
  sample.weight = Gray(reflected * ggx.G2(up, wi) / ggx.G1(up));
  sample.is_delta = false;
  return sample.pdf > 0;
}

float EvaluateDielectricReflection(const Material& material, Vec3 wo, Vec3 wi) {
  Vec3 m;
  if (!ReflectionHalf(material, wo, wi, m)) return 0;
  const Ggx ggx(material);
  float cos_t = 0;
  return FresnelDielectric(Dot(Up(wo), m), material.ior, cos_t) * ggx.D(m) *
         ggx.G2(Up(wo), Up(wi)) / (4 * std::abs(wo.z * wi.z));
}

float PdfDielectricReflection(const Material& material, Vec3 wo, Vec3 wi) {
  Vec3 m;
  if (!ReflectionHalf(material, wo, wi, m)) return 0;
  return Ggx(material).PdfVisible(Up(wo), m) / (4 * std::max(1e-12F, Dot(Up(wo), m)));
}

}  // namespace lucerna
