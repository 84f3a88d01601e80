#include "render/estimate/radius_controller.h"

namespace lucerna {
namespace {

// The first radius for ever: the estimate of a histogram, whose buckets are given, and of theory's
// kernels of a given width. Its bias stays.
class Fixed final : public RadiusController {
 public:
  PixelRadius Next(const PixelRadius& now, const RoundEvidence& evidence,
                   const PassRange& /*passes*/, std::span<double> /*memory*/) const override {
    return {now.radius, now.photons + evidence.photons};
  }

  std::optional<TheorySlopes> Slopes() const override {
    return TheorySlopes{.noise = -1, .squared_bias = 0};
  }
};

}  // namespace

std::unique_ptr<RadiusController> MakeFixed(const RenderSettings& /*settings*/,
                                            float /*initial_radius*/) {
  return std::make_unique<Fixed>();
}

}  // namespace lucerna
