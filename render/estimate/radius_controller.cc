#include "render/estimate/radius_controller.h"

#include <algorithm>
#include <cmath>

namespace lucerna {
namespace {

// Keeps a share alpha of the photons of each pass and the density with them.
// Source: Hachisuka, Ogaki & Jensen 2008, "Progressive Photon Mapping".
class Ppm final : public RadiusController {
 public:
  explicit Ppm(double alpha) : alpha_(alpha) {}

  PixelRadius Next(const PixelRadius& now, const PassEvidence& evidence,
                   std::uint64_t /*pass*/) const override {
    if (!(evidence.photons > 0)) return now;
    // The photons were gathered in a disc that may be larger than today's: count those that
    // today's would have held.
    const double shrink = static_cast<double>(now.radius) / static_cast<double>(evidence.radius);
    const double m = evidence.photons * shrink * shrink;
    const auto n = static_cast<double>(now.photons);
    const double kept = n + alpha_ * m;
    return {static_cast<float>(static_cast<double>(now.radius) * std::sqrt(kept / (n + m))),
            static_cast<float>(kept)};
  }

 private:
  double alpha_;
};

// The same shrinking for every pixel, whatever its photons.
// Source: Knaus & Zwicker 2011, "Progressive Photon Mapping: A Probabilistic Approach", eq. (18).
class Pppm final : public RadiusController {
 public:
  explicit Pppm(double alpha) : alpha_(alpha) {}

  PixelRadius Next(const PixelRadius& now, const PassEvidence& evidence,
                   std::uint64_t pass) const override {
    const auto i = static_cast<double>(pass + 1);
    return {static_cast<float>(static_cast<double>(now.radius) *
                               std::sqrt((i + alpha_) / (i + 1))),
            now.photons + static_cast<float>(evidence.photons)};
  }

 private:
  double alpha_;
};

}  // namespace

std::unique_ptr<RadiusController> MakeRadiusController(const RenderSettings& settings) {
  switch (settings.radius_controller) {
    case RadiusControllerKind::kPpm:
      return std::make_unique<Ppm>(settings.alpha);
    case RadiusControllerKind::kPppm:
      return std::make_unique<Pppm>(settings.alpha);
  }
  return nullptr;
}

}  // namespace lucerna
