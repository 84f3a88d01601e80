// How much less do photons scatter over many passes than independent ones would?
//
// Photons are spaced evenly over the passes, so that light which they reach by few bounces has far
// less noise in the mean of all passes than the passes' differences suggest. Radii must not grow
// against noise that is not there (estimate/controllers/appm.cc).
#pragma once

#include "render/estimate/image_sums.h"

namespace lucerna {

// Of the whole passes, two squared relative noises (estimate/relative_error.h), one over the other:
// what the halves' difference shows of the light by photons, over what all light would have if
// passes were independent. At most 1, and 1 where nothing is known: before the second pass, and
// in the dark. Larger images are sampled at fewer than 2^18 pixels.
[[nodiscard]] double PhotonNoiseShare(const ImageSums& sums);

// What is assumed where the image must not be looked at: pool has 0.25, corner 0.8 (256 passes).
inline constexpr double kUnguidedNoiseShare = 0.5;

}  // namespace lucerna
