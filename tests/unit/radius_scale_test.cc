// Are the radii of the image scaled by what its bias and noise ask for, and no further than its
// pixels' evidence allows?
#include "render/estimate/radius_scale.h"

#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "gtest/gtest.h"

#include "render/math/rng.h"
#include "render/scene/render_settings.h"

namespace lucerna {
namespace {

constexpr std::size_t kWidth = 128;
constexpr std::size_t kPixels = kWidth * kWidth;
constexpr std::uint64_t kPasses = 16;

// Says of a pixel what its memory holds: the most that it allows, and what its passes had.
class Asked final : public RadiusController {
 public:
  [[nodiscard]] std::size_t MemoryPerPixel() const override { return 2; }
  [[nodiscard]] PixelRadius Next(const PixelRadius& now, const RoundEvidence& /*evidence*/,
                                 const PassRange& /*passes*/,
                                 std::span<double> /*memory*/) const override {
    return now;
  }
  [[nodiscard]] std::optional<ScaledRadius> Scaled(std::span<const double> memory,
                                                   std::uint64_t passes,
                                                   std::uint64_t rounds) const override {
    EXPECT_EQ(rounds, RoundsUntil(passes));
    return ScaledRadius{.most = memory[0], .use = memory[1]};
  }
};

double Normal(KeyedRng& rng) {
  const double around =
      static_cast<double>(rng.Uniform() + rng.Uniform() + rng.Uniform() + rng.Uniform());
  return std::sqrt(3.0) * (around - 2);
}

// Light of 1 in every pixel, of which each pass shows blur of `bias` in the pixels from `first` on,
// and both scatter by so much.
struct Light {
  double bias = 0, scatter = 0.1, bias_scatter = 0.1;
  std::size_t first = 0;
  std::size_t tiles = kPixels;  // of 16 × 16 pixels, the first of which have light
};
ImageSums SumsOf(const Light& light, double scale = 1) {
  ImageSums sums(kPixels);
  ThreadTeam team(1);
  KeyedRng rng(17);
  for (PassRange round = RoundOf(0); round.first < kPasses; round = RoundOf(round.last)) {
    SliceSums slice = EmptySlice(round, kPixels, 0);
    const auto size = static_cast<double>(round.size());
    const PassWeights weights = WeightsOf(round);
    for (std::size_t i = 0; i < kPixels; ++i) {
      if (i / kWidth / 16 * (kWidth / 16) + i % kWidth / 16 >= light.tiles) continue;
      const double even = weights.even + light.scatter * std::sqrt(weights.even) * Normal(rng);
      const double odd = weights.odd + light.scatter * std::sqrt(weights.odd) * Normal(rng);
      const double bias = i < light.first ? 0 : light.bias;
      for (std::size_t c = 0; c < 3; ++c) {
        slice.columns[kPhotonRadiance + c].Set(i, static_cast<float>(scale * (even + odd)));
        if (size > 1)
          slice.columns[kHalfDifference + c].Set(i, static_cast<float>(scale * (even - odd)));
      }
      const auto biases = [&](double passes) {
        return static_cast<float>(
            scale * (passes * bias + light.bias_scatter * std::sqrt(passes) * Normal(rng)));
      };
      slice.columns[kEvenBias].Set(i, biases(weights.even));
      slice.columns[kOddBias].Set(i, biases(weights.odd));
    }
    sums.WeighBy(100);
    sums.Add(slice, team);
  }
  return sums;
}

// `most` of the pixels from `first` on; 1 of the others.
double ScaleOf(const ImageSums& sums, double most = 1, std::size_t first = 0, double use = 1) {
  const Asked controller;
  PixelRadii::Numbers numbers;
  numbers.radius.resize(kPixels);
  for (std::size_t i = 0; i < kPixels; ++i) {
    numbers.memory.push_back(i < first ? 1 : most);
    numbers.memory.push_back(use);
  }
  const PixelRadii radii(std::move(numbers), controller);
  return RadiusScale(sums, radii, SampleNoise(sums), kWidth);
}

// The squared noise of a mean of 16 passes is 0.1² / 16, known from 16,384 differences to 1.1 %.
// The squared bias, 0.05², is known to 0.9 % (deviations of 1.2e-3 and, of bias with noise, 2.5e-3
// in one pixel), of which one deviation is taken. Sixth roots have a sixth of that.
TEST(RadiusScaleTest, IsThatOfLeastErrorForTheBiasOfTheImage) {
  const double expected = std::pow(0.01 / 16 / (2 * 0.05 * 0.05), 1.0 / 6);
  EXPECT_NEAR(ScaleOf(SumsOf({.bias = 0.05})), expected, 0.01 * expected);
}

// No pixel of these knows its bias: it is 0.4 of a deviation of its mean.
TEST(RadiusScaleTest, KnowsBiasThatNoPixelIsSureOf) {
  const double expected = std::pow(0.01 / 16 / (2 * 0.05 * 0.05), 1.0 / 6);
  EXPECT_NEAR(ScaleOf(SumsOf({.bias = 0.05, .bias_scatter = 0.5})), expected, 0.05 * expected);
}

TEST(RadiusScaleTest, LeavesRadiiOfEvenLightAlone) {
  EXPECT_EQ(ScaleOf(SumsOf({})), 1);
  EXPECT_EQ(ScaleOf(SumsOf({.bias_scatter = 0.5})), 1);
}

// Bias of 0.05 at radii of half the size is 0.2 at whole ones, and noise half of what it is.
TEST(RadiusScaleTest, CountsTheFactorsThatPassesHad) {
  const double at_half = std::pow(0.01 / 16 / (2 * 0.05 * 0.05), 1.0 / 6);
  EXPECT_NEAR(ScaleOf(SumsOf({.bias = 0.05}), 1, 0, 0.5), 0.5 * at_half, 0.005 * at_half);
}

// All bias is in a quarter of the pixels, whose own evidence holds their radii at 0.3 already.
TEST(RadiusScaleTest, LeavesOutPixelsThatTheirOwnEvidenceHolds) {
  constexpr std::size_t kFirst = kPixels / 4 * 3;
  const ImageSums sums = SumsOf({.bias = 0.2, .first = kFirst});
  EXPECT_LT(ScaleOf(sums), 0.6);
  EXPECT_EQ(ScaleOf(sums, 0.3, kFirst), 1);
  // As soon as they are held above the factor they count.
  EXPECT_NEAR(ScaleOf(sums, 0.9, kFirst), ScaleOf(sums), 1e-12);
}

TEST(RadiusScaleTest, IsTheSameWhateverFactorScalesAllLight) {
  const double scale = ScaleOf(SumsOf({.bias = 0.05}));
  EXPECT_EQ(ScaleOf(SumsOf({.bias = 0.05}, 0x1p-40)), scale);
  EXPECT_EQ(ScaleOf(SumsOf({.bias = 0.05}, 0x1p50)), scale);
  EXPECT_NEAR(ScaleOf(SumsOf({.bias = 0.05}, 1e5)), scale, 1e-4);
}

TEST(RadiusScaleTest, IsOneWhereChanceIsNotKnown) {
  EXPECT_EQ(ScaleOf(ImageSums(kPixels)), 1);
  EXPECT_EQ(ScaleOf(SumsOf({.bias = 0.05, .tiles = 7})), 1);
  EXPECT_LT(ScaleOf(SumsOf({.bias = 0.05, .tiles = 8})), 0.8);
}

TEST(RadiusScaleTest, IsOneWhereTheControllerScalesNothing) {
  RenderSettings settings;
  settings.radius_controller = RadiusControllerKind::kPpm;
  const std::unique_ptr<RadiusController> ppm = MakeRadiusController(settings, 1);
  const ImageSums sums = SumsOf({.bias = 0.05});
  EXPECT_EQ(RadiusScale(sums, PixelRadii(kPixels, 1, *ppm), SampleNoise(sums), kWidth), 1);
}

}  // namespace
}  // namespace lucerna
