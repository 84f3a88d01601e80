// How wrong is the image, without knowing the right one?
//
// Noise. Even and odd passes draw from sequences that are independent of each other, so the two
// halves of a render are two independent images, and a quarter of their squared difference is the
// squared noise of their mean, whatever the stratification within a half. In one pixel that is one
// number with one degree of freedom; over an image of thousands of pixels it is precise.
//
// Bias. The kernel blurs. Beside every sum with the whole kernel K goes one with the difference
// between K and the same kernel at kInnerShare of the radius: what the outer part of the blur
// changes, and, divided by 1 - kInnerShare², an estimate of all that it changes (exact for light
// whose second derivative is even across the disc). The product of the two halves' estimates is
// free of their noise. Where that product is too noisy, one of the two is smoothed over the pixels
// around it, which takes chance out of the product, and on steps some of the bias. How far around
// is chosen as by Lepskii 1991, "On a Problem of Adaptive Estimation in Gaussian White Noise": the
// widest that agrees with all narrower ones, none included. An inner kernel of a third finds 0.9 to
// 1.3 of the squared bias of a straight step at radii of 1 to 5 pixels.
// Source: Hachisuka, Jarosz & Jensen 2010, "A Progressive Error Estimation Framework for Photon
// Density Estimation", with kernels' differences in place of derivatives.
//
// Relative errors are squares over (value² + floor), and the value is not known either. For noise,
// what two halves and the pixels around agree on is one guess, the least of that and the pixel's
// own mean another, and the mean of what they give is used. For bias it matters on the dark side of
// a step, where the blur has made the value too large: a half's value less its estimated bias is
// used, but no less than the least of the pixels within a kernel's reach. While the estimated bias
// is mostly noise, less of it is taken off; what would come of all or nothing of it widens the
// interval.
//
// Both errors leave out the kTrimmedShare of pixels in which the relative error is largest, of the
// true error as of the estimated one: the mean of a squared relative error over an image is
// otherwise decided by a handful of pixels whose light came by one path in a million, of which no
// estimate knows anything until it has come.
//
// Interval. Squares vary by chance: that of a normal difference D by 2 E[D²]², which E[D⁴] tells,
// the product of two independent halves' biases by at most its own mean square. Neighbours share
// photons, so that the spread of a sum is larger by the area over which differences are alike
// (sum of the squares of their correlations, found in the differences themselves). The true
// squared error around its expectation spreads alike, and by its cross term of bias and noise. What
// the models above leave open is kModelError, and for the bias kLeastBias and kMostBias. Intervals
// are valid at all looks together: look j (from 1) spends SpentAt(j) of the error probability.
// Source: the stitching of Howard, Ramdas, McAuliffe & Sekhon 2021, "Time-uniform, nonparametric,
// nonasymptotic confidence sequences", with looks as the epochs and normal tails within one.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "render/base/parallel.h"
#include "render/estimate/pass_weights.h"
#include "render/estimate/relative_error.h"

namespace lucerna {

// Sums of a colour over passes, in double.
using RgbSum = std::array<double, 3>;
[[nodiscard]] constexpr double LuminanceOf(const RgbSum& c) {
  return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
}

// An expected squared error and its parts.
struct SquaredError {
  double noise = 0;
  double bias = 0;
  // Interval in which the true squared error of this image lies.
  double low = 0, high = 0;

  [[nodiscard]] double total() const { return noise + bias; }
};

struct ErrorEstimate {
  // Mean over pixels and channels of error² / (value² + floor): what ImageMetrics calls rel_mse
  // with a trim_share of kTrimmedShare. Infinite while the image is black: relative to nothing
  // there is no error, and the light may not have been found yet.
  SquaredError relative;
  // Mean of error² over the same pixels: the square of its rmse.
  SquaredError absolute;
  // The relative squared error of all pixels; no interval is known where rare light decides it.
  double untrimmed = 0;
  // How many pixels `relative` and `absolute` leave out.
  std::int64_t left_out_pixels = 0;
  // Squared noise over that of independent passes: below 1 where stratification over passes helps.
  double noise_factor = 1;
  // Number of pixels whose noise is alike.
  double noise_area = 1;
};

// What the models of noise may be off by, in the logarithm of the squared error: a seventh of the
// error. Most of it is light so rare that the halves have hardly seen it.
inline constexpr double kModelError = 0.3;

// What passes brought to one pixel, in the colours and the exposure of the image: weighted sums
// over passes.
struct PixelStatistics {
  std::array<float, 3> all{};
  std::array<float, 3> half_difference{};  // even passes less odd ones
  float squared_deviations = 0;            // of passes' luminances from their mean
  float even_bias = 0, odd_bias = 0;       // luminance, of even passes and of odd ones
  std::array<float, 3> bias_color{};       // of luminance 1
};
// Of all pixels, as columns, row-major: they are used up one by one.
struct ImageStatistics {
  ImageStatistics() = default;
  // All zero; passes weigh 1 each.
  ImageStatistics(int image_width, int image_height, std::int64_t image_passes);

  [[nodiscard]] std::size_t pixels() const { return squared_deviations.size(); }
  [[nodiscard]] PixelStatistics At(std::size_t pixel) const;
  void Set(std::size_t pixel, const PixelStatistics& statistics);

  int width = 0, height = 0;
  std::int64_t passes = 0;
  PassWeights weights;
  // [pixels] what PixelStatistics has by these names.
  std::array<std::vector<float>, 3> all, half_difference, bias_color;
  std::vector<float> squared_deviations, even_bias, odd_bias;
};

// Passes before the first look at the error: halves of two passes each.
inline constexpr std::int64_t kFirstCheckpoint = 4;
// After how many passes to estimate next. An estimate takes as long as a tenth of a pass, so there
// are few while passes are few: after twice as many passes, from 16 on after half as many again,
// from 64 on after a sixth more, and so always where the error is near a target, `near_target`.
[[nodiscard]] constexpr std::int64_t NextCheckpoint(std::int64_t passes, bool near_target) {
  const std::int64_t next = near_target || passes >= 64 ? passes * 7 / 6
                            : passes >= 16              ? passes * 3 / 2
                                                        : passes * 2;
  return next > passes ? next : passes + 1;
}

// The share of the error probability that look j (from 1) spends; of all looks the sum is 1.
[[nodiscard]] constexpr double SpentAt(int look) {
  return 3.0 / ((look + 2.0) * (look + 3.0));
}

// The share of runs in which the true error lies within the interval at all looks.
inline constexpr double kConfidence = 0.95;

// `look` counts the looks at this render, from 1. The result does not depend on the number of
// threads. Requires image.passes >= 2.
[[nodiscard]] ErrorEstimate EstimateError(ImageStatistics image, int look, ThreadTeam& team);

// Returns z with P(|Z| > z) = probability for a standard normal Z. Requires 0 < probability < 1.
[[nodiscard]] double TwoSidedNormalQuantile(double probability);

}  // namespace lucerna
