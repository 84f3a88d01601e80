// Images made of known values and known noise, denoised.
#include "render/film/denoise.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "gtest/gtest.h"

#include "render/math/rng.h"

namespace lucerna {
namespace {

constexpr int kWidth = 96, kHeight = 80;  // more than a tile of the filter, and not whole ones
constexpr std::size_t kPixels = static_cast<std::size_t>(kWidth) * kHeight;

using Truth = std::function<double(int x, int y)>;

double Normal(KeyedRng& rng) {
  // Twelve uniform numbers: of variance 1.
  double normal = -6;
  for (int i = 0; i < 12; ++i)
    normal += static_cast<double>(rng.Uniform());
  return normal;
}

// Grey, on one white surface; the mean of both halves has noise of `deviation`.
NoisyImage ImageOf(const Truth& truth, double deviation, std::uint64_t key) {
  NoisyImage image;
  image.width = kWidth;
  image.height = kHeight;
  for (std::size_t c = 0; c < 3; ++c) {
    image.features.albedo[c].assign(kPixels, 1);
    image.features.normal[c].assign(kPixels, c == 2 ? 1 : 0);
  }
  image.features.normal_variance.assign(kPixels, 0);
  image.features.distance.assign(kPixels, 5);
  image.noise.assign(kPixels, static_cast<float>(deviation));
  KeyedRng rng(key);
  for (ColorColumns& half : image.halves) {
    for (std::size_t pixel = 0; pixel < kPixels; ++pixel) {
      const int x = static_cast<int>(pixel) % kWidth, y = static_cast<int>(pixel) / kWidth;
      const double value = truth(x, y) + std::sqrt(2.0) * deviation * Normal(rng);
      for (std::vector<float>& channel : half) {
        channel.resize(kPixels);
        channel[pixel] = static_cast<float>(value);
      }
    }
  }
  return image;
}

DenoisedImage Denoised(NoisyImage image, int threads = 2) {
  ThreadTeam team(threads);
  return Denoise(std::move(image), team);
}

// Mean squared error of the green channel, over that of the image's noise, of the pixels that
// count.
double ErrorLeft(const DenoisedImage& denoised, const Truth& truth, double deviation,
                 const std::function<bool(int x, int y)>& counts) {
  double squares = 0, pixels = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      if (!counts(x, y)) continue;
      const std::size_t pixel = static_cast<std::size_t>(y) * kWidth + static_cast<std::size_t>(x);
      const double off = static_cast<double>(denoised.pixels[1][pixel]) - truth(x, y);
      squares += off * off;
      ++pixels;
    }
  }
  return squares / pixels / (deviation * deviation);
}
bool Everywhere(int, int) {
  return true;
}

double Flat(int, int) {
  return 1;
}
double Step(int x, int) {
  return x < 40 ? 1 : 2;
}
// As fine as pixels, below the noise of one.
double Weave(int x, int y) {
  return (x + y) % 2 == 0 ? 0.8 : 1.2;
}
// As fine, without a pattern.
double Gravel(int x, int y) {
  KeyedRng rng(static_cast<std::uint64_t>(y * kWidth + x));
  return 0.75 + 0.5 * static_cast<double>(rng.Uniform());
}
// A quarter each: flat, a step, a slope, and stripes as wide as a patch.
double Mixed(int x, int y) {
  if (y < kHeight / 2) return x < kWidth / 2 ? 1 : (x < 3 * kWidth / 4 ? 0.6 : 1.4);
  return x < kWidth / 2 ? 0.7 + 0.01 * x : ((x / 4) % 2 == 0 ? 0.8 : 1.3);
}

TEST(DenoiseTest, OfFlatLightLittleNoiseIsLeft) {
  const double left = ErrorLeft(Denoised(ImageOf(Flat, 0.3, 1)), Flat, 0.3, Everywhere);
  EXPECT_LT(left, 0.02);
  // No filter leaves less than the mean of all that it looks at.
  EXPECT_GT(left, 1 / (17.0 * 17));
}

TEST(DenoiseTest, WhatHasNoNoiseStays) {
  const DenoisedImage denoised = Denoised(ImageOf(Mixed, 0, 1));
  for (std::size_t pixel = 0; pixel < kPixels; ++pixel) {
    const int x = static_cast<int>(pixel) % kWidth, y = static_cast<int>(pixel) / kWidth;
    ASSERT_NEAR(static_cast<double>(denoised.pixels[1][pixel]), Mixed(x, y), 2e-5) << x << ' ' << y;
  }
}

TEST(DenoiseTest, AStepAboveTheNoiseStaysSharp) {
  const auto beside = [](int x, int) { return x == 39 || x == 40; };
  EXPECT_LT(ErrorLeft(Denoised(ImageOf(Step, 0.1, 2)), Step, 0.1, beside), 0.3);
}

// Filters find nothing alike, and the other half shows that it is no noise.
TEST(DenoiseTest, DetailWithoutAnyPatternComesBack) {
  EXPECT_LT(ErrorLeft(Denoised(ImageOf(Gravel, 0.1, 3)), Gravel, 0.1, Everywhere), 1.02);
}

// The mean of estimates less true errors, over sixteen images, within five of its deviations.
class DenoisedErrorTest : public testing::TestWithParam<double> {};

TEST_P(DenoisedErrorTest, IsWhatTheHalvesSay) {
  const double deviation = GetParam();
  constexpr int kImages = 16;
  for (const auto& [name, truth] : {std::pair<const char*, Truth>{"flat", Flat},
                                    {"step", Step},
                                    {"weave", Weave},
                                    {"gravel", Gravel},
                                    {"mixed", Mixed}}) {
    double off_by = 0, right = 0, chance = 0, largest = 0;
    for (std::uint64_t key = 0; key < kImages; ++key) {
      const DenoisedImage denoised = Denoised(ImageOf(truth, deviation, 100 + key));
      // The squared noise is deviation², and relative errors weigh it by the square of the value.
      double squares = 0, noise = 0;
      for (std::size_t pixel = 0; pixel < kPixels; ++pixel) {
        const int x = static_cast<int>(pixel) % kWidth, y = static_cast<int>(pixel) / kWidth;
        const double value = truth(x, y);
        const double off = static_cast<double>(denoised.pixels[1][pixel]) - value;
        const double floor = 0.01;  // times the squared mean of the image, near 1
        squares += off * off / (value * value + floor);
        noise += deviation * deviation / (value * value + floor);
      }
      off_by += (denoised.noise_left + denoised.blur - squares / noise) / kImages;
      right += squares / noise / kImages;
      chance += denoised.deviation * denoised.deviation / (kImages * kImages);
      largest = std::max(largest, denoised.deviation);
    }
    // Shares are chosen by both halves, which makes the estimate too small by up to 2 %.
    EXPECT_NEAR(off_by, 0, 5 * std::sqrt(chance) + 0.02 * right) << name;
    EXPECT_LT(largest, 0.2) << name << ": chance alone says nothing";
  }
}
INSTANTIATE_TEST_SUITE_P(Deviations, DenoisedErrorTest, testing::Values(0.1, 0.3));

TEST(DenoiseTest, SurfacesOfOtherNormalsDoNotMix) {
  constexpr double kDeviation = 0.3;
  const auto truth = [](int x, int) { return x < 40 ? 1 : 1.3; };
  const auto beside = [](int x, int) { return x >= 37 && x < 43; };
  const auto error = [&](bool is_corner) {
    double sum = 0;
    for (std::uint64_t key = 0; key < 8; ++key) {
      NoisyImage image = ImageOf(truth, kDeviation, 200 + key);
      for (std::size_t pixel = 0; is_corner && pixel < kPixels; ++pixel) {
        if (pixel % kWidth < 40) continue;
        image.features.normal[2][pixel] = 0;
        image.features.normal[0][pixel] = 1;
      }
      sum += ErrorLeft(Denoised(std::move(image)), truth, kDeviation, beside);
    }
    return sum / 8;
  };
  EXPECT_LT(error(true), 0.5 * error(false));
}

// Through rough glass each pixel's paths meet a bright floor and a dark wall, in numbers that
// chance decides: normals have the same noise as the light of both halves.
TEST(DenoiseTest, NormalsThatAreChanceDoNotKeepNoise) {
  constexpr int kPaths = 8;  // of a half
  const double deviation = 1.2 * 0.5 / std::sqrt(2.0 * kPaths);
  NoisyImage image = ImageOf(Flat, 0, 4);
  image.noise.assign(kPixels, static_cast<float>(deviation));
  KeyedRng rng(5);
  for (std::size_t pixel = 0; pixel < kPixels; ++pixel) {
    double floor = 0;
    for (ColorColumns& half : image.halves) {
      double of_half = 0;
      for (int path = 0; path < kPaths; ++path)
        of_half += rng.Uniform() < 0.5F ? 1.0 / kPaths : 0;
      for (std::vector<float>& channel : half)
        channel[pixel] = static_cast<float>(0.4 + 1.2 * of_half);
      floor += of_half / 2;
    }
    image.features.normal[1][pixel] = static_cast<float>(floor);
    image.features.normal[2][pixel] = static_cast<float>(1 - floor);
    const double square = floor * floor + (1 - floor) * (1 - floor);
    image.features.normal_variance[pixel] = static_cast<float>((1 - square) / (2 * kPaths - 1));
  }
  const double with_variance = ErrorLeft(Denoised(image), Flat, deviation, Everywhere);
  image.features.normal_variance.assign(kPixels, 0);
  const double without = ErrorLeft(Denoised(image), Flat, deviation, Everywhere);
  EXPECT_LT(with_variance, 0.1);
  EXPECT_LT(with_variance, 0.2 * without);
}

TEST(DenoiseTest, TexturesAreNotLight) {
  constexpr double kDeviation = 0.2;
  const auto albedo = [](int x, int y) { return 0.9 * Gravel(x, y) - 0.475; };  // 0.2 to 0.65
  const Truth truth = albedo;
  NoisyImage image = ImageOf([](int, int) { return 1.0; }, kDeviation, 6);
  for (std::size_t pixel = 0; pixel < kPixels; ++pixel) {
    const int x = static_cast<int>(pixel) % kWidth, y = static_cast<int>(pixel) / kWidth;
    const auto share = static_cast<float>(albedo(x, y));
    for (std::size_t c = 0; c < 3; ++c) {
      image.features.albedo[c][pixel] = share;
      for (ColorColumns& half : image.halves)
        half[c][pixel] *= share;
    }
    image.noise[pixel] *= share;
  }
  EXPECT_LT(ErrorLeft(Denoised(std::move(image)), truth, kDeviation, Everywhere), 0.005);
}

TEST(DenoiseTest, WhatCameOnceIsSpread) {
  NoisyImage image = ImageOf(Flat, 0.1, 7);
  constexpr std::size_t kPixel = 40 * kWidth + 50;
  for (std::size_t c = 0; c < 3; ++c)
    image.halves[0][c][kPixel] = 100;
  // As the noise layer has a pixel that one pass decides: by the difference of its own halves.
  image.noise[kPixel] = 50;
  const DenoisedImage denoised = Denoised(std::move(image));
  EXPECT_LT(denoised.pixels[1][kPixel], 3);
}

TEST(DenoiseTest, ThreadsChangeNoBit) {
  EXPECT_EQ(Denoised(ImageOf(Mixed, 0.2, 8), 1).pixels, Denoised(ImageOf(Mixed, 0.2, 8), 3).pixels);
}

TEST(DenoiseTest, BrightnessChangesNothing) {
  const DenoisedImage plain = Denoised(ImageOf(Mixed, 0.2, 9));
  for (const float factor : {0x1p-90F, 0x1p-20F, 0x1p90F}) {
    NoisyImage scaled = ImageOf(Mixed, 0.2, 9);
    for (ColorColumns& half : scaled.halves) {
      for (std::vector<float>& channel : half) {
        for (float& value : channel)
          value *= factor;
      }
    }
    for (float& value : scaled.noise)
      value *= factor;
    const DenoisedImage denoised = Denoised(std::move(scaled));
    EXPECT_EQ(denoised.noise_left, plain.noise_left);
    EXPECT_EQ(denoised.blur, plain.blur);
    for (std::size_t pixel = 0; pixel < kPixels; ++pixel)
      ASSERT_EQ(denoised.pixels[1][pixel], factor * plain.pixels[1][pixel]);
  }
}

TEST(DenoiseTest, HalvesOfUnlikeWeightCountAsTheyWeigh) {
  NoisyImage image = ImageOf(Flat, 0, 10);
  for (std::size_t c = 0; c < 3; ++c) {
    image.halves[0][c].assign(kPixels, 1);
    image.halves[1][c].assign(kPixels, 2);
  }
  image.noise.assign(kPixels, 0.5F);
  image.even_share = 0.75;
  EXPECT_NEAR(static_cast<double>(Denoised(std::move(image)).pixels[1][kPixels / 2]), 1.25, 1e-5);
}

TEST(DenoiseTest, ABlackImageStaysBlack) {
  const DenoisedImage denoised = Denoised(ImageOf([](int, int) { return 0.0; }, 0, 11));
  for (const float value : denoised.pixels[1])
    ASSERT_EQ(value, 0);
}

TEST(ErrorOfDenoisedTest, HoldsTheImagesBiasAndTheFiltersBlur) {
  DenoisedImage denoised;
  denoised.noise_left = 0.2;
  denoised.blur = 0.1;
  denoised.all_left = 0.25;
  ErrorEstimate image;
  image.relative = {.noise = 4, .bias = 1, .low = 3, .high = 8};
  image.untrimmed = 9;
  const DenoisedError error = ErrorOfDenoised(denoised, image);
  EXPECT_DOUBLE_EQ(error.relative.noise, 0.8);
  EXPECT_DOUBLE_EQ(error.relative.bias, 1.4);
  EXPECT_DOUBLE_EQ(error.untrimmed, 1 + 8 * 0.25);
  EXPECT_LT(error.relative.low, error.relative.total());
  EXPECT_GT(error.relative.high, 8 * error.relative.total() / 5) << "blur may add to bias";
  denoised.feature_share = 1;
  EXPECT_GT(ErrorOfDenoised(denoised, image).relative.high, error.relative.high);
}

}  // namespace
}  // namespace lucerna
