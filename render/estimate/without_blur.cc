#include "render/estimate/without_blur.h"

#include <algorithm>
#include <cmath>

namespace lucerna {
namespace {

// Fewer parts do not know their variance.
constexpr double kFewestParts = 8;
// In deviations of the bias: of less nothing is taken, for noise shows more in one pixel of 170; of
// more all is taken.
constexpr double kLeastTaken = 2.75;
constexpr double kAllTaken = 4.5;
constexpr double kSlope = kAllTaken / (kAllTaken - kLeastTaken);
// Of even light, by photons of one flux: the variance of the bias times their number, over the
// squared light. For Epanechnikov's kernel π (10 R - 2 ∫ K K') / (1 - a²)², where K' is the inner
// kernel, of a third of the width.
constexpr double kBiasNoise = 12;
// Photons differ in flux: as many count as this share of them. Before a bright one has come, what
// is missing in the middle of a disc looks like blur that hardly varies.
constexpr double kEffectiveShare = 1.0 / 3;
// What is left of the squared bias where all is taken off, over it: 0.02 to 0.08 at a straight
// step, for pixels of 2 to 1 radii of the inner kernel.
constexpr double kLeft = 0.05;

}  // namespace

WithoutBlur::WithoutBlur(const ImageSums& sums, const RadiusController& controller,
                         double noise_share, bool media_scatter)
    : sums_(sums),
      weight_(sums.weights().all()),
      passes_(static_cast<double>(sums.passes())),
      parts_(static_cast<double>(sums.parts())),
      noise_share_(noise_share) {
  if (!controller.RemovesBlur() || media_scatter || parts_ < kFewestParts) return;
  // About Student's quantile.
  const double freedom = parts_ - 1;
  least_ = std::sqrt(freedom * std::expm1(kLeastTaken * kLeastTaken / freedom));
}

ImageSums::Pixel WithoutBlur::At(std::size_t pixel) const {
  ImageSums::Pixel sum = sums_.At(pixel);
  const double luminance = WorkingLuminance(sum.photons);
  if (least_ == 0 || !(luminance > 0)) return sum;
  const double both = sum.even_bias + sum.odd_bias;
  const double bias = both / weight_;
  const double square = bias * bias;
  const double light = luminance / weight_;
  const double of_parts =
      noise_share_ * std::max((sum.bias_squares / weight_ - square) / (parts_ - 1), 0.0);
  const double of_photons =
      kBiasNoise * light * light / std::max(kEffectiveShare * sum.photon_count, 1.0);
  const double variance = std::max(of_parts, of_photons);
  if (!(square > least_ * least_ * variance)) return sum;
  const double least = least_ * std::sqrt(variance / square);
  double share = kSlope * (1 - least);
  const double slope = share < 1 ? kSlope : 1;
  share = std::min(share, 1.0);
  // No light is less than none.
  if (both > luminance) share = std::min(share, luminance / both);
  const double difference = sum.even_bias - sum.odd_bias;
  for (std::size_t c = 0; c < 3; ++c) {
    const double color = sum.photons[c] / luminance;
    sum.photons[c] -= share * both * color;
    sum.half_difference[c] -= share * difference * color;
  }
  sum.squared_deviations += share * share * of_parts * weight_ * (passes_ - 1);
  const double left = std::sqrt((1 - share) * (1 - share) + kLeft * share * share +
                                2 * of_parts / square * (slope - share));
  sum.even_bias *= left;
  sum.odd_bias *= left;
  return sum;
}

}  // namespace lucerna
