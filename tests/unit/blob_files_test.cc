// Blobs on the disk are whole, or they are not there.
#include "server/state/blob_files.h"

#include <filesystem>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

#include "render/base/files.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace {

std::size_t FilesIn(const std::string& folder) {
  std::size_t files = 0;
  for ([[maybe_unused]] const auto& file : std::filesystem::directory_iterator(folder))
    ++files;
  return files;
}

TEST(BlobFilesTest, KeepsBytesForTheNextStart) {
  const TemporaryFolder folder;
  const std::string bytes = "a scene";
  {
    const auto blobs = BlobFiles::Open(folder.At("blobs")).value();
    EXPECT_FALSE(blobs->Has(Sha256(bytes)));
    EXPECT_TRUE(absl::IsNotFound(blobs->Get(Sha256(bytes)).status()));
    ASSERT_TRUE(blobs->Put(Sha256(bytes), bytes).ok());
    ASSERT_TRUE(blobs->Put(Sha256(bytes), bytes).ok());
  }
  const auto blobs = BlobFiles::Open(folder.At("blobs")).value();
  EXPECT_TRUE(blobs->Has(Sha256(bytes)));
  EXPECT_EQ(blobs->Get(Sha256(bytes)).value(), bytes);
}

TEST(BlobFilesTest, NeverReadsFlippedOrTornBytes) {
  const TemporaryFolder folder;
  const auto blobs = BlobFiles::Open(folder.path()).value();
  const std::string bytes = "a scene";
  const Digest digest = Sha256(bytes);
  for (const char* damaged : {"a scenE", "a sce", "", "a scene "}) {
    ASSERT_TRUE(blobs->Put(digest, bytes).ok());
    ASSERT_TRUE(WriteFile(folder.At(digest.Hex()), damaged).ok());
    EXPECT_TRUE(absl::IsDataLoss(blobs->Get(digest).status())) << damaged;
    EXPECT_FALSE(blobs->Has(digest)) << "it can be uploaded again";
  }
  ASSERT_TRUE(WriteFile(folder.At(digest.Hex()), "damaged").ok());
  ASSERT_TRUE(blobs->Put(digest, bytes).ok());
  EXPECT_EQ(blobs->Get(digest).value(), bytes);
}

TEST(BlobFilesTest, RemovesWhatNobodyNeedsAndWhatACrashLeft) {
  const TemporaryFolder folder;
  {
    const auto blobs = BlobFiles::Open(folder.path()).value();
    ASSERT_TRUE(blobs->Put(Sha256("kept"), "kept").ok());
    ASSERT_TRUE(blobs->Put(Sha256("dropped"), "dropped").ok());
    blobs->KeepOnly({Sha256("kept"), Sha256("never there")});
    EXPECT_TRUE(blobs->Has(Sha256("kept")));
    EXPECT_FALSE(blobs->Has(Sha256("dropped")));
  }
  ASSERT_TRUE(WriteFile(folder.At("abc.12.0.tmp"), "half a bl").ok());
  ASSERT_EQ(FilesIn(folder.path()), 2U);
  const auto blobs = BlobFiles::Open(folder.path()).value();
  EXPECT_EQ(FilesIn(folder.path()), 1U);
  EXPECT_TRUE(blobs->Has(Sha256("kept")));
}

TEST(BlobFilesTest, SaysWhyThereIsNoFolder) {
  const TemporaryFolder folder;
  ASSERT_TRUE(WriteFile(folder.At("file"), "").ok());
  const auto blobs = BlobFiles::Open(folder.At("file/blobs"));
  EXPECT_THAT(std::string(blobs.status().message()), testing::HasSubstr("file/blobs"));
}

}  // namespace
}  // namespace lucerna
