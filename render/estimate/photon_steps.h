// How many photons do a job's passes have?
//
// Early passes have few, so that the first image comes soon. Later ones may have more: a pass costs
// an eye path a pixel however many photons it has, and what is best depends on which of the two
// the noise comes from. The number changes between rounds (estimate/rounds.h), and in steps of two.
#pragma once

#include <cstdint>
#include <vector>

#include "render/estimate/image_sums.h"

namespace lucerna {

// From `first_pass` on, passes have so many photons.
struct PhotonStep {
  std::uint64_t first_pass = 0;
  std::uint64_t photons_per_pass = 0;
  bool operator==(const PhotonStep&) const = default;
};
// In order of passes; the first is that of pass 0.
using PhotonSteps = std::vector<PhotonStep>;

// The photons of one pass. Requires steps.
[[nodiscard]] std::uint64_t PhotonsOf(const PhotonSteps& steps, std::uint64_t pass);
// The fewest passes from the first on that have so many photons together. Requires steps, with at
// least a photon a pass.
[[nodiscard]] std::uint64_t PassesFor(const PhotonSteps& steps, std::uint64_t photons);

// Where the variance of a pixel's passes comes from, as means over pixels, relative to the squared
// value.
struct VarianceSplit {
  double total = 0;    // of one pass
  double photons = 0;  // of that, what its photons bring
};
// Photons arrive one by one: N of them in a kernel vary by kernel_noise / N of their squared sum,
// where kernel_noise is the kernel's ∫K² times the area within reach over that of the kernel.
// Requires sums.passes() >= 2.
[[nodiscard]] VarianceSplit SplitVariance(const ImageSums& sums, double kernel_noise);

// How many times as many photons give the least variance for the time: with variances v and costs c
// of photons and eye paths, sqrt(v_photons c_eye / (v_eye c_photons)). As if infinitely many where
// all variance is of photons.
[[nodiscard]] double BestPhotonFactor(const VarianceSplit& split, double photons_per_pixel);

}  // namespace lucerna
