// A digest is SHA-256 of the bytes, however they arrive, and survives being written down.
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

TEST(DigestTest, ComesBackFromHexAndBytes) {
  const Digest digest = Sha256("abc");
  EXPECT_EQ(Digest::FromHex(digest.Hex()).value(), digest);
  EXPECT_EQ(
      Digest::FromHex("BA7816BF8F01CFEA414140DE5DAE2223B00361A396177A9CB410FF61F20015AD").value(),
      digest);
  EXPECT_EQ(Digest::FromBytes(digest.Bytes()).value(), digest);
}

TEST(DigestTest, RefusesWhatIsNotADigest) {
  const std::string hex = kAbc;
  EXPECT_FALSE(Digest::FromHex(hex.substr(1)).ok());
  EXPECT_FALSE(Digest::FromHex(hex + hex).ok());
  std::string wrong = hex;
  wrong[0] = 'g';
  EXPECT_FALSE(Digest::FromHex(wrong).ok());
  EXPECT_FALSE(Digest::FromBytes("short").ok());
}

}  // namespace
}  // namespace lucerna
