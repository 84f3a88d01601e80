// When memory runs out while a slice is merged, the round is as it was, and the slice can come
// again.
//
// Every allocation of a merge is made to fail, one after the other.
#include <memory>
#include <new>
#include <vector>

#include "gtest/gtest.h"

#include "server/round_merger.h"
#include "tests/memory/failing_allocations.h"

namespace lucerna {
namespace {

constexpr std::size_t kMergedPixels = 5;
const PassKey kRound = {"job", 16};  // of 4 passes

SliceSums Slice(std::uint64_t pass) {
  SliceSums sum = EmptySlice({pass, pass + 1}, kMergedPixels, 1);
  const std::vector<float> numbers(kMergedPixels, static_cast<float>(pass % 7));
  for (PackedFloats& column : sum.columns) {
    if (!column.empty()) column.Write(0, numbers);
  }
  sum.tally.photons = 100;
  sum.dropped_photons = {{pass, 1}};
  return sum;
}

// A slice as it is.
class SameSlice final : public PackedSlice {
 public:
  explicit SameSlice(SliceSums slice) : slice_(std::move(slice)) {}
  SliceSums Unpacked() const override { return slice_; }
  Status AddTo(SliceSums& sum) const override {
    const SliceSums copy = slice_;  // as what is unpacked needs memory
    return MergeSibling(sum, copy);
  }

 private:
  SliceSums slice_;
};

std::unique_ptr<RoundMerger> RoundWith(const std::vector<std::uint64_t>& passes, bool are_packed) {
  auto merger = std::make_unique<RoundMerger>();
  merger->Open(
      kRound,
      {.passes = RoundOf(16), .pixels = kMergedPixels, .evidence = 1, .photons_per_pass = 100});
  for (const std::uint64_t pass : passes) {
    std::unique_ptr<const PackedSlice> packed;
    if (are_packed) packed = std::make_unique<SameSlice>(Slice(pass));
    EXPECT_TRUE(merger->Merge(kRound, Slice(pass), std::move(packed)).ok());
  }
  return merger;
}

class RoundMergerMemoryTest : public testing::TestWithParam<bool> {};

TEST_P(RoundMergerMemoryTest, AMergeThatRunsOutOfMemoryChangesNothingAndCanBeMadeAgain) {
  const std::shared_ptr<const SliceSums> whole = RoundWith({16, 18, 19, 17}, false)->Take(kRound);
  int failures = 0;
  for (bool has_failed = true; has_failed; ++failures) {
    SCOPED_TRACE(failures);
    const auto merger = RoundWith({16, 18, 19}, GetParam());
    const std::size_t before = merger->Prefix(kRound).size();
    SliceSums last = Slice(17);
    std::unique_ptr<const PackedSlice> packed = std::make_unique<SameSlice>(last);
    has_failed = false;
    allocations_left = failures;
    try {
      EXPECT_TRUE(merger->Merge(kRound, std::move(last), std::move(packed)).ok());
    } catch (const std::bad_alloc&) {
      has_failed = true;
    }
    allocations_left = kNever;
    if (has_failed) {
      EXPECT_FALSE(merger->Has(kRound, {17, 18}));
      EXPECT_EQ(merger->PrefixEnd(kRound), 17U);
      EXPECT_EQ(merger->Prefix(kRound).size(), before);
      const auto again = merger->Merge(kRound, Slice(17));
      ASSERT_TRUE(again.ok());
      EXPECT_EQ(*again, MergeOutcome::kAccepted);
    }
    ASSERT_EQ(merger->PrefixEnd(kRound), 20U);
    EXPECT_EQ(*merger->Take(kRound), *whole);
  }
  EXPECT_GT(failures, 5) << "a merge of three slices allocates";
}
INSTANTIATE_TEST_SUITE_P(Waiting, RoundMergerMemoryTest, testing::Bool(),
                         [](const auto& test) { return test.param ? "Packed" : "AsTheyAre"; });

}  // namespace
}  // namespace lucerna
