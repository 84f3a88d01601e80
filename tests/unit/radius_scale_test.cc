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
constexpr std::size_t kPixelsScaled = kWidth * kWidth;
constexpr std::uint64_t kPasses = 16;

// Says of a pixel what its memory holds.
class Asked final : public RadiusController {
 public:
  [[nodiscard]] std::size_t MemoryPerPixel() const override { return 5; }
  [[nodiscard]] PixelRadius Next(const PixelRadius& now, const RoundEvidence& /*evidence*/,
                                 const PassRange& /*passes*/,
                                 std::span<double> /*memory*/) const override {
    return now;
  }
  [[nodiscard]] std::optional<ScaledRadius> Scaled(std::span<const double> memory,
                                                   const PassesTaken& taken) const override {
    EXPECT_EQ(taken.rounds, RoundsUntil(taken.passes));
    EXPECT_DOUBLE_EQ(taken.photons, 100.0 * static_cast<double>(taken.passes));
    return ScaledRadius{.most = memory[0],
                        .use = memory[1],
                        .blurred = memory[2],
                        .even_bias = memory[3],
                        .odd_bias = memory[4]};
  }
};

double Normal(KeyedRng& rng) {
  const double around =
      static_cast<double>(rng.Uniform() + rng.Uniform() + rng.Uniform() + rng.Uniform());
  return std::sqrt(3.0) * (around - 2);
}

// Light of 1 in every pixel, which scatters by 0.1 a pass.
struct Light {
  double scale = 1;
  std::size_t tiles = kPixelsScaled;  // of 16 × 16 pixels, the first of which have light
};
ImageSums SumsOf(const Light& light = {}) {
  ImageSums sums(kPixelsScaled);
  ThreadTeam team(1);
  KeyedRng rng(17);
  for (PassRange round = RoundOf(0); round.first < kPasses; round = RoundOf(round.last)) {
    SliceSums slice = EmptySlice(round, kPixelsScaled, 0);
    const PassWeights weights = WeightsOf(round);
    for (std::size_t i = 0; i < kPixelsScaled; ++i) {
      if (i / kWidth / 16 * (kWidth / 16) + i % kWidth / 16 >= light.tiles) continue;
      const double even = weights.even + 0.1 * std::sqrt(weights.even) * Normal(rng);
      const double odd = weights.odd + 0.1 * std::sqrt(weights.odd) * Normal(rng);
      for (std::size_t c = 0; c < 3; ++c) {
        slice.columns[kPhotonRadiance + c].Set(i, static_cast<float>(light.scale * (even + odd)));
        if (round.size() > 1) {
          slice.columns[kHalfDifference + c].Set(i, static_cast<float>(light.scale * (even - odd)));
        }
      }
    }
    sums.WeighBy(100);
    sums.Add(slice, team);
  }
  return sums;
}

// What pixels say of themselves, those before `first` apart: they have no bias, and are held by
// nothing.
struct OfPixels {
  double bias = 0, scatter = 0.03;  // of a half
  double most = 1, use = 1, blurred = 1;
  std::size_t first = 0;
};
double ScaleOf(const ImageSums& sums, const OfPixels& pixels, double scale = 1) {
  const Asked controller;
  KeyedRng rng(18);
  PixelRadii::Numbers numbers;
  numbers.radius.resize(kPixelsScaled);
  for (std::size_t i = 0; i < kPixelsScaled; ++i) {
    const double bias = i < pixels.first ? 0 : pixels.bias;
    const double even = scale * (bias + pixels.scatter * Normal(rng));
    const double odd = scale * (bias + pixels.scatter * Normal(rng));
    for (const double number :
         {i < pixels.first ? 1 : pixels.most, pixels.use, pixels.blurred, even, odd})
      numbers.memory.push_back(number);
  }
  const PixelRadii radii(std::move(numbers), controller);
  return RadiusScale(sums, radii, SampleNoise(sums), kWidth);
}

// Where V / m² + B (p² + m²)² is least, to a tenth of a step.
double LeastAt(double noise, double bias, double past) {
  double least = 1;
  const auto error = [&](double m) {
    return noise / (m * m) + bias * (past * past + m * m) * (past * past + m * m);
  };
  for (double m = 1; m > 0.09; m *= 0.999) {
    if (error(m) < error(least)) least = m;
  }
  return least;
}

constexpr double kNoise = 0.1 * 0.1 / kPasses;

// The squared noise of a mean of 16 passes is known from 16,384 differences to 1.1 %, the squared
// bias, 0.05², to 0.7 % (deviations of 2.1e-3 and 0.9e-3 in one pixel), of which two deviations are
// taken. Sixth roots have a sixth of that; steps are of 1 %.
TEST(RadiusScaleTest, IsThatOfLeastErrorForTheBiasOfTheImage) {
  for (const double past : {0.3, 1.0}) {
    const double expected = LeastAt(kNoise, 0.05 * 0.05, past);
    ASSERT_LT(expected, 0.7);
    EXPECT_NEAR(ScaleOf(SumsOf(), {.bias = 0.05, .blurred = past}), expected, 0.014 * expected)
        << past;
  }
}

// No pixel of these knows its bias: it is half a deviation of its mean.
TEST(RadiusScaleTest, KnowsBiasThatNoPixelIsSureOf) {
  const double expected = LeastAt(kNoise, 0.05 * 0.05, 1);
  EXPECT_NEAR(ScaleOf(SumsOf(), {.bias = 0.05, .scatter = 0.14}), expected, 0.05 * expected);
}

TEST(RadiusScaleTest, LeavesRadiiOfEvenLightAlone) {
  EXPECT_EQ(ScaleOf(SumsOf(), {}), 1);
  EXPECT_EQ(ScaleOf(SumsOf(), {.scatter = 0.14}), 1);
}

// Noise of radii of half the size is a quarter of it at whole ones.
TEST(RadiusScaleTest, CountsTheFactorsThatPassesHad) {
  const double expected = LeastAt(kNoise / 4, 0.05 * 0.05, 1);
  EXPECT_NEAR(ScaleOf(SumsOf(), {.bias = 0.05, .use = 0.5}), expected, 0.014 * expected);
}

// All bias is in a sixteenth of the pixels, one tile in height, whose square is 1.6 % of the light.
// That it lies together says nothing of chance.
TEST(RadiusScaleTest, IsSureOfBiasThatLiesTogether) {
  constexpr std::size_t kFirst = kPixelsScaled / 16 * 15;
  const double expected = LeastAt(kNoise, 0.2 * 0.2 / 16, 1);
  EXPECT_NEAR(ScaleOf(SumsOf(), {.bias = 0.2, .scatter = 0.01, .first = kFirst}), expected,
              0.014 * expected);
}

// All bias is in a quarter of the pixels, whose own evidence holds their radii at 0.2 already.
TEST(RadiusScaleTest, LeavesOutPixelsThatTheirOwnEvidenceHolds) {
  constexpr std::size_t kFirst = kPixelsScaled / 4 * 3;
  const ImageSums sums = SumsOf();
  const double alone = ScaleOf(sums, {.bias = 0.2, .first = kFirst});
  EXPECT_LT(alone, 0.5);
  EXPECT_EQ(ScaleOf(sums, {.bias = 0.2, .most = 0.2, .first = kFirst}), 1);
  // Those held above the factor count, as far as they are free.
  const double expected = LeastAt(kNoise, 0.9 * 0.2 * 0.2 / 4, 1);
  EXPECT_NEAR(ScaleOf(sums, {.bias = 0.2, .most = 0.9, .first = kFirst}), expected,
              0.014 * expected);
}

TEST(RadiusScaleTest, IsTheSameWhateverFactorScalesAllLight) {
  const double scale = ScaleOf(SumsOf(), {.bias = 0.05});
  EXPECT_LT(scale, 0.7);
  for (const double factor : {0x1p-40, 0x1p50, 1e5})
    EXPECT_EQ(ScaleOf(SumsOf({.scale = factor}), {.bias = 0.05}, factor), scale);
}

TEST(RadiusScaleTest, IsOneWhereChanceIsNotKnown) {
  EXPECT_EQ(ScaleOf(ImageSums(kPixelsScaled), {.bias = 0.05}), 1);
  EXPECT_EQ(ScaleOf(SumsOf({.tiles = 7}), {.bias = 0.05}), 1);
  EXPECT_LT(ScaleOf(SumsOf({.tiles = 8}), {.bias = 0.05}), 0.8);
}

TEST(RadiusScaleTest, IsOneWhereTheControllerScalesNothing) {
  RenderSettings settings;
  settings.radius_controller = RadiusControllerKind::kPpm;
  const std::unique_ptr<RadiusController> ppm = MakeRadiusController(settings, 1);
  const ImageSums sums = SumsOf();
  EXPECT_EQ(RadiusScale(sums, PixelRadii(kPixelsScaled, 1, *ppm), SampleNoise(sums), kWidth), 1);
}

}  // namespace
}  // namespace lucerna
