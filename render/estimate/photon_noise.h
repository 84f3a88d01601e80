// How much less do photons scatter over many passes than independent ones would?
//
// Photons are spaced evenly over the passes, so that light which they reach by few bounces has far
// less noise in the mean of all passes than the passes' differences suggest. Radii must not grow
// against noise that is not there (estimate/controllers/appm.cc).
#pragma once

#include <cstddef>
#include <vector>

#include "render/estimate/image_sums.h"

namespace lucerna {

// What the halves of the whole passes show of the noise of light by photons, in pixels that stand
// for the image: all, or of larger images fewer than 2^18 of them. Those without light are left
// out.
struct NoiseSample {
  struct Pixel {
    std::size_t index = 0;
    double luminance = 0;  // of all light
    double noise = 0;      // squared deviation of the mean of all passes
  };
  std::vector<Pixel> pixels;
  std::size_t stride = 1;  // pixels of the image that each stands for
  double floor = 0;        // RelativeErrorFloor
};
// Empty before the second pass.
[[nodiscard]] NoiseSample SampleNoise(const ImageSums& sums);

// Of the whole passes, two squared relative noises (estimate/relative_error.h), one over the other:
// what the halves' difference shows of the light by photons, over what all light would have if
// passes were independent. At most 1, and 1 where nothing is known: before the second pass, and
// in the dark. `sample` is SampleNoise(sums).
[[nodiscard]] double PhotonNoiseShare(const ImageSums& sums, const NoiseSample& sample);

// The same of blur (ImageSums::Pixel::even_bias): what the halves' difference shows of the noise of
// its mean, over what rounds would leave if they were independent. Few pixels hardly know it: the
// share is nearer to 1 the fewer there are.
[[nodiscard]] double BlurNoiseShare(const ImageSums& sums, const NoiseSample& sample);

// What is assumed where the image must not be looked at: pool has 0.25, corner 0.8 (256 passes).
inline constexpr double kUnguidedNoiseShare = 0.5;

}  // namespace lucerna
