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
#include "render/wire/slice_codec.h"
#include "tests/fuzz/mutation.h"

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

constexpr SliceShape kSlice = {
    .passes = {16, 18}, .pixels = 5, .evidence = 2, .photons_per_pass = 100};

SliceSums SomeSlice(const SliceShape& shape) {
  SliceSums slice = EmptySlice(shape.passes, shape.pixels, shape.evidence);
  for (std::size_t column = 0; column < slice.columns.size(); ++column) {
    for (std::size_t pixel = 0; pixel < slice.columns[column].size(); ++pixel) {
      slice.columns[column].Set(
          pixel,
          Rounded(std::exp(8 * static_cast<double>(pixel)) * (pixel % 3 == 0 ? -1 : 1) / 1000,
                  SignificantBits(shape.passes.size(), column, shape.evidence)));
    }
  }
  slice.tally.photons = shape.photons_per_pass * shape.passes.size();
  slice.tally.dropped = 2;
  slice.dropped_photons = {{shape.passes.first, 5}, {shape.passes.first, 99}};
  return slice;
}

// What decodes must keep the promises of SliceSums and be fit to merge.
void CheckSliceOf(const std::string& bytes, const SliceShape& shape) {
  auto decoded = DecodeSlice(bytes, shape);
  if (!decoded.ok()) return;
  ASSERT_EQ(decoded->passes, shape.passes);
  ASSERT_EQ(decoded->columns.size(), ColumnsOf(shape.passes, shape.evidence));
  bool is_kept = true;
  for (std::size_t column = 0; column < decoded->columns.size(); ++column) {
    const unsigned int bits = SignificantBits(shape.passes.size(), column, shape.evidence);
    for (std::size_t pixel = 0; pixel < shape.pixels; ++pixel) {
      const float value = decoded->At(column, pixel);
      is_kept &= std::isfinite(value) && Rounded(static_cast<double>(value), bits) == value;
    }
  }
  ASSERT_TRUE(is_kept);
  ASSERT_EQ(decoded->tally.photons, shape.photons_per_pass * shape.passes.size());
  ASSERT_TRUE(decoded->tally.energy.Balance() && decoded->tally.LightsFit());
  for (const PhotonKey& photon : decoded->dropped_photons) {
    ASSERT_TRUE(photon.pass >= shape.passes.first && photon.pass < shape.passes.last &&
                photon.index < shape.photons_per_pass);
  }
  const auto again = DecodeSlice(EncodeSlice(*decoded), shape);
  ASSERT_TRUE(again.ok() && *again == *decoded);
  SliceShape of_sibling = shape;
  of_sibling.passes = SiblingOf(shape.passes);
  const Status merged = MergeSibling(*decoded, SomeSlice(of_sibling));
  EXPECT_TRUE(merged.ok() || absl::IsOutOfRange(merged)) << merged;
  for (std::size_t column = 0; column < decoded->columns.size(); ++column) {
    for (std::size_t pixel = 0; pixel < shape.pixels; ++pixel)
      is_kept &= std::isfinite(decoded->At(column, pixel));
  }
  EXPECT_TRUE(is_kept);
}
void CheckSlice(const std::string& bytes) {
  CheckSliceOf(bytes, kSlice);
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

TEST(WireBytesTest, DamagedNumbersOfEyePathsAreRefusedOrInRange) {
  TruncateAndFlip(EncodeEyePathCounts(EyePathCounts(kHitpoints, 3)), [](const std::string& bytes) {
    const auto decoded = DecodeEyePathCounts(bytes, kHitpoints);
    if (!decoded.ok()) return;
    for (const std::uint8_t count : *decoded)
      EXPECT_TRUE(count >= 1 && count <= kMostEyePaths);
  });
}

TEST(WireBytesTest, DamagedSlicesAreRefusedOrHarmless) {
  TruncateAndFlip(EncodeSlice(SomeSlice(kSlice)), CheckSlice);
}

TEST(WireBytesTest, NoTruncatedSliceDecodes) {
  const std::string bytes = EncodeSlice(SomeSlice(kSlice));
  ASSERT_TRUE(DecodeSlice(bytes, kSlice).ok());
  for (std::size_t size = 0; size < bytes.size(); ++size)
    EXPECT_FALSE(DecodeSlice(bytes.substr(0, size), kSlice).ok()) << size;
}

TEST(WireBytesTest, MutatedSlicesAreRefusedOrHarmless) {
  SliceShape with_features = kSlice;
  with_features.passes = {7, 8};
  with_features.evidence = 0;
  for (const SliceShape& shape : {kSlice, with_features}) {
    const std::string bytes = EncodeSlice(SomeSlice(shape));
    for (std::uint64_t key = 0; key < 4000; ++key)
      CheckSliceOf(Mutated(bytes, key), shape);
  }
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
    for (const bool is_pixels : {true, false}) {
      ByteWriter slice;
      slice.Bytes("LSL6");
      slice.Varint(kSlice.passes.first);
      slice.Varint(kSlice.passes.size());
      slice.Varint(is_pixels ? count : kSlice.pixels);
      slice.Varint(is_pixels ? ColumnsOf(kSlice.passes, kSlice.evidence) : count);
      EXPECT_FALSE(DecodeSlice(slice.Take(), kSlice).ok());
    }
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
