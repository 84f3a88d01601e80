// The deviations of pixels made of known noise.
#include "render/estimate/noise_layer.h"

#include <cmath>
#include <vector>

#include "gtest/gtest.h"

#include "render/math/rng.h"

namespace lucerna {
namespace {

constexpr int kSide = 64;
constexpr std::size_t kPixels = static_cast<std::size_t>(kSide) * kSide;

// A pixel whose variance over passes is `of_passes`, and whose halves differ by a normal number of
// which it is `factor` times as much.
PixelNoise Pixel(KeyedRng& rng, double of_passes, double factor) {
  // Twelve uniform numbers: of variance 1.
  double normal = -6;
  for (int i = 0; i < 12; ++i)
    normal += static_cast<double>(rng.Uniform());
  return {.of_halves = normal * normal * factor * of_passes,
          .of_passes = of_passes,
          .largest_share = 0.1};
}

double RootMeanSquare(const std::vector<float>& noise, bool (*counts)(std::size_t pixel)) {
  double sum = 0;
  double count = 0;
  for (std::size_t i = 0; i < noise.size(); ++i) {
    if (!counts(i)) continue;
    sum += static_cast<double>(noise[i]) * static_cast<double>(noise[i]);
    ++count;
  }
  return std::sqrt(sum / count);
}

bool IsLeft(std::size_t pixel) {
  return pixel % kSide < kSide / 2;
}
bool IsFarLeft(std::size_t pixel) {
  return pixel % kSide < kSide / 4;
}
bool IsFarRight(std::size_t pixel) {
  return pixel % kSide >= kSide * 3 / 4;
}
bool IsEdge(std::size_t pixel) {
  return pixel % kSide == 20;
}
bool IsBesideTheEdge(std::size_t pixel) {
  return pixel % kSide == 19 || pixel % kSide == 21;
}

// Stratification helps in the right half, a hundredfold, and not in the left. A quarter of the
// image away from the border between them each side has its own factor.
TEST(NoiseLayerTest, TheFactorIsThatOfThePlace) {
  KeyedRng rng(3);
  std::vector<PixelNoise> pixels(kPixels);
  for (std::size_t i = 0; i < kPixels; ++i)
    pixels[i] = Pixel(rng, 4, IsLeft(i) ? 1 : 0.01);
  const std::vector<float> noise = NoiseOfPixels(kSide, kSide, 1, pixels);
  // Of 1024 squared normal numbers: deviation 0.044 of the square, 0.022 of its root.
  EXPECT_NEAR(RootMeanSquare(noise, IsFarLeft) / 2, 1, 0.09);
  EXPECT_NEAR(RootMeanSquare(noise, IsFarRight) / 0.2, 1, 0.09);
}

// One column of pixels has a thousand times the variance over passes, almost none of which is left
// in the mean: an edge. Neither side takes the other's factor.
TEST(NoiseLayerTest, AnEdgeHasAFactorOfItsOwn) {
  KeyedRng rng(4);
  std::vector<PixelNoise> pixels(kPixels);
  for (std::size_t i = 0; i < kPixels; ++i)
    pixels[i] = IsEdge(i) ? Pixel(rng, 1000, 0.02) : Pixel(rng, 1, 1);
  const std::vector<float> noise = NoiseOfPixels(kSide, kSide, 1, pixels);
  // 64 and 128 numbers.
  EXPECT_NEAR(RootMeanSquare(noise, IsEdge) / std::sqrt(20), 1, 4 * 0.09);
  EXPECT_NEAR(RootMeanSquare(noise, IsBesideTheEdge), 1, 4 * 0.06);
}

// A pixel in which one pass has found what no other did: its halves are what is known, and its
// neighbours do not hear of it.
TEST(NoiseLayerTest, OneOutlierCountsForItselfOnly) {
  std::vector<PixelNoise> pixels(kPixels,
                                 {.of_halves = 0.04, .of_passes = 1, .largest_share = 0.1});
  const std::size_t place = 30 * kSide + 30;
  pixels[place] = {.of_halves = 2, .of_passes = 2, .largest_share = 1};
  const std::vector<float> noise = NoiseOfPixels(kSide, kSide, 1, pixels);
  EXPECT_FLOAT_EQ(noise[place], std::sqrt(2.0F));
  EXPECT_NEAR(noise[place + 1], 0.2, 1e-6);
}

// More pixels are averaged where noise is alike in many: the spread of the layer stays the same.
TEST(NoiseLayerTest, ReachesFartherWhereNeighboursAreAlike) {
  const auto spread = [](int alike) {
    KeyedRng rng(5);
    std::vector<PixelNoise> pixels(kPixels);
    for (std::size_t i = 0; i < kPixels; ++i) {
      const auto a = static_cast<std::size_t>(alike);
      const std::size_t first = i / kSide / a * a * kSide + i % kSide / a * a;
      pixels[i] = first == i ? Pixel(rng, 1, 1) : pixels[first];
    }
    double squares = 0;
    for (const float noise : NoiseOfPixels(kSide, kSide, alike * alike, pixels))
      squares += std::pow(static_cast<double>(noise) * static_cast<double>(noise) - 1, 2);
    return std::sqrt(squares / kPixels);
  };
  // 24 degrees of freedom: sqrt(2/24) = 0.29 of the square.
  EXPECT_LT(spread(1), 0.29);
  EXPECT_LT(spread(4), 0.35);
}

TEST(NoiseLayerTest, ScalesWithTheLightToTheBit) {
  KeyedRng rng(6);
  std::vector<PixelNoise> pixels(kPixels);
  for (std::size_t i = 0; i < kPixels; ++i)
    pixels[i] = Pixel(rng, 0.3 + static_cast<double>(i % 97), 0.4);
  const std::vector<float> noise = NoiseOfPixels(kSide, kSide, 3, pixels);
  for (const int exponent : {-60, -1, 1, 60}) {
    std::vector<PixelNoise> scaled = pixels;
    for (PixelNoise& pixel : scaled) {
      pixel.of_halves = std::ldexp(pixel.of_halves, 2 * exponent);
      pixel.of_passes = std::ldexp(pixel.of_passes, 2 * exponent);
    }
    const std::vector<float> of_scaled = NoiseOfPixels(kSide, kSide, 3, scaled);
    for (std::size_t i = 0; i < kPixels; ++i)
      ASSERT_EQ(of_scaled[i], std::ldexp(noise[i], exponent)) << i;
  }
}

TEST(NoiseLayerTest, PixelsThatAreTheSameInAllPassesHaveNone) {
  std::vector<PixelNoise> pixels(kPixels);
  EXPECT_EQ(NoiseOfPixels(kSide, kSide, 1, pixels), std::vector<float>(kPixels));
  pixels[7] = {.of_halves = 0.5, .of_passes = 1, .largest_share = 0.2};
  const std::vector<float> noise = NoiseOfPixels(kSide, kSide, 1, pixels);
  EXPECT_EQ(noise[6], 0);
  EXPECT_FLOAT_EQ(noise[7], std::sqrt(0.5F));
  // One pixel, and a single row.
  EXPECT_FLOAT_EQ(NoiseOfPixels(1, 1, 1, {{{.of_halves = 4, .of_passes = 1}}}).front(), 2);
  EXPECT_EQ(NoiseOfPixels(kSide, 1, 100, std::vector<PixelNoise>(kSide, {1, 1, 0})).size(), kSide);
}

}  // namespace
}  // namespace lucerna
