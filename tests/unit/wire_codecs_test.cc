// What crosses the wire must come back to the last bit, be as small as promised, and be refused
// when it is anything but what an encoder of ours wrote.
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <string>

#include "gtest/gtest.h"

#include "render/math/octahedral.h"
#include "render/wire/accumulation_codec.h"
#include "render/wire/block_codec.h"
#include "render/wire/bytes.h"
#include "render/wire/chunks.h"

namespace lucerna {
namespace {

constexpr std::size_t kPixels = 256 * 256;

// A floor seen at a slant, with a normal that waves, as a camera of 256 × 256 pixels sees it.
HitpointBlock FloorBlock() {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> jitter(0, 1);
  HitpointBlock block;
  for (int y = 0; y < 256; ++y) {
    for (int x = 0; x < 256; ++x) {
      const float px = (static_cast<float>(x) + jitter(random)) / 256 - 0.5F;
      const float pz = 2 / (1.2F - (static_cast<float>(y) + jitter(random)) / 256);
      block.positions.push_back({px * pz, 0.01F * std::sin(20 * px), pz});
      block.normals_oct.push_back(EncodeOctahedral(Normalize({-0.2F * std::cos(20 * px), 1, 0})));
    }
  }
  return block;
}

// Every hitpoint catches about five photons of up to 2^18 quanta, each of its own colour.
Accumulation RealisticAccumulation(std::size_t hitpoints, double touched_share) {
  std::mt19937_64 random(2);
  std::poisson_distribution<std::uint32_t> photons(5);
  std::uniform_real_distribution<double> weight(0, 1 << 18);
  std::uniform_real_distribution<double> tint(0.7, 1.0);
  std::bernoulli_distribution is_touched(touched_share);
  Accumulation accumulation;
  accumulation.tally = {.photons = 1000,
                        .rays = 3000,
                        .deposits = 2000,
                        .pairs = 5000,
                        .dropped = 2,
                        .excess = 2,
                        .energy = {.emitted = 4'096'000,
                                   .roulette_gain = 5,
                                   .roulette_loss = 1'000'000,
                                   .absorbed = -6,
                                   .escaped = 3'096'000,
                                   .smoothing = -1,
                                   .cut_off = 7,
                                   .dropped = 5},
                        .lights = {{.sent = 700, .in_view = {3, 650}}, {.sent = 300}}};
  accumulation.dropped_photons = {41, std::uint64_t{1} << 40};
  for (std::size_t i = 0; i < hitpoints; ++i) {
    if (!is_touched(random)) continue;
    const std::uint32_t count = std::max(1U, photons(random));
    std::array<std::int64_t, 3> flux = {0, 0, 0};
    for (std::uint32_t p = 0; p < count; ++p) {
      const double w = weight(random);
      flux[0] += std::llround(w * tint(random));
      flux[1] += std::llround(0.8 * w * tint(random));
      flux[2] += std::llround(0.5 * w * tint(random));
    }
    accumulation.hitpoints.push_back(static_cast<std::uint32_t>(i));
    accumulation.counts.push_back(count);
    for (std::size_t c = 0; c < 3; ++c)
      accumulation.flux[c].push_back(flux[c]);
  }
  return accumulation;
}

TEST(VarintTest, CarriesEveryWidthAndRefusesMoreThan64Bits) {
  for (int bit = 0; bit < 64; ++bit) {
    for (const std::uint64_t value : {std::uint64_t{1} << bit, (std::uint64_t{1} << bit) - 1}) {
      ByteWriter writer;
      writer.Varint(value);
      const std::string bytes = writer.Take();
      ByteReader reader(bytes);
      EXPECT_EQ(reader.Varint(), value);
      EXPECT_TRUE(reader.finished());
    }
  }
  const std::string too_wide = std::string(9, '\xFF') + '\x02';
  ByteReader reader(too_wide);
  EXPECT_EQ(reader.Varint(), 0U);
  EXPECT_FALSE(reader.ok());
}

TEST(BlockCodecTest, BringsABlockAndItsRadiiBackInUnder24BytesAHitpoint) {
  const HitpointBlock block = FloorBlock();
  RadiusColumn radii;
  for (const Vec3& p : block.positions)
    radii.push_back(0.01F * p.z);
  const std::string bytes = EncodeHitpointBlock(block);
  const std::string radius_bytes = EncodeRadii(radii);
  const double size =
      static_cast<double>(bytes.size() + radius_bytes.size()) / static_cast<double>(block.size());
  RecordProperty("bytes_per_hitpoint", std::to_string(size));
  EXPECT_LE(size, 24);

  const auto decoded = DecodeHitpointBlock(bytes, block.size());
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(*decoded, block);
  const auto decoded_radii = DecodeRadii(radius_bytes, block.size());
  ASSERT_TRUE(decoded_radii.ok()) << decoded_radii.status();
  EXPECT_EQ(*decoded_radii, radii);
}

TEST(BlockCodecTest, BringsGlossyRowsBack) {
  HitpointBlock block = FloorBlock();
  const std::uint32_t up = EncodeOctahedral({0, 1, 0});
  for (std::uint32_t i = 3; i < 60'000; i += 7)
    block.glossy.push_back({i, i % 5, up, up});
  const auto decoded = DecodeHitpointBlock(EncodeHitpointBlock(block), block.size());
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(*decoded, block);
}

// A block of three rows, of which the last is a caustic one on a metal with a texture.
HitpointBlock CausticBlock() {
  HitpointBlock block;
  const std::uint32_t up = EncodeOctahedral({0, 1, 0});
  block.positions = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  block.normals_oct = {up, up, up};
  block.glossy = {{1, 0, up, up}, {2, 1, up, up}};
  block.places = {{}, {{3, 2.5F, 0.125F}, {0.1F, 0.5F, 0, 2}, EncodeOctahedral({0, 1, 0})}};
  block.caustic_rows = 1;
  return block;
}

TEST(BlockCodecTest, BringsCausticRowsAndTexturesBack) {
  const HitpointBlock block = CausticBlock();
  const auto decoded = DecodeHitpointBlock(EncodeHitpointBlock(block), block.size());
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(*decoded, block);
}

TEST(BlockCodecTest, RefusesCausticRowsThatAreNotGlossyAndColumnsOfAnotherLength) {
  const auto is_refused = [](const HitpointBlock& block) {
    return DecodeHitpointBlock(EncodeHitpointBlock(block), 3).status().code() ==
           absl::StatusCode::kInvalidArgument;
  };
  HitpointBlock block = CausticBlock();
  block.caustic_rows = 3;
  EXPECT_TRUE(is_refused(block));
  // Row 1 would have to be glossy, and row 0 is in its place.
  block = CausticBlock();
  block.caustic_rows = 2;
  block.glossy[0].hitpoint = 0;
  EXPECT_TRUE(is_refused(block));
  block = CausticBlock();
  block.places.pop_back();
  EXPECT_TRUE(is_refused(block));
  block = CausticBlock();
  block.places[1].color.g = -1;
  EXPECT_TRUE(is_refused(block));
  block.places[1].color.g = HUGE_VALF;
  EXPECT_TRUE(is_refused(block));
}

TEST(BlockCodecTest, BringsAnEmptyBlockBack) {
  const auto decoded = DecodeHitpointBlock(EncodeHitpointBlock({}), 10);
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(decoded->size(), 0U);
  EXPECT_TRUE(DecodeRadii(EncodeRadii({}), 0).ok());
}

TEST(BlockCodecTest, RefusesWhatBreaksABlocksPromises) {
  const std::uint32_t up = EncodeOctahedral({0, 1, 0});
  HitpointBlock good;
  good.positions = {{1, 2, 3}, {4, 5, 6}};
  good.normals_oct = {up, up};
  good.glossy = {{0, 0, up, up}, {1, 0, up, up}};
  ASSERT_TRUE(DecodeHitpointBlock(EncodeHitpointBlock(good), 2).ok());
  EXPECT_FALSE(DecodeHitpointBlock(EncodeHitpointBlock(good), 1).ok()) << "too many rows";

  HitpointBlock bad = good;
  bad.positions[1].y = std::numeric_limits<float>::quiet_NaN();
  EXPECT_FALSE(DecodeHitpointBlock(EncodeHitpointBlock(bad), 2).ok());
  bad = good;
  bad.positions[0].x = HUGE_VALF;
  EXPECT_FALSE(DecodeHitpointBlock(EncodeHitpointBlock(bad), 2).ok());
  bad = good;
  bad.normals_oct[0] = 0xFFFFFFFF;
  EXPECT_FALSE(DecodeHitpointBlock(EncodeHitpointBlock(bad), 2).ok());
  bad = good;
  std::swap(bad.glossy[0], bad.glossy[1]);
  EXPECT_FALSE(DecodeHitpointBlock(EncodeHitpointBlock(bad), 2).ok());
  bad = good;
  bad.glossy[1].hitpoint = 2;
  EXPECT_FALSE(DecodeHitpointBlock(EncodeHitpointBlock(bad), 2).ok());
  EXPECT_FALSE(DecodeHitpointBlock(EncodeHitpointBlock(good) + "x", 2).ok());

  for (const float radius : {0.0F, -1.0F, HUGE_VALF, std::numeric_limits<float>::quiet_NaN()}) {
    EXPECT_FALSE(DecodeRadii(EncodeRadii({1, radius}), 2).ok()) << radius;
  }
  EXPECT_FALSE(DecodeRadii(EncodeRadii({1, 1}), 3).ok());
}

TEST(BlockCodecTest, BringsNumbersOfEyePathsBack) {
  const EyePathCounts counts = {1, 9, 2, 3, 5, 1};
  EXPECT_EQ(DecodeEyePathCounts(EncodeEyePathCounts(counts), 6).value(), counts);
  EXPECT_FALSE(DecodeEyePathCounts(EncodeEyePathCounts(counts), 5).ok());
  EXPECT_FALSE(DecodeEyePathCounts(EncodeEyePathCounts(counts) + "x", 6).ok());
  EXPECT_FALSE(DecodeEyePathCounts(EncodeRadii(RadiusColumn(6, 1.0F)), 6).ok());
  for (const std::uint8_t count : {std::uint8_t{0}, std::uint8_t{kMostEyePaths + 1}})
    EXPECT_FALSE(DecodeEyePathCounts(EncodeEyePathCounts({1, count}), 2).ok()) << count;
}

TEST(AccumulationCodecTest, BringsARealisticOneBackInUnder9BytesATouchedHitpoint) {
  const Accumulation accumulation = RealisticAccumulation(kPixels, 0.96);
  const std::string bytes = EncodeAccumulation(accumulation, kPixels);
  const double size = static_cast<double>(bytes.size()) / static_cast<double>(accumulation.size());
  RecordProperty("bytes_per_touched_hitpoint", std::to_string(size));
  EXPECT_LE(size, 9);
  const auto decoded = DecodeAccumulation(bytes, kPixels);
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(*decoded, accumulation);
}

TEST(AccumulationCodecTest, RefusesPhotonsByLightThatCannotBe) {
  const auto decodes = [](std::vector<LightTally> lights) {
    Accumulation accumulation;
    accumulation.tally.photons = 100;
    accumulation.tally.lights = std::move(lights);
    return DecodeAccumulation(EncodeAccumulation(accumulation, 10), 10).ok();
  };
  EXPECT_TRUE(decodes({{.sent = 40, .in_view = {40, 0}}, {.sent = 60}}));
  EXPECT_TRUE(decodes(std::vector<LightTally>(kMaxLightTallies, {.sent = 1})));
  EXPECT_FALSE(decodes(std::vector<LightTally>(kMaxLightTallies + 1, {.sent = 1})));
  EXPECT_FALSE(decodes({{.sent = 101}}));
  EXPECT_FALSE(decodes({{.sent = 40, .in_view = {41, 0}}}));
}

TEST(AccumulationCodecTest, RefusesCountersThatNoWorkerReaches) {
  const auto decodes = [](std::uint64_t BatchTally::*counter, std::uint64_t value) {
    Accumulation accumulation;
    accumulation.tally.photons = 100;
    accumulation.tally.*counter = value;
    return DecodeAccumulation(EncodeAccumulation(accumulation, 10), 10).ok();
  };
  constexpr std::uint64_t kMost = std::uint64_t{1} << 57;
  for (const auto counter :
       {&BatchTally::rays, &BatchTally::deposits, &BatchTally::pairs, &BatchTally::excess}) {
    EXPECT_TRUE(decodes(counter, kMost));
    EXPECT_FALSE(decodes(counter, kMost + 1));
    EXPECT_FALSE(decodes(counter, std::numeric_limits<std::uint64_t>::max()));
  }
}

TEST(AccumulationCodecTest, BringsSparseAndEmptyOnesBack) {
  for (const double share : {0.0, 0.001, 0.05, 1.0}) {
    const Accumulation accumulation = RealisticAccumulation(kPixels, share);
    const auto decoded = DecodeAccumulation(EncodeAccumulation(accumulation, kPixels), kPixels);
    ASSERT_TRUE(decoded.ok()) << decoded.status();
    EXPECT_EQ(*decoded, accumulation) << share;
  }
}

TEST(AccumulationCodecTest, BringsEveryInt64Back) {
  constexpr std::int64_t kLow = std::numeric_limits<std::int64_t>::min();
  constexpr std::int64_t kHigh = std::numeric_limits<std::int64_t>::max();
  const std::vector<std::int64_t> values = {kLow, kLow + 1, -1, 0, 1, kHigh - 1, kHigh};
  Accumulation accumulation;
  std::uint32_t row = 0;
  for (const std::int64_t r : values) {
    for (const std::int64_t g : values) {
      for (const std::int64_t b : values) {
        accumulation.hitpoints.push_back(row++);
        accumulation.counts.push_back(row % 3 == 0 ? 0xFFFFFFFF : row);
        accumulation.flux[0].push_back(r);
        accumulation.flux[1].push_back(g);
        accumulation.flux[2].push_back(b);
      }
    }
  }
  const auto decoded = DecodeAccumulation(EncodeAccumulation(accumulation, row), row);
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(*decoded, accumulation);
}

TEST(AccumulationCodecTest, RefusesAnotherBlocksAndLeftOverBytes) {
  const std::string bytes = EncodeAccumulation(RealisticAccumulation(100, 0.5), 100);
  ASSERT_TRUE(DecodeAccumulation(bytes, 100).ok());
  EXPECT_FALSE(DecodeAccumulation(bytes, 99).ok());
  EXPECT_FALSE(DecodeAccumulation(bytes, 101).ok());
  EXPECT_FALSE(DecodeAccumulation(bytes + '\0', 100).ok());
  EXPECT_FALSE(DecodeAccumulation("", 100).ok());
}

TEST(ChunkCollectorTest, HoldsBytesToWhatWasAnnounced) {
  const std::string bytes(700'000, 'x');
  std::string_view rest = bytes;
  ChunkCollector good(Sha256(bytes), bytes.size());
  int chunks = 0;
  for (auto chunk = NextChunk(rest); !chunk.empty(); chunk = NextChunk(rest), ++chunks) {
    ASSERT_TRUE(good.Add(chunk).ok());
  }
  EXPECT_EQ(chunks, 3);
  EXPECT_TRUE(absl::IsInvalidArgument(good.Add("y"))) << "one byte more than announced";
  const auto collected = good.Finish();
  ASSERT_TRUE(collected.ok());
  EXPECT_EQ(*collected, bytes);

  ChunkCollector wrong(Sha256("other"), 3);
  ASSERT_TRUE(wrong.Add("abc").ok());
  EXPECT_TRUE(absl::IsDataLoss(wrong.Finish().status()));
  ChunkCollector truncated(Sha256("abc"), 3);
  ASSERT_TRUE(truncated.Add("ab").ok());
  EXPECT_TRUE(absl::IsDataLoss(truncated.Finish().status()));
  ChunkCollector too_long(Sha256(bytes), 2 * kMaxChunkBytes);
  EXPECT_FALSE(too_long.Add(std::string(kMaxChunkBytes + 1, 'x')).ok());
}

}  // namespace
}  // namespace lucerna
