// What is pinned must stay, what is not must make room, and the bound must hold.
#include "server/blob_store.h"

#include "gtest/gtest.h"

#include "render/base/files.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace {

Digest Put(BlobStore& blobs, const std::string& bytes) {
  const Digest digest = Sha256(bytes);
  EXPECT_TRUE(blobs.Put(digest, bytes).ok());
  return digest;
}

TEST(BlobStoreTest, GivesBackWhatWasPut) {
  BlobStore blobs(100);
  const Digest digest = Put(blobs, "hello");
  EXPECT_EQ(**blobs.Get(digest), "hello");
  EXPECT_TRUE(absl::IsNotFound(blobs.Get(Sha256("other")).status()));
  Put(blobs, "hello");
  EXPECT_EQ(blobs.size_bytes(), 5U) << "kept once";
}

TEST(BlobStoreTest, ForgetsTheLeastRecentlyUsedFirst) {
  BlobStore blobs(10);
  const Digest a = Put(blobs, "aaaa");
  const Digest b = Put(blobs, "bbbb");
  ASSERT_TRUE(blobs.Get(a).ok());
  const Digest c = Put(blobs, "cccc");
  EXPECT_TRUE(blobs.Has(a));
  EXPECT_FALSE(blobs.Has(b));
  EXPECT_TRUE(blobs.Has(c));
  EXPECT_LE(blobs.size_bytes(), 10U);
}

TEST(BlobStoreTest, KeepsWhatIsPinnedAndSaysWhenItIsFull) {
  BlobStore blobs(10);
  const Digest a = Put(blobs, "aaaa");
  StatusOr<BlobPin> first = blobs.Pin(a);
  StatusOr<BlobPin> second = blobs.Pin(a);
  ASSERT_TRUE(first.ok() && second.ok());
  const Digest b = Sha256("bbbb");
  const StatusOr<BlobPin> of_b = blobs.PutPinned(b, "bbbb");
  ASSERT_TRUE(of_b.ok());
  EXPECT_TRUE(absl::IsResourceExhausted(blobs.Put(Sha256("cccc"), "cccc")));
  *first = BlobPin();
  EXPECT_TRUE(absl::IsResourceExhausted(blobs.Put(Sha256("cccc"), "cccc"))) << "pinned twice";
  *second = BlobPin();
  EXPECT_TRUE(blobs.Has(a)) << "stays while there is room";
  EXPECT_TRUE(blobs.Put(Sha256("cccc"), "cccc").ok());
  EXPECT_FALSE(blobs.Has(a));
  EXPECT_TRUE(absl::IsNotFound(blobs.Pin(a).status()));
}

TEST(BlobStoreTest, DropsWithTheLastPin) {
  BlobStore blobs(10);
  const Digest a = Sha256("aaaa");
  StatusOr<BlobPin> first = blobs.PutPinned(a, "aaaa", AfterLastPin::kDrop);
  StatusOr<BlobPin> second = blobs.PutPinned(a, "aaaa", AfterLastPin::kDrop);
  ASSERT_TRUE(first.ok() && second.ok());
  *first = BlobPin();
  EXPECT_TRUE(blobs.Has(a)) << "another pass has the same radii";
  const Blob held = *blobs.Get(a);
  *second = BlobPin();
  EXPECT_FALSE(blobs.Has(a));
  EXPECT_EQ(blobs.size_bytes(), 0U);
  EXPECT_EQ(*held, "aaaa") << "what is being sent stays valid";
}

TEST(BlobStoreTest, APinMovesWithItsOwnerAndEndsOnce) {
  BlobStore blobs(4);
  const Digest a = Put(blobs, "aaaa");
  {
    PinnedBlobs pins;
    pins.push_back(*blobs.Pin(a));
    const PinnedBlobs moved = std::move(pins);
    pins.clear();
    EXPECT_EQ(moved[0].digest(), a);
    EXPECT_TRUE(absl::IsResourceExhausted(blobs.Put(Sha256("bbbb"), "bbbb")));
  }
  EXPECT_TRUE(blobs.Put(Sha256("bbbb"), "bbbb").ok());
  EXPECT_FALSE(blobs.Has(a));
}

TEST(BlobStoreTest, ReadsFromTheDiskWhatIsNotInMemory) {
  const TemporaryFolder folder;
  const auto files = BlobFiles::Open(folder.path()).value();
  BlobStore blobs(10, files.get());
  const Digest kept = Sha256("kept");
  ASSERT_TRUE(files->Put(kept, "kept").ok());
  EXPECT_TRUE(blobs.Has(kept));
  EXPECT_EQ(blobs.size_bytes(), 0U);
  EXPECT_EQ(**blobs.Get(kept), "kept");
  EXPECT_EQ(blobs.size_bytes(), 4U) << "memory is its cache";
  Put(blobs, "0123456789");
  EXPECT_EQ(blobs.size_bytes(), 10U) << "and makes room";
  {
    const auto pin = blobs.Pin(kept);
    ASSERT_TRUE(pin.ok()) << pin.status();
    EXPECT_EQ(blobs.size_bytes(), 4U);
    EXPECT_TRUE(absl::IsResourceExhausted(blobs.Put(Sha256("0123456789"), "0123456789")));
  }
  BlobStore full(0, files.get());
  EXPECT_EQ(**full.Get(kept), "kept") << "also without room in memory";
  ASSERT_TRUE(WriteFile(folder.At(kept.Hex()), "kepT").ok());
  EXPECT_TRUE(absl::IsDataLoss(full.Get(kept).status()));
  EXPECT_TRUE(absl::IsNotFound(full.Get(kept).status()));
}

}  // namespace
}  // namespace lucerna
