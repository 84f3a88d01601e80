#include <cmath>

#include "render/estimate/radius_controller.h"

namespace lucerna {
namespace {

// Keeps a share alpha of the photons of each pass and the density with them.
// Source: Hachisuka, Ogaki & Jensen 2008, "Progressive Photon Mapping".
class Ppm final : public RadiusController {
 public:
  explicit Ppm(double alpha) : alpha_(alpha) {}

  PixelRadius Next(const PixelRadius& now, const RoundEvidence& evidence,
                   const PassRange& /*passes*/, std::span<double> /*memory*/) const override {
    if (!(evidence.photons > 0)) return now;
    // The photons were gathered in a disc that may be larger than today's: count those that
    // today's would have held.
    const double shrink = now.radius / evidence.radius;
    const double m = evidence.photons * shrink * shrink;
    const double n = now.photons;
    const double kept = n + alpha_ * m;
    return {now.radius * std::sqrt(kept / (n + m)), kept};
  }

  // As for pppm: on average over a disc the radii are the same.
  std::optional<TheorySlopes> Slopes() const override {
    return TheorySlopes{.noise = -alpha_, .squared_bias = -2 * (1 - alpha_)};
  }

 private:
  double alpha_;
};

}  // namespace

std::unique_ptr<RadiusController> MakePpm(const RenderSettings& settings,
                                          float /*initial_radius*/) {
  return std::make_unique<Ppm>(settings.alpha);
}

}  // namespace lucerna
