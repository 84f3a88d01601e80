// Is the share of noise what the halves show over what independent passes would have?
#include "render/estimate/photon_noise.h"

#include <cmath>
#include <cstdint>
#include <functional>

#include "gtest/gtest.h"

#include "render/math/rng.h"

namespace lucerna {
namespace {

constexpr std::size_t kPixels = 40'000;

// Of 16 passes with light of `photons(pixel, pass)` by photons, and `direct(...)` without.
using Light = std::function<double(std::size_t pixel, std::uint64_t pass)>;
double ShareOf(const Light& photons, const Light& direct, std::size_t pixels = kPixels) {
  ThreadTeam team(1);
  ImageSums sums(pixels);
  for (std::uint64_t pass = 0; pass < 16; ++pass) {
    SliceSums slice = EmptySlice({pass, pass + 1}, pixels, 0);
    for (std::size_t i = 0; i < pixels; ++i) {
      for (std::size_t c = 0; c < 3; ++c) {
        slice.columns[kPhotonRadiance + c].Set(i, static_cast<float>(photons(i, pass)));
        slice.columns[kDirectRadiance + c].Set(i, static_cast<float>(direct(i, pass)));
      }
    }
    sums.WeighBy(100);
    sums.Add(slice, team);
  }
  return PhotonNoiseShare(sums, SampleNoise(sums));
}

// The share where no noise is left: as if a thousand pixels with all of it were added.
double ShareOfDoubt(std::size_t pixels) {
  return 1000 / (1000 + static_cast<double>(pixels));
}

double Nothing(std::size_t /*pixel*/, std::uint64_t /*pass*/) {
  return 0;
}

// Uniform around 1, of variance 1/300.
double Independent(std::size_t pixel, std::uint64_t pass) {
  KeyedRng rng(CombineKeys(CombineKeys(5, pixel), pass));
  return 0.9 + 0.2 * static_cast<double>(rng.Uniform());
}

// The ratio of two means over 40,000 pixels: its deviation is about sqrt(2 / 40,000) = 0.007.
TEST(PhotonNoiseTest, IsOneForIndependentPasses) {
  EXPECT_NEAR(ShareOf(Independent, Nothing), 1, 0.03);
}

// Light that even and odd passes see alike, two by two, has no noise that the halves show.
TEST(PhotonNoiseTest, IsNothingWhereHalvesAgree) {
  const auto pairs = [](std::size_t pixel, std::uint64_t pass) {
    return Independent(pixel, pass / 2);
  };
  EXPECT_LT(ShareOf(pairs, Nothing), 1e-6);
}

// Direct light, of twice the deviation, counts as noise that photons do not have.
TEST(PhotonNoiseTest, CountsDirectLightAmongTheNoiseOfPassesOnly) {
  const auto direct = [](std::size_t pixel, std::uint64_t pass) {
    return 2 * Independent(pixel, pass + 1000);
  };
  EXPECT_NEAR(ShareOf(Independent, direct), 1.0 / 5, 0.01);
}

TEST(PhotonNoiseTest, IsOneWhereNothingIsKnown) {
  EXPECT_EQ(ShareOf(Nothing, Nothing, 10), 1);
  EXPECT_EQ(PhotonNoiseShare(ImageSums(10), {}), 1);
}

// Of 16 passes whose kernels changed pixels by `blur(pixel, pass)`.
double BlurShareOf(const std::function<double(std::size_t pixel, std::uint64_t pass)>& blur,
                   std::size_t pixels = kPixels) {
  ThreadTeam team(1);
  ImageSums sums(pixels);
  for (PassRange round = RoundOf(0); round.first < 16; round = RoundOf(round.last)) {
    SliceSums slice = EmptySlice(round, pixels, 0);
    for (std::size_t i = 0; i < pixels; ++i) {
      for (std::size_t c = 0; c < 3; ++c)
        slice.columns[kPhotonRadiance + c].Set(i, static_cast<float>(round.size()));
      double halves[2] = {0, 0};
      for (std::uint64_t pass = round.first; pass < round.last; ++pass)
        halves[pass % 2] += blur(i, pass);
      slice.columns[kEvenBias].Set(i, static_cast<float>(halves[0]));
      slice.columns[kOddBias].Set(i, static_cast<float>(halves[1]));
    }
    sums.Add(slice, team);
  }
  return BlurNoiseShare(sums, SampleNoise(sums));
}

// 40,000 pixels with the thousand that are added: the ratio is known to 0.7 %, what rounds vary by
// to as much.
TEST(BlurNoiseShareTest, IsOneForIndependentPasses) {
  EXPECT_GT(BlurShareOf(Independent), 0.97);
}

// Two passes up, two down: in the mean of all, and of each half, nothing is left but 1.
double ByTurns(std::size_t pixel, std::uint64_t pass) {
  const double chance = Independent(pixel, pass / 4);
  return 1 + (pass % 4 < 2 ? chance : -chance);
}

// Blur that always is the same does not count as noise; what differs from pass to pass by turns
// cancels in the mean of all, and in each half.
TEST(BlurNoiseShareTest, IsThatOfTheHalves) {
  EXPECT_NEAR(BlurShareOf(ByTurns), ShareOfDoubt(kPixels), 0.01);
}

TEST(BlurNoiseShareTest, FewPixelsHardlyKnowIt) {
  EXPECT_NEAR(BlurShareOf(ByTurns, 250), ShareOfDoubt(250), 0.01);
  EXPECT_EQ(BlurNoiseShare(ImageSums(10), {}), 1);
}

// More pixels than are looked at: the same share, for all parts of the image are among them.
TEST(PhotonNoiseTest, SamplesLargeImages) {
  constexpr std::size_t kLarge = 400'000;
  const auto half = [](std::size_t pixel, std::uint64_t pass) {
    return pixel < kLarge / 2 ? Independent(pixel, pass) : Independent(pixel, pass / 2);
  };
  // Two passes that agree vary as one: their deviations count alike in what passes show.
  EXPECT_NEAR(ShareOf(half, Nothing, kLarge), 0.5, 0.02);
}

}  // namespace
}  // namespace lucerna
