#include "render/estimate/controllers/frequency_prediction.h"
#include "render/estimate/radius_controller.h"

namespace lucerna {
namespace {

// Of the consistent frequency controller, below the predicted radius.
constexpr double kConsistentAlpha = 0.95;

// Shrinks as PPM does until the radius that the frequency photons predict to keep the bias within
// the tolerance; from there a share `floor_alpha` of the photons is kept. With 1 the radius stays
// (the published rule: all photons kept, a bias within the tolerance for ever); below 1 the
// estimate is consistent. Source: Belcour & Soler 2011, "Frequency Based Kernel Estimation for
// Progressive Photon Mapping".
class FrequencyFloor final : public RadiusController {
 public:
  FrequencyFloor(const RenderSettings& settings, float initial_radius, double floor_alpha)
      : alpha_(settings.alpha), floor_alpha_(floor_alpha), prediction_(settings, initial_radius) {}

  std::size_t MemoryPerPixel() const override { return FrequencyPrediction::kNumbers; }

  PixelRadius Next(const PixelRadius& now, const RoundEvidence& evidence,
                   const PassRange& /*passes*/, std::span<double> memory) const override {
    FrequencyPrediction::Add(evidence, memory);
    if (!(evidence.photons > 0)) return now;
    const std::optional<BandwidthPrediction> prediction = prediction_.Predict(memory);
    const double radius = now.radius;
    const double shrink = radius / evidence.radius;
    const RadiusStep step =
        ShrinkToPrediction(now.photons, evidence.photons * shrink * shrink, radius,
                           prediction ? prediction->min_radius : 0, alpha_, floor_alpha_);
    FrequencyPrediction::Fade(step.kept_share, memory);
    return {step.radius, step.photons};
  }

  bool Predicts() const override { return true; }
  std::optional<BandwidthPrediction> Predict(std::span<const double> memory) const override {
    return prediction_.Predict(memory);
  }

  // Once its radius stays.
  std::optional<TheorySlopes> Slopes() const override {
    return floor_alpha_ == 1 ? std::optional(TheorySlopes{.noise = -1, .squared_bias = 0})
                             : std::nullopt;
  }

 private:
  double alpha_;
  double floor_alpha_;
  FrequencyPrediction prediction_;
};

}  // namespace

std::unique_ptr<RadiusController> MakeFrequency(const RenderSettings& settings,
                                                float initial_radius) {
  return std::make_unique<FrequencyFloor>(settings, initial_radius, 1);
}

std::unique_ptr<RadiusController> MakeFrequencyConsistent(const RenderSettings& settings,
                                                          float initial_radius) {
  return std::make_unique<FrequencyFloor>(settings, initial_radius, kConsistentAlpha);
}

}  // namespace lucerna
