// Bytes from the wire may be anything. Decoding them must end with a value that keeps its
// promises or with an error, never with a crash or with memory beyond what the block's size
// allows: tried by truncation at every byte, by flipping every bit, and by lying about counts.
#include <cmath>
#include <cstdint>
#include <string>

#include "gtest/gtest.h"

#include "render/math/octahedral.h"
#include "render/wire/accumulation_codec.h"
#include "render/wire/block_codec.h"
#include "render/wire/bytes.h"

namespace lucerna {
namespace {

constexpr std::size_t kHitpoints = 40;

Accumulation SomeAccumulation(std::uint32_t step) {
  Accumulation accumulation;
  for (std::uint32_t i = 0; i < kHitpoints; i += step) {
    accumulation.hitpoints.push_back(i);
    accumulation.counts.push_back(1 + i % 4);
    accumulation.flux[0].push_back(1000 * i);
    accumulation.flux[1].push_back(70'000 * (1 + i % 4));
    accumulation.flux[2].push_back(12'345);
  }
  accumulation.tally.photons = 100;
  return accumulation;
}

HitpointBlock SomeBlock() {
  HitpointBlock block;
  const std::uint32_t up = EncodeOctahedral({0, 0, 1});
  for (std::uint32_t i = 0; i < kHitpoints; ++i) {
    block.positions.push_back({static_cast<float>(i), 1, 2});
    block.normals_oct.push_back(up + i);
    if (i % 5 == 0) block.glossy.push_back({i, 1, up, up});
  }
  return block;
}

void CheckAccumulation(const std::string& bytes) {
  const auto decoded = DecodeAccumulation(bytes, kHitpoints);
  if (!decoded.ok()) return;
  // What decodes must be fit to merge, as far as the format alone can tell.
  PassSums sums(kHitpoints);
  EXPECT_TRUE(sums.Add(*decoded).ok());
}

void CheckBlock(const std::string& bytes) {
  const auto decoded = DecodeHitpointBlock(bytes, kHitpoints);
  if (!decoded.ok()) return;
  EXPECT_LE(decoded->size(), kHitpoints);
  EXPECT_EQ(decoded->normals_oct.size(), decoded->size());
  for (const Vec3& position : decoded->positions)
    EXPECT_TRUE(IsFinite(position));
  for (const GlossyHitpoint& glossy : decoded->glossy)
    EXPECT_LT(glossy.hitpoint, decoded->size());
}

template <typename Check>
void TruncateAndFlip(const std::string& bytes, const Check& check) {
  for (std::size_t size = 0; size < bytes.size(); ++size)
    check(bytes.substr(0, size));
  for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
    std::string flipped = bytes;
    flipped[bit / 8] = static_cast<char>(flipped[bit / 8] ^ (1 << (bit % 8)));
    check(flipped);
  }
}

TEST(WireBytesTest, DamagedAccumulationsAreRefusedOrHarmless) {
  TruncateAndFlip(EncodeAccumulation(SomeAccumulation(1), kHitpoints), CheckAccumulation);
  TruncateAndFlip(EncodeAccumulation(SomeAccumulation(17), kHitpoints), CheckAccumulation);
}

TEST(WireBytesTest, NoTruncatedAccumulationDecodes) {
  const std::string bytes = EncodeAccumulation(SomeAccumulation(2), kHitpoints);
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_FALSE(DecodeAccumulation(bytes.substr(0, size), kHitpoints).ok()) << size;
  }
}

TEST(WireBytesTest, DamagedBlocksAreRefusedOrHarmless) {
  TruncateAndFlip(EncodeHitpointBlock(SomeBlock()), CheckBlock);
}

TEST(WireBytesTest, DamagedRadiiAreRefusedOrFiniteAndPositive) {
  TruncateAndFlip(EncodeRadii(RadiusColumn(kHitpoints, 0.5F)), [](const std::string& bytes) {
    const auto decoded = DecodeRadii(bytes, kHitpoints);
    if (!decoded.ok()) return;
    for (const float radius : *decoded)
      EXPECT_TRUE(radius > 0 && std::isfinite(radius));
  });
}

TEST(WireBytesTest, HugeCountsAreRefusedBeforeAnythingIsAllocated) {
  for (const std::uint64_t count : {std::uint64_t{1} << 40, ~std::uint64_t{0}}) {
    ByteWriter block;
    block.Bytes("LHB1");
    block.Varint(count);
    block.Varint(0);
    EXPECT_FALSE(DecodeHitpointBlock(block.Take(), kHitpoints).ok());
    ByteWriter accumulation;
    accumulation.Bytes("LAC1");
    accumulation.Varint(kHitpoints);
    accumulation.Varint(count);
    EXPECT_FALSE(DecodeAccumulation(accumulation.Take(), kHitpoints).ok());
  }
}

TEST(WireBytesTest, APlaneThatUnpacksToMoreThanItsRowsIsRefused) {
  // 64 MiB of zeros in a few kilobytes, where 40 bytes are expected.
  ByteWriter writer;
  writer.Compressed(std::string(std::size_t{64} << 20, '\0'));
  const std::string bytes = writer.Take();
  ASSERT_LT(bytes.size(), 100'000U);
  ByteReader reader(bytes);
  EXPECT_TRUE(reader.Compressed(kHitpoints).empty());
  EXPECT_FALSE(reader.ok());
}

}  // namespace
}  // namespace lucerna
