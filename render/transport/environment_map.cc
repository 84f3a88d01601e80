#include "render/transport/environment_map.h"

#include <algorithm>
#include <array>
#include <utility>

#include "render/base/status.h"
#include "render/math/color_space.h"
#include "render/math/equal_area_square.h"
#include "render/math/uplift.h"
#include "render/math/warp.h"
#include "render/transport/sky_detail.h"

namespace lucerna {
namespace {

// The density [sr⁻¹] of a direction from which light of this radiance comes.
float DensityOf(Rgb radiance, double mean_luminance) {
  const double share = static_cast<double>(Luminance(radiance)) / mean_luminance;
  return static_cast<float>(share) / (4 * kPi);
}

}  // namespace

EnvironmentMap::EnvironmentMap(const InfiniteLight& light, std::size_t number)
    : map_(light.map),
      number_(number),
      scale_(light.radiance),
      scale_now_(light.radiance),
      axes_(light.axes),
      size_(light.map->width),
      texels_(size_, map_->height, [this](int x, int y) {
        return Luminance(RadianceOf({x, y}));
      }) {
  LUCERNA_CHECK(map_->width == map_->height);
  std::array<double, 3> sum{};
  for (int y = 0; y < size_; ++y) {
    for (int x = 0; x < size_; ++x) {
      const Rgb radiance = RadianceOf({x, y});
      largest_ = std::max(largest_, MaxChannel(radiance));
      for (int c = 0; c < 3; ++c)
        sum[static_cast<std::size_t>(c)] += static_cast<double>(radiance[c]);
    }
  }
  const double texels = static_cast<double>(size_) * static_cast<double>(size_);
  mean_ = {static_cast<float>(sum[0] / texels), static_cast<float>(sum[1] / texels),
           static_cast<float>(sum[2] / texels)};
  mean_luminance_ = texels_.sum() / texels;
}

Rgb EnvironmentMap::RadianceOf(Texel texel) const {
  return ToWorking(map_->At(texel.x, texel.y)) * scale_;
}

Rgb EnvironmentMap::RadianceNow(Texel texel) const {
  if (uplift_ == nullptr) return RadianceOf(texel);
  return uplift_->Unbounded(map_->At(texel.x, texel.y)) * scale_now_;
}

Vec2 EnvironmentMap::PlaceOf(Vec3 direction) const {
  return EqualAreaPlace(
      {Dot(direction, axes_.x), Dot(direction, axes_.y), Dot(direction, axes_.z)});
}

EnvironmentMap::Texel EnvironmentMap::TexelOf(Vec3 direction) const {
  const Vec2 place = PlaceOf(direction);
  const auto index = [&](float coordinate) {
    return std::min(static_cast<int>(coordinate * static_cast<float>(size_)), size_ - 1);
  };
  return {index(place.x), index(place.y)};
}

Rgb EnvironmentMap::Radiance(Vec3 direction) const {
  return RadianceNow(TexelOf(direction));
}

float EnvironmentMap::PdfSolidAngle(Vec3 direction) const {
  return DensityOf(RadianceOf(TexelOf(direction)), mean_luminance_);
}

Vec3 EnvironmentMap::Sample(float u1, float u2) const {
  const auto [x, y] = texels_.Sample(u1, u2);
  const auto side = static_cast<float>(size_);
  const Vec3 local = EqualAreaDirection({x / side, y / side});
  return axes_.x * local.x + axes_.y * local.y + axes_.z * local.z;
}

bool EnvironmentMap::SampleEmission(const Emitter& emitter, const BoundingSphere& scene,
                                    const EmissionNumbers& u, Emission& emission) const {
  const Vec3 towards = Sample(u.direction1, u.direction2);
  const Texel texel = TexelOf(towards);
  const float pdf = DensityOf(RadianceOf(texel), mean_luminance_);
  if (!(pdf > 0)) return false;
  SetEnteringRay(towards, scene, u, emission.ray);
  emission.flux = RadianceNow(texel) * (kPi * scene.radius * scene.radius / (pdf * emitter.choice));
  return true;
}

EmissionNumbers EnvironmentMap::FindNumbers(const BoundingSphere& scene, Vec3 point,
                                            Vec3 direction) const {
  const Vec2 on_map = PlaceOf(direction);
  const auto side = static_cast<float>(size_);
  const Vec2 numbers = texels_.NumbersAt({on_map.x * side, on_map.y * side});
  const Vec2 place = EnteringPlace(direction, scene, point);
  return {place.x, place.y, numbers.x, numbers.y};
}

std::unique_ptr<const InfiniteSpectrum> EnvironmentMap::MeasureSpectrum() const {
  return std::make_unique<SkyDetail>(*this);
}

InfiniteEmissions MakeEnvironmentEmissions(const std::vector<InfiniteLight>& lights) {
  InfiniteEmissions emissions;
  for (std::size_t number = 0; number < lights.size(); ++number) {
    if (lights[number].kind != InfiniteLight::Kind::kEnvironment) continue;
    auto environment = std::make_shared<EnvironmentMap>(lights[number], number);
    if (!IsBlack(environment->MeanRadiance())) emissions.push_back(std::move(environment));
  }
  return emissions;
}

}  // namespace lucerna
