// How much memory does an error estimate take?
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "gtest/gtest.h"

#include "render/base/memory.h"
#include "render/estimate/error_estimate.h"
#include "render/math/rng.h"
#include "tests/memory/failing_allocations.h"

namespace lucerna {
namespace {

constexpr int kSide = 256;
constexpr std::size_t kPixels = std::size_t{kSide} * kSide;

ImageStatistics NoisyImage() {
  ImageStatistics image(kSide, kSide, /*image_passes=*/4);
  KeyedRng rng(2);
  for (std::size_t i = 0; i < kPixels; ++i) {
    PixelStatistics pixel;
    pixel.all = {4 + rng.Uniform(), 4 + rng.Uniform(), 4 + rng.Uniform()};
    pixel.half_difference = {rng.Uniform(), rng.Uniform(), rng.Uniform()};
    pixel.squared_deviations = rng.Uniform();
    pixel.even_bias = 0.1F * rng.Uniform();
    pixel.odd_bias = 0.1F * rng.Uniform();
    pixel.bias_color = {1, 1, 1};
    image.Set(i, pixel);
  }
  return image;
}

// The most is held while bias is smoothed: six numbers of a pixel's bias and four of its errors,
// what the narrower smoothing has said (two) and what this one says (two), and two more on the way.
// Before that, what a pixel's statistics give takes their place.
TEST(ErrorEstimateMemoryTest, TakesAThirdMoreThanTheImage) {
  ThreadTeam team(1);
  ImageStatistics image = NoisyImage();
  const std::size_t before = LiveBytes() - kPixels * sizeof(PixelStatistics);
  ForgetMostLiveBytes();
  const ErrorEstimate estimate = EstimateError(std::move(image), 1, team);
  EXPECT_GT(estimate.relative.noise, 0);
  constexpr std::size_t of_pixel = sizeof(float) * (6 + 4 + 2 + 2 + 2);
  static_assert(3 * of_pixel == 4 * sizeof(PixelStatistics));
  constexpr std::size_t kSlack = std::size_t{64} * 4096;
  EXPECT_LE(MostLiveBytes() - before, kPixels * of_pixel + kSlack);
  EXPECT_LE(LiveBytes(), before + kSlack);
}

TEST(FreeMemoryOfTest, KeepsNothing) {
  std::vector<float> column(kPixels, 1.0F);
  const std::size_t before = LiveBytes();
  FreeMemoryOf(column);
  EXPECT_TRUE(column.empty());
  EXPECT_LE(LiveBytes(), before - kPixels * sizeof(float));
}

}  // namespace
}  // namespace lucerna
