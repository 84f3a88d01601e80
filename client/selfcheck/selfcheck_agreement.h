// Do two scenes whose images should be equal differ by more than their noise?
//
// Several renders of the one, with a seed each, give its mean and its variance in every tile of the
// image. Those of the other are compared with that, all tiles together: the sum of the squared
// differences of the means over what noise alone would make of it is distributed as F, and is given
// as the standard deviations of a normal variable (Paulson 1942). Noise exceeds 5 of them once in
// 3.5 million cases, and a tile that is off by about one and a half times its noise is found.
#pragma once

#include <span>

#include "render/base/status.h"
#include "render/image/image.h"

namespace lucerna {

inline constexpr double kMostDeviations = 5;

// The deviations of the channel, R, G or B, that has most of them. `base` has at least three images
// and `others` one, all of one size and with seeds of their own.
// Errors: INTERNAL when an image has not the size or the channels of the first.
[[nodiscard]] StatusOr<double> DeviationsBeyondNoise(std::span<const Image* const> base,
                                                     std::span<const Image* const> others);

}  // namespace lucerna
