// Does every photon count alike, whatever the number of photons of its pass, and of direct light
// every pass?
#include "render/estimate/image_sums.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <vector>

#include "gtest/gtest.h"

#include "render/math/rng.h"

namespace lucerna {
namespace {

constexpr std::size_t kPixels = 50;
// Of eight passes, and what they weigh beside the last.
constexpr std::array<std::uint64_t, 8> kPhotons = {100, 100, 100, 200, 200, 800, 800, 800};
constexpr std::array<double, 8> kWeights = {0.125, 0.125, 0.125, 0.25, 0.25, 1, 1, 1};

SliceSums SliceOf(std::uint64_t pass) {
  SliceSums slice = EmptySlice({pass, pass + 1}, kPixels, 0);
  KeyedRng rng(CombineKeys(11, pass));
  for (std::size_t i = 0; i < kPixels; ++i) {
    const float photons = rng.Uniform();
    const float direct = rng.Uniform();
    for (std::size_t c = 0; c < 3; ++c) {
      slice.columns[kPhotonRadiance + c].Set(i, photons);
      slice.columns[kDirectRadiance + c].Set(i, direct);
    }
    slice.columns[pass % 2 == 0 ? kEvenBias : kOddBias].Set(i, rng.Uniform());
    slice.columns[kPhotonCount].Set(i, 3);
  }
  return slice;
}

double LuminanceOfSlice(const SliceSums& slice, std::size_t pixel) {
  const auto sum = [&](std::size_t c) {
    return static_cast<double>(slice.At(kPhotonRadiance + c, pixel)) +
           static_cast<double>(slice.At(kDirectRadiance + c, pixel));
  };
  return WorkingLuminance(sum(0), sum(1), sum(2));
}

TEST(ImageSumsTest, PhotonsCountAlikeAndSoDoPassesOfDirectLight) {
  ThreadTeam team(1);
  ImageSums sums(kPixels);
  for (std::uint64_t pass = 0; pass < kPhotons.size(); ++pass) {
    const double factor = sums.WeighBy(kPhotons[pass]);
    EXPECT_EQ(factor, pass == 3 ? 0.5 : (pass == 5 ? 0.25 : 1.0)) << pass;
    sums.Add(SliceOf(pass), team);
  }
  EXPECT_EQ(sums.passes(), 8U);
  const PassWeights weights = sums.weights();
  EXPECT_EQ(weights.even, 0.125 + 0.125 + 0.25 + 1);
  EXPECT_EQ(weights.odd, 0.125 + 0.25 + 1 + 1);
  EXPECT_EQ(weights.squares, 3 * 0.125 * 0.125 + 2 * 0.25 * 0.25 + 3);
  for (std::size_t i = 0; i < kPixels; ++i) {
    // Of even passes and of odd ones.
    std::array<double, 2> photons{};
    std::array<double, 2> direct{};
    double even_bias = 0, odd_bias = 0, largest = 0;
    for (std::uint64_t pass = 0; pass < kWeights.size(); ++pass) {
      const SliceSums slice = SliceOf(pass);
      const auto at = [&](std::size_t column) {
        return kWeights[pass] * static_cast<double>(slice.At(column, i));
      };
      photons[pass % 2] += at(kPhotonRadiance);
      direct[pass % 2] += static_cast<double>(slice.At(kDirectRadiance, i));
      even_bias += at(kEvenBias);
      odd_bias += at(kOddBias);
      largest = std::max(largest, at(kLargestLuminance) / std::sqrt(kWeights[pass]));
    }
    const ImageSums::Pixel pixel = sums.At(i);
    EXPECT_DOUBLE_EQ(pixel.photons[1], photons[0] + photons[1]);
    EXPECT_NEAR(pixel.direct[1] / weights.all(), (direct[0] + direct[1]) / 8, 1e-12);
    EXPECT_NEAR(sums.RadianceAt(i)[1], pixel.radiance()[1], 1e-12);
    const double even = 0.5 * (pixel.radiance()[1] + pixel.half_difference[1]) / weights.even;
    const double odd = 0.5 * (pixel.radiance()[1] - pixel.half_difference[1]) / weights.odd;
    // The luminances of eight passes' direct light have 16 bits each.
    EXPECT_NEAR(even - odd,
                photons[0] / weights.even - photons[1] / weights.odd + (direct[0] - direct[1]) / 4,
                8 * 0x1p-17);
    // Floats, of eight terms.
    EXPECT_NEAR(pixel.even_bias, even_bias, 1e-6);
    EXPECT_NEAR(pixel.odd_bias, odd_bias, 1e-6);
    EXPECT_NEAR(static_cast<double>(pixel.largest), largest, 1e-6);
    EXPECT_EQ(pixel.photon_count, 8 * 3) << "photons are counted, not weighed";
  }
}

// Where all light is of photons the squared deviations are weighted ones from the weighted mean.
TEST(ImageSumsTest, SquaredDeviationsAreWeighted) {
  ThreadTeam team(1);
  ImageSums sums(kPixels);
  std::vector<SliceSums> slices;
  for (std::uint64_t pass = 0; pass < kPhotons.size(); ++pass) {
    slices.push_back(SliceOf(pass));
    for (std::size_t c = 0; c < 3; ++c) {
      for (std::size_t i = 0; i < kPixels; ++i)
        slices.back().columns[kDirectRadiance + c].Set(i, 0);
    }
    sums.WeighBy(kPhotons[pass]);
    sums.Add(slices.back(), team);
  }
  for (std::size_t i = 0; i < kPixels; ++i) {
    double mean = 0;
    for (std::size_t pass = 0; pass < slices.size(); ++pass)
      mean += kWeights[pass] * LuminanceOfSlice(slices[pass], i) / sums.weights().all();
    double deviations = 0;
    for (std::size_t pass = 0; pass < slices.size(); ++pass) {
      const double off = LuminanceOfSlice(slices[pass], i) - mean;
      deviations += kWeights[pass] * off * off;
    }
    EXPECT_NEAR(sums.At(i).squared_deviations, deviations, 1e-12);
  }
}

// Negative weights of a pixel filter may leave a colour with next to no luminance, whose difference
// of halves is no multiple of it.
TEST(ImageSumsTest, DirectLightThatCancelsOutHasNoLargeDifference) {
  ThreadTeam team(1);
  ImageSums sums(1);
  constexpr std::array<float, 3> kEven = {1, 1, 1};
  constexpr std::array<float, 3> kOdd = {0, -1.3F, -1};
  for (std::uint64_t pass = 0; pass < 4; ++pass) {
    SliceSums slice = EmptySlice({pass, pass + 1}, 1, 0);
    for (std::size_t c = 0; c < 3; ++c)
      slice.columns[kDirectRadiance + c].Set(0, pass == 1 ? kOdd[c] : kEven[c]);
    sums.WeighBy(pass < 2 ? 100 : 800);
    sums.Add(slice, team);
  }
  constexpr std::array<float, 3> kBoth = {kEven[0] + kOdd[0], kEven[1] + kOdd[1], 0};
  ASSERT_GT(WorkingLuminance(kBoth[0], kBoth[1], kBoth[2]), 0);
  ASSERT_LT(WorkingLuminance(kBoth[0], kBoth[1], kBoth[2]), 0.1);
  // The passes' values over all four of them.
  for (const double difference : sums.At(0).half_difference)
    EXPECT_LE(std::abs(difference), 4 * 1.3);
}

// A job that ends within a round of more photons, and goes on, has the bits of one that did not
// end.
TEST(ImageSumsTest, ATailOfMorePhotonsWeighsAsWhenItIsAdded) {
  ThreadTeam team(1);
  ImageSums stopped(kPixels);
  ImageSums straight(kPixels);
  for (ImageSums* sums : {&stopped, &straight}) {
    sums->WeighBy(100);
    sums->Add(SliceOf(0), team);
    sums->Add(SliceOf(1), team);
  }
  stopped.WeighBy(400);
  stopped.SetTail({std::make_shared<const SliceSums>(SliceOf(2))});
  straight.WeighBy(400);
  straight.Add(SliceOf(2), team);
  EXPECT_EQ(stopped.weights(), straight.weights());
  EXPECT_EQ(stopped.weights().all(), 1.5);
  EXPECT_EQ(stopped.At(7).radiance(), straight.At(7).radiance());
  EXPECT_EQ(stopped.At(7).half_difference, straight.At(7).half_difference);
  EXPECT_EQ(stopped.At(7).squared_deviations, straight.At(7).squared_deviations);
  // It goes on: the tail goes, and comes again with what follows it.
  stopped.SetTail({});
  EXPECT_EQ(stopped.weights().all(), 0.5);
  EXPECT_EQ(stopped.WeighBy(400), 1);
  for (ImageSums* sums : {&stopped, &straight}) {
    if (sums == &stopped) sums->Add(SliceOf(2), team);
    sums->Add(SliceOf(3), team);
  }
  EXPECT_EQ(stopped.weights(), straight.weights());
  EXPECT_EQ(stopped.whole().columns.radiance, straight.whole().columns.radiance);
  EXPECT_EQ(stopped.whole().columns.squared_deviations,
            straight.whole().columns.squared_deviations);
  EXPECT_EQ(stopped.whole().columns.half_difference, straight.whole().columns.half_difference);
  EXPECT_EQ(stopped.whole().columns.direct_difference, straight.whole().columns.direct_difference);
}

TEST(PassWeightsTest, EvenAndOddPassesOfARange) {
  EXPECT_EQ(WeightsOf({0, 1}), (PassWeights{.even = 1, .odd = 0, .squares = 1}));
  EXPECT_EQ(WeightsOf({1, 2}), (PassWeights{.even = 0, .odd = 1, .squares = 1}));
  EXPECT_EQ(WeightsOf({8, 16}), (PassWeights{.even = 4, .odd = 4, .squares = 8}));
  EXPECT_EQ(WeightsOf({5, 8}), (PassWeights{.even = 1, .odd = 2, .squares = 3}));
  EXPECT_EQ(WeightsOf({3, 3}), PassWeights());
}

}  // namespace
}  // namespace lucerna
