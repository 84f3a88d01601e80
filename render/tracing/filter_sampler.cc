#include "render/tracing/filter_sampler.h"

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

// Each halving makes the sums of weights even over twice as many passes. What has less than this
// is drawn more often than it needs, and noise does not feel it.
constexpr float kLeastNegativeShare = 1.0F / 256;

// The share of draws that negative weights of `negative` in all have beside positive ones of
// `positive`: the power of two with the smallest mean square of the weights.
float NegativeShare(double positive, double negative) {
  if (!(negative > 0)) return 0;
  const auto mean_square = [&](float share) {
    const auto q = static_cast<double>(share);
    return positive * positive / (1 - q) + negative * negative / q;
  };
  float share = 0.5F;
  while (share > kLeastNegativeShare && mean_square(share / 2) < mean_square(share))
    share /= 2;
  return share;
}

// The number in [0, 1) that `u` is within [low, low + width).
float Within(float u, float low, float width) {
  return std::min((u - low) / width, std::nextafter(1.0F, 0.0F));
}

}  // namespace

FilterSampler::Axis::Axis(const PixelFilter& filter, float radius) : radius_(radius) {
  // Each cell gets the filter's mean over it; 16 midpoints leave an error far below a sample's.
  std::array<double, kCells> mass{};
  const auto r = static_cast<double>(radius);
  double total = 0;
  for (std::size_t i = 0; i < kCells; ++i) {
    for (int k = 0; k < 16; ++k) {
      const double x =
          r * (2 * (static_cast<double>(i) + (k + 0.5) / 16) / static_cast<double>(kCells) - 1);
      mass[i] += FilterAt(filter, r, x);
    }
    total += mass[i];
  }
  for (const Sign sign : {Sign::kPositive, Sign::kNegative}) {
    Part& part = parts_[static_cast<std::size_t>(sign)];
    const auto of_cell = [&](std::size_t i) {
      return std::max(0.0, sign == Sign::kPositive ? mass[i] : -mass[i]);
    };
    double whole = 0;
    for (std::size_t i = 0; i < kCells; ++i)
      whole += of_cell(i);
    if (!(whole > 0)) continue;
    part.mass = whole / total;
    double sum = 0;
    for (std::size_t i = 0; i < kCells; ++i) {
      sum += of_cell(i);
      part.cumulative[i + 1] = static_cast<float>(sum / whole);
    }
    part.cumulative[kCells] = 1;
    std::uint8_t cell = 0;
    static_assert(kCells - 1 <= UINT8_MAX);
    for (std::size_t i = 0; i < kCells; ++i) {
      const float u = static_cast<float>(i) / static_cast<float>(kCells);
      while (cell + 1U < kCells && part.cumulative[cell + 1U] <= u)
        ++cell;
      part.first_cell[i] = cell;
    }
  }
}

float FilterSampler::Axis::Sample(Sign sign, float u) const {
  const Part& part = OfSign(sign);
  std::size_t cell = part.first_cell[std::min(
      static_cast<std::size_t>(u * static_cast<float>(kCells)), kCells - 1)];
  while (cell + 1 < kCells && part.cumulative[cell + 1] <= u)
    ++cell;
  const float width = part.cumulative[cell + 1] - part.cumulative[cell];
  const float inside = width > 0 ? (u - part.cumulative[cell]) / width : 0.5F;
  return radius_ * (2 * (static_cast<float>(cell) + inside) / static_cast<float>(kCells) - 1);
}

FilterSampler::Parts FilterSampler::Axis::At(float offset) const {
  const float place = (offset / radius_ + 1) * (0.5F * static_cast<float>(kCells));
  if (!(place >= 0 && place < static_cast<float>(kCells))) return {};
  const auto cell = static_cast<std::size_t>(place);
  const auto of_part = [&](const Part& part) {
    return (part.cumulative[cell + 1] - part.cumulative[cell]) *
           (static_cast<float>(kCells) / (2 * radius_)) * static_cast<float>(part.mass);
  };
  return {of_part(OfSign(Sign::kPositive)), of_part(OfSign(Sign::kNegative))};
}

FilterSampler::FilterSampler(const PixelFilter& filter)
    : x_(filter, filter.radius_x), y_(filter, filter.radius_y) {
  const double both_positive = x_.Mass(Sign::kPositive) * y_.Mass(Sign::kPositive);
  const double both_negative = x_.Mass(Sign::kNegative) * y_.Mass(Sign::kNegative);
  const double negative_x = x_.Mass(Sign::kNegative) * y_.Mass(Sign::kPositive);
  const double negative_y = x_.Mass(Sign::kPositive) * y_.Mass(Sign::kNegative);
  const double positive = both_positive + both_negative;
  const double negative = negative_x + negative_y;
  const float share = NegativeShare(positive, negative);
  const auto draws_of = [](float of_all, double mass, double first) {
    const auto q = static_cast<double>(of_all);
    return Draws{of_all, static_cast<float>(mass / q), static_cast<float>(q / mass),
                 static_cast<float>(first / mass)};
  };
  positive_ = draws_of(1 - share, positive, both_positive);
  if (share > 0) {
    negative_ = draws_of(share, negative, negative_x);
    negative_.weight = -negative_.weight;
  }
}

FilterSampler::Draw FilterSampler::Sample(float u, float v) const {
  // The negative weights' interval is the first. Within it, and beside it, what is positive along
  // y comes first.
  const bool is_negative = u < negative_.share;
  const Draws& draws = is_negative ? negative_ : positive_;
  u = Within(u, is_negative ? 0 : negative_.share, draws.share);
  const bool is_first = u < draws.first;
  u = is_first ? Within(u, 0, draws.first) : Within(u, draws.first, 1 - draws.first);
  const Sign y = is_first ? Sign::kPositive : Sign::kNegative;
  const Sign x = is_first == is_negative ? Sign::kNegative : Sign::kPositive;
  return {x_.Sample(x, u), y_.Sample(y, v), draws.weight};
}

}  // namespace lucerna
