// What is on the disk is what was counted, whatever was refused, replaced or removed.
#include "server/state/disk_budget.h"

#include <array>
#include <memory>
#include <string>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

#include "render/base/files.h"
#include "server/state/blob_files.h"
#include "server/state/checkpoint_files.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace {

Status Write(DiskBudget& budget, const std::string& path, std::size_t bytes) {
  const std::string text(bytes, 'x');
  const std::string_view piece = text;
  return budget.Write(path, {&piece, 1}, "");
}

TEST(DiskBudgetTest, RefusesWhatDoesNotFitAndTakesWhatDoes) {
  const TemporaryFolder folder;
  DiskBudget budget(100);
  ASSERT_TRUE(Write(budget, folder.At("a"), 60).ok());
  const Status refused = Write(budget, folder.At("b"), 41);
  EXPECT_TRUE(absl::IsResourceExhausted(refused)) << refused;
  EXPECT_TRUE(IsOverDiskLimit(refused));
  EXPECT_EQ(SizeOfFile(folder.At("b")), 0U);
  EXPECT_EQ(budget.used_bytes(), 60U);
  EXPECT_TRUE(Write(budget, folder.At("b"), 40).ok());
  EXPECT_FALSE(budget.HasRoom(1));
  budget.Remove(folder.At("a"));
  budget.Remove(folder.At("a"));
  EXPECT_EQ(budget.used_bytes(), 40U);
}

TEST(DiskBudgetTest, CountsAFileTwiceWhileItIsReplacedAndOnceThen) {
  const TemporaryFolder folder;
  DiskBudget budget(100);
  ASSERT_TRUE(Write(budget, folder.At("a"), 60).ok());
  EXPECT_TRUE(IsOverDiskLimit(Write(budget, folder.At("a"), 60)));
  ASSERT_TRUE(Write(budget, folder.At("a"), 40).ok());
  EXPECT_EQ(budget.used_bytes(), 40U);
}

TEST(DiskBudgetTest, AFileThatTheDiskRefusesDoesNotCount) {
  const TemporaryFolder folder;
  DiskBudget budget(100);
  const Status failed = Write(budget, folder.At("no such folder/a"), 60);
  EXPECT_FALSE(failed.ok());
  EXPECT_FALSE(IsOverDiskLimit(failed));
  EXPECT_EQ(budget.used_bytes(), 0U);
}

TEST(DiskBudgetTest, CountsWhatWasThereAndWhatGrowsByItself) {
  const TemporaryFolder folder;
  ASSERT_TRUE(WriteFile(folder.At("database"), std::string(30, 'x')).ok());
  {
    const auto blobs = BlobFiles::Open(folder.At("blobs")).value();
    ASSERT_TRUE(blobs->Put(Sha256("bytes"), "bytes").ok());
  }
  const auto budget = std::make_shared<DiskBudget>(100);
  budget->AddGrowing(folder.At("database"));
  const auto blobs = BlobFiles::Open(folder.At("blobs"), budget).value();
  EXPECT_EQ(budget->used_bytes(), 35U);
  ASSERT_TRUE(WriteFile(folder.At("database"), std::string(99, 'x')).ok());
  EXPECT_TRUE(IsOverDiskLimit(blobs->Put(Sha256("more"), "more")));
  EXPECT_EQ(blobs->SizeOf({Sha256("bytes"), Sha256("more")}), 5U);
  ASSERT_TRUE(WriteFile(folder.At(absl::StrCat("blobs/", Sha256("bytes").Hex())), "bytez").ok());
  EXPECT_TRUE(absl::IsDataLoss(blobs->Get(Sha256("bytes")).status()));
  EXPECT_EQ(budget->used_bytes(), 99U);
}

TEST(DiskBudgetTest, CheckpointsAreCountedAndRemoved) {
  const TemporaryFolder folder;
  const auto budget = std::make_shared<DiskBudget>(100'000);
  const auto files = CheckpointFiles::Open(folder.path(), budget).value();
  const std::string sums(10'000, 'x');
  const CheckpointPieces checkpoint = {"profile", "record", {sums}};
  for (int i = 0; i < 5; ++i)
    ASSERT_TRUE(files->Write("job", checkpoint).ok());
  EXPECT_EQ(budget->used_bytes(), 2 * CheckpointFiles::SizeAsFile(checkpoint));
  EXPECT_EQ(files->SizeOf({"job", "other"}), budget->used_bytes());
  const std::string more(100'000, 'x');
  EXPECT_TRUE(IsOverDiskLimit(files->Write("job", {"", "", {more}})));
  int read = 0;
  EXPECT_TRUE(files
                  ->Read("job",
                         [&](const Checkpoint&) {
                           ++read;
                           return false;
                         })
                  .empty());
  EXPECT_EQ(read, 2);
  files->KeepOnly({});
  EXPECT_EQ(budget->used_bytes(), 0U);
}

}  // namespace
}  // namespace lucerna
