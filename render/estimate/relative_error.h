// Relative squared errors: error² / (value² + floor), where the floor follows the image.
//
// relMSE is the mean of this over the pixels and channels of an image. Without the floor a pixel
// that is nearly black would decide the mean. The floor is kFloorShare of the squared mean
// luminance of the image whose values are divided by, so that light scaled by any factor gives the
// same relative errors. The mean is taken over all pixels, black ones included, but for the
// brightest kBrightShare of the pixels that have any light: emitters in view, often 100 to 10,000
// times as bright as what they light, must not decide it. Counting that share among the lit pixels
// only leaves a floor above 0 also in an image that is mostly black.
#pragma once

#include <cstddef>
#include <span>

namespace lucerna {

inline constexpr double kFloorShare = 0.01;
inline constexpr double kBrightShare = 0.01;

// The floor for an image whose pixels have these luminances, in any order. Negative ones count as
// 0. Returns 0 if and only if no pixel is above 0: such an image has no relative error.
// Requires finite luminances.
[[nodiscard]] double RelativeErrorFloor(std::span<const double> luminances);

// One term of relMSE. Where there is neither a value nor a floor: 0 for no error, else infinite.
[[nodiscard]] constexpr double RelativeSquare(double squared_error, double value, double floor) {
  return squared_error == 0 ? 0 : squared_error / (value * value + floor);
}

// The share of pixels, those with the largest relative errors, that errors of images leave out.
inline constexpr double kTrimmedShare = 0.001;
// How many of `pixels` are left without `share` of them.
[[nodiscard]] constexpr std::size_t KeptPixels(std::size_t pixels, double share = kTrimmedShare) {
  return pixels - static_cast<std::size_t>(share * static_cast<double>(pixels));
}

}  // namespace lucerna
