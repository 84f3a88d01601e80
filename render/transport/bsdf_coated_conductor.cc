// A metal under a dielectric coat, on both sides of a surface. Equations as in transport/coat.h.
#include <algorithm>
#include <array>
#include <cmath>

#include "render/math/color_space.h"
#include "render/transport/bsdf_kinds.h"
#include "render/transport/bsdf_parts.h"
#include "render/transport/coat.h"
#include "render/transport/microfacet.h"

namespace lucerna {
namespace {

// Of what follows from the indices of a metal, which are those of Rec. 709's channels unless they
// are those of a pass's wavelengths: in the scene's colours.
Rgb InScene(const Material& material, Rgb of_indices) {
  return material.is_at_wavelengths ? of_indices : ToWorking(of_indices);
}

bool IsMirror(const Material& material) {
  return PropertiesOf(material).is_smooth && material.parts == Parts::kAll;
}

// What the metal reflects of light that comes to it through the coat, in the space of its indices.
Rgb MetalInCoat(const Material& material, float cosine) {
  const float outside = material.is_metal_in_coat ? 1 : material.ior;
  return FresnelConductor(cosine, material.eta * (1 / outside), material.k * (1 / outside));
}

// The share of the residual that is left when the metal absorbs: a power of its reflectance for
// each number of meetings. Of a layer that scatters, all directions together.
Rgb HazeColor(const Material& material) {
  // Light that meets the metal again comes more slanted than what comes first.
  constexpr float kMeanCosine = 0.6F;
  const Rgb metal = MetalInCoat(material, kMeanCosine);
  Rgb sum;
  for (int i = CoatTable::kHits; i > 0; --i)
    sum = metal * (sum + CoatShareOfHits(material, static_cast<std::size_t>(i)));
  return sum + CoatShareOfHits(material, 0);
}

// What the metal absorbs at CoatTable::kMetalCosines.
using Absorbed = std::array<Rgb, CoatTable::kMetalCosines.size()>;
Absorbed AbsorbedAtCosines(const Material& material) {
  Absorbed absorbed;
  for (std::size_t i = 0; i < absorbed.size(); ++i)
    absorbed[i] = Gray(1) - MetalInCoat(material, CoatTable::kMetalCosines[i]);
  return absorbed;
}

// A mean over cosines; where these are added to others, of what is added.
Rgb MeanOf(const Absorbed& absorbed, const CoatTable::CosineWeights& weights) {
  Rgb mean;
  for (std::size_t i = 0; i < absorbed.size(); ++i)
    mean += absorbed[i] * weights[i];
  return mean;
}

Rgb HeldInUnit(Rgb color) {
  return {std::clamp(color.r, 0.0F, 1.0F), std::clamp(color.g, 0.0F, 1.0F),
          std::clamp(color.b, 0.0F, 1.0F)};
}

// What is left of light that meets a metal as `meetings` says, one reflectance for all of them.
float LeftOf(const CoatMeetings& meetings, float reflectance) {
  const float more = reflectance * (1 - meetings.goes_on) / (1 - meetings.goes_on * reflectance);
  return reflectance * (meetings.once + (1 - meetings.once) * more);
}

// HazeColor of a layer that does not scatter, for light from a direction at `cosine`.
Rgb ResidualColor(const Material& material, const Absorbed& absorbed, float cosine) {
  const CoatMeetings meetings = CoatMeetingsOf(material, cosine);
  const Rgb metal = HeldInUnit(Gray(1) - MeanOf(absorbed, CoatResidualCosines(material, cosine)));
  return {LeftOf(meetings, metal.r), LeftOf(meetings, metal.g), LeftOf(meetings, metal.b)};
}

// A smooth coat over a smooth metal: the sum over all orders, all in one direction.
Rgb MirrorReflectance(const Material& material, float cosine) {
  float cos_t = 0;
  const float reflected = FresnelDielectric(cosine, material.ior, cos_t);
  if (!(reflected < 1)) return Gray(reflected);
  // What one way down, to the metal and up brings back.
  const Rgb metal = MetalInCoat(material, cos_t) * Square(CoatCrossing(material, cos_t));
  Rgb sum;
  for (int i = 0; i < material.base_hits; ++i) {
    const Rgb before = sum;
    sum = metal * (Gray(1) + sum * reflected);
    if (sum == before) break;
  }
  return Gray(reflected) + InScene(material, sum * Square(1 - reflected));
}

// --- the lobes of what is scattered broadly

// Which of them there are, and the probabilities with which they are drawn.
struct Lobes {
  float coat = 0;      // what facets of the coat reflect
  float base = 0;      // what meets the metal once
  float residual = 0;  // the rest: by facets that are wider, or, with haze, diffuse
};

Lobes LobesOf(const Material& material, Vec3 up) {
  // Facets that are turned away may reflect far more than the surface as a whole.
  constexpr float kLeastShare = 0.02F;
  float cos_t = 0;
  const float metal = MaxChannel(MetalInCoat(material, 1));
  Lobes lobes;
  if (!HasNoFacets(material) && material.parts == Parts::kAll) {
    lobes.coat = std::max(kLeastShare, FresnelDielectric(up.z, material.ior, cos_t));
  }
  lobes.base = std::max(kLeastShare, metal * CoatEntering(material, up));
  const Rgb residual = CoatResidual(material, up.z);
  lobes.residual = material.HasHaze() ? MaxChannel(residual * HazeColor(material))
                                      : residual.g * LeftOf(CoatMeetingsOf(material, up.z), metal);
  const float sum = lobes.coat + lobes.base + lobes.residual;
  return {lobes.coat / sum, lobes.base / sum, lobes.residual / sum};
}

// The half vector of two directions on the upper side; false where there is none.
bool Half(Vec3 a, Vec3 b, Vec3& m) {
  m = a + b;
  const float squared = LengthSquared(m);
  if (squared == 0) return false;
  m = m / std::sqrt(squared);
  return true;
}

// Of both, on the upper side.
float PdfUp(const Material& material, Vec3 up, Vec3 wi) {
  const Lobes lobes = LobesOf(material, up);
  float pdf = material.HasHaze() ? lobes.residual * wi.z * kInversePi : 0;
  Vec3 m;
  if (lobes.coat > 0 && Half(up, wi, m)) {
    pdf += lobes.coat * Ggx(material).PdfVisible(up, m) / (4 * std::max(1e-12F, Dot(up, m)));
  }
  Vec3 up_in;
  Vec3 wi_in;
  if (CoatRefracted(material, up, up_in) && CoatRefracted(material, wi, wi_in) &&
      Half(up_in, wi_in, m)) {
    float visible = lobes.base * BaseFacets(material).PdfVisible(up_in, m);
    if (!material.HasHaze()) visible += lobes.residual * AgainFacets(material).PdfVisible(up_in, m);
    const float inside = visible / (4 * std::max(1e-12F, Dot(up_in, m)));
    // Snell's law, of solid angles.
    pdf += inside * wi.z / (Square(material.ior) * wi_in.z);
  }
  return pdf;
}

Rgb EvaluateUp(const Material& material, Vec3 up, Vec3 wi) {
  float coat = 0;
  Vec3 m;
  if (!HasNoFacets(material) && material.parts == Parts::kAll && Half(up, wi, m)) {
    const Ggx ggx(material);
    float cos_t = 0;
    coat = FresnelDielectric(Dot(up, m), material.ior, cos_t) * ggx.D(m) * ggx.G2(up, wi) /
           (4 * up.z * wi.z);
  }
  Rgb below;
  Vec3 up_in;
  Vec3 wi_in;
  if (CoatRefracted(material, up, up_in) && CoatRefracted(material, wi, wi_in) &&
      Half(up_in, wi_in, m)) {
    const Ggx ggx = BaseFacets(material);
    const float jacobian = 1 / (4 * up_in.z * wi_in.z * Square(material.ior));
    const Absorbed absorbed = material.HasHaze() ? Absorbed() : AbsorbedAtCosines(material);
    Rgb metal = MetalInCoat(material, Dot(up_in, m));
    if (!HasNoFacets(material) && !material.HasHaze()) {
      metal = HeldInUnit(metal - MeanOf(absorbed, CoatOnceCosines(material, up.z)) -
                         MeanOf(absorbed, CoatOnceCosines(material, wi.z)));
    }
    below = metal * (ggx.D(m) * ggx.G2(up_in, wi_in) * jacobian * CoatEntering(material, up) *
                     CoatEntering(material, wi));
    if (!material.HasHaze()) {
      const Ggx again = AgainFacets(material);
      const Rgb color =
          (ResidualColor(material, absorbed, up.z) + ResidualColor(material, absorbed, wi.z)) *
          0.5F;
      below += color * (again.D(m) * again.G2(up_in, wi_in) * jacobian * CoatAgain(material, up.z) *
                        CoatAgain(material, wi.z));
    }
  }
  if (!material.HasHaze()) return Gray(coat) + InScene(material, below);
  const Rgb mean = CoatMeanResidual(material);
  const Rgb residual = CoatResidual(material, up.z) * CoatResidual(material, wi.z) * kInversePi;
  const auto of_mean = [](float product, float of) { return of > 0 ? product / of : 0.0F; };
  below += HazeColor(material) * Rgb{of_mean(residual.r, mean.r), of_mean(residual.g, mean.g),
                                     of_mean(residual.b, mean.b)};
  return Gray(coat) + InScene(material, below);
}

bool SampleUp(const Material& material, Vec3 up, float u1, float u2, Vec3& wi) {
  const Lobes lobes = LobesOf(material, up);
  // u1 chooses a lobe, and what is left of it a direction.
  const auto rest = [](float u, float low, float share) {
    return std::clamp((u - low) / share, 0.0F, 0x1.fffffep-1F);
  };
  if (u1 < lobes.coat) {
    wi = ReflectAt(up, Ggx(material).SampleVisible(up, rest(u1, 0, lobes.coat), u2));
  } else if (const bool is_base = u1 < lobes.coat + lobes.base; is_base || !material.HasHaze()) {
    Vec3 up_in;
    if (!CoatRefracted(material, up, up_in)) return false;
    const Vec3 m =
        is_base ? BaseFacets(material).SampleVisible(up_in, rest(u1, lobes.coat, lobes.base), u2)
                : AgainFacets(material).SampleVisible(
                      up_in, rest(u1, lobes.coat + lobes.base, lobes.residual), u2);
    const Vec3 wi_in = ReflectAt(up_in, m);
    // Beyond the critical angle nothing leaves at once.
    const float x = wi_in.x * material.ior;
    const float y = wi_in.y * material.ior;
    const float squared = 1 - x * x - y * y;
    if (!(wi_in.z > 0) || !(squared > 0)) return false;
    wi = {x, y, std::sqrt(squared)};
  } else {
    wi = SquareToCosineHemisphere(rest(u1, lobes.coat + lobes.base, 1 - lobes.coat - lobes.base),
                                  u2);
  }
  return wi.z > 0;
}

}  // namespace

bool CoatedConductorBsdf::Sample(const Material& material, Vec3 wo, float u_lobe, float u1,
                                 float u2, Carried carried, BsdfSample& sample) {
  if (wo.z == 0) return false;
  const Vec3 mirrored = {-wo.x, -wo.y, wo.z};
  if (IsMirror(material)) {
    sample = {mirrored, MirrorReflectance(material, std::abs(wo.z)), 0, true};
    return true;
  }
  if (HasNoFacets(material) && material.parts == Parts::kFirst) {
    float cos_t = 0;
    sample = {mirrored, Gray(FresnelDielectric(std::abs(wo.z), material.ior, cos_t)), 0, true};
    return sample.weight.g > 0;
  }
  if (HasNoFacets(material) && material.parts == Parts::kAll) {
    return SampleParts<CoatedConductorBsdf>(material, ShareOfFirst(material, wo), wo, u_lobe, u1,
                                            u2, carried, sample);
  }
  const Vec3 up = Up(wo);
  Vec3 wi;
  if (!SampleUp(material, up, u1, u2, wi)) return false;
  sample.pdf = PdfUp(material, up, wi);
  if (!(sample.pdf > 0)) return false;
  sample.wi = wo.z < 0 ? -wi : wi;
  sample.weight = EvaluateUp(material, up, wi) * (wi.z / sample.pdf);
  sample.is_delta = false;
  return true;
}

Rgb CoatedConductorBsdf::Evaluate(const Material& material, Vec3 wo, Vec3 wi, Carried /*carried*/) {
  if (!(wo.z * wi.z > 0) || PropertiesOf(material).is_smooth) return {};
  return EvaluateUp(material, Up(wo), Up(wi));
}

float CoatedConductorBsdf::Pdf(const Material& material, Vec3 wo, Vec3 wi) {
  if (!(wo.z * wi.z > 0) || PropertiesOf(material).is_smooth) return 0;
  const float pdf = PdfUp(material, Up(wo), Up(wi));
  const bool chooses = HasNoFacets(material) && material.parts == Parts::kAll;
  return chooses ? (1 - ShareOfFirst(material, wo)) * pdf : pdf;
}

Rgb CoatedConductorBsdf::Albedo(const Material& material) {
  if (material.parts == Parts::kFirst) return Gray(1);
  return InScene(material, MetalInCoat(material, 1));
}

float CoatedConductorBsdf::ReflectedShare(const Material& /*material*/, float /*cos_o*/) {
  return 1;
}

// About what each part scatters, as for a diffuse base.
float CoatedConductorBsdf::ShareOfFirst(const Material& material, Vec3 wo) {
  float cos_t = 0;
  const float coat = FresnelDielectric(std::abs(wo.z), material.ior, cos_t);
  const float base =
      CoatEntering(material, Up(wo)) * MaxChannel(MetalInCoat(material, std::max(0.1F, cos_t)));
  return base > 0 ? coat / (coat + base) : 1;
}

Rgb CoatedConductorBsdf::EyeFactor(const Material& /*material*/, Vec3 /*wo*/) {
  return {};
}

float CoatedConductorBsdf::PhotonFactor(const Material& /*material*/, Vec3 /*wi*/) {
  return 1;
}

}  // namespace lucerna
