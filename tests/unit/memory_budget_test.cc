// Claims are bytes that are held, refusals name who holds most, and caches let go before that.
#include "server/memory_budget.h"

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

#include "server/blob_store.h"

namespace lucerna {
namespace {

using testing::HasSubstr;

TEST(MemoryBudgetTest, HoldsWhatIsClaimedUntilTheClaimEnds) {
  MemoryBudget budget(100);
  std::optional<MemoryClaim> first = budget.Claim(MemoryUse::kUploads, 60).value();
  {
    const MemoryClaim second = budget.Claim(MemoryUse::kCommits, 40).value();
    EXPECT_EQ(budget.held(), 100U);
    EXPECT_EQ(budget.HeldFor(MemoryUse::kCommits), 40U);
    EXPECT_TRUE(absl::IsResourceExhausted(budget.Claim(MemoryUse::kJobs, 1).status()));
    EXPECT_TRUE(budget.Claim(MemoryUse::kJobs, 0).ok());
  }
  MemoryClaim moved = *std::move(first);
  first.reset();
  EXPECT_EQ(budget.held(), 60U) << "a claim that was moved is held once";
  moved = MemoryClaim();
  EXPECT_EQ(budget.held(), 0U);
  EXPECT_TRUE(absl::IsResourceExhausted(budget.Claim(MemoryUse::kJobs, UINT64_MAX).status()));
}

// Jobs that hold all memory end only by results.
TEST(MemoryBudgetTest, OneOfAKindComesEvenWhereNothingIsLeft) {
  MemoryBudget budget(100);
  const MemoryClaim job = budget.Claim(MemoryUse::kJobs, 95).value();
  ASSERT_FALSE(budget.Claim(MemoryUse::kCommits, 40).ok());
  {
    const MemoryClaim one = budget.ClaimOneAnyway(MemoryUse::kCommits, 40);
    EXPECT_FALSE(one.is_empty());
    EXPECT_EQ(budget.held(), 135U);
    EXPECT_TRUE(budget.ClaimOneAnyway(MemoryUse::kCommits, 40).is_empty());
    EXPECT_FALSE(budget.Claim(MemoryUse::kUploads, 1).ok()) << "beyond the budget";
  }
  EXPECT_EQ(budget.held(), 95U);
}

TEST(MemoryBudgetTest, ARefusalNamesTheLargestHolders) {
  MemoryBudget budget(10'000'000);
  const MemoryClaim jobs = budget.Claim(MemoryUse::kJobs, 6'000'000).value();
  const MemoryClaim images = budget.Claim(MemoryUse::kImages, 500'000).value();
  const MemoryClaim uploads = budget.Claim(MemoryUse::kUploads, 2'000'000).value();
  EXPECT_EQ(std::string(budget.Claim(MemoryUse::kCommits, 3'000'000).status().message()),
            "the coordinator has no memory for 3.0 MB of results of workers: 8.5 MB of its 10.0 MB "
            "are held, most of it by jobs (6.0 MB) and uploads (2.0 MB); try again later, or start "
            "it with a larger --max-memory");
}

TEST(MemoryBudgetTest, CachesLetGoInOrderAndNoMoreThanIsNeeded) {
  MemoryBudget budget(100);
  std::vector<MemoryClaim> blobs;
  std::vector<MemoryClaim> photons;
  const auto pop = [](std::vector<MemoryClaim>& claims) {
    return [&claims] {
      if (claims.empty()) return false;
      claims.pop_back();
      return true;
    };
  };
  budget.AddCache(pop(blobs));
  budget.AddCache(pop(photons));
  for (int i = 0; i < 5; ++i) {
    blobs.push_back(budget.Claim(MemoryUse::kBlobs, 10).value());
    photons.push_back(budget.Claim(MemoryUse::kJobs, 10).value());
  }
  const MemoryClaim some = budget.Claim(MemoryUse::kUploads, 15).value();
  EXPECT_EQ(blobs.size(), 3U);
  EXPECT_EQ(photons.size(), 5U);
  const MemoryClaim more = budget.Claim(MemoryUse::kUploads, 45).value();
  EXPECT_EQ(blobs.size(), 0U);
  EXPECT_EQ(photons.size(), 4U);
  EXPECT_FALSE(budget.Claim(MemoryUse::kUploads, 101).ok());
  EXPECT_EQ(photons.size(), 4U) << "what can never fit costs nobody anything";
}

TEST(MemoryBudgetTest, FilesAreClaimedAndHitpointsBelongToTheirJob) {
  MemoryBudget budget(100);
  BlobStore blobs(1000, nullptr, &budget);
  budget.AddCache([&] { return blobs.DropOldest(); });
  ASSERT_TRUE(blobs.Put(Sha256("a"), std::string(60, 'a')).ok());
  EXPECT_EQ(budget.HeldFor(MemoryUse::kBlobs), 60U);
  const auto pin = blobs.PutPinned(Sha256("block"), std::string(500, 'b'), AfterLastPin::kDrop);
  ASSERT_TRUE(pin.ok());
  EXPECT_EQ(budget.held(), 60U);
  // The first is not needed by anybody.
  const auto file = blobs.PutPinned(Sha256("c"), std::string(70, 'c'));
  ASSERT_TRUE(file.ok());
  EXPECT_FALSE(blobs.Has(Sha256("a")));
  EXPECT_TRUE(absl::IsResourceExhausted(blobs.Put(Sha256("d"), std::string(40, 'd'))));
  EXPECT_EQ(budget.held(), 70U);
}

}  // namespace
}  // namespace lucerna
