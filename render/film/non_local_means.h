// What would an image be, were each pixel the mean of those that look alike?
//
// Non-local means: the weight of a pixel q for a pixel p follows from the mean squared difference
// of the patches around them, over its expectation were both the same but for noise, less 1. At 0
// and below, q weighs 1; at 3 k² nothing, where k is a strength. Where features are given, surfaces
// of other albedo, normal or depth weigh less, and those far off nothing.
// Sources: Buades, Coll & Morel 2005, "A Non-Local Algorithm for Image Denoising"; Rousselle,
// Knaus & Zwicker 2012, "Adaptive Rendering with Non-Local Means Filtering", with a polynomial in
// place of the exponential, and every image weighed by itself.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "render/base/parallel.h"

namespace lucerna {

using ColorColumns = std::array<std::vector<float>, 3>;  // [channel][height × width]

// What pixels show, row-major.
struct SurfaceFeatures {
  ColorColumns albedo, normal;
  // Of the mean normal: 0 where all of a pixel's paths meet the same plane, more where they meet
  // several, as through rough glass.
  std::vector<float> normal_variance;
  std::vector<float> distance;  // infinite where nothing was hit
};

// How far off pixels count, to each side, and of what half width patches are.
inline constexpr int kFilterReach = 8;
inline constexpr int kPatchReach = 2;

// Two independent images of the same view.
using ImageHalves = std::array<ColorColumns, 2>;

// Both filtered, by each of the strengths; each half by itself. `variance` is that of one half, and
// above 0. Without features nullptr. Requires columns of width × height, without anything that is
// not finite but distances.
[[nodiscard]] std::vector<ImageHalves> FilterHalves(
    int width, int height, const ImageHalves& halves, const ColorColumns& variance,
    const SurfaceFeatures* features, std::span<const float> strengths, ThreadTeam& team);

}  // namespace lucerna
