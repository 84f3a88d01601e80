// A file is written whole or not at all, and every failure names the file and the reason.
#include "render/base/files.h"

#include <cstdlib>
#include <filesystem>
#include <string>

#include "gtest/gtest.h"
#include <sys/stat.h>
#include <unistd.h>

namespace lucerna {
namespace {

class FilesTest : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = testing::TempDir() + "/lucerna_files_XXXXXX";
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    folder_ = name;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  [[nodiscard]] std::string Path(const std::string& name) const { return folder_ + "/" + name; }
  [[nodiscard]] std::size_t FilesInFolder() const {
    std::size_t count = 0;
    for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder_))
      ++count;
    return count;
  }

  std::string folder_;
};

TEST_F(FilesTest, ReadsWhatItWrote) {
  std::string bytes = "first\n";
  bytes.push_back('\0');
  bytes += std::string(100000, '\xFF');
  ASSERT_TRUE(WriteFile(Path("a"), bytes).ok());
  EXPECT_EQ(ReadFile(Path("a")).value(), bytes);
  ASSERT_TRUE(WriteFile(Path("a"), "second").ok());
  EXPECT_EQ(ReadFile(Path("a")).value(), "second");
  ASSERT_TRUE(WriteFile(Path("a"), "").ok());
  EXPECT_EQ(ReadFile(Path("a")).value(), "");
  EXPECT_EQ(FilesInFolder(), 1U);
}

TEST_F(FilesTest, ALinkStaysALinkToTheNewBytes) {
  ASSERT_EQ(::mkdir(Path("elsewhere").c_str(), 0700), 0);
  ASSERT_TRUE(WriteFile(Path("elsewhere/a"), "first").ok());
  ASSERT_EQ(::symlink("elsewhere/a", Path("link").c_str()), 0);
  ASSERT_TRUE(WriteFile(Path("link"), "second").ok());
  EXPECT_TRUE(std::filesystem::is_symlink(Path("link")));
  EXPECT_EQ(ReadFile(Path("elsewhere/a")).value(), "second");
}

TEST_F(FilesTest, KnowsOnePlaceUnderSeveralNames) {
  EXPECT_TRUE(IsSameFile(Path("new"), Path("./new")));
  EXPECT_TRUE(IsSameFile("new", std::filesystem::current_path().string() + "/new"));
  EXPECT_FALSE(IsSameFile(Path("new"), Path("newer")));
  ASSERT_TRUE(WriteFile(Path("a"), "x").ok());
  ASSERT_EQ(::symlink("a", Path("link").c_str()), 0);
  EXPECT_TRUE(IsSameFile(Path("a"), Path("link")));
}

TEST_F(FilesTest, NamesTheFileThatIsMissingOrIsAFolder) {
  const Status missing = ReadFile(Path("none")).status();
  EXPECT_EQ(missing.code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(missing.message().substr(0, Path("none").size()), Path("none"));
  const Status folder = ReadFile(folder_).status();
  EXPECT_EQ(folder.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(WriteFile(folder_, "x").code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(CheckWritable(folder_).code(), absl::StatusCode::kInvalidArgument);
}

TEST_F(FilesTest, RefusesAPipeInsteadOfWaitingForIt) {
  ASSERT_EQ(::mkfifo(Path("pipe").c_str(), 0600), 0);
  EXPECT_EQ(ReadFile(Path("pipe")).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST_F(FilesTest, RefusesMoreThanTheLimitBeforeReadingIt) {
  ASSERT_TRUE(WriteFile(Path("a"), "12345").ok());
  EXPECT_TRUE(ReadFile(Path("a"), 5).ok());
  EXPECT_EQ(ReadFile(Path("a"), 4).status().code(), absl::StatusCode::kResourceExhausted);
}

TEST_F(FilesTest, LeavesTheOldFileAndNothingElseWhenTheFolderIsMissing) {
  EXPECT_EQ(WriteFile(Path("none/a"), "x").code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(CheckWritable(Path("none/a")).code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(FilesInFolder(), 0U);
}

TEST_F(FilesTest, SaysThatTheDiskIsFull) {
  if (::access("/dev/full", W_OK) != 0) GTEST_SKIP() << "this machine has no /dev/full";
  EXPECT_EQ(WriteFile("/dev/full", "x").code(), absl::StatusCode::kResourceExhausted);
}

TEST_F(FilesTest, LooksForAWritableFolderWithoutLeavingAnything) {
  EXPECT_TRUE(CheckWritable(Path("new")).ok());
  EXPECT_EQ(FilesInFolder(), 0U);
}

}  // namespace
}  // namespace lucerna
