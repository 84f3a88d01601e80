// How much light may an image lack because no photon has found its way yet?
//
// An estimate of noise knows nothing of light that has not been found. Of N photons that a light
// has sent, none landed in view: then, at 95 %, fewer than 3/N of its photons would, and the power
// that may be missing is at most 3/N of the light's. With k landed it is the upper limit of a
// Poisson number's mean, less what was found; from kEnoughPhotons on the halves of the render
// differ in that light, and its noise is part of the estimate. Source: Hanley & Lippman-Hand 1983,
// "If Nothing Goes Wrong, Is Everything All Right?".
//
// The bound falls with N alone while nothing is found, so the first checkpoint at which it is below
// a target is known beforehand: it spends its 5 % once, however many checkpoints there are.
//
// From power to an error of the image, assumed: a watt that lands in view brings as much radiance
// as the watts that were found there do. Which pixels it lands on is not assumed: the worst case
// counts (LargestRelativeError).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "render/estimate/accumulation.h"
#include "render/estimate/relative_error.h"

namespace lucerna {

// Photons in view, of one light and path class, from which on the estimate of noise is enough.
inline constexpr std::uint64_t kEnoughPhotons = 100;

// How many photons may be missing where `found` are in view: the 95 % upper limit of the mean of a
// Poisson number that was `found`, less `found`; 0 from kEnoughPhotons on. MissingPhotons(0) = 3.0.
[[nodiscard]] double MissingPhotons(std::uint64_t found);

// The largest mean over pixels of error² / truth², without the kTrimmedShare of pixels in which it
// is largest, when an even image lacks light of `share` of its mean, on any part of its pixels:
// share² / (4 (share + kTrimmedShare)), on the share + 2 kTrimmedShare of pixels where it does
// most.
[[nodiscard]] double LargestRelativeError(double share);
// The same of error² / mean², which is larger.
[[nodiscard]] double LargestAbsoluteError(double share);

// What is known of a light and of the photons that it has sent.
struct LightPhotons {
  double power_w = 0;
  LightTally tally;
};
// The part of an image on which photons land.
struct PhotonView {
  bool takes_photons = true;  // else no photon can be found there
  bool has_caustics = true;   // there are smooth surfaces
  // Means over pixels: radiance that photons brought, and radiance that a watt would bring, spread
  // evenly over the visible surfaces.
  double photon_radiance = 0;
  double radiance_per_watt = 0;
  double brightness = 0;  // radiance that errors are relative to
};

// By light, the share of the image's brightness that may be missing: infinite where the image is
// black.
[[nodiscard]] std::vector<double> MissingShares(std::span<const LightPhotons> lights,
                                                const PhotonView& view);

}  // namespace lucerna
