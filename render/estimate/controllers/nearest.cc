#include <algorithm>
#include <cmath>

#include "render/estimate/radius_controller.h"

namespace lucerna {
namespace {

// The radius within which the k nearest of all photons so far are expected, by the density of those
// that were found: the bandwidth of the k-nearest-neighbour estimate (Loftsgaarden & Quesenberry
// 1965, "A Nonparametric Estimate of a Multivariate Density Function"; Jensen 1996, "Global
// Illumination using Photon Maps"). Counts are sums, so no photon has to be kept or sent; the
// number that a disc really holds differs from k by its root or so. k grows as the number of passes
// to the power of 2/3, at which squared bias and noise of light on a surface fall alike (Mack &
// Rosenblatt 1979, "Multivariate k-nearest neighbor density estimates", for two dimensions).
class Nearest final : public RadiusController {
 public:
  std::size_t MemoryPerPixel() const override { return kNumbers; }

  PixelRadius Next(const PixelRadius& now, const RoundEvidence& evidence, const PassRange& passes,
                   std::span<double> memory) const override {
    // Photons within one unit radius, if their density is even.
    memory[kPhotons] += evidence.photons / (evidence.radius * evidence.radius);
    PixelRadius next = {now.radius, now.photons + evidence.photons};
    if (memory[kPhotons] > 0) {
      const double k = kPhotonsOfFirstPass * std::pow(static_cast<double>(passes.last), 2.0 / 3);
      next.radius = std::min(now.radius, std::sqrt(k / memory[kPhotons]));
    }
    return next;
  }

  std::optional<TheorySlopes> Slopes() const override {
    return TheorySlopes{.noise = -2.0 / 3, .squared_bias = -2.0 / 3};
  }

 private:
  enum Memory : std::size_t { kPhotons, kNumbers };
  // k for the photons of one pass. About as many lie in a disc of three pixels with a photon for
  // each.
  static constexpr double kPhotonsOfFirstPass = 28;
};

}  // namespace

std::unique_ptr<RadiusController> MakeNearest(const RenderSettings& /*settings*/,
                                              float /*initial_radius*/) {
  return std::make_unique<Nearest>();
}

}  // namespace lucerna
