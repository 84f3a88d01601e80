#include "render/estimate/radius_controller.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "render/estimate/evidence.h"
#include "render/estimate/kernel.h"
#include "render/frequency/bandwidth.h"

namespace lucerna {
namespace {

// Keeps a share alpha of the photons of each pass and the density with them.
// Source: Hachisuka, Ogaki & Jensen 2008, "Progressive Photon Mapping".
class Ppm final : public RadiusController {
 public:
  explicit Ppm(double alpha) : alpha_(alpha) {}

  PixelRadius Next(const PixelRadius& now, const PassEvidence& evidence, std::uint64_t /*pass*/,
                   std::span<double> /*memory*/) const override {
    if (!(evidence.photons > 0)) return now;
    // The photons were gathered in a disc that may be larger than today's: count those that
    // today's would have held.
    const double shrink = now.radius / evidence.radius;
    const double m = evidence.photons * shrink * shrink;
    const double n = now.photons;
    const double kept = n + alpha_ * m;
    return {now.radius * std::sqrt(kept / (n + m)), kept};
  }

 private:
  double alpha_;
};

// The same shrinking for every pixel, whatever its photons.
// Source: Knaus & Zwicker 2011, "Progressive Photon Mapping: A Probabilistic Approach", eq. (18).
class Pppm final : public RadiusController {
 public:
  explicit Pppm(double alpha) : alpha_(alpha) {}

  PixelRadius Next(const PixelRadius& now, const PassEvidence& evidence, std::uint64_t pass,
                   std::span<double> /*memory*/) const override {
    const auto i = static_cast<double>(pass + 1);
    return {now.radius * std::sqrt((i + alpha_) / (i + 1)), now.photons + evidence.photons};
  }

 private:
  double alpha_;
};

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

  PixelRadius Next(const PixelRadius& now, const PassEvidence& evidence, std::uint64_t /*pass*/,
                   std::span<double> memory) const override {
    const double h = static_cast<double>(kCurvatureReach) * evidence.radius;
    const double h2 = h * h;
    const auto column = [&](CurvatureColumn c) {
      return kWeightUnit * static_cast<double>(evidence.columns[c]);
    };
    // Per pass and unit of flux: the Laplacian of the flux density, the density of squares, and
    // blur over the squared radius.
    memory[kLaplacian] += column(kCurvatureLaplacian) * 24 / (std::numbers::pi * h2 * h2);
    memory[kSquares] += column(kCurvatureWeight2) / (std::numbers::pi * h2);
    const double blur = evidence.blur / (evidence.radius * evidence.radius);
    memory[kBlur] += blur;
    memory[kBlurSquares] += blur * blur;
    memory[kPasses] += 1;
    PixelRadius next = {now.radius, now.photons + evidence.photons};

    const double n = memory[kPasses];
    // Of the bias over the squared radius, squared.
    const double by_laplacian = moments_.mu2 / 2 * memory[kLaplacian] / n;
    const double square = std::max(by_laplacian * by_laplacian, SureSquareOfBlur(memory));
    if (square == 0) return next;
    // The least of roughness · squares / (n r²) + square r⁴.
    const double sixth = moments_.roughness * (memory[kSquares] / n) / (n * 2 * square);
    const double radius = std::max(std::cbrt(std::sqrt(sixth)), smallest_);
    next.radius = std::min(next.radius, radius);
    return next;
  }

 private:
  enum Memory : std::size_t { kLaplacian, kSquares, kBlur, kBlurSquares, kPasses, kNumbers };
  static constexpr double kSmallestShare = 0.01;
  // Blur counts from so many passes on, and so many times its standard deviation is taken from it:
  // less than this is shown by noise in one of thousands of pixels.
  static constexpr double kFirstPasses = 8;
  static constexpr double kSureDeviations = 8;

  static double SureSquareOfBlur(std::span<const double> memory) {
    const double n = memory[kPasses];
    if (n < kFirstPasses) return 0;
    const double mean = memory[kBlur] / n;
    const double variance = (memory[kBlurSquares] / n - mean * mean) / (n - 1);
    return std::max(0.0, mean * mean - kSureDeviations * kSureDeviations * variance);
  }

  KernelMoments moments_;
  double smallest_;
};

// Of the consistent frequency controller, below the predicted radius.
constexpr double kConsistentAlpha = 0.95;

// Keeps the radius while the photons in the disc look uniform, and shrinks it where a chi-square
// test over twelve cells refuses that.
// Source: Lin, Li, Zeng, Zhang, Jia, Wang & Zhang 2020, "CPPM: Chi-Squared Progressive Photon
// Mapping".
class Cppm final : public RadiusController {
 public:
  std::size_t MemoryPerPixel() const override { return kSectors + 1; }

  PixelRadius Next(const PixelRadius& now, const PassEvidence& evidence, std::uint64_t /*pass*/,
                   std::span<double> memory) const override {
    PixelRadius next = {now.radius, now.photons + evidence.photons};
    // Photons of a disc that has been left behind say nothing about today's cells.
    // What was gathered with is rounded to a float.
    if (evidence.radius > now.radius * (1 + 1e-6)) return next;
    double total = 0;
    for (std::size_t i = 0; i < kSectors; ++i) {
      memory[i] += static_cast<double>(evidence.columns[i]);
      total += memory[i];
    }
    double& wanted = memory[kSectors];
    if (wanted == 0) wanted = kFirstTest;
    if (total < wanted) return next;
    // Quantiles of chi-square at 95 % with 11 and 5 degrees of freedom.
    if (Statistic(memory.first(kSectors)) >= 19.675) {
      const bool inner_is_even = Statistic(memory.first(kSectors / 2)) < 11.070;
      next.radius *= std::sqrt(inner_is_even ? 0.5 : 0.8);
    }
    for (double& count : memory.first(kSectors))
      count = 0;
    wanted *= kTestGrowth;
    return next;
  }

 private:
  static constexpr double kFirstTest = 50;
  static constexpr double kTestGrowth = 1.5625;

  // Pearson's statistic of counts that should be equal.
  static double Statistic(std::span<const double> counts) {
    double sum = 0;
    double squares = 0;
    for (const double count : counts) {
      sum += count;
      squares += count * count;
    }
    return sum > 0 ? static_cast<double>(counts.size()) * squares / sum - sum : 0;
  }
};

// What frequency photons say of a pixel, kept over passes as FrequencySums in the controller's
// memory. Lengths in unit radii.
class FrequencyBelief {
 public:
  static constexpr std::size_t kNumbers = kFrequencyColumns;

  FrequencyBelief(const RenderSettings& settings, float initial_radius)
      : bias_(settings.bias),
        moments_(Kernel{settings.kernel}.Moments()),
        range_{kSmallestShare * static_cast<double>(initial_radius),
               static_cast<double>(initial_radius)} {}

  [[nodiscard]] const KernelMoments& moments() const { return moments_; }

  // Takes in a pass, then lets what is older fade with the disc's area.
  static void Add(const PassEvidence& evidence, std::span<double> memory) {
    if (evidence.columns.empty()) return;
    const double radius = evidence.radius;
    // Columns hold x = trace · radius²; memory holds traces, so that radii can change.
    const double to_trace = 1 / (radius * radius);
    const auto column = [&](FrequencyColumn c) { return static_cast<double>(evidence.columns[c]); };
    Store(Sums(memory) + FrequencySums{kWeightUnit * column(kFrequencyWeight),
                                       kWeightUnit * column(kFrequencyWeight2),
                                       kWeightUnit * to_trace * column(kFrequencyTrace),
                                       kWeightUnit * to_trace * to_trace * column(kFrequencyTrace2),
                                       column(kFrequencyCount)},
          memory);
  }
  static void Fade(double area_ratio, std::span<double> memory) {
    Store(Sums(memory).Faded(area_ratio), memory);
  }

  [[nodiscard]] std::optional<BandwidthPrediction> Predict(std::span<const double> memory) const {
    const auto predicted = PredictTrace(Sums(memory), range_, bias_, moments_);
    if (!predicted) return std::nullopt;
    return BandwidthPrediction{predicted->trace, RadiusFor(bias_, predicted->trace, moments_)};
  }

 private:
  // Predictions are held above this share of the first radius.
  static constexpr double kSmallestShare = 0.01;

  static FrequencySums Sums(std::span<const double> memory) {
    return {memory[kFrequencyWeight], memory[kFrequencyWeight2], memory[kFrequencyTrace],
            memory[kFrequencyTrace2], memory[kFrequencyCount]};
  }
  static void Store(const FrequencySums& sums, std::span<double> memory) {
    memory[kFrequencyWeight] = sums.weight;
    memory[kFrequencyWeight2] = sums.weight2;
    memory[kFrequencyTrace] = sums.weighted_trace;
    memory[kFrequencyTrace2] = sums.weighted_trace2;
    memory[kFrequencyCount] = sums.photons;
  }

  double bias_;
  KernelMoments moments_;
  RadiusRange range_;
};

// Shrinks as PPM does until the radius that the frequency photons predict to keep the bias within
// the tolerance; from there a share `floor_alpha` of the photons is kept. With 1 the radius stays
// (the published rule: all photons kept, a bias within the tolerance for ever); below 1 the
// estimate is consistent. Source: Belcour & Soler 2011, "Frequency Based Kernel Estimation for
// Progressive Photon Mapping".
class FrequencyFloor final : public RadiusController {
 public:
  FrequencyFloor(const RenderSettings& settings, float initial_radius, double floor_alpha)
      : alpha_(settings.alpha), floor_alpha_(floor_alpha), belief_(settings, initial_radius) {}

  std::size_t MemoryPerPixel() const override { return FrequencyBelief::kNumbers; }

  PixelRadius Next(const PixelRadius& now, const PassEvidence& evidence, std::uint64_t /*pass*/,
                   std::span<double> memory) const override {
    FrequencyBelief::Add(evidence, memory);
    if (!(evidence.photons > 0)) return now;
    const std::optional<BandwidthPrediction> prediction = belief_.Predict(memory);
    const double radius = now.radius;
    const double shrink = radius / evidence.radius;
    const RadiusStep step =
        ShrinkToPrediction(now.photons, evidence.photons * shrink * shrink, radius,
                           prediction ? prediction->min_radius : 0, alpha_, floor_alpha_);
    FrequencyBelief::Fade(step.kept_share, memory);
    return {step.radius, step.photons};
  }

  bool Predicts() const override { return true; }
  std::optional<BandwidthPrediction> Predict(std::span<const double> memory) const override {
    return belief_.Predict(memory);
  }

 private:
  double alpha_;
  double floor_alpha_;
  FrequencyBelief belief_;
};

// Takes the radius that makes noise and predicted bias together least, never below the one that
// keeps the bias within the tolerance.
class FrequencyMse final : public RadiusController {
 public:
  FrequencyMse(const RenderSettings& settings, float initial_radius)
      : belief_(settings, initial_radius) {}

  std::size_t MemoryPerPixel() const override { return FrequencyBelief::kNumbers + 1; }

  PixelRadius Next(const PixelRadius& now, const PassEvidence& evidence, std::uint64_t /*pass*/,
                   std::span<double> memory) const override {
    FrequencyBelief::Add(evidence, memory);
    const double gathered = evidence.radius;
    double& photon_density = memory[FrequencyBelief::kNumbers];
    photon_density += evidence.photons / (std::numbers::pi * gathered * gathered);
    const double radius = now.radius;
    const std::optional<BandwidthPrediction> prediction = belief_.Predict(memory);
    // Until there is evidence the radius stays: at a photon or two a pass, tens of passes go by
    // before eight frequency photons have come, and a radius that shrank meanwhile could not grow
    // back.
    double next = radius;
    if (prediction && photon_density > 0) {
      next = StepToLeastError(
          radius, prediction->min_radius,
          LeastErrorRadius(photon_density, kTypicalBias * prediction->trace, belief_.moments()));
    }
    FrequencyBelief::Fade(next * next / (radius * radius), memory);
    return {next, now.photons + evidence.photons};
  }

  bool Predicts() const override { return true; }
  std::optional<BandwidthPrediction> Predict(std::span<const double> memory) const override {
    return belief_.Predict(memory);
  }

 private:
  // The predicted trace bounds the curvature of light; over a picture the bias is a tenth to a
  // third of that bound (measured on the scenes of one kind of light each). The bound keeps the
  // tolerance, the typical value is what the least error is looked for with.
  static constexpr double kTypicalBias = 0.25;

  FrequencyBelief belief_;
};

}  // namespace

std::unique_ptr<RadiusController> MakeRadiusController(const RenderSettings& settings,
                                                       float initial_radius) {
  switch (settings.radius_controller) {
    case RadiusControllerKind::kPpm:
      return std::make_unique<Ppm>(settings.alpha);
    case RadiusControllerKind::kPppm:
      return std::make_unique<Pppm>(settings.alpha);
    case RadiusControllerKind::kAppm:
      return std::make_unique<Appm>(settings, initial_radius);
    case RadiusControllerKind::kCppm:
      return std::make_unique<Cppm>();
    case RadiusControllerKind::kFrequency:
      return std::make_unique<FrequencyFloor>(settings, initial_radius, 1);
    case RadiusControllerKind::kFrequencyConsistent:
      return std::make_unique<FrequencyFloor>(settings, initial_radius, kConsistentAlpha);
    case RadiusControllerKind::kFrequencyMse:
      return std::make_unique<FrequencyMse>(settings, initial_radius);
  }
  return nullptr;
}

}  // namespace lucerna
