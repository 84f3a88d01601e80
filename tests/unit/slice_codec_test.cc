// A slice must come back to the last bit, cost few bytes, and be refused when it is anything but
// what an encoder of ours wrote for the slice that was asked for.
#include "render/wire/slice_codec.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "gtest/gtest.h"

#include "render/estimate/evidence.h"
#include "render/math/rng.h"
#include "render/wire/bytes.h"

namespace lucerna {
namespace {

constexpr std::uint64_t kPhotons = 1000;

SliceShape Shape(const PassRange& passes, std::size_t pixels, std::size_t evidence) {
  return {.passes = passes, .pixels = pixels, .evidence = evidence, .photons_per_pass = kPhotons};
}

// Numbers of both signs and of many magnitudes, zeros among them, in every column.
SliceSums RandomSlice(const SliceShape& shape) {
  SliceSums slice = EmptySlice(shape.passes, shape.pixels, shape.evidence);
  KeyedRng rng(CombineKeys(11, shape.passes.first));
  for (std::size_t column = 0; column < slice.columns.size(); ++column) {
    for (std::size_t pixel = 0; pixel < slice.columns[column].size(); ++pixel) {
      if (rng.Bits() % 4 == 0) continue;
      const double sign = rng.Bits() % 2 == 0 ? 1 : -1;
      slice.columns[column].Set(
          pixel, Rounded(sign * std::exp(60 * static_cast<double>(rng.Uniform()) - 30),
                         SignificantBits(shape.passes.size(), column, shape.evidence)));
    }
  }
  slice.eye_rays = 12'345;
  slice.tally = {.photons = kPhotons * shape.passes.size(),
                 .rays = std::uint64_t{1} << 57,
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
  slice.dropped_photons = {{shape.passes.first, 41}, {shape.passes.last - 1, kPhotons - 1}};
  return slice;
}

TEST(SliceCodecTest, BringsSlicesOfAllShapesBack) {
  for (const PassRange& passes : {PassRange{0, 1}, PassRange{15, 16}, PassRange{16, 18},
                                  PassRange{40, 44}, PassRange{512, 576}}) {
    for (const std::size_t evidence :
         {std::size_t{0}, std::size_t{kCurvatureColumns}, std::size_t{kSectors}}) {
      for (const std::size_t pixels : {std::size_t{1}, std::size_t{777}}) {
        const SliceShape shape = Shape(passes, pixels, evidence);
        const SliceSums slice = RandomSlice(shape);
        const std::string bytes = EncodeSlice(slice);
        const auto decoded = DecodeSlice(bytes, shape);
        ASSERT_TRUE(decoded.ok()) << decoded.status() << ", from pass " << passes.first;
        EXPECT_EQ(*decoded, slice);
        EXPECT_EQ(EncodeSlice(*decoded), bytes) << "the same slice gives the same bytes";
      }
    }
  }
}

// The bytes of a slice make the same sum as the slice itself, as either half, column by column.
TEST(EncodedSliceTest, AddsToItsSiblingWhatTheSliceWould) {
  for (const PassRange& passes :
       {PassRange{14, 15}, PassRange{15, 16}, PassRange{64, 65}, PassRange{64, 68}}) {
    for (const std::size_t evidence : {std::size_t{0}, std::size_t{kCurvatureColumns}}) {
      SCOPED_TRACE(passes.first);
      const SliceShape shape = Shape(passes, 777, evidence);
      const SliceSums slice = RandomSlice(shape);
      const EncodedSlice encoded(EncodeSlice(slice), shape);
      EXPECT_EQ(encoded.Unpacked(), slice);
      const SliceSums sibling = RandomSlice(Shape(SiblingOf(passes), 777, evidence));
      SliceSums expected = sibling;
      ASSERT_TRUE(MergeSibling(expected, slice).ok());
      SliceSums sum = sibling;
      ASSERT_TRUE(encoded.AddTo(sum).ok());
      EXPECT_EQ(sum, expected);
    }
  }
}

TEST(EncodedSliceTest, IsAddedToNothingButItsSibling) {
  const SliceShape shape = Shape({14, 15}, 5, 2);
  const EncodedSlice encoded(EncodeSlice(RandomSlice(shape)), shape);
  for (const SliceShape& other :
       {Shape({12, 13}, 5, 2), Shape({15, 16}, 6, 2), Shape({15, 16}, 5, 0)}) {
    SliceSums sum = RandomSlice(other);
    EXPECT_TRUE(absl::IsInvalidArgument(encoded.AddTo(sum)));
  }
}

// Each column keeps its largest, its smallest and its negative zero.
TEST(SliceCodecTest, BringsTheEndsOfEveryColumnBack) {
  const SliceShape shape = Shape({3, 4}, 6, kSectors);
  SliceSums slice = RandomSlice(shape);
  for (std::size_t column = 0; column < slice.columns.size(); ++column) {
    if (FollowsFromRadiance(shape.passes, column)) continue;
    const unsigned int bits = SignificantBits(shape.passes.size(), column, shape.evidence);
    slice.columns[column].Write(
        0, std::array{Rounded(1e300, bits), Rounded(-1e300, bits),
                      Rounded(std::numeric_limits<double>::denorm_min(), bits), -0.0F,
                      std::bit_cast<float>(std::uint32_t{1} << DroppedBits(bits)), 1.0F});
  }
  const auto decoded = DecodeSlice(EncodeSlice(slice), shape);
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  for (std::size_t column = 0; column < slice.columns.size(); ++column) {
    for (std::size_t row = 0; row < shape.pixels; ++row) {
      EXPECT_EQ(std::bit_cast<std::uint32_t>(decoded->At(column, row)),
                std::bit_cast<std::uint32_t>(slice.At(column, row)))
          << column << " " << row;
    }
  }
}

// Three bytes for 16 significant bits with exponent and sign, two for 8, and a bit more for the
// difference of red and blue from green: at most 42 bytes a pixel of a slice without evidence or
// features, whatever the numbers.
TEST(SliceCodecTest, TakesAtMostFortyTwoBytesAPixel) {
  const SliceShape shape = Shape({64, 72}, 10'000, 0);
  const std::string bytes = EncodeSlice(RandomSlice(shape));
  EXPECT_LE(static_cast<double>(bytes.size()), 42.0 * static_cast<double>(shape.pixels) + 1000);
  // Of a slice in which nothing was found, next to nothing.
  SliceSums dark = EmptySlice(shape.passes, shape.pixels, shape.evidence);
  dark.tally.photons = kPhotons * shape.passes.size();
  EXPECT_LE(EncodeSlice(dark).size(), 1000U);
}

// A pass alone differs from no other: what two halves, deviations and the largest pass are follows.
TEST(SliceCodecTest, SendsNothingThatFollowsFromTheRadianceOfOnePass) {
  const std::size_t pixels = 5000;
  const auto size_of = [&](const PassRange& passes) {
    const SliceShape shape = Shape(passes, pixels, 0);
    SliceSums slice = RandomSlice(shape);
    for (const std::size_t column : {std::size_t{kEvenBias}, std::size_t{kOddBias},
                                     std::size_t{kPhotonCount}, std::size_t{kBlur}})
      slice.columns[column].Write(0, std::vector<float>(pixels));
    return static_cast<double>(EncodeSlice(slice).size());
  };
  const double radiance = 6 * 3 * static_cast<double>(pixels);
  EXPECT_LE(size_of({64, 65}), radiance + 1000);
  EXPECT_GE(size_of({64, 66}), radiance + 1000);
}

// Noise that all channels have in common is sent once: light of one color on surfaces of one color
// each takes 3 bytes a pixel of green and next to nothing of red and blue, to the last bit.
TEST(SliceCodecTest, ChannelsInOneRatioCostLittleMoreThanOne) {
  const std::size_t pixels = 20'000;
  const SliceShape shape = Shape({64, 65}, pixels, 0);
  SliceSums slice = EmptySlice(shape.passes, pixels, 0);
  slice.tally.photons = kPhotons;
  KeyedRng rng(3);
  for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
    const double light = std::exp(static_cast<double>(rng.Uniform()) * 4);
    const bool is_left = pixel % 200 < 100;
    const auto set = [&](std::size_t c, double value) {
      slice.columns[kDirectRadiance + c].Set(pixel, Rounded(value, 16));
    };
    set(0, (is_left ? 0.7 : 0.2) * light);
    set(1, (is_left ? 0.3 : 0.6) * light);
    set(2, is_left ? 0 : 3 * light);
  }
  const std::string bytes = EncodeSlice(slice);
  // Random bits are 16 of green; red and blue differ by a rounding or two, and wholly where the
  // surface changes, for 8 of 100 pixels.
  EXPECT_LE(static_cast<double>(bytes.size()), 4.0 * static_cast<double>(pixels));
  const auto decoded = DecodeSlice(bytes, shape);
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(*decoded, slice);
}

// Whoever decodes may round denormal numbers to zero, or not: what is predicted does not depend on
// it.
TEST(SliceCodecTest, FromAndToThreadsThatFlushDenormals) {
  const SliceShape shape = Shape({16, 18}, 4096, 0);
  SliceSums slice = RandomSlice(shape);
  for (std::size_t column = 0; column < 9; ++column) {
    for (std::size_t pixel = 0; pixel < shape.pixels; ++pixel) {
      // From ordinary numbers to denormal ones, so that ratios and products end up there too.
      const auto power = static_cast<int>((pixel * 7 + column * 41) % 160);
      slice.columns[column].Set(pixel, Rounded(std::ldexp(1.25, 10 - power), 8));
    }
  }
  ThreadTeam flushing(1);
  const std::string bytes = EncodeSlice(slice);
  std::string by_team;
  flushing.For(1, 1, [&](std::size_t, std::size_t) { by_team = EncodeSlice(slice); });
  EXPECT_EQ(bytes, by_team);
  StatusOr<SliceSums> decoded = absl::UnknownError("not decoded");
  flushing.For(1, 1, [&](std::size_t, std::size_t) { decoded = DecodeSlice(bytes, shape); });
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  for (std::size_t column = 0; column < slice.columns.size(); ++column) {
    for (std::size_t pixel = 0; pixel < shape.pixels; ++pixel) {
      ASSERT_EQ(std::bit_cast<std::uint32_t>(decoded->At(column, pixel)),
                std::bit_cast<std::uint32_t>(slice.At(column, pixel)))
          << column << " " << pixel;
    }
  }
}

TEST(SliceCodecTest, RefusesASliceThatWasNotAskedFor) {
  const SliceShape shape = Shape({16, 18}, 20, kSectors);
  const std::string bytes = EncodeSlice(RandomSlice(shape));
  ASSERT_TRUE(DecodeSlice(bytes, shape).ok());
  const auto refuses = [&](SliceShape other) {
    return absl::IsInvalidArgument(DecodeSlice(bytes, other).status());
  };
  SliceShape other = shape;
  other.passes = {18, 20};
  EXPECT_TRUE(refuses(other));
  other.passes = {16, 17};
  EXPECT_TRUE(refuses(other));
  other = shape;
  other.pixels = 19;
  EXPECT_TRUE(refuses(other));
  other.pixels = 21;
  EXPECT_TRUE(refuses(other));
  other = shape;
  other.evidence = kCurvatureColumns;
  EXPECT_TRUE(refuses(other));
  other = shape;
  other.photons_per_pass = kPhotons / 2;
  EXPECT_TRUE(refuses(other));
  EXPECT_TRUE(absl::IsInvalidArgument(DecodeSlice(bytes + '\0', shape).status()));
  EXPECT_TRUE(absl::IsInvalidArgument(DecodeSlice("LAC1", shape).status()));
  EXPECT_TRUE(absl::IsInvalidArgument(DecodeSlice("", shape).status()));
}

TEST(SliceCodecTest, RefusesNumbersThatAreNotFinite) {
  const SliceShape shape = Shape({16, 18}, 20, kSectors);
  for (const float value :
       {std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity(),
        std::numeric_limits<float>::quiet_NaN()}) {
    for (std::size_t column = 0; column < ColumnsOf(shape.passes, shape.evidence); ++column) {
      SliceSums slice = RandomSlice(shape);
      slice.columns[column].Set(7, value);
      EXPECT_TRUE(absl::IsInvalidArgument(DecodeSlice(EncodeSlice(slice), shape).status()))
          << value << " in column " << column;
    }
  }
}

// The planes of a column may hold more bits than its values have; what remained after the shift
// would be another number.
TEST(SliceCodecTest, RefusesAValueWithTooManyBits) {
  const SliceShape shape = Shape({16, 18}, 2, 0);
  // With a bit above all others in the column that is sent as the n-th, or nowhere.
  const auto bytes_with_bit_in = [&](std::size_t damaged) {
    SliceSums dark = EmptySlice(shape.passes, shape.pixels, 0);
    dark.tally.photons = kPhotons;
    // The head of a dark slice, whose columns have no planes.
    const std::string of_dark = EncodeSlice(dark);
    ByteWriter writer;
    writer.Bytes(std::string_view(of_dark).substr(0, of_dark.size() - kSliceColumns));
    const std::vector<std::size_t> sent = {14, 1, 4, 7, 9, 10, 11, 12, 13, 15, 0, 2, 3, 5, 6, 8};
    for (std::size_t i = 0; i < sent.size(); ++i) {
      const unsigned int empty =
          DroppedBits(SignificantBits(shape.passes.size(), sent[i], shape.evidence));
      const std::uint32_t above = std::uint32_t{1} << (32 - empty);
      // Red and blue differ from green by nothing.
      const bool is_beside = i >= kSliceColumns - 6;
      const std::uint32_t one = is_beside ? 0 : std::bit_cast<std::uint32_t>(1.0F) >> empty;
      const std::vector<std::uint32_t> codes = {0, i != damaged ? one
                                                   : is_beside
                                                       ? ZigZag(static_cast<std::int32_t>(above))
                                                       : above};
      writer.Planes(codes);
    }
    return writer.Take();
  };
  const auto whole = DecodeSlice(bytes_with_bit_in(kSliceColumns), shape);
  ASSERT_TRUE(whole.ok()) << whole.status();
  for (std::size_t column = 0; column < kSliceColumns; ++column) {
    EXPECT_EQ(whole->At(column, 1), 1.0F) << column;
    EXPECT_FALSE(DecodeSlice(bytes_with_bit_in(column), shape).ok()) << column;
  }
}

// Whoever is told to replay a photon must find it.
TEST(SliceCodecTest, RefusesDroppedPhotonsThatItsPassesDoNotHave) {
  const SliceShape shape = Shape({16, 18}, 3, 0);
  const auto status_with = [&](std::uint64_t dropped, std::vector<PhotonKey> named) {
    SliceSums slice = RandomSlice(shape);
    slice.tally.dropped = dropped;
    slice.dropped_photons = std::move(named);
    return DecodeSlice(EncodeSlice(slice), shape).status();
  };
  EXPECT_TRUE(status_with(1, {{16, 0}}).ok());
  EXPECT_TRUE(status_with(1, {{17, kPhotons - 1}}).ok());
  EXPECT_TRUE(absl::IsInvalidArgument(status_with(1, {{15, 0}})));
  EXPECT_TRUE(absl::IsInvalidArgument(status_with(1, {{18, 0}})));
  EXPECT_TRUE(absl::IsInvalidArgument(status_with(1, {{16, kPhotons}})));
  EXPECT_TRUE(absl::IsInvalidArgument(status_with(2, {{16, 5}, {16, 5}})));
  EXPECT_TRUE(absl::IsInvalidArgument(status_with(2, {{17, 0}, {16, 5}})));
  EXPECT_TRUE(absl::IsInvalidArgument(status_with(2, {{16, 5}})));
  EXPECT_TRUE(absl::IsInvalidArgument(status_with(0, {{16, 5}})));
  std::vector<PhotonKey> many;
  for (std::uint64_t index = 0; index < kDroppedNamed; ++index)
    many.push_back({16, index});
  EXPECT_TRUE(status_with(100, many).ok());
  many.push_back({17, 0});
  EXPECT_TRUE(absl::IsInvalidArgument(status_with(100, many)));
}

TEST(SliceCodecTest, RefusesCountersThatContradictEachOther) {
  const SliceShape shape = Shape({16, 18}, 3, 0);
  SliceSums slice = RandomSlice(shape);
  slice.tally.energy.escaped += 1;
  EXPECT_TRUE(absl::IsInvalidArgument(DecodeSlice(EncodeSlice(slice), shape).status()));
  slice = RandomSlice(shape);
  slice.tally.lights[0].in_view[0] = slice.tally.lights[0].sent + 1;
  EXPECT_TRUE(absl::IsInvalidArgument(DecodeSlice(EncodeSlice(slice), shape).status()));
  slice = RandomSlice(shape);
  slice.tally.photons -= 1;
  EXPECT_TRUE(absl::IsInvalidArgument(DecodeSlice(EncodeSlice(slice), shape).status()));
  slice = RandomSlice(shape);
  slice.tally.lights.assign(kMaxLightTallies + 1, {.sent = 1});
  EXPECT_TRUE(absl::IsInvalidArgument(DecodeSlice(EncodeSlice(slice), shape).status()));
}

}  // namespace
}  // namespace lucerna
