#include "render/estimate/missing_light.h"

#include <algorithm>
#include <cmath>

#include "render/estimate/error_estimate.h"

namespace lucerna {
namespace {

constexpr double kMissProbability = 0.05;

// P(X <= found) of a Poisson number with this mean.
double AtMost(std::uint64_t found, double mean) {
  double term = std::exp(-mean);
  double sum = term;
  for (std::uint64_t i = 1; i <= found; ++i) {
    term *= mean / static_cast<double>(i);
    sum += term;
  }
  return sum;
}

}  // namespace

double MissingPhotons(std::uint64_t found) {
  if (found >= kEnoughPhotons) return 0;
  const auto k = static_cast<double>(found);
  double low = k;
  double high = 2 * k + 10;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (AtMost(found, middle) > kMissProbability ? low : high) = middle;
  }
  return high - k;
}

double LargestRelativeError(double share) {
  if (!(share > 0)) return 0;
  constexpr double kTrimmed = kTrimmedShare;
  // On a share s of the pixels the truth is 1 + share / s, and the error share / s. Of
  // (s - trimmed) share² / (s + share)² the largest is at s = share + 2 trimmed.
  if (share + 2 * kTrimmed >= 1) {
    const double lost = 1 / (1 + 1 / share);
    return (1 - kTrimmed) * lost * lost;
  }
  return share * share / (4 * (share + kTrimmed));
}

double LargestAbsoluteError(double share) {
  // Of (s - trimmed) share² / s² the largest is at s = 2 trimmed.
  return share > 0 ? share * share / (4 * kTrimmedShare) : 0;
}

std::vector<double> MissingShares(std::span<const LightPhotons> lights, const PhotonView& view) {
  std::vector<double> shares(lights.size());
  if (!view.takes_photons) return shares;
  double found_w = 0;
  std::uint64_t found = 0;
  for (const LightPhotons& light : lights) {
    for (const std::uint64_t in_view : light.tally.in_view) {
      if (light.tally.sent == 0) continue;
      found_w +=
          light.power_w * static_cast<double>(in_view) / static_cast<double>(light.tally.sent);
      found += in_view;
    }
  }
  double per_watt = found_w > 0 ? view.photon_radiance / found_w : 0;
  // Few photons tell little of what a watt brings.
  if (found < kEnoughPhotons) per_watt = std::max(per_watt, view.radiance_per_watt);
  for (std::size_t i = 0; i < lights.size(); ++i) {
    const LightPhotons& light = lights[i];
    double missing = 0;
    for (const PathClass path : kAllPathClasses) {
      if (path == PathClass::kCaustic && !view.has_caustics) continue;
      missing += MissingPhotons(light.tally.InView(path));
    }
    if (missing == 0) continue;
    const double of_power =
        light.tally.sent == 0 ? 1 : std::min(1.0, missing / static_cast<double>(light.tally.sent));
    shares[i] =
        view.brightness > 0 ? light.power_w * of_power * per_watt / view.brightness : HUGE_VAL;
  }
  return shares;
}

}  // namespace lucerna
