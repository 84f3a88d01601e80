// A digest is SHA-256 of the bytes, however they arrive.
#include "render/base/digest.h"

#include "gtest/gtest.h"

namespace lucerna {
namespace {

// FIPS 180-4, appendix B.1 and the empty message.
constexpr char kAbc[] = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
constexpr char kEmpty[] = "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855";

TEST(DigestTest, IsSha256) {
  EXPECT_EQ(Sha256("abc").Hex(), kAbc);
  EXPECT_EQ(Sha256("").Hex(), kEmpty);
}

TEST(DigestTest, DoesNotDependOnThePieces) {
  Sha256Stream stream;
  stream.Add("a");
  stream.Add("");
  stream.Add("bc");
  EXPECT_EQ(stream.Finish(), Sha256("abc"));
}

TEST(DigestTest, ComesBackFromBytes) {
  const Digest digest = Sha256("abc");
  EXPECT_EQ(Digest::FromBytes(digest.Bytes()).value(), digest);
}

TEST(DigestTest, RefusesWhatIsNotADigest) {
  EXPECT_FALSE(Digest::FromBytes("short").ok());
}

}  // namespace
}  // namespace lucerna
