// What the radius controllers that use frequency photons have in common.
#pragma once

#include <optional>
#include <span>

#include "render/estimate/evidence.h"
#include "render/estimate/radius_controller.h"
#include "render/frequency/bandwidth.h"
#include "render/math/kernel.h"

namespace lucerna {

// The sums over a pixel's frequency photons, kept over passes as FrequencySums in the controller's
// memory, and the radius that they predict. Lengths in unit radii.
class FrequencyPrediction {
 public:
  static constexpr std::size_t kNumbers = kFrequencyColumns;

  FrequencyPrediction(const RenderSettings& settings, float initial_radius)
      : bias_(settings.bias),
        moments_(Kernel{settings.kernel}.Moments()),
        range_{kSmallestShare * static_cast<double>(initial_radius),
               static_cast<double>(initial_radius)} {}

  [[nodiscard]] const KernelMoments& moments() const { return moments_; }

  // Takes in a pass, then lets what is older fade with the disc's area.
  static void Add(const RoundEvidence& evidence, std::span<double> memory) {
    if (evidence.columns.empty()) return;
    const double radius = evidence.radius;
    // Columns hold x = trace · radius²; memory holds traces, so that radii can change.
    const double to_trace = 1 / (radius * radius);
    const auto column = [&](FrequencyColumn c) { return evidence.columns[c]; };
    Store(Sums(memory) + FrequencySums{kWeightUnit * column(kFrequencyWeight),
                                       kWeight2Unit * column(kFrequencyWeight2),
                                       kWeightUnit * to_trace * column(kFrequencyTrace),
                                       kWeightUnit * to_trace * to_trace * column(kFrequencyTrace2),
                                       column(kFrequencyCount)},
          memory);
  }
  static void Fade(double area_ratio, std::span<double> memory) {
    Store(Sums(memory).Faded(area_ratio), memory);
  }

  [[nodiscard]] std::optional<BandwidthPrediction> Predict(std::span<const double> memory) const {
    const auto predicted = PredictTrace(Sums(memory), range_, bias_, moments_);
    if (!predicted) return std::nullopt;
    return BandwidthPrediction{predicted->trace, RadiusFor(bias_, predicted->trace, moments_)};
  }

 private:
  // Predictions are held above this share of the first radius.
  static constexpr double kSmallestShare = 0.01;

  static FrequencySums Sums(std::span<const double> memory) {
    return {memory[kFrequencyWeight], memory[kFrequencyWeight2], memory[kFrequencyTrace],
            memory[kFrequencyTrace2], memory[kFrequencyCount]};
  }
  static void Store(const FrequencySums& sums, std::span<double> memory) {
    memory[kFrequencyWeight] = sums.weight;
    memory[kFrequencyWeight2] = sums.weight2;
    memory[kFrequencyTrace] = sums.weighted_trace;
    memory[kFrequencyTrace2] = sums.weighted_trace2;
    memory[kFrequencyCount] = sums.photons;
  }

  double bias_;
  KernelMoments moments_;
  RadiusRange range_;
};

}  // namespace lucerna
