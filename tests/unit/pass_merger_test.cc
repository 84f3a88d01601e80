// A batch must count once, however often and late it comes, and only if it was lent as it is.
#include "server/pass_merger.h"

#include "gtest/gtest.h"

namespace lucerna {
namespace {

using Outcome = MergeOutcome;

const PassKey kPass = {"job", 3};

Accumulation Batch(WorkRange range, std::int64_t flux = 5) {
  Accumulation accumulation;
  accumulation.hitpoints = {1};
  accumulation.counts = {1};
  for (auto& channel : accumulation.flux)
    channel = {flux};
  accumulation.tally.photons = range.size();
  return accumulation;
}

StatusOr<Outcome> Merge(PassMerger& merger, WorkRange range) {
  return merger.Merge(kPass, range, Batch(range));
}

TEST(PassMergerTest, MergesEachRangeOnceInAnyOrder) {
  PassMerger merger;
  merger.Open(kPass, 2, 100);
  EXPECT_EQ(*Merge(merger, {60, 100}), Outcome::kAccepted);
  EXPECT_EQ(*Merge(merger, {0, 30}), Outcome::kAccepted);
  EXPECT_EQ(*Merge(merger, {60, 100}), Outcome::kDuplicate);
  EXPECT_FALSE(merger.IsComplete(kPass));
  EXPECT_EQ(*Merge(merger, {30, 60}), Outcome::kAccepted);
  EXPECT_TRUE(merger.IsComplete(kPass));
  const PassSums sums = merger.Take(kPass);
  EXPECT_EQ(sums.flux(0).ToVector(), (std::vector<std::int64_t>{0, 15}));
  EXPECT_EQ(sums.tally().photons, 100U);
  EXPECT_EQ(*Merge(merger, {30, 60}), Outcome::kSuperseded);
}

TEST(PassMergerTest, RefusesRangesThatWereNeverLent) {
  PassMerger merger;
  merger.Open(kPass, 2, 100);
  ASSERT_TRUE(Merge(merger, {40, 60}).ok());
  for (const WorkRange range :
       {WorkRange{30, 41}, {59, 70}, {45, 50}, {30, 70}, {40, 61}, {50, 50}, {70, 60}, {90, 101}}) {
    EXPECT_TRUE(absl::IsInvalidArgument(Merge(merger, range).status()))
        << range.first << " " << range.last;
  }
  EXPECT_EQ(*Merge(merger, {30, 40}), Outcome::kAccepted);
  EXPECT_EQ(*Merge(merger, {60, 61}), Outcome::kAccepted);
}

TEST(PassMergerTest, RefusesABatchWhoseTallyIsOfAnotherSizeAndForgetsIt) {
  PassMerger merger;
  merger.Open(kPass, 2, 100);
  const WorkRange range = {0, 50};
  EXPECT_FALSE(merger.Merge(kPass, range, Batch({0, 49})).ok());
  Accumulation out_of_range = Batch(range);
  out_of_range.hitpoints = {2};
  EXPECT_FALSE(merger.Merge(kPass, range, out_of_range).ok());
  EXPECT_EQ(*Merge(merger, range), Outcome::kAccepted) << "a refused batch may come again";
}

TEST(PassMergerTest, RefusesABatchThatNamesPhotonsItDidNotTrace) {
  PassMerger merger;
  merger.Open(kPass, 2, 100);
  const WorkRange range = {20, 50};
  const auto merge = [&](std::uint64_t dropped, std::vector<std::uint64_t> named) {
    Accumulation batch = Batch(range);
    batch.tally.dropped = dropped;
    batch.dropped_photons = std::move(named);
    return merger.Merge(kPass, range, batch).status();
  };
  EXPECT_TRUE(absl::IsInvalidArgument(merge(1, {19})));
  EXPECT_TRUE(absl::IsInvalidArgument(merge(1, {50})));
  EXPECT_TRUE(absl::IsInvalidArgument(merge(2, {30, 30})));
  EXPECT_TRUE(absl::IsInvalidArgument(merge(2, {31, 30})));
  EXPECT_TRUE(absl::IsInvalidArgument(merge(2, {30})));
  EXPECT_TRUE(absl::IsInvalidArgument(merge(0, {30})));
  EXPECT_TRUE(absl::IsInvalidArgument(merge(31, {20, 21, 22, 23, 24, 25, 26, 27})));
  EXPECT_TRUE(merge(30, {20, 21, 22, 23, 24, 25, 26, 49}).ok());
}

TEST(PassMergerTest, ADroppedPassIsSuperseded) {
  PassMerger merger;
  EXPECT_EQ(*Merge(merger, {0, 10}), Outcome::kSuperseded);
  merger.Open(kPass, 2, 100);
  EXPECT_EQ(merger.Hitpoints(kPass), 2U);
  merger.Drop(kPass);
  EXPECT_EQ(*Merge(merger, {0, 10}), Outcome::kSuperseded);
  EXPECT_FALSE(merger.Hitpoints(kPass));
}

}  // namespace
}  // namespace lucerna
