// The noise that a reference tells of itself must be the noise it has, or every error that is
// corrected by it is wrong.
#include "render/film/reference.h"

#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <set>
#include <vector>

#include "gtest/gtest.h"

#include "render/film/image_metrics.h"

namespace lucerna {
namespace {

Image GrayImage(std::vector<float> pixels, const std::string& seed = "") {
  Image image;
  image.width = static_cast<int>(pixels.size());
  image.height = 1;
  image.channels = {{"B", pixels}, {"G", pixels}, {"R", pixels}};
  image.metadata = {{"lucerna.seed", seed}, {"lucerna.passes", "8"}};
  return image;
}

// Pixels around 2 with a standard deviation of `deviation`.
Image Noisy(double deviation, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(2, deviation);
  std::vector<float> pixels(20'000);
  for (float& pixel : pixels)
    pixel = static_cast<float>(normal(random));
  return GrayImage(pixels, std::to_string(seed));
}

// References of neighbouring seeds can be averaged, and measure images of any seed one types.
TEST(ReferenceTest, HalvesShareNoSeedWithAnyOther) {
  std::set<std::uint64_t> seeds;
  for (std::uint64_t seed = 0; seed < 1000; ++seed) {
    for (const std::uint64_t of_half : SeedsOfHalves(seed)) {
      EXPECT_TRUE(seeds.insert(of_half).second) << seed;
      EXPECT_GT(of_half, 1U << 30) << seed;
    }
  }
}

TEST(ReferenceTest, WorkedByHand) {
  const StatusOr<Image> reference = MakeReference(GrayImage({1, 4}, "0"), GrayImage({3, 4}, "1"));
  ASSERT_TRUE(reference.ok()) << reference.status();
  EXPECT_EQ(reference->Find("G")->pixels, (std::vector<float>{2, 4}));
  EXPECT_EQ(reference->Find("noise.G")->pixels, (std::vector<float>{1, 0}));
  EXPECT_NEAR(std::stod(reference->metadata.at("lucerna.reference.rel_mse")), 1 / 4.09 / 2, 1e-6);
  EXPECT_EQ(reference->metadata.at("lucerna.reference.rel_mse_trimmed"),
            reference->metadata.at("lucerna.reference.rel_mse"))
      << "of two pixels none is left out";
  EXPECT_NEAR(std::stod(reference->metadata.at("lucerna.reference.rmse")), std::sqrt(0.5), 1e-6);
  // Mean luminance 3: a floor of 0.09.
  EXPECT_EQ(reference->metadata.at("lucerna.reference.seeds"), "0 1");
  EXPECT_EQ(reference->metadata.at("lucerna.reference.passes"), "8 8");
  EXPECT_TRUE(TellsItsNoise(*reference));
}

TEST(ReferenceTest, TakingItsNoiseAwayLeavesTheErrorOfTheImage) {
  // Halves of unlike noise: 0.3 and 0.1. The average has (0.09 + 0.01)/4 = 0.025.
  const StatusOr<Image> reference = MakeReference(Noisy(0.3, 1), Noisy(0.1, 2));
  ASSERT_TRUE(reference.ok()) << reference.status();
  const StatusOr<ImageMetrics> metrics = Compare(Noisy(0.1, 3), *reference);
  ASSERT_TRUE(metrics.ok()) << metrics.status();
  ASSERT_TRUE(metrics->reference_mse && metrics->reference_rel_mse);
  // 20,000 samples (all channels are the same): relative standard error of a variance is 1 %.
  EXPECT_NEAR(*metrics->reference_mse, 0.025, 4 * 0.025 * 0.01);
  EXPECT_NEAR(metrics->rmse * metrics->rmse - *metrics->reference_mse, 0.01,
              4 * (0.035 + 0.025) * 0.01);
  // The mean of value² + 0.04 is 4.065; the reciprocal's mean is larger by the values' spread, 2 %.
  EXPECT_NEAR(*metrics->reference_rel_mse, 0.025 / 4.04, 0.08 * 0.025 / 4.04);
}

TEST(ReferenceTest, TheNoiseIsThatOfTheComparedPixels) {
  const StatusOr<Image> reference =
      MakeReference(GrayImage({1, 2, 9}, "0"), GrayImage({3, 2, 1}, "1"));
  ASSERT_TRUE(reference.ok()) << reference.status();
  const Image mask = GrayImage({1, 1, 0});
  const StatusOr<ImageMetrics> masked = Compare(GrayImage({2, 2, 2}), *reference, {.mask = &mask});
  ASSERT_TRUE(masked.ok()) << masked.status();
  EXPECT_DOUBLE_EQ(masked->reference_mse.value(), 0.5);
  // What clipping leaves of the noise is not known.
  EXPECT_FALSE(Compare(GrayImage({2, 2, 2}), *reference, {.clip = 3})->reference_mse.has_value());
}

TEST(ReferenceTest, AnImageWithoutTheFiguresTellsNothing) {
  Image image = GrayImage({1});
  EXPECT_FALSE(TellsItsNoise(image));
  for (const char* name : kNoiseLayer)
    image.channels.push_back({name, {1}});
  EXPECT_FALSE(TellsItsNoise(image)) << "somebody else's layer";
  EXPECT_FALSE(Compare(GrayImage({1}), image)->reference_mse.has_value());
}

TEST(ReferenceTest, RefusesHalvesThatAreNone) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_FALSE(MakeReference(GrayImage({1, 2}, "0"), GrayImage({1}, "1")).ok());
  EXPECT_FALSE(MakeReference(GrayImage({1}, "0"), GrayImage({1}, "0")).ok()) << "the same seed";
  EXPECT_FALSE(MakeReference(GrayImage({nan}, "0"), GrayImage({1}, "1")).ok());
  Image other = GrayImage({1}, "1");
  other.metadata["lucerna.scene_digest"] = "another";
  EXPECT_FALSE(MakeReference(GrayImage({1}, "0"), other).ok());
  Image colourless = GrayImage({1}, "1");
  colourless.channels.pop_back();
  EXPECT_FALSE(MakeReference(GrayImage({1}, "0"), colourless).ok());
}

}  // namespace
}  // namespace lucerna
