// Is blur that is surely there taken off, chance left alone, and what is left known?
#include "render/estimate/without_blur.h"

#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <utility>

#include "gtest/gtest.h"

#include "render/math/rng.h"
#include "render/scene/render_settings.h"

namespace lucerna {
namespace {

constexpr std::uint64_t kPasses = 64;
constexpr double kLight = 2;
constexpr double kPhotonsInPass = 1e6;  // so many that their own floor does not count

double Normal(KeyedRng& rng) {
  const auto u = 1 - static_cast<double>(rng.Uniform());
  const double angle = 2 * std::numbers::pi * static_cast<double>(rng.Uniform());
  return std::sqrt(-2 * std::log(u)) * std::cos(angle);
}

// Passes in which kernels changed each pixel by `bias`, with this deviation; all light times
// `scale`.
ImageSums SumsOf(std::size_t pixels, double bias, double deviation, double photons_in_pass,
                 double scale = 1) {
  ImageSums sums(pixels);
  ThreadTeam team(1);
  KeyedRng rng(5);
  for (PassRange round = RoundOf(0); round.first < kPasses; round = RoundOf(round.last)) {
    SliceSums slice = EmptySlice(round, pixels, 0);
    const auto size = static_cast<double>(round.size());
    for (std::size_t i = 0; i < pixels; ++i) {
      for (std::size_t c = 0; c < 3; ++c)
        slice.columns[kPhotonRadiance + c].Set(i, static_cast<float>(scale * kLight * size));
      const PassWeights weights = WeightsOf(round);
      const auto half = [&](double passes) {
        return static_cast<float>(scale *
                                  (passes * bias + std::sqrt(passes) * deviation * Normal(rng)));
      };
      slice.columns[kEvenBias].Set(i, half(weights.even));
      slice.columns[kOddBias].Set(i, half(weights.odd));
      slice.columns[kPhotonCount].Set(i, static_cast<float>(photons_in_pass * size));
    }
    sums.Add(slice, team);
  }
  return sums;
}

std::unique_ptr<RadiusController> Controller(RadiusControllerKind kind) {
  RenderSettings settings;
  settings.radius_controller = kind;
  return MakeRadiusController(settings, 1);
}

TEST(WithoutBlurTest, TakesSureBlurOff) {
  constexpr double kBias = 0.40625;  // of few bits
  constexpr double kPhotons = 200;
  const ImageSums sums = SumsOf(1, kBias, 0, kPhotons);
  const auto appm = Controller(RadiusControllerKind::kAppm);
  const ImageSums::Pixel before = sums.At(0);
  const ImageSums::Pixel after = WithoutBlur(sums, *appm, 1).At(0);
  // Nothing varies, so that the variance is that of even light by a third of the photons.
  const double variance = 12 * kLight * kLight / (kPhotons * kPasses / 3);
  // Firm shrinkage between 2.75 and 4.5 deviations, about Student's quantiles of 20 rounds.
  ASSERT_EQ(sums.parts(), 20U);
  const double least = std::sqrt(19 * std::expm1(2.75 * 2.75 / 19));
  const double share = 4.5 / 1.75 * (1 - least * std::sqrt(variance) / kBias);
  ASSERT_GT(share, 0.2);
  ASSERT_LT(share, 0.8);
  EXPECT_NEAR(after.photons[1], kPasses * (kLight - share * kBias), 1e-4 * kPasses);
  EXPECT_NEAR(after.half_difference[1], before.half_difference[1], 1e-4 * kPasses);
  const double left = std::sqrt((1 - share) * (1 - share) + 0.05 * share * share);
  EXPECT_NEAR(after.even_bias, left * before.even_bias, 1e-4 * kPasses);
  EXPECT_NEAR(after.odd_bias, left * before.odd_bias, 1e-4 * kPasses);
  EXPECT_EQ(after.direct, before.direct);
}

TEST(WithoutBlurTest, LeavesOtherControllersAlone) {
  const ImageSums sums = SumsOf(1, 0.5, 0, 300);
  const auto ppm = Controller(RadiusControllerKind::kPpm);
  EXPECT_EQ(WithoutBlur(sums, *ppm, 1).At(0).photons, sums.At(0).photons);
}

// Photons of segments are not among a pixel's count.
TEST(WithoutBlurTest, TakesNothingWhereMediaScatter) {
  const ImageSums sums = SumsOf(1, 0.5, 0, 300);
  const auto appm = Controller(RadiusControllerKind::kAppm);
  EXPECT_NE(WithoutBlur(sums, *appm, 1).At(0).photons, sums.At(0).photons);
  EXPECT_EQ(WithoutBlur(sums, *appm, 1, /*media_scatter=*/true).At(0).photons, sums.At(0).photons);
}

TEST(WithoutBlurTest, NoLightIsLessThanNone) {
  const ImageSums sums = SumsOf(1, 1.1 * kLight, 0, kPhotonsInPass);
  const auto appm = Controller(RadiusControllerKind::kAppm);
  EXPECT_NEAR(WithoutBlur(sums, *appm, 1).At(0).photons[1], 0, 1e-9);
}

// Squares of biases as faint as this are 0 as floats, and blur that varies would be sure.
TEST(WithoutBlurTest, IsTheSameWhateverFactorScalesAllLight) {
  constexpr std::size_t kSomePixels = 100;
  constexpr double kDeviation = 0.3;
  constexpr double kBias = 3.5 * kDeviation / 8;  // 3.5 deviations of the mean of 64 passes
  const auto appm = Controller(RadiusControllerKind::kAppm);
  const ImageSums sums = SumsOf(kSomePixels, kBias, kDeviation, kPhotonsInPass);
  for (const double scale : {0x1p-80, 0x1p60}) {
    const ImageSums scaled = SumsOf(kSomePixels, kBias, kDeviation, kPhotonsInPass, scale);
    for (std::size_t i = 0; i < kSomePixels; ++i) {
      EXPECT_EQ(WithoutBlur(scaled, *appm, 1).At(i).photons[1],
                scale * WithoutBlur(sums, *appm, 1).At(i).photons[1])
          << scale;
    }
  }
}

// Of pixels without blur at most about one in 170 is changed.
TEST(WithoutBlurTest, LeavesChanceAlone) {
  constexpr std::size_t kManyPixels = 20000;
  const ImageSums sums = SumsOf(kManyPixels, 0, 0.3, kPhotonsInPass);
  const auto appm = Controller(RadiusControllerKind::kAppm);
  const WithoutBlur removal(sums, *appm, 1);
  std::size_t changed = 0;
  for (std::size_t i = 0; i < kManyPixels; ++i)
    changed += removal.At(i).photons != sums.At(i).photons ? 1 : 0;
  // 0.6 % of them, and five deviations; the quantile is an approximation of Student's.
  EXPECT_LT(static_cast<double>(changed), 120 + 5 * 11);
  EXPECT_GT(changed, 0U);
}

// The squared error of what was taken is what the product of the halves' biases says, and the noise
// that halves differ by, whatever the bias is in deviations of its mean.
TEST(WithoutBlurTest, KnowsWhatIsLeft) {
  constexpr std::size_t kManyPixels = 20000;
  constexpr double kDeviation = 0.3;
  const auto appm = Controller(RadiusControllerKind::kAppm);
  for (const double deviations : {2.0, 4.0, 5.0, 6.0, 8.0}) {
    const double bias = deviations * kDeviation / std::sqrt(static_cast<double>(kPasses));
    const ImageSums sums = SumsOf(kManyPixels, bias, kDeviation, kPhotonsInPass);
    const WithoutBlur removal(sums, *appm, 1);
    double truth = 0;
    double estimated = 0;
    double noise = 0;  // of a pass, as the squared deviations have it
    double expected_noise = 0;
    for (std::size_t i = 0; i < kManyPixels; ++i) {
      const ImageSums::Pixel before = sums.At(i);
      const ImageSums::Pixel after = removal.At(i);
      const double taken = (before.photons[1] - after.photons[1]) / kPasses;
      truth += (bias - taken) * (bias - taken);
      const double product = before.even_bias * before.odd_bias / (kPasses / 2 * (kPasses / 2));
      const double left = after.even_bias * after.odd_bias / (kPasses / 2 * (kPasses / 2));
      const double share = taken / ((before.even_bias + before.odd_bias) / kPasses);
      noise += (after.squared_deviations - before.squared_deviations) / (kPasses - 1);
      expected_noise += share * share * kDeviation * kDeviation;
      estimated +=
          left - 0.05 * share * share * product + share * share * kDeviation * kDeviation / kPasses;
    }
    // The variance is known from 20 rounds alone.
    EXPECT_NEAR(estimated / truth, 1, 0.1) << deviations;
    // Below that, pixels in which blur seems to vary little are chosen.
    if (deviations >= 6) {
      EXPECT_NEAR(noise / expected_noise, 1, 0.1) << deviations;
    }
  }
}

}  // namespace
}  // namespace lucerna
