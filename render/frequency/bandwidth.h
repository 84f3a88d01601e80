// How large may a kernel be, for what the spectra of the photons in it say?
//
// A kernel of radius r sees the light's curvature as bias, and few photons as noise. The spectral
// trace of the irradiance bounds its curvature, so it bounds the bias before a single photon is
// counted:
//
//   |relative bias| <= (mu2/2) tr r²                                                      eq. (1)
//
// The bound is relative to the local peak: where it is much brighter nearby, the bias relative to
// the dark place itself may be larger.
//
// All functions are pure; what they predict is finite for finite numbers. A relative bias is a
// share: 0.02 is 2 %.
//
// Source: after Belcour & Soler 2011, "Frequency Based Kernel Estimation for Progressive Photon
// Mapping"; the averages and the rule for least error are our own.
#pragma once

#include <optional>

#include "render/math/kernel.h"

namespace lucerna {

// Returns the radius [m] at which eq. (1) reaches `relative_bias`; very large for no trace.
[[nodiscard]] double RadiusFor(double relative_bias, double trace, const KernelMoments& kernel);
// Returns the trace [m⁻²] for which RadiusFor gives this radius.
[[nodiscard]] double TraceFor(double relative_bias, double radius_m, const KernelMoments& kernel);
// eq. (1).
[[nodiscard]] double RelativeBiasBound(double trace, double radius_m, const KernelMoments& kernel);

// What the frequency photons of one hitpoint add up to, each with the luminance of its weighted
// flux as weight.
struct FrequencySums {
  double weight = 0;           // Σw
  double weight2 = 0;          // Σw²
  double weighted_trace = 0;   // Σw tr
  double weighted_trace2 = 0;  // Σw tr²
  double photons = 0;          // how many

  // After the radius shrinks so that its disc keeps this share of its area, older photons fade:
  // most of them landed where the kernel no longer reaches. Their number stays.
  [[nodiscard]] FrequencySums Faded(double kept_share) const;
  [[nodiscard]] FrequencySums operator+(const FrequencySums& other) const;
};

// Below this many, or below kFewestEffective of equal weight, chance alone could say anything.
inline constexpr double kFewestFrequencyPhotons = 8;
inline constexpr double kFewestEffective = 4;

// The range that predictions are held in: never above the first radius, never below what no
// pixel can show.
struct RadiusRange {
  double smallest_m = 0;
  double largest_m = 0;
};

struct PredictedTrace {
  double trace = 0;              // mean plus one standard error [m⁻²]
  double effective_photons = 0;  // of equal weight
};

// The weighted mean of the photons' traces bounds the sum of their fields as each bounds its own.
// No value: too few photons, so shrink as without frequency photons.
[[nodiscard]] std::optional<PredictedTrace> PredictTrace(const FrequencySums& sums,
                                                         const RadiusRange& range,
                                                         double relative_bias,
                                                         const KernelMoments& kernel);

// One step of the published rule. Requires photons, new_photons >= 0.
struct RadiusStep {
  double kept_share = 1;  // f, of photons, flux and area
  double photons = 0;     // N
  double radius = 0;
};

// Above the predicted radius photons are kept as by PPM with `alpha`, but not below it; from
// there on with `alpha_below`. 1 is the published rule: every photon is kept and the bias stays. A
// value between alpha and 1 lets the radius go on to zero, slowly: consistent.
// No prediction: predicted_radius = 0, which is PPM.
[[nodiscard]] RadiusStep ShrinkToPrediction(double photons, double new_photons, double radius,
                                            double predicted_radius, double alpha,
                                            double alpha_below);

// (Σw)² / Σw²: how many photons of equal weight would be as noisy. 0 without any.
[[nodiscard]] double EffectivePhotons(double weight, double weight2);

// Returns the radius [m] of least mean squared error for photons of this density [m⁻²] (summed
// over passes): noise roughness/(density r²) against the square of eq. (1).
[[nodiscard]] double LeastErrorRadius(double photon_density, double trace,
                                      const KernelMoments& kernel);

// The next radius on the way to it: no lower than the predicted one, since below that bias is
// tolerated, and no more than 30 % lower at once. Never grows.
[[nodiscard]] double StepToLeastError(double radius, double predicted_radius,
                                      double least_error_radius);

}  // namespace lucerna
