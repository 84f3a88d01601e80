#include <algorithm>
#include <cmath>
#include <numbers>

#include "render/estimate/evidence.h"
#include "render/estimate/radius_controller.h"
#include "render/math/kernel.h"

namespace lucerna {
namespace {

// Takes the radius of least mean squared error for the bias that the photons themselves show, in
// two ways. Source: Kaplanyan & Dachsbacher 2013, "Adaptive Progressive Photon Mapping", restated.
// The Laplacian is that of a biweight kernel which stays wider than the estimate's by
// kCurvatureReach. By that its noise alone asks for a radius 1.5 times the present one, so even
// light is not shrunk for nothing. But on the rim of a bright spot a Laplacian passes through zero
// while the bias is largest, so what the kernel itself adds over one of a third of its radius
// counts too, as far as it is surely more than noise.
class Appm final : public RadiusController {
 public:
  Appm(const RenderSettings& settings, float initial_radius)
      : moments_(Kernel{settings.kernel}.Moments()),
        smallest_(kSmallestShare * static_cast<double>(initial_radius)) {}

  std::size_t MemoryPerPixel() const override { return kNumbers; }

  PixelRadius Next(const PixelRadius& now, const RoundEvidence& evidence, const PassRange& passes,
                   std::span<double> memory) const override {
    const double h = static_cast<double>(kCurvatureReach) * evidence.radius;
    const double h2 = h * h;
    // Sums over passes, per unit of flux: the Laplacian of the flux density, the density of
    // squares, and blur over the squared radius.
    memory[kLaplacian] +=
        kWeightUnit * evidence.columns[kCurvatureLaplacian] * 24 / (std::numbers::pi * h2 * h2);
    memory[kSquares] +=
        kWeight2Unit * evidence.columns[kCurvatureWeight2] / (std::numbers::pi * h2);
    const double blur = evidence.blur / (evidence.radius * evidence.radius);
    memory[kBlur] += blur;
    const auto of_round = static_cast<double>(passes.size());
    memory[kBlurSquares] += blur * blur / of_round;
    PixelRadius next = {now.radius, now.photons + evidence.photons};

    const auto n = static_cast<double>(passes.last);
    // Of the bias over the squared radius, squared.
    const double by_laplacian = moments_.mu2 / 2 * memory[kLaplacian] / n;
    const double square =
        std::max(by_laplacian * by_laplacian,
                 SureSquareOfBlur(memory, n, static_cast<double>(evidence.rounds)));
    if (square == 0) return next;
    // The least of roughness · squares / (n r²) + square r⁴.
    const double sixth = moments_.roughness * (memory[kSquares] / n) / (n * 2 * square);
    const double r2 = now.radius * now.radius;
    // Mostly it is not: a root less for every pixel.
    if (sixth < r2 * r2 * r2) {
      next.radius = std::min(next.radius, std::max(std::cbrt(std::sqrt(sixth)), smallest_));
    }
    return next;
  }

  std::optional<TheorySlopes> Slopes() const override {
    return TheorySlopes{.noise = -2.0 / 3, .squared_bias = -2.0 / 3};
  }

 private:
  enum Memory : std::size_t { kLaplacian, kSquares, kBlur, kBlurSquares, kNumbers };
  static constexpr double kSmallestShare = 0.01;
  // Blur counts from so many rounds on, and so many times its standard deviation is taken from it:
  // less than this is shown by noise in one of thousands of pixels.
  static constexpr double kFirstRounds = 8;
  static constexpr double kSureDeviations = 8;

  static double SureSquareOfBlur(std::span<const double> memory, double n, double rounds) {
    if (rounds < kFirstRounds) return 0;
    const double mean = memory[kBlur] / n;
    // A round of k passes varies as one pass does, times k.
    const double variance = (memory[kBlurSquares] / n - mean * mean) / (rounds - 1);
    return std::max(0.0, mean * mean - kSureDeviations * kSureDeviations * variance);
  }

  KernelMoments moments_;
  double smallest_;
};

}  // namespace

std::unique_ptr<RadiusController> MakeAppm(const RenderSettings& settings, float initial_radius) {
  return std::make_unique<Appm>(settings, initial_radius);
}

}  // namespace lucerna
