// The error estimate on images made of known noise and known bias.
#include "render/estimate/error_estimate.h"

#include <array>
#include <cmath>
#include <vector>

#include "gtest/gtest.h"

#include "render/estimate/relative_error.h"
#include "render/math/rng.h"
#include "tests/support/error_statistics.h"

namespace lucerna {
namespace {

constexpr int kSide = 96;
constexpr std::size_t kPixels = static_cast<std::size_t>(kSide) * kSide;

// Of passes whose sum is `all`.
ImageStatistics StatisticsOf(const ErrorStatistics& statistics, const std::vector<RgbSum>& all,
                             bool has_bias) {
  ImageStatistics image(kSide, kSide, statistics.passes());
  for (std::size_t i = 0; i < kPixels; ++i) {
    PixelStatistics pixel;
    for (std::size_t c = 0; c < 3; ++c) {
      pixel.all[c] = static_cast<float>(all[i][c]);
      pixel.half_difference[c] = static_cast<float>(2 * statistics.even_sum()[i][c] - all[i][c]);
    }
    const double luminance = LuminanceOf(all[i]);
    pixel.squared_deviations =
        static_cast<float>(statistics.square_sum()[i] -
                           luminance * luminance / static_cast<double>(statistics.passes()));
    if (has_bias) {
      pixel.even_bias = static_cast<float>(statistics.even_bias()[i]);
      pixel.odd_bias = static_cast<float>(statistics.odd_bias()[i]);
      pixel.bias_color = {1, 1, 1};
    }
    image.Set(i, pixel);
  }
  return image;
}

ErrorEstimate EstimateOf(const ErrorStatistics& statistics, const std::vector<RgbSum>& all,
                         int look) {
  ThreadTeam team(1);
  return EstimateError(StatisticsOf(statistics, all, true), look, team);
}

// A grey image of value 2 with independent noise of standard deviation `noise` a pass, and `bias`.
struct Made {
  ErrorStatistics statistics{kPixels};
  std::vector<RgbSum> all = std::vector<RgbSum>(kPixels);
  double true_square = 0;  // mean over pixels of (mean - 2)²

  Made(int passes, double noise, double bias, std::uint64_t key) {
    KeyedRng rng(key);
    for (int pass = 0; pass < passes; ++pass) {
      std::vector<RgbSum> radiance(kPixels);
      std::vector<double> biases(kPixels);
      for (std::size_t pixel = 0; pixel < kPixels; ++pixel) {
        // Uniform, of unit variance.
        const double u = (2 * static_cast<double>(rng.Uniform()) - 1) * std::sqrt(3.0);
        const double value = 2 + bias + noise * u;
        radiance[pixel] = {value, value, value};
        // What is known of the bias is noisier than the image.
        biases[pixel] = bias + 3 * noise * (2 * static_cast<double>(rng.Uniform()) - 1);
        for (double& sum : all[pixel])
          sum += value;
      }
      statistics.AddPass(static_cast<std::uint64_t>(pass), radiance, biases);
    }
    for (const RgbSum& sum : all) {
      const double off = sum[0] / passes - 2;
      true_square += off * off / static_cast<double>(kPixels);
    }
  }

  [[nodiscard]] ErrorEstimate Estimate(int look) const { return EstimateOf(statistics, all, look); }
};

TEST(ErrorEstimateTest, FindsNoiseAndBias) {
  for (const int passes : {4, 7, 30}) {
    const Made made(passes, 0.5, 0.1, 11);
    const ErrorEstimate estimate = made.Estimate(1);
    // 9216 pixels of a squared normal number each: 1.5 % is a standard deviation.
    EXPECT_NEAR(estimate.absolute.noise / (0.25 / passes), 1, 0.06) << passes;
    // The product of two halves of deviation 3 · 0.5/√3 · √(2/passes), over 96 pixels' root; by
    // chance the widest smoothing may be taken to lose half a deviation more than it does.
    const double half = 1.5 / std::sqrt(3.0) * std::sqrt(2.0 / passes);
    EXPECT_NEAR(estimate.absolute.bias, 0.01, 4.5 * (half * half + 2 * 0.1 * half) / 96) << passes;
    // Noise is relative to what is there, bias to what would be there without it, 2, as halves of
    // variance v know it: the mean of 1/x² is larger than 1/2² by 3v/2² of it.
    const double noise = estimate.absolute.noise / (1.01 * 2.1 * 2.1);
    const double bias = estimate.absolute.bias / (1.01 * 2.0 * 2.0);
    const double variance = (0.25 + 0.75) * 2.0 / passes;
    EXPECT_NEAR(estimate.relative.total() / (noise + bias), 1,
                0.12 + 3 * variance / 4 * bias / (noise + bias))
        << passes;
    EXPECT_NEAR(estimate.noise_factor, 1, 0.06) << passes;
    EXPECT_LE(estimate.absolute.low, made.true_square);
    EXPECT_GE(estimate.absolute.high, made.true_square);
  }
}

// Passes of fewer photons scatter more and weigh less, and the weights of even and odd ones differ.
TEST(ErrorEstimateTest, FindsNoiseAndBiasOfPassesThatWeighUnalike) {
  constexpr std::array<double, 7> kWeights = {0.125, 0.125, 0.125, 0.5, 0.5, 1, 1};
  constexpr double kBias = 0.1;
  // Of a pass of weight 1, in value and in what is known of the bias.
  constexpr double kVariance = 0.25;
  ImageStatistics image(kSide, kSide, kWeights.size());
  image.weights = {};
  for (std::size_t pass = 0; pass < kWeights.size(); ++pass)
    (pass % 2 == 0 ? image.weights.even : image.weights.odd) += kWeights[pass];
  const double weight = image.weights.all();
  KeyedRng rng(12);
  const auto scattered = [&](double w) {
    return (2 * static_cast<double>(rng.Uniform()) - 1) * std::sqrt(3 * kVariance / w);
  };
  double true_square = 0;
  for (std::size_t i = 0; i < kPixels; ++i) {
    std::array<double, 2> halves{};
    std::array<double, 2> biases{};
    double squares = 0;
    for (std::size_t pass = 0; pass < kWeights.size(); ++pass) {
      const double w = kWeights[pass];
      const double value = 2 + kBias + scattered(w);
      halves[pass % 2] += w * value;
      biases[pass % 2] += w * (kBias + scattered(w));
      squares += w * value * value;
    }
    const double all = halves[0] + halves[1];
    const auto gray = [](double value) {
      const auto v = static_cast<float>(value);
      return std::array<float, 3>{v, v, v};
    };
    image.Set(i, {.all = gray(all),
                  .half_difference = gray(halves[0] - halves[1]),
                  .squared_deviations = static_cast<float>(squares - all * all / weight),
                  .even_bias = static_cast<float>(biases[0]),
                  .odd_bias = static_cast<float>(biases[1]),
                  .bias_color = {1, 1, 1}});
    const double off = all / weight - 2;
    true_square += off * off / static_cast<double>(kPixels);
  }
  ThreadTeam team(1);
  const ErrorEstimate estimate = EstimateError(image, 1, team);
  EXPECT_NEAR(estimate.absolute.noise / (kVariance / weight), 1, 0.06) << "as in the test above";
  EXPECT_NEAR(estimate.noise_factor, 1, 0.06);
  // The product of two halves, known up to its deviation over the root of the pixels; smoothing
  // may lose half a deviation more.
  const double of_halves =
      kVariance / std::sqrt(image.weights.even * image.weights.odd) / std::sqrt(1.0 * kPixels);
  EXPECT_NEAR(estimate.absolute.bias, kBias * kBias, 4.5 * (of_halves + 0.05 * kBias * kBias));
  EXPECT_LE(estimate.absolute.low, true_square);
  EXPECT_GE(estimate.absolute.high, true_square);
}

struct ValueAndBias {
  double value = 0, bias = 0;
};

// Of four grey passes made pixel by pixel.
template <typename Make>
ErrorEstimate EstimateOfPasses(const Make& make) {
  ErrorStatistics statistics(kPixels);
  std::vector<RgbSum> all(kPixels);
  for (std::uint64_t pass = 0; pass < 4; ++pass) {
    std::vector<RgbSum> radiance(kPixels);
    std::vector<double> biases(kPixels);
    for (std::size_t pixel = 0; pixel < kPixels; ++pixel) {
      const ValueAndBias made = make(pass, pixel);
      radiance[pixel] = {made.value, made.value, made.value};
      biases[pixel] = made.bias;
      for (double& sum : all[pixel])
        sum += made.value;
    }
    statistics.AddPass(pass, radiance, biases);
  }
  return EstimateOf(statistics, all, 1);
}

// Passes with noise, a bias that changes from place to place, and some bright emitters; all of it
// times `factor`.
ErrorEstimate EstimateOfLightTimes(double factor) {
  KeyedRng rng(31);
  const auto uniform = [&] { return static_cast<double>(rng.Uniform()); };
  ErrorStatistics statistics(kPixels);
  std::vector<RgbSum> all(kPixels);
  for (std::uint64_t pass = 0; pass < 8; ++pass) {
    std::vector<RgbSum> radiance(kPixels);
    std::vector<double> biases(kPixels);
    for (std::size_t pixel = 0; pixel < kPixels; ++pixel) {
      const double value = factor * (pixel % 211 == 0 ? 500 : 0.1 + 3 * uniform());
      radiance[pixel] = {value, value, value};
      biases[pixel] = factor * (0.1 * std::sin(static_cast<double>(pixel % kSide) / 9) + uniform());
      for (double& sum : all[pixel])
        sum += value;
    }
    statistics.AddPass(pass, radiance, biases);
  }
  return EstimateOf(statistics, all, 1);
}

TEST(ErrorEstimateTest, LightTimesAnyFactorGivesTheSameRelativeError) {
  const SquaredError base = EstimateOfLightTimes(1).relative;
  EXPECT_GT(base.noise, 0.01);
  EXPECT_GT(base.bias, 0.001);
  for (const int exponent : {-60, -7, 1, 16, 60}) {
    const SquaredError scaled = EstimateOfLightTimes(std::ldexp(1.0, exponent)).relative;
    EXPECT_EQ(scaled.noise, base.noise) << exponent;
    EXPECT_EQ(scaled.bias, base.bias) << exponent;
    EXPECT_EQ(scaled.low, base.low) << exponent;
    EXPECT_EQ(scaled.high, base.high) << exponent;
  }
  // Means around a pixel, noise and bias are floats, rounded at most some eight times; errors of
  // 2^-24 of a mean of 49 values count ten times in a difference a tenth as large.
  for (const double factor : {0.4, 3.0, 40000.0}) {
    const SquaredError scaled = EstimateOfLightTimes(factor).relative;
    EXPECT_NEAR(scaled.noise / base.noise, 1, 1e-5) << factor;
    EXPECT_NEAR(scaled.bias / base.bias, 1, 1e-5) << factor;
    EXPECT_NEAR(scaled.low / base.low, 1, 1e-5) << factor;
    EXPECT_NEAR(scaled.high / base.high, 1, 1e-5) << factor;
  }
}

// A few pixels with a thousand times the noise decide the error of all pixels, and are left out of
// the other.
TEST(ErrorEstimateTest, TellsTheErrorWithAndWithoutTheWorstPixels) {
  KeyedRng rng(37);
  const ErrorEstimate estimate = EstimateOfPasses([&](std::uint64_t, std::size_t pixel) {
    const double noise = 2 * static_cast<double>(rng.Uniform()) - 1;
    return ValueAndBias{1000 + (pixel % 1111 == 0 ? 1000 : 1) * noise, 0};
  });
  EXPECT_EQ(estimate.left_out_pixels, 9);
  // Noise of variance 1/3 a pass, four passes, in 1.01e6; nine of 9216 pixels with a million times.
  EXPECT_NEAR(estimate.relative.total() * 1.01e6 / (1.0 / 12), 1, 0.1);
  EXPECT_GT(estimate.untrimmed, 100 * estimate.relative.total());
  EXPECT_LT(estimate.untrimmed, 5000 * estimate.relative.total());
}

// Nothing has been found yet: that is no error of 0.
TEST(ErrorEstimateTest, ABlackImageHasNoKnownRelativeError) {
  const ErrorEstimate estimate =
      EstimateOfPasses([](std::uint64_t, std::size_t) { return ValueAndBias{}; });
  EXPECT_EQ(estimate.relative.total(), HUGE_VAL);
  EXPECT_EQ(estimate.relative.high, HUGE_VAL);
  EXPECT_EQ(estimate.absolute.total(), 0);
}

// What is known of the bias comes from the photons that the value comes from: where chance brings
// more of them, both are larger. Relative to a value that knows both halves, their product would
// come out as 0.025 here.
TEST(ErrorEstimateTest, ChanceThatValueAndBiasShareIsNoBias) {
  KeyedRng rng(17);
  const ErrorEstimate estimate = EstimateOfPasses([&](std::uint64_t, std::size_t) {
    const double chance = 0.9 * (2 * static_cast<double>(rng.Uniform()) - 1);
    return ValueAndBias{1 + chance, chance};
  });
  // Half a pass's variance of 0.27: products deviate by 0.135 times weights of about 2.5, over 96
  // pixels' root.
  EXPECT_LT(estimate.relative.bias, 4 * 0.135 * 2.5 / 96);
}

// Kernels eight pixels wide, and a bias that changes its sign every four: smoothing over as much as
// the kernels do would lose it.
TEST(ErrorEstimateTest, KeepsABiasThatWideSmoothingWouldLose) {
  constexpr double kBias = 0.3;
  constexpr std::size_t kBlocks = kSide / 8;
  KeyedRng rng(23);
  std::array<double, kBlocks * kBlocks> blocks{};
  const ErrorEstimate estimate = EstimateOfPasses([&](std::uint64_t, std::size_t pixel) {
    const std::size_t x = pixel % kSide;
    const std::size_t y = pixel / kSide;
    double& block = blocks[y / 8 * kBlocks + x / 8];
    if (x % 8 == 0 && y % 8 == 0) block = 0.2 * (static_cast<double>(rng.Uniform()) - 0.5);
    const double bias = x / 4 % 2 == 0 ? kBias : -kBias;
    return ValueAndBias{2 + bias + block, bias + 0.1 * (static_cast<double>(rng.Uniform()) - 0.5)};
  });
  // Any smoothing would lose a quarter or more.
  EXPECT_NEAR(estimate.absolute.bias / (kBias * kBias), 1, 0.05);
}

// A kernel across a step brings light to the dark side: the relative error there is measured by how
// dark it is without the blur. Dark columns of 0.01 hold 0.21, bright ones of 1 hold 0.8.
TEST(ErrorEstimateTest, BiasOnTheDarkSideOfAStepIsRelativeToTheDark) {
  const auto is_dark = [](std::size_t pixel) { return pixel % kSide / 12 % 2 == 0; };
  const auto is_beside_step = [](std::size_t pixel) { return (pixel % kSide + 1) % 12 < 2; };
  double true_square = 0;
  std::vector<double> luminances(kPixels);
  for (std::size_t pixel = 0; pixel < kPixels; ++pixel)
    luminances[pixel] = is_dark(pixel) ? 0.01 : 1;
  const double floor = RelativeErrorFloor(luminances);
  for (std::size_t pixel = 0; pixel < kPixels; ++pixel) {
    if (!is_beside_step(pixel)) continue;
    true_square += 0.04 / (luminances[pixel] * luminances[pixel] + floor) / kPixels;
  }
  KeyedRng rng(31);
  const ErrorEstimate estimate = EstimateOfPasses([&](std::uint64_t, std::size_t pixel) {
    const double bias = !is_beside_step(pixel) ? 0 : is_dark(pixel) ? 0.2 : -0.2;
    const double noise = 0.01 * (2 * static_cast<double>(rng.Uniform()) - 1);
    return ValueAndBias{(is_dark(pixel) ? 0.01 : 1) + bias + noise, bias};
  });
  // The 0.1 % of pixels with the largest errors are left out: of a sixth that have any, 0.6 %, and
  // a floor of the blurred image.
  EXPECT_NEAR(std::sqrt(estimate.relative.bias / true_square), 1, 0.03);
}

TEST(ErrorEstimateTest, LooksSpendAllOfTheErrorProbability) {
  double spent = 0;
  for (int look = 1; look <= 100000; ++look) {
    EXPECT_LE(SpentAt(look + 1), SpentAt(look));
    spent += SpentAt(look);
  }
  EXPECT_NEAR(spent, 1, 1e-4);
}

TEST(ErrorEstimateTest, LaterLooksHaveWiderIntervals) {
  const Made made(10, 0.5, 0, 5);
  const SquaredError first = made.Estimate(1).absolute;
  const SquaredError tenth = made.Estimate(10).absolute;
  EXPECT_EQ(first.total(), tenth.total());
  EXPECT_LT(tenth.low, first.low);
  EXPECT_GT(tenth.high, first.high);
  EXPECT_LT(first.low, first.total());
}

// Passes that repeat each other's errors with the other sign, as stratified ones do: what the
// passes vary by says nothing of what the halves do.
TEST(ErrorEstimateTest, NoiseFactorSeesStratification) {
  ErrorStatistics statistics(kPixels);
  std::vector<RgbSum> all(kPixels);
  KeyedRng rng(9);
  std::array<std::vector<double>, 2> shift = {std::vector<double>(kPixels),
                                              std::vector<double>(kPixels)};
  const std::vector<double> none(kPixels);
  for (int pass = 0; pass < 16; ++pass) {
    std::vector<RgbSum> radiance(kPixels);
    std::vector<double>& half = shift[static_cast<std::size_t>(pass % 2)];
    for (std::size_t pixel = 0; pixel < kPixels; ++pixel) {
      // Of each half every other pass takes back what the one before brought.
      half[pixel] = pass % 4 < 2 ? static_cast<double>(rng.Uniform()) - 0.5 : -half[pixel];
      const double value = 1 + half[pixel] + 0.01 * static_cast<double>(rng.Uniform());
      radiance[pixel] = {value, value, value};
      for (double& sum : all[pixel])
        sum += value;
    }
    statistics.AddPass(static_cast<std::uint64_t>(pass), radiance, none);
  }
  ThreadTeam team(1);
  const ErrorEstimate estimate = EstimateError(StatisticsOf(statistics, all, false), 1, team);
  EXPECT_LT(estimate.noise_factor, 0.01);
}

TEST(TwoSidedNormalQuantileTest, KnowsTheTable) {
  EXPECT_NEAR(TwoSidedNormalQuantile(0.05), 1.959964, 1e-6);
  EXPECT_NEAR(TwoSidedNormalQuantile(0.3173105), 1, 1e-6);
  EXPECT_NEAR(TwoSidedNormalQuantile(2e-9), 5.997807, 1e-5);
}

}  // namespace
}  // namespace lucerna
