#include <cmath>

#include "render/estimate/radius_controller.h"

namespace lucerna {
namespace {

// The same shrinking for every pixel, whatever its photons.
// Source: Knaus & Zwicker 2011, "Progressive Photon Mapping: A Probabilistic Approach", eq. (18).
class Pppm final : public RadiusController {
 public:
  explicit Pppm(double alpha) : alpha_(alpha) {}

  PixelRadius Next(const PixelRadius& now, const RoundEvidence& evidence, const PassRange& passes,
                   std::span<double> /*memory*/) const override {
    return {now.radius * ScheduledShrink(alpha_, passes), now.photons + evidence.photons};
  }

  // radius² falls as passes^(alpha - 1).
  std::optional<TheorySlopes> Slopes() const override {
    return TheorySlopes{.noise = -alpha_, .squared_bias = -2 * (1 - alpha_)};
  }

 private:
  double alpha_;
};

}  // namespace

std::unique_ptr<RadiusController> MakePppm(const RenderSettings& settings,
                                           float /*initial_radius*/) {
  return std::make_unique<Pppm>(settings.alpha);
}

}  // namespace lucerna
