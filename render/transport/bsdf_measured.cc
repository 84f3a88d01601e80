// Measured surfaces (scene/measured_table.h).
//
// A real surface scatters alike both ways, but tables with errors between their knots do not. The
// table is always that of the eye's direction, so that eye paths and photons see the same surface.
#include <algorithm>

#include "render/scene/measured_table.h"
#include "render/transport/bsdf_kinds.h"

namespace lucerna {
namespace {

// f(eye, light) [sr⁻¹], of directions on the outside.
Rgb ValueOf(const Material& material, Vec3 eye, Vec3 light) {
  constexpr float kLeastCosine = 1e-6F;
  return material.measured->Scattered(eye, light, material.measured_planes) /
         std::max(light.z, kLeastCosine);
}

}  // namespace

bool MeasuredBsdf::Sample(const Material& material, Vec3 wo, float /*u_lobe*/, float u1, float u2,
                          Carried carried, BsdfSample& sample) {
  const float side = wo.z < 0 ? -1.0F : 1.0F;
  if (wo.z == 0) return false;
  const Vec3 up = wo * side;
  const MeasuredTable::Drawn drawn = material.measured->Sample(up, u1, u2);
  if (!(drawn.wi.z > 0) || !(drawn.pdf > 0)) return false;
  sample.wi = drawn.wi * side;
  sample.pdf = drawn.pdf;
  const Rgb value =
      carried == Carried::kFlux ? ValueOf(material, drawn.wi, up) : ValueOf(material, up, drawn.wi);
  sample.weight = value * (drawn.wi.z / drawn.pdf);
  sample.is_delta = false;
  return true;
}

Rgb MeasuredBsdf::Evaluate(const Material& material, Vec3 wo, Vec3 wi, Carried carried) {
  if (!(wo.z * wi.z > 0)) return {};
  const float side = wo.z < 0 ? -1.0F : 1.0F;
  return carried == Carried::kFlux ? ValueOf(material, wi * side, wo * side)
                                   : ValueOf(material, wo * side, wi * side);
}

float MeasuredBsdf::Pdf(const Material& material, Vec3 wo, Vec3 wi) {
  if (!(wo.z * wi.z > 0)) return 0;
  const float side = wo.z < 0 ? -1.0F : 1.0F;
  return material.measured->Pdf(wo * side, wi * side);
}

Rgb MeasuredBsdf::Albedo(const Material& material) {
  return material.measured->Albedo(material.measured_planes);
}

float MeasuredBsdf::ReflectedShare(const Material& /*material*/, float /*cos_o*/) {
  return 1;
}

float MeasuredBsdf::ShareOfFirst(const Material& /*material*/, Vec3 /*wo*/) {
  return 1;
}

Rgb MeasuredBsdf::EyeFactor(const Material& /*material*/, Vec3 /*wo*/) {
  return {};
}

float MeasuredBsdf::PhotonFactor(const Material& /*material*/, Vec3 /*wi*/) {
  return 1;
}

}  // namespace lucerna
