#include <numbers>

#include "render/estimate/controllers/frequency_prediction.h"
#include "render/estimate/radius_controller.h"

namespace lucerna {
namespace {

// Takes the radius that makes noise and predicted bias together least, never below the one that
// keeps the bias within the tolerance.
class FrequencyMse final : public RadiusController {
 public:
  FrequencyMse(const RenderSettings& settings, float initial_radius)
      : prediction_(settings, initial_radius) {}

  std::size_t MemoryPerPixel() const override { return FrequencyPrediction::kNumbers + 1; }

  PixelRadius Next(const PixelRadius& now, const RoundEvidence& evidence,
                   const PassRange& /*passes*/, std::span<double> memory) const override {
    FrequencyPrediction::Add(evidence, memory);
    const double gathered = evidence.radius;
    double& photon_density = memory[FrequencyPrediction::kNumbers];
    photon_density += evidence.photons / (std::numbers::pi * gathered * gathered);
    const double radius = now.radius;
    const std::optional<BandwidthPrediction> prediction = prediction_.Predict(memory);
    // Until there is evidence the radius stays: at a photon or two a pass, tens of passes go by
    // before eight frequency photons have come, and a radius that shrank meanwhile could not grow
    // back.
    double next = radius;
    if (prediction && photon_density > 0) {
      next = StepToLeastError(radius, prediction->min_radius,
                              LeastErrorRadius(photon_density, kTypicalBias * prediction->trace,
                                               prediction_.moments()));
    }
    FrequencyPrediction::Fade(next * next / (radius * radius), memory);
    return {next, now.photons + evidence.photons};
  }

  bool Predicts() const override { return true; }
  std::optional<BandwidthPrediction> Predict(std::span<const double> memory) const override {
    return prediction_.Predict(memory);
  }

 private:
  // The predicted trace bounds the curvature of light; over a picture the bias is a tenth to a
  // third of that bound (measured on the scenes of one kind of light each). The bound keeps the
  // tolerance, the typical value is what the least error is looked for with.
  static constexpr double kTypicalBias = 0.25;

  FrequencyPrediction prediction_;
};

}  // namespace

std::unique_ptr<RadiusController> MakeFrequencyMse(const RenderSettings& settings,
                                                   float initial_radius) {
  return std::make_unique<FrequencyMse>(settings, initial_radius);
}

}  // namespace lucerna
