#include "render/tracing/pixel_sampler.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace lucerna {
namespace {

double GaussianAt(double x, double sigma) {
  return std::exp(-x * x / (2 * sigma * sigma));
}

// Mitchell & Netravali 1988, eq. (8), over a support of two radii of 1.
double MitchellAt(double x, double b, double c) {
  x = std::abs(2 * x);
  if (x <= 1) {
    return ((12 - 9 * b - 6 * c) * x * x * x + (-18 + 12 * b + 6 * c) * x * x + (6 - 2 * b)) / 6;
  }
  if (x <= 2) {
    return ((-b - 6 * c) * x * x * x + (6 * b + 30 * c) * x * x + (-12 * b - 48 * c) * x +
            (8 * b + 24 * c)) /
           6;
  }
  return 0;
}

// sin(πx) / (πx).
double SincAt(double x) {
  const double angle = std::numbers::pi * std::abs(x);
  return angle < 1e-5 ? 1 : std::sin(angle) / angle;
}

// The filter along one axis, not normalised.
double FilterAt(const PixelFilter& filter, double radius, double x) {
  switch (filter.kind) {
    case PixelFilter::Kind::kBox:
      return 1;
    case PixelFilter::Kind::kTriangle:
      return std::max(0.0, radius - std::abs(x));
    case PixelFilter::Kind::kGaussian:
      return std::max(0.0, GaussianAt(x, static_cast<double>(filter.sigma)) -
                               GaussianAt(radius, static_cast<double>(filter.sigma)));
    case PixelFilter::Kind::kMitchell:
      return MitchellAt(x / radius, static_cast<double>(filter.b), static_cast<double>(filter.c));
    case PixelFilter::Kind::kSinc:
      // Duchon 1979, "Lanczos Filtering in One and Two Dimensions".
      return SincAt(x) * SincAt(x / static_cast<double>(filter.window));
  }
  return 0;
}

}  // namespace

FilterSampler::FilterSampler(const PixelFilter& filter, float radius) : radius_(radius) {
  // Each cell gets the filter's mean over it; 16 midpoints leave an error far below a sample's.
  std::array<double, kCells> mass{};
  const auto r = static_cast<double>(radius);
  double total = 0;
  double absolute = 0;
  for (std::size_t i = 0; i < kCells; ++i) {
    for (int k = 0; k < 16; ++k) {
      const double x =
          r * (2 * (static_cast<double>(i) + (k + 0.5) / 16) / static_cast<double>(kCells) - 1);
      mass[i] += FilterAt(filter, r, x);
    }
    total += mass[i];
    absolute += std::abs(mass[i]);
  }
  double sum = 0;
  for (std::size_t i = 0; i < kCells; ++i) {
    sum += std::abs(mass[i]);
    cumulative_[i + 1] = static_cast<float>(sum / absolute);
    weight_[i] = static_cast<float>(std::copysign(absolute / total, mass[i]));
  }
  cumulative_[kCells] = 1;
  std::uint8_t cell = 0;
  static_assert(kCells - 1 <= UINT8_MAX);
  for (std::size_t i = 0; i < kCells; ++i) {
    const float u = static_cast<float>(i) / static_cast<float>(kCells);
    while (cell + 1U < kCells && cumulative_[cell + 1U] <= u)
      ++cell;
    first_cell_[i] = cell;
  }
}

float FilterSampler::Sample(float u, float& weight) const {
  std::size_t cell =
      first_cell_[std::min(static_cast<std::size_t>(u * static_cast<float>(kCells)), kCells - 1)];
  while (cell + 1 < kCells && cumulative_[cell + 1] <= u)
    ++cell;
  const float width = cumulative_[cell + 1] - cumulative_[cell];
  const float inside = width > 0 ? (u - cumulative_[cell]) / width : 0.5F;
  weight *= weight_[cell];
  return radius_ * (2 * (static_cast<float>(cell) + inside) / static_cast<float>(kCells) - 1);
}

FilterSampler::Values FilterSampler::At(float offset) const {
  const float place = (offset / radius_ + 1) * (0.5F * static_cast<float>(kCells));
  if (!(place >= 0 && place < static_cast<float>(kCells))) return {};
  const auto cell = static_cast<std::size_t>(place);
  const float density =
      (cumulative_[cell + 1] - cumulative_[cell]) * (static_cast<float>(kCells) / (2 * radius_));
  return {density, density * weight_[cell]};
}

}  // namespace lucerna
