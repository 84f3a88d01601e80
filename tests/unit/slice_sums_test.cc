// Are slices the same sums, whoever adds up what, and as exact as they say?
#include "render/estimate/slice_sums.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "render/estimate/image_sums.h"
#include "render/estimate/slice_tree.h"
#include "render/math/rng.h"

namespace lucerna {
namespace {

constexpr std::size_t kPixels = 64;
constexpr std::size_t kEvidence = 2;

// A pass of random columns.
SliceSums RandomPass(std::uint64_t pass) {
  SliceSums slice = EmptySlice({pass, pass + 1}, kPixels, kEvidence);
  KeyedRng rng(CombineKeys(7, pass));
  for (std::size_t column = 0; column < slice.columns.size(); ++column) {
    if (FollowsFromRadiance(slice.passes, column)) continue;
    for (std::size_t pixel = 0; pixel < kPixels; ++pixel) {
      const double number = std::exp(8.0 * static_cast<double>(rng.Uniform()) - 4.0);
      slice.columns[column].Set(pixel, Rounded(number, SignificantBits(1, column, kEvidence)));
    }
  }
  slice.tally.photons = 10 + pass;
  slice.eye_rays = pass;
  return slice;
}

double LuminanceAt(const SliceSums& slice, std::size_t pixel) {
  const auto at = [&](std::size_t column) { return static_cast<double>(slice.At(column, pixel)); };
  return WorkingLuminance(at(kPhotonRadiance) + at(kDirectRadiance),
                          at(kPhotonRadiance + 1) + at(kDirectRadiance + 1),
                          at(kPhotonRadiance + 2) + at(kDirectRadiance + 2));
}

TEST(SliceSumsTest, RoundsToNearestWithTiesToEven) {
  EXPECT_EQ(Rounded(1, 8), 1.0F);
  // 8 significant bits: steps of 2^-7 from 1 on.
  EXPECT_EQ(Rounded(1 + 0x1.8p-8, 8), 1.0F + 0x1p-7F);
  EXPECT_EQ(Rounded(1 + 0x0.8p-8, 8), 1.0F);
  EXPECT_EQ(Rounded(1 + 0x1p-8, 8), 1.0F);            // tie, 1 is even
  EXPECT_EQ(Rounded(1 + 0x3p-8, 8), 1.0F + 0x4p-8F);  // tie, upwards
  EXPECT_EQ(Rounded(-1 - 0x1.8p-8, 8), -1.0F - 0x1p-7F);
  EXPECT_EQ(Rounded(1 + 0x1p-16, 16), 1.0F);
  EXPECT_EQ(Rounded(1 + 0x1.8p-16, 16), 1.0F + 0x1p-15F);
}

// What is too large becomes the largest sum, which needs no rounding with any number of bits.
TEST(SliceSumsTest, RoundingStaysFinite) {
  for (const PassRange& passes : {PassRange{0, 1}, PassRange{16, 18}, PassRange{512, 576}}) {
    for (std::size_t column = 0; column < ColumnsOf(passes, kEvidence); ++column) {
      const unsigned int bits = SignificantBits(passes.size(), column, kEvidence);
      EXPECT_EQ(Rounded(1e300, bits), static_cast<float>(kLargestSum)) << column;
      EXPECT_EQ(Rounded(-1e300, bits), -static_cast<float>(kLargestSum)) << column;
    }
  }
}

// Half a bit more each time that the number of photons doubles, from 8 bits on and up to 16.
TEST(SliceSumsTest, LightByPhotonsHasBitsByTheirNumber) {
  EXPECT_EQ(PhotonBits(0), 16U) << "no noise to hide in";
  EXPECT_EQ(PhotonBits(1), 8U);
  EXPECT_EQ(PhotonBits(31), 8U);
  EXPECT_EQ(PhotonBits(32), 9U);
  EXPECT_EQ(PhotonBits(1024), 11U);
  EXPECT_EQ(PhotonBits(1 << 19), 16U);
  EXPECT_EQ(PhotonBits(static_cast<float>(kLargestSum)), 16U);
  // One rounding with dither has at most a quarter of the square of a step, which is at most 2^-7
  // of the number at 8 bits: below a thousandth of the variance of n independent photons of equal
  // weight, 1 / n of the square, with as many photons as have these bits.
  for (float count = 1; count < 1e9F; count *= 1.5F) {
    const double step = std::exp2(1.0 - PhotonBits(count));
    if (PhotonBits(count) == 16) break;
    EXPECT_LT(step * step / 4, 1e-3 / static_cast<double>(count)) << count;
  }
}

// Down or up by less than a step, by chance, and right in the mean; to nearest with 16 bits.
TEST(SliceSumsTest, DitherKeepsTheMeanOfLightByPhotons) {
  const PhotonRounding rounded({6, 8});
  constexpr std::array<float, 3> kLight = {1.0037F, -0x1.fe8p20F, 3e-39F};
  constexpr int kSamples = 1 << 16;
  std::array<double, 3> sum{};
  for (std::size_t pixel = 0; pixel < kSamples; ++pixel) {
    const std::array<float, 3> light = rounded(pixel, 5, kLight);
    for (std::size_t c = 0; c < 3; ++c) {
      ASSERT_EQ(light[c], Rounded(static_cast<double>(light[c]), 8));
      ASSERT_LT(std::abs(light[c] - kLight[c]), std::abs(kLight[c]) * 0x1p-7F + 0x1p-133F);
      sum[c] += static_cast<double>(light[c]);
    }
  }
  for (std::size_t c = 0; c < 3; ++c) {
    // Of a step of the number's own, five standard deviations of the mean of numbers that are
    // within it: a step over twice the root of the samples.
    const double step =
        c == 2 ? 0x1p-133 : std::exp2(std::floor(std::log2(std::abs(kLight[c]))) - 7);
    EXPECT_NEAR(sum[c] / kSamples, static_cast<double>(kLight[c]),
                5 * step / 2 / std::sqrt(kSamples));
  }
  EXPECT_EQ(rounded(3, 5, {0, 0, 0}), (std::array<float, 3>{}));
  const float light = 1 + 0x1.8p-16F;
  EXPECT_EQ(rounded(3, 0, {light, light, light})[2], Rounded(static_cast<double>(light), 16));
  // Other slices and pixels take other chances.
  int same_slice = 0;
  int same_pixel = 0;
  for (std::size_t pixel = 0; pixel < 1000; ++pixel) {
    const float here = rounded(pixel, 5, {1.0039F, 0, 0})[0];
    same_slice += PhotonRounding({4, 8})(pixel, 5, {1.0039F, 0, 0})[0] == here ? 1 : 0;
    same_pixel += rounded(pixel + 1000, 5, {1.0039F, 0, 0})[0] == here ? 1 : 0;
  }
  // Half of them, up to five deviations.
  EXPECT_NEAR(same_slice, 500, 5 * 16);
  EXPECT_NEAR(same_pixel, 500, 5 * 16);
}

// What follows from the radiance of a single pass: the difference of halves with the sign of its
// half, no deviations, and its luminance, at least 0. In runs as pixel by pixel.
TEST(SliceSumsTest, WhatFollowsFromTheRadianceOfOnePassIsRead) {
  for (const std::uint64_t pass : {6, 7}) {
    constexpr std::size_t kMany = 2 * kPixelsUnpacked + 5;
    SliceSums slice = EmptySlice({pass, pass + 1}, kMany, kEvidence);
    KeyedRng rng(3);
    for (std::size_t column = 0; column < kHalfDifference; ++column) {
      for (std::size_t pixel = 0; pixel < kMany; ++pixel)
        slice.columns[column].Set(pixel, Rounded(static_cast<double>(rng.Uniform()) - 0.25, 16));
    }
    for (std::size_t column = kHalfDifference; column <= kLargestLuminance; ++column) {
      std::vector<float> run(kMany - 3);
      slice.Read(column, 3, run);
      for (std::size_t pixel = 3; pixel < kMany; ++pixel) {
        double expected = 0;
        if (column < kSquaredDeviations) {
          const std::size_t c = column - kHalfDifference;
          expected = (pass % 2 == 0 ? 1 : -1) *
                     (static_cast<double>(slice.At(kPhotonRadiance + c, pixel)) +
                      static_cast<double>(slice.At(kDirectRadiance + c, pixel)));
        } else if (column == kDirectDifference) {
          const auto direct = [&](std::size_t c) {
            return static_cast<double>(slice.At(kDirectRadiance + c, pixel));
          };
          expected = (pass % 2 == 0 ? 1 : -1) * WorkingLuminance(direct(0), direct(1), direct(2));
        } else if (column == kLargestLuminance) {
          expected = std::max(0.0, LuminanceAt(slice, pixel));
        }
        const unsigned int bits = SignificantBits(1, column, kEvidence);
        ASSERT_EQ(run[pixel - 3], Rounded(expected, bits)) << column << " " << pixel;
        ASSERT_EQ(slice.At(column, pixel), run[pixel - 3]) << column << " " << pixel;
      }
    }
  }
}

// Passes without noise have none in their sum: no difference of halves, no deviations, and to 16
// bits the same mean, however many there are.
TEST(SliceSumsTest, LightWithoutNoiseStaysWithout) {
  SliceTree tree({64, 72});
  for (std::uint64_t pass = 64; pass < 72; ++pass) {
    SliceSums slice = EmptySlice({pass, pass + 1}, kPixels, kEvidence);
    for (std::size_t c = 0; c < 3; ++c) {
      for (std::size_t pixel = 0; pixel < kPixels; ++pixel)
        slice.columns[kDirectRadiance + c].Set(
            pixel, Rounded(1.0 / (3.0 + static_cast<double>(pixel + c)), 16));
    }
    ASSERT_TRUE(tree.Add(std::move(slice)).ok());
  }
  for (std::size_t pixel = 0; pixel < kPixels; ++pixel) {
    EXPECT_EQ(tree.Whole()->At(kSquaredDeviations, pixel), 0);
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_EQ(tree.Whole()->At(kHalfDifference + c, pixel), 0);
      const double mean = static_cast<double>(tree.Whole()->At(kDirectRadiance + c, pixel)) / 8;
      EXPECT_NEAR(mean * (3.0 + static_cast<double>(pixel + c)), 1, 0x1p-16);
    }
  }
}

// A difference of halves that is far smaller than the radiance has its own bits.
TEST(SliceSumsTest, SmallDifferencesOfHalvesAreKept) {
  SliceSums even = EmptySlice({64, 65}, 1, kEvidence);
  SliceSums odd = EmptySlice({65, 66}, 1, kEvidence);
  even.columns[kDirectRadiance].Set(0, 1);
  odd.columns[kDirectRadiance].Set(0, 1 + 0x1p-15F);
  ASSERT_TRUE(MergeSibling(even, odd).ok());
  EXPECT_EQ(even.At(kHalfDifference, 0), -0x1p-15F);
}

TEST(SliceSumsTest, SiblingsMakeTheSameSumInEitherOrder) {
  SliceSums forward = RandomPass(32);
  SliceSums backward = RandomPass(33);
  ASSERT_TRUE(MergeSibling(forward, RandomPass(33)).ok());
  ASSERT_TRUE(MergeSibling(backward, RandomPass(32)).ok());
  EXPECT_EQ(forward, backward);
  EXPECT_EQ(forward.passes, (PassRange{32, 34}));
  EXPECT_EQ(forward.tally.photons, 10U + 32 + 10 + 33);
}

TEST(SliceSumsTest, OnlySiblingsMakeASum) {
  SliceSums slice = RandomPass(33);
  EXPECT_TRUE(absl::IsInvalidArgument(MergeSibling(slice, RandomPass(34))));
  EXPECT_EQ(slice, RandomPass(33));
}

// The deviations of a tree are those of all values from their mean, up to 8 bits at each of three
// levels: 3 × 2^-9.
TEST(SliceSumsTest, DeviationsAreThoseOfAllPasses) {
  SliceTree tree({64, 72});
  std::vector<double> luminances;
  for (std::uint64_t pass = 64; pass < 72; ++pass) {
    luminances.push_back(LuminanceAt(RandomPass(pass), 5));
    ASSERT_TRUE(tree.Add(RandomPass(pass)).ok());
  }
  double mean = 0;
  for (const double luminance : luminances)
    mean += luminance / 8;
  double squares = 0;
  for (const double luminance : luminances)
    squares += (luminance - mean) * (luminance - mean);
  // Pairs, fours and the eight were each rounded once.
  const double rounding =
      std::exp2(-static_cast<double>(SignificantBits(8, kSquaredDeviations, kEvidence)));
  EXPECT_NEAR(static_cast<double>(tree.Whole()->At(kSquaredDeviations, 5)), squares,
              3 * rounding * squares);
}

TEST(SliceTreeTest, TheOrderOfSlicesIsNotSeen) {
  SliceTree forward({64, 72});
  SliceTree shuffled({64, 72});
  for (std::uint64_t pass = 64; pass < 72; ++pass)
    ASSERT_TRUE(forward.Add(RandomPass(pass)).ok());
  // Two passes as one slice, as a worker sends them.
  SliceSums pair = RandomPass(66);
  ASSERT_TRUE(MergeSibling(pair, RandomPass(67)).ok());
  for (const std::uint64_t pass : {71U, 64U, 69U, 68U})
    ASSERT_TRUE(shuffled.Add(RandomPass(pass)).ok());
  ASSERT_TRUE(shuffled.Add(pair).ok());
  EXPECT_EQ(shuffled.PrefixEnd(), 65U);
  for (const std::uint64_t pass : {65U, 70U})
    ASSERT_TRUE(shuffled.Add(RandomPass(pass)).ok());
  ASSERT_TRUE(forward.IsWhole());
  ASSERT_TRUE(shuffled.IsWhole());
  EXPECT_EQ(*forward.Whole(), *shuffled.Whole());
}

// What a merge holds of the other half beside the column that it adds.
TEST(SiblingMergeTest, KeepsLightAlone) {
  SliceSums sum = RandomPass(2);
  const SliceSums other = RandomPass(3);
  SliceSums expected = sum;
  ASSERT_TRUE(MergeSibling(expected, other).ok());
  SliceSums head = other;
  head.columns.clear();
  SiblingMerge merge(sum, head);
  ASSERT_TRUE(merge.Begin(kPixels, other.columns.size()).ok());
  for (std::size_t column = other.columns.size(); column-- > 0;) {
    if (!FollowsFromRadiance(other.passes, column)) merge.Add(column, other.columns[column]);
  }
  for (std::size_t column = 0; column < other.columns.size(); ++column) {
    const bool is_kept = column < kHalfDifference || column == kPhotonCount;
    EXPECT_EQ(merge.sibling().columns[column].empty(), !is_kept) << column;
  }
  merge.Finish();
  EXPECT_EQ(sum, expected);
}

// Holds a slice, and counts what is asked of it.
class CountedSlice final : public PackedSlice {
 public:
  CountedSlice(SliceSums slice, int& added) : slice_(std::move(slice)), added_(added) {}
  SliceSums Unpacked() const override { return slice_; }
  Status AddTo(SliceSums& sum) const override {
    ++added_;
    return MergeSibling(sum, slice_);
  }

 private:
  SliceSums slice_;
  int& added_;
};

TEST(SliceTreeTest, ASliceThatWaitsMayBePacked) {
  SliceTree plain({64, 72});
  SliceTree packed({64, 72});
  int added = 0;
  for (const std::uint64_t pass : {65U, 64U, 66U, 71U, 69U, 67U, 68U, 70U}) {
    ASSERT_TRUE(plain.Add(RandomPass(pass)).ok());
    ASSERT_TRUE(
        packed.Add(RandomPass(pass), std::make_unique<CountedSlice>(RandomPass(pass), added)).ok());
    EXPECT_EQ(packed.Check({pass, pass + 1}).value(), SliceTree::Outcome::kDuplicate);
    EXPECT_EQ(packed.PrefixEnd(), plain.PrefixEnd());
    const auto prefix = plain.Prefix();
    const auto unpacked = packed.Prefix();
    ASSERT_EQ(unpacked.size(), prefix.size());
    for (std::size_t i = 0; i < prefix.size(); ++i)
      EXPECT_EQ(*unpacked[i], *prefix[i]);
  }
  EXPECT_EQ(added, 4) << "one of each pair has waited, and sums wait as they are";
  EXPECT_EQ(*packed.Whole(), *plain.Whole());

  // A round of one pass waits for nothing.
  SliceTree single({5, 6});
  ASSERT_TRUE(single.Add(RandomPass(5), std::make_unique<CountedSlice>(RandomPass(6), added)).ok());
  EXPECT_EQ(*single.Whole(), RandomPass(5));
}

TEST(SliceTreeTest, ACounterThatDoesNotFitIsRefusedWhereTheOtherHalfIsPacked) {
  SliceTree tree({64, 72});
  int added = 0;
  SliceSums full = RandomPass(64);
  full.tally.photons = UINT64_MAX;
  ASSERT_TRUE(tree.Add(full, std::make_unique<CountedSlice>(full, added)).ok());
  EXPECT_TRUE(absl::IsOutOfRange(tree.Add(RandomPass(65))));
  EXPECT_EQ(tree.PrefixEnd(), 65U);
  EXPECT_EQ(*tree.Prefix()[0], full);
  EXPECT_EQ(added, 0);
}

TEST(SliceTreeTest, EachPassCountsOnce) {
  SliceTree tree({64, 72});
  SliceSums pair = RandomPass(66);
  ASSERT_TRUE(MergeSibling(pair, RandomPass(67)).ok());
  ASSERT_TRUE(tree.Add(pair).ok());
  EXPECT_EQ(tree.Check({66, 68}).value(), SliceTree::Outcome::kDuplicate);
  EXPECT_EQ(tree.Check({66, 67}).value(), SliceTree::Outcome::kDuplicate);
  EXPECT_TRUE(absl::IsInvalidArgument(tree.Check({64, 68}).status()));
  EXPECT_TRUE(absl::IsInvalidArgument(tree.Check({72, 73}).status()));
  EXPECT_EQ(tree.Check({68, 72}).value(), SliceTree::Outcome::kAccepted);
}

// The tail counts as its passes would, and goes away again.
TEST(ImageSumsTest, ATailCountsUntilItIsTakenAway) {
  ThreadTeam team(1);
  ImageSums sums(kPixels);
  sums.Add(RandomPass(0), team);
  sums.Add(RandomPass(1), team);
  const ImageSums::Pixel before = sums.At(3);
  sums.SetTail({std::make_shared<const SliceSums>(RandomPass(2))});
  const ImageSums::Pixel with_tail = sums.At(3);
  EXPECT_EQ(sums.RadianceAt(3), with_tail.radiance());
  EXPECT_EQ(sums.passes(), 3U);
  EXPECT_EQ(sums.whole_passes(), 2U);
  sums.SetTail({});
  EXPECT_EQ(sums.At(3).photons, before.photons);
  // What is added takes the tail away, too.
  sums.SetTail({std::make_shared<const SliceSums>(RandomPass(2))});
  sums.Add(RandomPass(2), team);
  EXPECT_EQ(sums.At(3).photons, with_tail.photons);
  EXPECT_EQ(sums.At(3).squared_deviations, with_tail.squared_deviations);
  EXPECT_EQ(sums.passes(), 3U);
}

// Whichever half is added to which, the reports of the first pass come first, and those that there
// is no room for are left out from behind.
TEST(SliceSumsTest, ReportsAreInOrderAndBounded) {
  const auto with = [](std::uint64_t pass, std::size_t reports) {
    SliceSums slice = EmptySlice({pass, pass + 1}, 3, 0);
    slice.reports.assign(reports, {.pixel = static_cast<std::uint32_t>(pass - 16)});
    return slice;
  };
  for (const bool is_first : {true, false}) {
    for (const std::size_t many : {std::size_t{5}, kMostReports - 1}) {
      const SliceSums first = with(16, many);
      const SliceSums second = with(17, 3);
      SliceSums sum = is_first ? first : second;
      ASSERT_TRUE(MergeSibling(sum, is_first ? second : first).ok());
      ASSERT_EQ(sum.reports.size(), std::min(many + 3, kMostReports));
      EXPECT_EQ(sum.reports[many - 1].pixel, 0U);
      EXPECT_EQ(sum.reports[many].pixel, 1U);
    }
  }
}

}  // namespace
}  // namespace lucerna
