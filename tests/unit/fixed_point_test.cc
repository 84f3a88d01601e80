// Rounding to quanta is fair, and a quantum is a power of two that follows the scene's power.
#include "render/math/fixed_point.h"

#include <cmath>

#include "gtest/gtest.h"

#include "render/math/rng.h"

namespace lucerna {
namespace {

constexpr std::uint32_t kDithers = 1U << 21;

// The mean of the rounded value over all random bits that there are: no statistics involved.
double MeanRounded(float value) {
  double sum = 0;
  for (std::uint32_t dither = 0; dither < kDithers; ++dither) {
    sum += static_cast<double>(RoundDithered(value, dither));
  }
  return sum / kDithers;
}

TEST(RoundDitheredTest, IsFairToTheFinenessOfItsBits) {
  KeyedRng rng(1);
  for (int exponent = -6; exponent <= 9; ++exponent) {
    for (int i = 0; i < 3; ++i) {
      const float value = std::pow(10.0F, static_cast<float>(exponent)) * (1 + 8 * rng.Uniform());
      // One step of the dither, and half a unit in the last place of the sum.
      const double bound = 0x1p-21 + static_cast<double>(value) * 0x1p-24;
      EXPECT_NEAR(MeanRounded(value), static_cast<double>(value), bound) << value;
    }
  }
}

TEST(RoundDitheredTest, GoesToANeighbourAndKeepsNothing) {
  EXPECT_EQ(MeanRounded(0), 0);
  for (const float value : {0.25F, 0.999F, 3.5F, 1000.75F}) {
    const auto below = static_cast<std::int64_t>(value);
    for (std::uint32_t dither = 0; dither < kDithers; dither += 101) {
      const std::int64_t rounded = RoundDithered(value, dither);
      ASSERT_TRUE(rounded == below || rounded == below + 1) << value << " " << dither;
    }
  }
}

TEST(RoundDitheredTest, IsExactAtTheLargestContributionAndItsSumsFit) {
  const auto largest = static_cast<std::int64_t>(kLargestContribution);
  EXPECT_EQ(RoundDithered(kLargestContribution, 0), largest);
  EXPECT_EQ(RoundDithered(kLargestContribution, kDithers - 1), largest);
  std::int64_t sum = 0;
  EXPECT_FALSE(__builtin_mul_overflow(8 * largest, static_cast<std::int64_t>(kMostTerms), &sum));
}

TEST(QuantumForTest, IsThePowerOfTwoThatIsPromised) {
  EXPECT_EQ(QuantumFor(1), std::ldexp(1.0F, -kFluxBits));
  EXPECT_EQ(QuantumFor(std::nextafter(1.0F, 2.0F)), std::ldexp(1.0F, 1 - kFluxBits));
  EXPECT_EQ(QuantumFor(std::nextafter(1.0F, 0.0F)), std::ldexp(1.0F, -kFluxBits));
  EXPECT_EQ(QuantumFor(0.5F), std::ldexp(1.0F, -1 - kFluxBits));
  EXPECT_EQ(QuantumFor(0), 1);
  EXPECT_EQ(QuantumFor(NAN), 1);
}

TEST(QuantumForTest, ScalesWithThePower) {
  KeyedRng rng(2);
  for (int i = 0; i < 1000; ++i) {
    const float power = 0.1F + 100 * rng.Uniform();
    for (const int k : {-60, -7, 1, 60}) {
      ASSERT_EQ(QuantumFor(std::ldexp(power, k)), std::ldexp(QuantumFor(power), k)) << power;
    }
  }
}

// A channel that hardly emits anything has quanta too, and as finite a number of them in a watt.
TEST(FluxScaleTest, IsFiniteForEveryPowerThatAFloatHolds) {
  for (const float power : {1e-44F, 1e-38F, 1e-34F, 1e-30F, 1e-9F, 1.0F, 1e30F, 3e38F}) {
    const FluxScale scale = FluxScale::ForPower(Gray(power));
    EXPECT_TRUE(std::isfinite(scale.quanta_per_watt.r)) << power;
    EXPECT_GT(scale.quanta_per_watt.r, 0) << power;
    EXPECT_EQ(scale.quanta_per_watt.r * scale.watts_per_quantum.r, 1) << power;
  }
}

}  // namespace
}  // namespace lucerna
