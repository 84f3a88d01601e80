#include "render/frequency/bandwidth.h"

#include <algorithm>
#include <cmath>

namespace lucerna {
namespace {

// Keeps quotients finite: the sixth root of the smallest density is still a number.
constexpr double kSmallest = 1e-150;
constexpr double kLargest = 1e150;

double Positive(double x) {
  return std::clamp(x, kSmallest, kLargest);
}

}  // namespace

double RadiusFor(double relative_bias, double trace, const KernelMoments& kernel) {
  return std::sqrt(2 * std::clamp(relative_bias, 0.0, 1.0) / (kernel.mu2 * Positive(trace)));
}

double TraceFor(double relative_bias, double radius_m, const KernelMoments& kernel) {
  const double radius = std::clamp(radius_m, 1e-75, 1e75);
  return 2 * std::clamp(relative_bias, 0.0, 1.0) / (kernel.mu2 * radius * radius);
}

double RelativeBiasBound(double trace, double radius_m, const KernelMoments& kernel) {
  const double radius = std::clamp(radius_m, 0.0, 1e75);
  return kernel.mu2 / 2 * std::clamp(trace, 0.0, kLargest) * radius * radius;
}

FrequencySums FrequencySums::Faded(double kept_share) const {
  return {weight * kept_share, weight2 * kept_share, weighted_trace * kept_share,
          weighted_trace2 * kept_share, photons};
}

FrequencySums FrequencySums::operator+(const FrequencySums& other) const {
  return {weight + other.weight, weight2 + other.weight2, weighted_trace + other.weighted_trace,
          weighted_trace2 + other.weighted_trace2, photons + other.photons};
}

std::optional<PredictedTrace> PredictTrace(const FrequencySums& sums, const RadiusRange& range,
                                           double relative_bias, const KernelMoments& kernel) {
  const double effective = EffectivePhotons(sums.weight, sums.weight2);
  if (!(sums.photons >= kFewestFrequencyPhotons) || !(effective >= kFewestEffective)) {
    return std::nullopt;
  }
  const double mean = sums.weighted_trace / sums.weight;
  const double variance = std::max(sums.weighted_trace2 / sums.weight - mean * mean, 0.0);
  const double upper = mean + std::sqrt(variance / effective);
  const double low = TraceFor(relative_bias, range.largest_m, kernel);
  const double high = std::max(low, TraceFor(relative_bias, range.smallest_m, kernel));
  // Sums beyond the range of a number (inf - inf) mean a trace beyond all bounds.
  return PredictedTrace{std::isnan(upper) ? high : std::clamp(upper, low, high), effective};
}

RadiusStep ShrinkToPrediction(double photons, double new_photons, double radius,
                              double predicted_radius, double alpha, double alpha_below) {
  const double all = photons + new_photons;
  if (!(all > 0)) return {1, photons, radius};
  const bool above = radius > predicted_radius;
  double kept = (photons + (above ? alpha : alpha_below) * new_photons) / all;
  if (above) {
    const double floor = predicted_radius / radius;
    if (kept < floor * floor) return {floor * floor, all * floor * floor, predicted_radius};
  }
  kept = std::min(kept, 1.0);
  return {kept, all * kept, radius * std::sqrt(kept)};
}

double EffectivePhotons(double weight, double weight2) {
  return weight > 0 && weight2 > 0 ? weight * (weight / weight2) : 0;
}

double LeastErrorRadius(double photon_density, double trace, const KernelMoments& kernel) {
  // The sixth root of 2 R2 / (density mu2² tr²), taken apart so that no square overflows.
  return std::cbrt(std::sqrt(2 * kernel.roughness / Positive(photon_density)) /
                   (kernel.mu2 * Positive(trace)));
}

double StepToLeastError(double radius, double predicted_radius, double least_error_radius) {
  return std::min(radius, std::max({predicted_radius, least_error_radius, 0.7 * radius}));
}

}  // namespace lucerna
