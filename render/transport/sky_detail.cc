#include "render/transport/sky_detail.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "render/math/warp.h"

namespace lucerna {
namespace {

// The pixel of a square of directions that lies at (x, y), which may be one or a few beyond an
// edge: each edge meets itself, turned about its middle.
std::size_t Folded(int x, int y, int size) {
  const auto fold = [&](int& along, int& across) {
    if (along >= 0 && along < size) return;
    along = along < 0 ? -along - 1 : 2 * size - 1 - along;
    across = size - 1 - across;
  };
  fold(x, y);
  fold(y, x);
  return static_cast<std::size_t>(std::clamp(y, 0, size - 1)) * static_cast<std::size_t>(size) +
         static_cast<std::size_t>(std::clamp(x, 0, size - 1));
}

}  // namespace

SkyDetail::SkyDetail(const EnvironmentMap& sky)
    : sky_(sky),
      size_(sky.size()),
      texel_rad_(std::sqrt(4 * static_cast<double>(kPi)) / static_cast<double>(sky.size())) {
  const auto size = static_cast<std::size_t>(size_);
  std::vector<float> luminance;
  luminance.reserve(size * size);
  for (int y = 0; y < size_; ++y) {
    for (int x = 0; x < size_; ++x) {
      luminance.push_back(sky.TexelLuminance(x, y));
      mean_ += static_cast<double>(luminance.back());
    }
  }
  mean_ /= static_cast<double>(luminance.size());
  // A pixel's own steps are no detail of the light: 1 2 1 along both sides.
  blurred_.reserve(luminance.size());
  for (int y = 0; y < size_; ++y) {
    for (int x = 0; x < size_; ++x) {
      float sum = 0;
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
          const auto weight = static_cast<float>((2 - std::abs(dx)) * (2 - std::abs(dy)));
          sum += weight * luminance[Folded(x + dx, y + dy, size_)];
        }
      }
      blurred_.push_back(sum / 16);
    }
  }
}

double SkyDetail::BlurredLuminance(Vec3 direction) const {
  const Vec2 place = sky_.PlaceOf(direction);
  const float x = place.x * static_cast<float>(size_) - 0.5F;
  const float y = place.y * static_cast<float>(size_) - 0.5F;
  const int x0 = static_cast<int>(std::floor(x));
  const int y0 = static_cast<int>(std::floor(y));
  const double fx = static_cast<double>(x - static_cast<float>(x0));
  const double fy = static_cast<double>(y - static_cast<float>(y0));
  const auto at = [&](int dx, int dy) {
    return static_cast<double>(blurred_[Folded(x0 + dx, y0 + dy, size_)]);
  };
  return (at(0, 0) * (1 - fx) + at(1, 0) * fx) * (1 - fy) +
         (at(0, 1) * (1 - fx) + at(1, 1) * fx) * fy;
}

Spectrum SkyDetail::Source(Vec3 direction, const SpectrumLimits& limits) const {
  constexpr double kLargestStep = 0.5;  // [rad], of maps with few pixels
  const double step = std::min(texel_rad_, kLargestStep);
  const Frame frame(direction);
  const auto across = static_cast<float>(std::tan(step));
  const double here = BlurredLuminance(direction);
  double around = 0;
  for (const Vec3 offset : {frame.s, -frame.s, frame.t, -frame.t}) {
    around += BlurredLuminance(Normalize(direction + offset * across));
  }
  return EnvironmentSource((around - 4 * here) / (step * step), here, mean_, texel_rad_, limits);
}

}  // namespace lucerna
