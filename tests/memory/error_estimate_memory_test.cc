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
  ImageStatistics image = {.width = kSide,
                           .height = kSide,
                           .passes = 4,
                           .pixels = std::vector<PixelStatistics>(kPixels)};
  KeyedRng rng(2);
  for (PixelStatistics& pixel : image.pixels) {
    pixel.all = {4 + rng.Uniform(), 4 + rng.Uniform(), 4 + rng.Uniform()};
    pixel.half_difference = {rng.Uniform(), rng.Uniform(), rng.Uniform()};
    pixel.squared_deviations = rng.Uniform();
    pixel.even_bias = 0.1F * rng.Uniform();
    pixel.odd_bias = 0.1F * rng.Uniform();
    pixel.bias_color = {1, 1, 1};
  }
  return image;
}

// While the pixels' errors are found: the image, sums of rows of three channels, the least
// luminance, the error of each pixel (six numbers), the difference of halves, and six of bias. The
// image is gone before bias is smoothed, which takes less than what it and the sums took.
TEST(ErrorEstimateMemoryTest, FreesTheImageBeforeBiasIsSmoothed) {
  ThreadTeam team(1);
  ImageStatistics image = NoisyImage();
  const std::size_t before = LiveBytes() - kPixels * sizeof(PixelStatistics);
  ForgetMostLiveBytes();
  const ErrorEstimate estimate = EstimateError(std::move(image), 1, team);
  EXPECT_GT(estimate.relative.noise, 0);
  const std::size_t of_pixel = sizeof(PixelStatistics) + sizeof(float) * (3 + 1 + 6 + 1 + 6);
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
