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
// A radius that is not shrunk grows beyond the first one, and comes back as evidence comes in: to
// that of least error where what noise may hide of the Laplacian is added to it, and where noise is
// what the halves of the image show, which may be far less than that of independent photons. It is
// used times a factor for the whole image, which knows bias that no pixel is sure of
// (estimate/radius_scale.h).
class Appm final : public RadiusController {
 public:
  Appm(const RenderSettings& settings, float initial_radius)
      : moments_(Kernel{settings.kernel}.Moments()),
        first_(static_cast<double>(initial_radius)),
        smallest_(kSmallestShare * first_) {}

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
    const double radius2 = Square(evidence.radius / first_);
    memory[kInverseSixths] += of_round / (radius2 * radius2 * radius2);
    // Rounds weigh by their photons and by what their radii show of the bias of wider ones.
    const double weight = evidence.photons_per_pass * radius2;
    memory[kEvenBias] += weight * evidence.even_bias;
    memory[kOddBias] += weight * evidence.odd_bias;
    memory[kFourths] += weight * of_round * radius2;
    PixelRadius next = {now.radius, now.photons + evidence.photons};

    const auto n = static_cast<double>(passes.last);
    // Of the bias over the squared radius, squared.
    const double by_laplacian = moments_.mu2 / 2 * memory[kLaplacian] / n;
    const Blur by_blur = BlurOf(memory, n, static_cast<double>(evidence.rounds));
    double& largest = memory[kLargest];
    double& free = memory[kFree];
    if (largest == 0) largest = free = first_;
    largest = Least(memory, n, largest, std::max(by_laplacian * by_laplacian, by_blur.sure));
    const double most_shrunk = kMostShrink * evidence.radius;
    const double shrunk = Least(memory, n, largest, by_blur.likely);
    const double likely = std::clamp(shrunk, most_shrunk, kMostGrowth * evidence.radius);
    next.radius = std::min(likely, largest);
    if (shrunk < evidence.scale * first_ || passes.last <= kPassesBeforeGrowth ||
        !(memory[kSquares] > 0)) {
      return next;
    }
    // Of the Laplacian of a biweight kernel.
    const double laplacian_noise = 192 / std::numbers::pi * (memory[kSquares] / n) *
                                   memory[kInverseSixths] /
                                   (n * n * Sixth(static_cast<double>(kCurvatureReach) * first_));
    const double square =
        std::max(by_laplacian * by_laplacian + moments_.mu2 * moments_.mu2 / 4 * laplacian_noise,
                 by_blur.more);
    const double crowded = now.radius * std::sqrt(kMostPhotons * n / next.photons);
    const double most = std::max(
        first_, std::min({kMostOfFirst * first_, kMostGrowth * free, crowded / evidence.scale}));
    free = std::max(first_, Least(memory, n, most, square, evidence.noise_share));
    const double grown = kMostGrowth * (now.radius < first_ ? evidence.radius : now.radius);
    next.radius = std::clamp(evidence.scale * free, most_shrunk, std::max(most_shrunk, grown));
    return next;
  }

  std::optional<ScaledRadius> Scaled(std::span<const double> memory,
                                     const PassesTaken& taken) const override {
    if (taken.passes < kPassesBeforeGrowth) return std::nullopt;
    const auto n = static_cast<double>(taken.passes);
    const double shrunk = Least(memory, n, memory[kLargest],
                                BlurOf(memory, n, static_cast<double>(taken.rounds)).likely);
    const double free = memory[kFree] / first_;
    // Half of the passes are even.
    const double bias = 2 * free * free / memory[kFourths];
    return ScaledRadius{.most = shrunk < first_ ? shrunk / memory[kFree] : 1,
                        .use = 1 / (free * std::cbrt(std::sqrt(memory[kInverseSixths] / n))),
                        .blurred = std::sqrt(std::sqrt(memory[kFourths] / taken.photons)) / free,
                        .even_bias = bias * memory[kEvenBias],
                        .odd_bias = bias * memory[kOddBias]};
  }

  // The published controllers show what their radii alone do.
  bool RemovesBlur() const override { return true; }

  std::optional<TheorySlopes> Slopes() const override {
    return TheorySlopes{.noise = -2.0 / 3, .squared_bias = -2.0 / 3};
  }

 private:
  enum Memory : std::size_t {
    kLaplacian,
    kSquares,
    kBlur,
    kBlurSquares,
    kInverseSixths,  // of radii over the first one
    // Over passes, that each weigh their photons: biases times squared radii, fourth powers of
    // radii, over the first one.
    kEvenBias,
    kOddBias,
    kFourths,
    kLargest,  // that sure evidence leaves, at most the first one
    kFree,     // without a factor for the image, at least the first one
    kNumbers
  };
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
  // Photons a pass are chosen before radii grow, by what the first passes show. Blur less so many
  // times its deviation holds growth back: with more, radii grow on edges, with less, noise alone
  // holds them. More photons in a disc, in the mean of the passes, take time for little less noise.
  static constexpr std::uint64_t kPassesBeforeGrowth = 8;
  static constexpr double kDeviationsInGrowth = 1.4;
  static constexpr double kMostPhotons = 60;

  // The radius of least error where noise is that of independent photons times `noise`, if that is
  // below `radius`.
  double Least(std::span<const double> memory, double n, double radius, double square,
               double noise = 1) const {
    if (!(square > 0)) return radius;
    // The least of noise · roughness · squares / (n r²) + square r⁴.
    const double sixth = noise * moments_.roughness * (memory[kSquares] / n) / (n * 2 * square);
    // Mostly it is not: a root less for every pixel.
    if (!(sixth < Sixth(radius))) return radius;
    return std::min(radius, std::max(std::cbrt(std::sqrt(sixth)), smallest_));
  }

  static double Square(double x) { return x * x; }
  static double Sixth(double x) { return x * x * x * x * x * x; }

  // Of the mean blur over the squared radius, squared: what is surely there, what is likely there,
  // and what is there rather than not.
  struct Blur {
    double sure = 0, likely = 0, more = 0;
  };
  static Blur BlurOf(std::span<const double> memory, double n, double rounds) {
    if (rounds < kFirstRounds) return {};
    const double mean = memory[kBlur] / n;
    const double square = mean * mean;
    // A round of k passes varies as one pass does, times k.
    const double variance = (memory[kBlurSquares] / n - square) / (rounds - 1);
    Blur blur;
    blur.sure = std::max(0.0, square - kSureDeviations * kSureDeviations * variance);
    blur.more = std::max(0.0, square - kDeviationsInGrowth * kDeviationsInGrowth * variance);
    // Few rounds do not know their variance: about Student's quantile for theirs.
    const double freedom = rounds - 1;
    const double quantile2 = freedom * std::expm1(kLikelyDeviations * kLikelyDeviations / freedom);
    if (square > quantile2 * variance) {
      blur.likely = square - kDeviationsTaken * kDeviationsTaken * variance;
    }
    return blur;
  }

  KernelMoments moments_;
  double first_, smallest_;
};

}  // namespace

std::unique_ptr<RadiusController> MakeAppm(const RenderSettings& settings, float initial_radius) {
  return std::make_unique<Appm>(settings, initial_radius);
}

}  // namespace lucerna
