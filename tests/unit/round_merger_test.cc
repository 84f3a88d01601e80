// A slice must count once, however often and late it comes, and only as a slice of an open round.
#include "server/round_merger.h"

#include <cstdint>
#include <memory>
#include <vector>

#include "gtest/gtest.h"

namespace lucerna {
namespace {

using Outcome = MergeOutcome;

constexpr std::size_t kPixels = 5;
const PassKey kRound = {"job", 16};  // of 4 passes

SliceShape Shape() {
  return {.passes = RoundOf(16), .pixels = kPixels, .evidence = 1, .photons_per_pass = 100};
}

// What a pass brings depends on its number.
SliceSums Slice(const PassRange& passes) {
  SliceSums sum = EmptySlice({passes.first, passes.first + 1}, kPixels, 1);
  const std::vector<float> numbers(kPixels, static_cast<float>(passes.first % 7));
  for (PackedFloats& column : sum.columns) {
    if (!column.empty()) column.Write(0, numbers);
  }
  sum.tally.photons = 100;
  sum.tally.rays = passes.first;
  if (passes.size() == 1) return sum;
  const std::uint64_t middle = passes.first + passes.size() / 2;
  sum = Slice({passes.first, middle});
  EXPECT_TRUE(MergeSibling(sum, Slice({middle, passes.last})).ok());
  return sum;
}

TEST(RoundMergerTest, MergesEachSliceOnceInAnyOrder) {
  RoundMerger merger;
  merger.Open(kRound, Shape());
  EXPECT_EQ(merger.PrefixEnd(kRound), 16U);
  EXPECT_EQ(*merger.Merge(kRound, Slice({18, 20})), Outcome::kAccepted);
  EXPECT_EQ(merger.PrefixEnd(kRound), 16U) << "there is a gap before it";
  EXPECT_TRUE(merger.Prefix(kRound).empty());
  EXPECT_EQ(*merger.Merge(kRound, Slice({18, 20})), Outcome::kDuplicate);
  EXPECT_EQ(*merger.Merge(kRound, Slice({16, 17})), Outcome::kAccepted);
  EXPECT_EQ(merger.PrefixEnd(kRound), 17U);
  EXPECT_EQ(merger.Prefix(kRound).size(), 1U);
  EXPECT_EQ(*merger.Merge(kRound, Slice({16, 17})), Outcome::kDuplicate);
  EXPECT_EQ(*merger.Merge(kRound, Slice({17, 18})), Outcome::kAccepted);
  EXPECT_EQ(*merger.Merge(kRound, Slice({17, 18})), Outcome::kDuplicate) << "after it was merged";
  EXPECT_EQ(merger.PrefixEnd(kRound), 20U);
  EXPECT_EQ(*merger.Take(kRound), Slice({16, 20}));
  EXPECT_EQ(*merger.Merge(kRound, Slice({17, 18})), Outcome::kSuperseded);
  EXPECT_FALSE(merger.PrefixEnd(kRound));
}

TEST(RoundMergerTest, RefusesSlicesThatWereNeverLent) {
  RoundMerger merger;
  merger.Open(kRound, Shape());
  ASSERT_EQ(*merger.Merge(kRound, Slice({16, 18})), Outcome::kAccepted);
  // Parts of what has come bring nothing new.
  for (const PassRange& passes : {PassRange{16, 17}, PassRange{17, 18}})
    EXPECT_EQ(*merger.Merge(kRound, Slice(passes)), Outcome::kDuplicate);
  for (const PassRange& passes :
       {PassRange{16, 20}, PassRange{20, 24}, PassRange{12, 14}, PassRange{64, 65}}) {
    EXPECT_TRUE(absl::IsInvalidArgument(merger.Merge(kRound, Slice(passes)).status()))
        << passes.first << " " << passes.last;
  }
  // Ranges that are no slices at all.
  for (const PassRange& passes :
       {PassRange{18, 18}, PassRange{20, 18}, PassRange{17, 19}, PassRange{16, 19}}) {
    SliceSums slice = Slice({18, 19});
    slice.passes = passes;
    EXPECT_TRUE(absl::IsInvalidArgument(merger.Merge(kRound, slice).status()))
        << passes.first << " " << passes.last;
  }
  EXPECT_EQ(*merger.Merge(kRound, Slice({19, 20})), Outcome::kAccepted);
  EXPECT_EQ(*merger.Merge(kRound, Slice({18, 19})), Outcome::kAccepted);
  EXPECT_EQ(*merger.Take(kRound), Slice({16, 20})) << "nothing of what was refused";
}

TEST(RoundMergerTest, ARoundThatIsNotOpenIsSuperseded) {
  RoundMerger merger;
  EXPECT_EQ(*merger.Merge(kRound, Slice({16, 17})), Outcome::kSuperseded);
  EXPECT_FALSE(merger.ShapeOf(kRound));
  merger.Open(kRound, Shape());
  EXPECT_EQ(merger.ShapeOf(kRound)->passes, Shape().passes);
  EXPECT_EQ(merger.ShapeOf(kRound)->pixels, kPixels);
  EXPECT_FALSE(merger.ShapeOf({"other job", 16}));
  EXPECT_EQ(*merger.Merge({"other job", 16}, Slice({16, 17})), Outcome::kSuperseded);
  merger.Drop(kRound);
  merger.Drop(kRound);
  EXPECT_EQ(*merger.Merge(kRound, Slice({16, 17})), Outcome::kSuperseded);
  // Opened again by a job that goes on: it begins from nothing.
  merger.Open(kRound, Shape());
  EXPECT_EQ(*merger.Merge(kRound, Slice({16, 17})), Outcome::kAccepted);
}

// The tail of an image keeps what it was given while the round goes on.
TEST(RoundMergerTest, APrefixStaysAsItWasWhenMoreComes) {
  RoundMerger merger;
  merger.Open(kRound, Shape());
  ASSERT_TRUE(merger.Merge(kRound, Slice({16, 17})).ok());
  ASSERT_TRUE(merger.Merge(kRound, Slice({19, 20})).ok());
  const ImageSums::Slices prefix = merger.Prefix(kRound);
  ASSERT_EQ(prefix.size(), 1U);
  ASSERT_TRUE(merger.Merge(kRound, Slice({17, 18})).ok());
  ASSERT_TRUE(merger.Merge(kRound, Slice({18, 19})).ok());
  EXPECT_EQ(*prefix[0], Slice({16, 17}));
  ASSERT_EQ(merger.Prefix(kRound).size(), 1U);
  EXPECT_EQ(*merger.Prefix(kRound)[0], Slice({16, 20}));
}

// Counters that do not fit belong to a slice that nobody has traced. It must not take others with
// it: the round can still become whole.
TEST(RoundMergerTest, ASliceWhoseCountersDoNotFitIsRefusedAndLeavesTheRoundAsItWas) {
  RoundMerger merger;
  merger.Open(kRound, Shape());
  ASSERT_TRUE(merger.Merge(kRound, Slice({16, 17})).ok());
  SliceSums forged = Slice({17, 18});
  forged.tally.rays = UINT64_MAX;
  EXPECT_TRUE(absl::IsOutOfRange(merger.Merge(kRound, forged).status()));
  EXPECT_EQ(merger.PrefixEnd(kRound), 17U);
  const auto again = merger.Merge(kRound, Slice({17, 18}));
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(*again, Outcome::kAccepted);
  ASSERT_TRUE(merger.Merge(kRound, Slice({18, 20})).ok());
  ASSERT_EQ(merger.PrefixEnd(kRound), 20U);
  EXPECT_EQ(*merger.Take(kRound), Slice({16, 20}));
}

}  // namespace
}  // namespace lucerna
