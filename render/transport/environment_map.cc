#include "render/transport/environment_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

#include "render/base/status.h"
#include "render/math/color_space.h"
#include "render/math/equal_area_square.h"
#include "render/math/warp.h"
#include "render/transport/sky_detail.h"

namespace lucerna {
namespace {

// The place of `u` in [0, 1) among cumulative shares that end at 1: in units of cells.
template <typename Number>
float PlaceIn(std::span<const Number> cumulative, float u) {
  const auto value = static_cast<Number>(u);
  // The first whose share ends beyond u; a cell without a share never is.
  auto found = std::upper_bound(cumulative.begin(), cumulative.end(), value);
  if (found == cumulative.end()) --found;
  const auto cell = found - cumulative.begin();
  const Number before = cell == 0 ? Number{0} : *(found - 1);
  const Number within = *found > before ? (value - before) / (*found - before) : Number{0};
  return static_cast<float>(cell) + std::min(static_cast<float>(within), 0x1.fffffep-1F);
}

// The number in [0, 1] of which PlaceIn is `place`.
template <typename Number>
float NumberAt(std::span<const Number> cumulative, float place) {
  const auto cell = static_cast<std::size_t>(place);
  const Number before = cell == 0 ? Number{0} : cumulative[cell - 1];
  return static_cast<float>(before + (cumulative[cell] - before) *
                                         static_cast<Number>(place - static_cast<float>(cell)));
}

// The density [sr⁻¹] of a direction from which light of this radiance comes.
float DensityOf(Rgb radiance, double mean_luminance) {
  const double share = static_cast<double>(Luminance(radiance)) / mean_luminance;
  return static_cast<float>(share) / (4 * kPi);
}

}  // namespace

EnvironmentMap::EnvironmentMap(const InfiniteLight& light)
    : map_(light.map), scale_(light.radiance), axes_(light.axes), size_(light.map->width) {
  LUCERNA_CHECK(map_->width == map_->height);
  const auto size = static_cast<std::size_t>(size_);
  columns_.reserve(size * size);
  rows_.reserve(size);
  std::array<double, 3> sum{};
  double luminance = 0;
  std::vector<double> row(size);
  for (int y = 0; y < size_; ++y) {
    double row_luminance = 0;
    for (int x = 0; x < size_; ++x) {
      const Rgb radiance = RadianceOf({x, y});
      largest_ = std::max(largest_, MaxChannel(radiance));
      for (int c = 0; c < 3; ++c)
        sum[static_cast<std::size_t>(c)] += static_cast<double>(radiance[c]);
      row_luminance += static_cast<double>(Luminance(radiance));
      row[static_cast<std::size_t>(x)] = row_luminance;
    }
    for (const double before : row) {
      columns_.push_back(row_luminance > 0 ? static_cast<float>(before / row_luminance) : 1.0F);
    }
    luminance += row_luminance;
    rows_.push_back(luminance);
  }
  const double texels = static_cast<double>(size) * static_cast<double>(size);
  mean_ = {static_cast<float>(sum[0] / texels), static_cast<float>(sum[1] / texels),
           static_cast<float>(sum[2] / texels)};
  mean_luminance_ = luminance / texels;
  if (luminance > 0) {
    for (double& share : rows_)
      share /= luminance;
  }
}

Rgb EnvironmentMap::RadianceOf(Texel texel) const {
  return ToWorking(map_->At(texel.x, texel.y)) * scale_;
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
  return RadianceOf(TexelOf(direction));
}

float EnvironmentMap::PdfSolidAngle(Vec3 direction) const {
  return DensityOf(Radiance(direction), mean_luminance_);
}

Vec3 EnvironmentMap::Sample(float u1, float u2) const {
  const auto size = static_cast<std::size_t>(size_);
  const float y = PlaceIn<double>(rows_, u1);
  const auto row = std::min(static_cast<std::size_t>(y), size - 1);
  const float x = PlaceIn<float>(std::span(columns_).subspan(row * size, size), u2);
  const auto side = static_cast<float>(size_);
  const Vec3 local = EqualAreaDirection({x / side, y / side});
  return axes_.x * local.x + axes_.y * local.y + axes_.z * local.z;
}

bool EnvironmentMap::SampleEmission(const Emitter& emitter, const BoundingSphere& scene,
                                    const EmissionNumbers& u, Emission& emission) const {
  const Vec3 towards = Sample(u.direction1, u.direction2);
  const Rgb radiance = Radiance(towards);
  const float pdf = DensityOf(radiance, mean_luminance_);
  if (!(pdf > 0)) return false;
  SetEnteringRay(towards, scene, u, emission.ray);
  emission.flux = radiance * (kPi * scene.radius * scene.radius / (pdf * emitter.choice));
  return true;
}

EmissionNumbers EnvironmentMap::FindNumbers(const BoundingSphere& scene, Vec3 point,
                                            Vec3 direction) const {
  const auto size = static_cast<std::size_t>(size_);
  const auto side = static_cast<float>(size_);
  const Vec2 on_map = PlaceOf(direction);
  const Vec2 place = EnteringPlace(direction, scene, point);
  const float y = std::min(on_map.y * side, std::nextafter(side, 0.0F));
  const float x = std::min(on_map.x * side, std::nextafter(side, 0.0F));
  const auto row = static_cast<std::size_t>(y);
  return {place.x, place.y, NumberAt<double>(rows_, y),
          NumberAt<float>(std::span(columns_).subspan(row * size, size), x)};
}

std::unique_ptr<const InfiniteSpectrum> EnvironmentMap::MeasureSpectrum() const {
  return std::make_unique<SkyDetail>(*this);
}

InfiniteEmissions MakeEnvironmentEmissions(const std::vector<InfiniteLight>& lights) {
  InfiniteEmissions emissions;
  for (const InfiniteLight& light : lights) {
    if (light.kind != InfiniteLight::Kind::kEnvironment) continue;
    auto environment = std::make_shared<EnvironmentMap>(light);
    if (!IsBlack(environment->MeanRadiance())) emissions.push_back(std::move(environment));
  }
  return emissions;
}

}  // namespace lucerna
