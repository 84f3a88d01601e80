#include "render/transport/coat_walk.h"

#include <cstdint>
#include <vector>

#include "render/math/warp.h"
#include "render/transport/bsdf.h"
#include "render/transport/media.h"

namespace lucerna {
namespace {

constexpr std::uint64_t kKey = 0x434f4154ULL;

}  // namespace

CosineSums LagrangeAt(float cosine) {
  const auto at = static_cast<double>(cosine);
  CosineSums values;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const auto own = static_cast<double>(CoatTable::kMetalCosines[i]);
    double value = at / own;  // of the node 0
    for (std::size_t j = 0; j < values.size(); ++j) {
      const auto other = static_cast<double>(CoatTable::kMetalCosines[j]);
      if (j != i) value *= (at - other) / (own - other);
    }
    values[i] = value;
  }
  return values;
}

void Add(const CosineSums& sums, double factor, CosineSums& to) {
  for (std::size_t i = 0; i < sums.size(); ++i)
    to[i] += factor * sums[i];
}

Vec3 DirectionAt(float cosine, float azimuth) {
  const float sine = std::sqrt(std::max(0.0F, 1 - cosine * cosine));
  return {sine * std::cos(azimuth), sine * std::sin(azimuth), cosine};
}

Crossed CrossSurface(const MaterialNumbers& material, Vec3 w, float index, float u1, float u2) {
  Crossed crossed;
  float cos_t = 0;
  if (HasNoFacets(material)) {
    crossed.reflected = FresnelDielectric(w.z, index, cos_t);
    crossed.transmitted = 1 - crossed.reflected;
    crossed.back = {-w.x, -w.y, w.z};
    crossed.beyond = {-w.x / index, -w.y / index, cos_t};
    return crossed;
  }
  const Ggx ggx(material);
  const Vec3 m = ggx.SampleVisible(w, u1, u2);
  const float cos_m = Dot(w, m);
  if (!(cos_m > 0)) return crossed;
  const float fresnel = FresnelDielectric(cos_m, index, cos_t);
  const float visible = ggx.G1(w);
  crossed.back = ReflectAt(w, m);
  if (crossed.back.z > 0) crossed.reflected = fresnel * ggx.G2(w, crossed.back) / visible;
  const Vec3 through = w * (-1 / index) + m * (cos_m / index - cos_t);
  crossed.beyond = {through.x, through.y, -through.z};
  if (fresnel < 1 && crossed.beyond.z > 0) {
    crossed.transmitted = (1 - fresnel) * ggx.G2(w, crossed.beyond) / visible;
  }
  return crossed;
}

Crossed CrossSurface(const MaterialNumbers& material, Vec3 w, float index, KeyedRng& rng) {
  if (HasNoFacets(material)) return CrossSurface(material, w, index, 0, 0);
  const float u1 = rng.Uniform();
  return CrossSurface(material, w, index, u1, rng.Uniform());
}

void LayerWalk::ScatterFirst() {
  const float cosine = std::max(std::abs(direction_.z), 1e-6F);
  const float share = -std::expm1(-material_.thickness / cosine);
  weight_ *= static_cast<double>(share);
  Scatter(std::min(-std::log1p(-rng_.Uniform() * share) * cosine, material_.thickness));
}

void LayerWalk::Scatter(float along) {
  depth_ += direction_.z < 0 ? along : -along;
  const float u1 = rng_.Uniform();
  direction_ = SamplePhase(direction_, material_.phase_g, u1, rng_.Uniform());
  albedos_.Scatter();
  is_scattered_ = true;
  ++events_;
}

WalkNumbers::WalkNumbers(int walk, int node)
    : rng_(CombineKeys(CombineKeys(kKey, static_cast<std::uint64_t>(node)),
                       static_cast<std::uint64_t>(walk))) {
  static const std::vector<SobolPoint> kPoints = [] {
    std::vector<SobolPoint> points(kCoatWalks);
    for (std::size_t i = 0; i < points.size(); ++i)
      points[i] = OwenSobol(i, kKey);
    return points;
  }();
  even_ = kPoints[static_cast<std::size_t>(walk)];
  KeyedRng shifts(CombineKeys(kKey, static_cast<std::uint64_t>(node)));
  for (float& number : even_) {
    number += shifts.Uniform();
    if (number >= 1) number -= 1;
  }
}

MetalWalk::MetalWalk(const MaterialNumbers& material, float cosine, const WalkNumbers& numbers)
    : material_(material), numbers_(numbers), metal_(material.base_alpha_u, material.base_alpha_v) {
  first_ = Cross(DirectionAt(cosine, 2 * kPi * numbers_.Next()), material.ior);
}

Crossed MetalWalk::Cross(Vec3 w, float index) {
  const float u1 = numbers_.Next();
  return CrossSurface(material_, w, index, u1, numbers_.Next());
}

bool MetalWalk::Reflect(Vec3 from, Vec3& up, float& factor) {
  factor = 1;
  up = {-from.x, -from.y, from.z};
  Vec3 facet = {0, 0, 1};
  if (material_.base_alpha_u > 0 || material_.base_alpha_v > 0) {
    const float u1 = numbers_.Next();
    facet = metal_.SampleVisible(from, u1, numbers_.Next());
    up = ReflectAt(from, facet);
    if (!(up.z > 0)) return false;
    factor = metal_.G2(from, up) / metal_.G1(from);
  }
  Add(LagrangeAt(std::clamp(Dot(from, facet), 0.0F, 1.0F)), 1, cosines_);
  return true;
}

}  // namespace lucerna
