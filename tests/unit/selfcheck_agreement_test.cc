// Equal up to noise must be told from different, and the odds must be those that are promised.
#include "client/selfcheck/selfcheck_agreement.h"

#include <cmath>
#include <vector>

#include "gtest/gtest.h"

#include "render/math/rng.h"

namespace lucerna {
namespace {

constexpr int kSide = 16;

// Grey pixels around `level` with a standard deviation of `noise`.
Image NoisyImage(double level, double noise, std::uint64_t seed) {
  KeyedRng rng(seed);
  ImageChannel channel = {.name = "R", .pixels = {}};
  for (int i = 0; i < kSide * kSide; ++i) {
    double sum = -6;
    for (int term = 0; term < 12; ++term)
      sum += static_cast<double>(rng.Uniform());
    channel.pixels.push_back(static_cast<float>(level + noise * sum));
  }
  Image image = {.width = kSide, .height = kSide, .channels = {channel}, .metadata = {}};
  for (const char* name : {"G", "B"}) {
    image.channels.push_back(channel);
    image.channels.back().name = name;
  }
  return image;
}

double Deviations(double level, std::uint64_t seed) {
  std::vector<Image> images;
  for (std::uint64_t i = 0; i < 8; ++i)
    images.push_back(NoisyImage(1, 0.2, 100 * seed + i));
  images.push_back(NoisyImage(level, 0.2, 100 * seed + 50));
  std::vector<const Image*> base;
  for (std::size_t i = 0; i < 8; ++i)
    base.push_back(&images[i]);
  const std::vector<const Image*> other = {&images.back()};
  const StatusOr<double> deviations = DeviationsBeyondNoise(base, other);
  return deviations.ok() ? *deviations : NAN;
}

TEST(SelfcheckAgreementTest, IsAStandardNormalVariableWhenOnlyNoiseDiffers) {
  constexpr int kTrials = 400;
  double sum = 0;
  double square = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const double deviations = Deviations(1, static_cast<std::uint64_t>(trial + 1));
    EXPECT_LT(deviations, kMostDeviations);
    sum += deviations / kTrials;
    square += deviations * deviations / kTrials;
  }
  // The mean of so many has a standard deviation of 1 / 20; the transformation is good to about
  // a tenth.
  EXPECT_NEAR(sum, 0, 0.1 + 4.0 / 20);
  EXPECT_NEAR(square, 1, 0.1 + 4 * std::sqrt(2.0) / 20);
}

// A tile of 16 pixels has a noise of 0.05, so this is three times it.
TEST(SelfcheckAgreementTest, SeesADifferenceOfThreeTimesTheNoise) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed)
    EXPECT_GT(Deviations(1.15, seed), kMostDeviations);
}

TEST(SelfcheckAgreementTest, NothingButTheSameAgreesWithoutNoise) {
  const Image image = NoisyImage(1, 0, 1);
  const Image other = NoisyImage(1.001, 0, 1);
  const std::vector<const Image*> base(3, &image);
  EXPECT_EQ(DeviationsBeyondNoise(base, {&base[0], 1}).value(), -HUGE_VAL);
  const Image* const others = &other;
  EXPECT_EQ(DeviationsBeyondNoise(base, {&others, 1}).value(), HUGE_VAL);
}

TEST(SelfcheckAgreementTest, ANumberThatIsNoneIsFarFromEverything) {
  std::vector<Image> images;
  for (std::uint64_t seed = 1; seed <= 4; ++seed)
    images.push_back(NoisyImage(1, 0.2, seed));
  images.back().channels[0].pixels[5] = NAN;
  const std::vector<const Image*> base = {&images[0], &images[1], &images[2]};
  const Image* const other = &images[3];
  EXPECT_EQ(DeviationsBeyondNoise(base, {&other, 1}).value(), HUGE_VAL);
}

}  // namespace
}  // namespace lucerna
