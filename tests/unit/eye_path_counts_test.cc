// Do eye paths and photons go where they take the most noise for the time?
#include "render/estimate/eye_path_counts.h"

#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "render/base/parallel.h"
#include "render/math/rng.h"

namespace lucerna {
namespace {

constexpr std::size_t kImageWidth = 96;
constexpr std::size_t kImagePixels = kImageWidth * kImageWidth;
constexpr std::uint64_t kPhotonsBefore = kImagePixels;
// Variance that one photon brings, over its squared flux.
constexpr double kNoiseOfPhoton = 3;

// Of a pixel whose value is 1.
struct Noise {
  double eye_paths = 0;  // deviation of one path
  double photons = 0;    // of those of a pass
  double bias = 0;
};
using NoiseRule = std::function<Noise(std::size_t pixel)>;

// Normal to the fourth moment: the sum of twelve uniforms.
double Normal(KeyedRng& rng) {
  double sum = -6;
  for (int i = 0; i < 12; ++i)
    sum += static_cast<double>(rng.Uniform());
  return sum;
}

// What is chosen after passes whose pixels are 1 and vary so. Photons found are as many as explain
// their noise.
Samples Chosen(const NoiseRule& noise_of, std::uint64_t most = kPhotonsBefore, double scale = 1) {
  ImageSums sums(kImagePixels);
  PassVariance variance(kImagePixels);
  ThreadTeam team(1);
  sums.WeighBy(kPhotonsBefore);
  for (std::uint64_t pass = 0; pass < kEyePathsCompared; ++pass) {
    SliceSums slice = EmptySlice({pass, pass + 1}, kImagePixels, 0);
    const EyePathCounts counts = ComparesEyePaths(pass)
                                     ? ComparedEyePaths(kImagePixels, kImageWidth, pass)
                                     : EyePathCounts(kImagePixels, 1);
    for (std::size_t i = 0; i < kImagePixels; ++i) {
      KeyedRng rng(CombineKeys(CombineKeys(5, pass), i));
      const Noise noise = noise_of(i);
      const double first = noise.eye_paths * Normal(rng);
      double of_paths = first;
      if (counts[i] == 2) {
        const double second = noise.eye_paths * Normal(rng);
        of_paths = (first + second) / 2;
        slice.columns[slice.first_feature() + kPathVariance].Set(
            i, static_cast<float>(scale * scale * (first - second) * (first - second) / 2));
      }
      const double value = 1 + noise.bias + of_paths + noise.photons * Normal(rng);
      for (std::size_t c = 0; c < 3; ++c)
        slice.columns[kPhotonRadiance + c].Set(i, static_cast<float>(scale * value));
      slice.columns[pass % 2 == 0 ? kEvenBias : kOddBias].Set(
          i, static_cast<float>(scale * (noise.bias + 0.01 * Normal(rng))));
      slice.columns[kPhotonCount].Set(
          i, static_cast<float>(kNoiseOfPhoton / std::max(noise.photons * noise.photons, 1e-4)));
    }
    // A path costs 3 + 4 * 0.75 = 6 rays, a photon 1.5 and what gathers it.
    slice.eye_rays = 4 * kImagePixels;
    slice.tally.photons = kPhotonsBefore;
    slice.tally.rays = kPhotonsBefore * 3 / 2;
    slice.tally.pairs = 5 * kPhotonsBefore;
    variance.Add(slice, sums);
    sums.Add(slice, team);
  }
  return ChooseSamples(variance, sums, kNoiseOfPhoton, kPhotonsBefore, most, kImageWidth);
}

// The middle of either half of the image: beyond what smoothing mixes.
double MeanCount(const EyePathCounts& counts, bool of_right) {
  double sum = 0, pixels = 0;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const std::size_t x = i % kImageWidth;
    if (of_right ? x < kImageWidth / 2 + 8 : x >= kImageWidth / 2 - 8) continue;
    sum += counts[i];
    ++pixels;
  }
  return sum / pixels;
}
bool IsRight(std::size_t pixel) {
  return pixel % kImageWidth >= kImageWidth / 2;
}

TEST(EyePathCountsTest, FollowTheDeviationOfEyePaths) {
  const Samples chosen = Chosen([](std::size_t pixel) {
    return Noise{.eye_paths = IsRight(pixel) ? 0.8 : 0.2, .photons = 0.05};
  });
  ASSERT_NE(chosen.eye_paths, nullptr);
  const double left = MeanCount(*chosen.eye_paths, false);
  const double right = MeanCount(*chosen.eye_paths, true);
  // Four times the deviation; numbers are 1, 2, 3, 5, 9, so that a ratio is off by up to 5/4.
  EXPECT_GE(right / left, 4 / 1.25);
  EXPECT_LE(right / left, 4 * 1.25);
}

TEST(EyePathCountsTest, AreNoneWhereAllNoiseIsOfPhotons) {
  const NoiseRule rule = [](std::size_t pixel) {
    return Noise{.eye_paths = IsRight(pixel) ? 0.02 : 0.005, .photons = 0.3};
  };
  EXPECT_EQ(Chosen(rule).eye_paths, nullptr);
  const Samples chosen = Chosen(rule, 8 * kPhotonsBefore);
  EXPECT_EQ(chosen.photons_per_pass, 8 * kPhotonsBefore);
}

TEST(EyePathCountsTest, KeepThePhotonsWhereTheNoiseIsOfEyePaths) {
  const Samples chosen = Chosen(
      [](std::size_t) { return Noise{.eye_paths = 0.5, .photons = 0.05}; }, 8 * kPhotonsBefore);
  EXPECT_EQ(chosen.photons_per_pass, kPhotonsBefore);
}

TEST(EyePathCountsTest, AreNoneWhereBiasIsAllTheError) {
  const auto rule = [](double bias) {
    return [bias](std::size_t pixel) {
      return Noise{.eye_paths = IsRight(pixel) ? 0.4 : 0.02, .photons = 0.05, .bias = bias};
    };
  };
  EXPECT_NE(Chosen(rule(0)).eye_paths, nullptr);
  EXPECT_EQ(Chosen(rule(0.5)).eye_paths, nullptr);
}

// Also at the ends of what a float holds.
TEST(EyePathCountsTest, AreTheSameWhateverFactorScalesAllLight) {
  const NoiseRule rule = [](std::size_t pixel) {
    return Noise{.eye_paths = IsRight(pixel) ? 0.8 : 0.1, .photons = 0.1};
  };
  const Samples expected = Chosen(rule, 8 * kPhotonsBefore);
  ASSERT_NE(expected.eye_paths, nullptr);
  for (const double scale : {0x1p-40, 0x1p40}) {
    const Samples chosen = Chosen(rule, 8 * kPhotonsBefore, scale);
    EXPECT_EQ(chosen.photons_per_pass, expected.photons_per_pass);
    ASSERT_NE(chosen.eye_paths, nullptr);
    EXPECT_EQ(*chosen.eye_paths, *expected.eye_paths);
  }
}

TEST(EyePathCountsTest, OfABlackImageAreNone) {
  const Samples chosen = Chosen([](std::size_t) { return Noise{}; }, 8 * kPhotonsBefore, 0);
  EXPECT_EQ(chosen.eye_paths, nullptr);
  EXPECT_EQ(chosen.photons_per_pass, kPhotonsBefore);
}

// Neither part of the image nor memory is lost: all together are no more than may be.
TEST(EyePathCountsTest, AreNoMoreThanMemoryHasRoomFor) {
  const Samples chosen = Chosen([](std::size_t) { return Noise{.eye_paths = 2, .photons = 0.01}; });
  double paths = kImagePixels;
  if (chosen.eye_paths != nullptr) {
    paths = 0;
    for (const std::uint8_t count : *chosen.eye_paths)
      paths += count;
  }
  EXPECT_LE(paths, 3.0 * kImagePixels);
}

TEST(EyePathCountsTest, EveryPixelIsComparedInEitherHalfAlike) {
  std::vector<int> even(12), odd(12);
  for (std::uint64_t pass = 0; pass < kEyePathsCompared; ++pass) {
    if (!ComparesEyePaths(pass)) continue;
    const EyePathCounts counts = ComparedEyePaths(12, 4, pass);
    for (std::size_t i = 0; i < counts.size(); ++i)
      (pass % 2 == 0 ? even : odd)[i] += counts[i] - 1;
  }
  EXPECT_EQ(even, std::vector<int>(12, 1));
  EXPECT_EQ(odd, std::vector<int>(12, 1));
}

}  // namespace
}  // namespace lucerna
