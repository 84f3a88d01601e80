// The figures of a comparison must be the ones worked out by hand, whatever is cropped, scaled,
// clipped, trimmed or masked first.
#include "render/film/image_metrics.h"

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "gtest/gtest.h"

namespace lucerna {
namespace {

Image GrayImage(int width, int height, std::vector<float> pixels) {
  Image image;
  image.width = width;
  image.height = height;
  image.channels = {{"B", pixels}, {"G", pixels}, {"R", pixels}};
  return image;
}

ImageMetrics Compared(const Image& a, const Image& b, const MetricsOptions& options = {}) {
  const StatusOr<ImageMetrics> metrics = Compare(a, b, options);
  EXPECT_TRUE(metrics.ok()) << metrics.status();
  return metrics.ok() ? *metrics : ImageMetrics{};
}

TEST(ImageMetricsTest, WorkedByHand) {
  // Differences 1 and -2 against a reference of 1 and 4.
  const ImageMetrics metrics = Compared(GrayImage(2, 1, {2, 2}), GrayImage(2, 1, {1, 4}));
  EXPECT_EQ(metrics.pixels, 2U);
  EXPECT_DOUBLE_EQ(metrics.rmse, std::sqrt(2.5));
  // Mean luminance 2.5, of which a hundredth of the square.
  EXPECT_DOUBLE_EQ(metrics.floor, 0.0625);
  EXPECT_DOUBLE_EQ(metrics.rel_mse, (1 / 1.0625 + 4 / 16.0625) / 2);
  EXPECT_DOUBLE_EQ(metrics.mean_a, 2);
  EXPECT_DOUBLE_EQ(metrics.mean_b, 2.5);
  EXPECT_DOUBLE_EQ(metrics.mean_ratio, 0.8);
}

TEST(ImageMetricsTest, ChannelsAreToldApart) {
  Image image = GrayImage(1, 1, {1});
  Image reference = GrayImage(1, 1, {1});
  image.channels[2].pixels = {3};      // R
  reference.channels[0].pixels = {4};  // B
  const ImageMetrics metrics = Compared(image, reference);
  EXPECT_DOUBLE_EQ(metrics.channel_mean_ratio[0], 3);
  EXPECT_DOUBLE_EQ(metrics.channel_mean_ratio[1], 1);
  EXPECT_DOUBLE_EQ(metrics.channel_mean_ratio[2], 0.25);
}

TEST(ImageMetricsTest, EqualImagesAreAtDistanceZeroAlsoWhenBlack) {
  const ImageMetrics metrics = Compared(GrayImage(2, 1, {0, 0}), GrayImage(2, 1, {0, 0}));
  EXPECT_EQ(metrics.rmse, 0);
  EXPECT_EQ(metrics.rel_mse, 0);
  EXPECT_EQ(metrics.mean_ratio, 1);
}

// A black reference has no relative error; the limit of ever darker ones is infinite.
TEST(ImageMetricsTest, AnyErrorIsInfiniteRelativeToABlackReference) {
  EXPECT_EQ(Compared(GrayImage(2, 1, {0, 1}), GrayImage(2, 1, {0, 0})).rel_mse, HUGE_VAL);
}

TEST(ImageMetricsTest, AFloorCanBeGiven) {
  const MetricsOptions options = {.floor = 0.01};
  const ImageMetrics metrics = Compared(GrayImage(2, 1, {2, 2}), GrayImage(2, 1, {1, 4}), options);
  EXPECT_DOUBLE_EQ(metrics.rel_mse, (1 / 1.01 + 4 / 16.01) / 2);
  EXPECT_EQ(metrics.floor, 0.01);
}

TEST(ImageMetricsTest, LightTimesAnyFactorGivesTheSameRelativeError) {
  std::mt19937 random(5);
  std::exponential_distribution<float> value(1);
  std::vector<float> pixels(4096);
  std::vector<float> noisy(pixels.size());
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    pixels[i] = value(random) * (i % 100 == 0 ? 1000.0F : 1.0F);
    noisy[i] = pixels[i] * (0.9F + 0.2F * value(random));
  }
  const auto compared = [&](float factor) {
    std::vector<float> a = noisy;
    std::vector<float> b = pixels;
    for (std::size_t i = 0; i < a.size(); ++i) {
      a[i] *= factor;
      b[i] *= factor;
    }
    return Compared(GrayImage(64, 64, a), GrayImage(64, 64, b), {.trim_share = 0.001}).rel_mse;
  };
  const double base = compared(1);
  EXPECT_GT(base, 0.01);
  for (const int exponent : {-60, -3, 1, 17, 60})
    EXPECT_EQ(compared(std::ldexp(1.0F, exponent)), base) << exponent;
  // Pixels are floats: each is off by at most 2^-24, and a difference of a tenth by ten times that.
  for (const float factor : {0.4F / 3, 0.3F, 7.0F, 40000.0F})
    EXPECT_NEAR(compared(factor) / base, 1, 8 * 10 * 0x1p-24) << factor;
}

TEST(ImageMetricsTest, SizesMustAgreeUnlessToldOtherwise) {
  const Image large = GrayImage(3, 2, {1, 2, 9, 3, 4, 9});
  const Image small = GrayImage(2, 2, {1, 2, 3, 4});
  EXPECT_EQ(Compare(large, small).status().code(), absl::StatusCode::kInvalidArgument);
  const ImageMetrics cropped = Compared(large, small, {.fit = MetricsOptions::Fit::kCrop});
  EXPECT_EQ(cropped.pixels, 4U);
  EXPECT_EQ(cropped.rmse, 0);
}

TEST(ImageMetricsTest, ScalingAveragesBoxesAndKeepsTheMean) {
  // 4 -> 2 columns, 2 -> 1 rows.
  const Image large = GrayImage(4, 2, {1, 2, 3, 4, 5, 6, 7, 8});
  EXPECT_EQ(
      Compared(large, GrayImage(2, 1, {3.5F, 5.5F}), {.fit = MetricsOptions::Fit::kScale}).rmse, 0);
  // 3 -> 2 columns: the middle one is shared.
  const ImageMetrics shared = Compared(GrayImage(3, 1, {3, 6, 12}), GrayImage(2, 1, {4, 10}),
                                       {.fit = MetricsOptions::Fit::kScale});
  EXPECT_NEAR(shared.rmse, 0, 1e-12);
  // Each axis goes to the smaller of the two.
  EXPECT_EQ(Compared(GrayImage(2, 1, {2, 4}), GrayImage(1, 2, {1, 5}),
                     {.fit = MetricsOptions::Fit::kScale})
                .pixels,
            1U);
}

TEST(ImageMetricsTest, ClipsBothImagesFirst) {
  const ImageMetrics metrics =
      Compared(GrayImage(2, 1, {100, 1}), GrayImage(2, 1, {7, 1}), {.clip = 5});
  EXPECT_EQ(metrics.rmse, 0);
  EXPECT_DOUBLE_EQ(metrics.mean_a, 3);
}

TEST(ImageMetricsTest, TrimsTheWorstPixels) {
  const Image image = GrayImage(4, 1, {1, 1, 1, 50});
  const Image reference = GrayImage(4, 1, {1, 1, 2, 1});
  const ImageMetrics metrics = Compared(image, reference, {.trim_share = 0.25});
  EXPECT_EQ(metrics.pixels, 3U);
  // The floor is that of the whole reference: mean 5/4.
  EXPECT_DOUBLE_EQ(metrics.rel_mse, 1 / (4 + 0.015625) / 3);
  EXPECT_EQ(metrics.rel_mse_trimmed, metrics.rel_mse);
  const double worst = 49 * 49 / (1 + 0.015625);
  EXPECT_DOUBLE_EQ(metrics.rel_mse_untrimmed, (1 / (4 + 0.015625) + worst) / 4);
  EXPECT_EQ(Compare(image, reference, {.trim_share = 1}).status().code(),
            absl::StatusCode::kInvalidArgument);
}

TEST(ImageMetricsTest, TellsTheErrorWithAndWithoutTheWorstPixelsWhateverIsAskedFor) {
  std::vector<float> pixels(2000, 2);
  const std::vector<float> reference(2000, 1);
  pixels[3] = 1e4F;
  pixels[77] = 1e3F;
  const ImageMetrics metrics = Compared(GrayImage(50, 40, pixels), GrayImage(50, 40, reference));
  EXPECT_EQ(metrics.pixels, 2000U);
  EXPECT_NEAR(metrics.rel_mse_trimmed, 1 / 1.01, 1e-12);
  EXPECT_EQ(metrics.rel_mse_untrimmed, metrics.rel_mse);
  EXPECT_NEAR(metrics.rel_mse, (1998 + std::pow(9999, 2) + std::pow(999, 2)) / 1.01 / 2000, 1e-6);
}

TEST(ImageMetricsTest, LeavesOutWhatTheMaskBlackens) {
  const Image mask = GrayImage(2, 1, {0, 0.5F});
  const ImageMetrics metrics =
      Compared(GrayImage(2, 1, {9, 2}), GrayImage(2, 1, {1, 2}), {.mask = &mask});
  EXPECT_EQ(metrics.pixels, 1U);
  EXPECT_EQ(metrics.rmse, 0);
  const Image small = GrayImage(1, 1, {1});
  EXPECT_EQ(
      Compare(GrayImage(2, 1, {9, 2}), GrayImage(2, 1, {1, 2}), {.mask = &small}).status().code(),
      absl::StatusCode::kInvalidArgument);
  const Image nothing = GrayImage(2, 1, {0, 0});
  EXPECT_EQ(
      Compare(GrayImage(2, 1, {9, 2}), GrayImage(2, 1, {1, 2}), {.mask = &nothing}).status().code(),
      absl::StatusCode::kInvalidArgument);
}

TEST(ImageMetricsTest, RefusesWhatIsNotANumberAndSaysWhere) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const Status status = Compare(GrayImage(2, 1, {1, 1}), GrayImage(2, 1, {1, nan})).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_NE(std::string(status.message()).find("reference is not finite at pixel (1, 0)"),
            std::string::npos)
      << status;
  // An infinite pixel is refused also where clipping would hide it.
  const float inf = std::numeric_limits<float>::infinity();
  EXPECT_FALSE(Compare(GrayImage(1, 1, {inf}), GrayImage(1, 1, {1}), {.clip = 5}).ok());
}

TEST(ImageMetricsTest, RefusesAnImageWithoutColour) {
  Image image = GrayImage(1, 1, {1});
  image.channels.erase(image.channels.begin());
  EXPECT_EQ(Compare(image, GrayImage(1, 1, {1})).status().code(),
            absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace lucerna
