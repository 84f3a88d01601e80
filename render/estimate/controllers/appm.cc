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
// counts too, as far as it is more than noise. What is surely more shrinks the radius for good. On
// an edge that takes hundreds of passes, for a hitpoint here and there is near it: what is likely
// more shrinks it too, until that is likely no longer.
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
    const Blur by_blur = BlurOf(memory, n, static_cast<double>(evidence.rounds));
    // The radius of least error, if that is below `radius`.
    const auto least = [&](double radius, double square) {
      if (!(square > 0)) return radius;
      // The least of roughness · squares / (n r²) + square r⁴.
      const double sixth = moments_.roughness * (memory[kSquares] / n) / (n * 2 * square);
      const double r2 = radius * radius;
      // Mostly it is not: a root less for every pixel.
      if (!(sixth < r2 * r2 * r2)) return radius;
      return std::min(radius, std::max(std::cbrt(std::sqrt(sixth)), smallest_));
    };
    double& largest = memory[kLargest];
    if (largest == 0) largest = now.radius;
    largest = least(largest, std::max(by_laplacian * by_laplacian, by_blur.sure));
    const double likely = std::clamp(least(largest, by_blur.likely), kMostShrink * evidence.radius,
                                     kMostGrowth * evidence.radius);
    next.radius = std::min(likely, largest);
    return next;
  }

  std::optional<TheorySlopes> Slopes() const override {
    return TheorySlopes{.noise = -2.0 / 3, .squared_bias = -2.0 / 3};
  }

 private:
  enum Memory : std::size_t { kLaplacian, kSquares, kBlur, kBlurSquares, kLargest, kNumbers };
  static constexpr double kSmallestShare = 0.01;
  // Blur counts from so many rounds on, and so many times its standard deviation is taken from it:
  // less than this is shown by noise in one of thousands of pixels.
  static constexpr double kFirstRounds = 8;
  static constexpr double kSureDeviations = 8;
  // Likely is what a normal mean exceeds by chance in one of 16,000 pixels; less is taken from it.
  static constexpr double kLikelyDeviations = 4;
  static constexpr double kDeviationsTaken = 3;
  // In one round, of the radius in use.
  static constexpr double kMostShrink = 0.6;
  static constexpr double kMostGrowth = 1.15;

  // Of the mean blur over the squared radius, squared: what is surely and what is likely there.
  struct Blur {
    double sure = 0, likely = 0;
  };
  static Blur BlurOf(std::span<const double> memory, double n, double rounds) {
    if (rounds < kFirstRounds) return {};
    const double mean = memory[kBlur] / n;
    const double square = mean * mean;
    // A round of k passes varies as one pass does, times k.
    const double variance = (memory[kBlurSquares] / n - square) / (rounds - 1);
    Blur blur;
    blur.sure = std::max(0.0, square - kSureDeviations * kSureDeviations * variance);
    // Few rounds do not know their variance: about Student's quantile for theirs.
    const double freedom = rounds - 1;
    const double quantile2 = freedom * std::expm1(kLikelyDeviations * kLikelyDeviations / freedom);
    if (square > quantile2 * variance) {
      blur.likely = square - kDeviationsTaken * kDeviationsTaken * variance;
    }
    return blur;
  }

  KernelMoments moments_;
  double smallest_;
};

}  // namespace

std::unique_ptr<RadiusController> MakeAppm(const RenderSettings& settings, float initial_radius) {
  return std::make_unique<Appm>(settings, initial_radius);
}

}  // namespace lucerna
