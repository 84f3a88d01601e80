// A checkpoint that was torn or flipped is never used; the one before it is.
#include "server/state/checkpoint_files.h"

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

#include "render/base/files.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

Checkpoint NumberedCheckpoint(int number) {
  return {.numeric_profile = "profile",
          .record = absl::StrCat("record ", number),
          .sums = std::string(1000, static_cast<char>('0' + number))};
}

// In two pieces.
Status Write(CheckpointFiles& files, const std::string& job_id, const Checkpoint& checkpoint) {
  const std::string_view sums = checkpoint.sums;
  return files.Write(
      job_id,
      {checkpoint.numeric_profile, checkpoint.record, {sums.substr(0, 400), sums.substr(400)}});
}

struct Found {
  std::vector<Checkpoint> newest_first;
  std::vector<std::string> damaged;
};
// All of a job: none is used.
Found ReadAll(CheckpointFiles& files, const std::string& job_id) {
  Found found;
  found.damaged = files.Read(job_id, [&](Checkpoint checkpoint) {
    found.newest_first.push_back(std::move(checkpoint));
    return false;
  });
  return found;
}

// The two files of job `j`, the newest as `first`.
class CheckpointFilesTest : public testing::Test {
 protected:
  void SetUp() override {
    files_ = CheckpointFiles::Open(folder_.At("checkpoints")).value();
    for (int number = 1; number <= 3; ++number)
      ASSERT_TRUE(Write(*files_, "j-1", NumberedCheckpoint(number)).ok());
  }
  [[nodiscard]] std::string Newest() const { return folder_.At("checkpoints/j-1.0"); }
  [[nodiscard]] std::string Older() const { return folder_.At("checkpoints/j-1.1"); }

  TemporaryFolder folder_;
  std::unique_ptr<CheckpointFiles> files_;
};

TEST_F(CheckpointFilesTest, KeepsTheTwoNewest) {
  const auto found = ReadAll(*files_, "j-1");
  EXPECT_THAT(found.newest_first, ElementsAre(NumberedCheckpoint(3), NumberedCheckpoint(2)));
  EXPECT_THAT(found.damaged, IsEmpty());
  EXPECT_TRUE(files_->Has("j-1"));
  EXPECT_FALSE(files_->Has("j-2"));
  EXPECT_THAT(ReadAll(*files_, "j-2").newest_first, IsEmpty());
}

TEST_F(CheckpointFilesTest, TheOlderIsLookedAtButNotUsedOnceTheNewerIs) {
  ASSERT_TRUE(WriteFile(Older(), "damaged").ok());
  std::vector<Checkpoint> read;
  const auto use = [&](Checkpoint checkpoint) {
    read.push_back(std::move(checkpoint));
    return true;
  };
  EXPECT_THAT(files_->Read("j-1", use), SizeIs(1));
  EXPECT_THAT(read, ElementsAre(NumberedCheckpoint(3)));

  read.clear();
  ASSERT_TRUE(Write(*files_, "j-1", NumberedCheckpoint(4)).ok()) << "in place of the older";
  const std::string torn = ReadFile(Newest()).value();
  ASSERT_TRUE(WriteFile(Newest(), torn.substr(0, torn.size() - 1)).ok());
  EXPECT_THAT(files_->Read("j-1", use), SizeIs(1)) << "what begins well and does not end so";
  EXPECT_THAT(read, ElementsAre(NumberedCheckpoint(4)));
}

TEST_F(CheckpointFilesTest, AFlippedBitAnywhereFallsBackToTheOneBefore) {
  const std::string whole = ReadFile(Newest()).value();
  for (std::size_t byte = 0; byte < whole.size(); ++byte) {
    std::string flipped = whole;
    flipped[byte] = static_cast<char>(flipped[byte] ^ (1 << byte % 8));
    ASSERT_TRUE(WriteFile(Newest(), flipped).ok());
    const auto found = ReadAll(*files_, "j-1");
    ASSERT_THAT(found.newest_first, ElementsAre(NumberedCheckpoint(2))) << "byte " << byte;
    ASSERT_THAT(found.damaged, SizeIs(1));
  }
}

TEST_F(CheckpointFilesTest, ATruncatedOneFallsBackToTheOneBefore) {
  const std::string whole = ReadFile(Newest()).value();
  for (std::size_t size = 0; size < whole.size(); ++size) {
    ASSERT_TRUE(WriteFile(Newest(), whole.substr(0, size)).ok());
    ASSERT_THAT(ReadAll(*files_, "j-1").newest_first, ElementsAre(NumberedCheckpoint(2))) << size;
  }
  ASSERT_TRUE(WriteFile(Newest(), whole + "x").ok());
  EXPECT_THAT(ReadAll(*files_, "j-1").newest_first, ElementsAre(NumberedCheckpoint(2)));
}

TEST_F(CheckpointFilesTest, ADamagedOneIsReplacedBeforeTheOneThatIsWhole) {
  ASSERT_TRUE(WriteFile(Newest(), "damaged").ok());
  files_ = CheckpointFiles::Open(folder_.At("checkpoints")).value();
  ASSERT_THAT(ReadAll(*files_, "j-1").newest_first, ElementsAre(NumberedCheckpoint(2)));
  ASSERT_TRUE(Write(*files_, "j-1", NumberedCheckpoint(4)).ok());
  EXPECT_THAT(ReadAll(*files_, "j-1").newest_first,
              ElementsAre(NumberedCheckpoint(4), NumberedCheckpoint(2)));
}

TEST_F(CheckpointFilesTest, TwoDamagedOnesAreNone) {
  ASSERT_TRUE(WriteFile(Newest(), "damaged").ok());
  ASSERT_TRUE(WriteFile(Older(), "damaged").ok());
  const auto found = ReadAll(*files_, "j-1");
  EXPECT_THAT(found.newest_first, IsEmpty());
  EXPECT_THAT(found.damaged, SizeIs(2));
}

TEST_F(CheckpointFilesTest, RemovesThoseOfJobsThatAreGoneAndWhatACrashLeft) {
  ASSERT_TRUE(Write(*files_, "j-2", NumberedCheckpoint(1)).ok());
  ASSERT_TRUE(Write(*files_, "j-3", NumberedCheckpoint(1)).ok());
  files_->KeepOnly({"j-1", "j-3"});
  EXPECT_TRUE(files_->Has("j-1"));
  EXPECT_FALSE(files_->Has("j-2"));
  EXPECT_TRUE(files_->Has("j-3"));
  const std::string unfinished = folder_.At("checkpoints/j-3.1.12.0.tmp");
  ASSERT_TRUE(WriteFile(unfinished, "half").ok());
  files_ = CheckpointFiles::Open(folder_.At("checkpoints")).value();
  EXPECT_FALSE(std::filesystem::exists(unfinished));
  EXPECT_THAT(ReadAll(*files_, "j-3").newest_first, ElementsAre(NumberedCheckpoint(1)));
}

}  // namespace
}  // namespace lucerna
