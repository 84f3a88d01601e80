// An image must come back from its EXR bit for bit, the same image must give the same bytes, and
// bytes that are not a whole EXR must be refused with a Status: no crash, no hang, no memory that
// only a lying header asked for.
#include "render/image/exr_file.h"

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <limits>
#include <random>

#include "gtest/gtest.h"

#include "render/base/files.h"
#include "render/math/rng.h"

namespace lucerna {
namespace {

// 5 x 300: more rows than any block of the format, and neither side a power of two.
Image Example() {
  Image image;
  image.width = 5;
  image.height = 300;
  float value = -3.25F;
  for (const char* name : {"R", "G", "B", "N.X", "Z", "photon_count"}) {
    ImageChannel channel{name, {}};
    for (int i = 0; i < image.width * image.height; ++i)
      channel.pixels.push_back(value *= -1.01F);
    value = 1;
    image.channels.push_back(std::move(channel));
  }
  image.channels[4].pixels[7] = std::numeric_limits<float>::infinity();
  image.channels[0].pixels[8] = std::numeric_limits<float>::denorm_min();
  image.channels[0].pixels[9] = -0.0F;
  image.channels[0].pixels[10] = std::numeric_limits<float>::quiet_NaN();
  image.metadata = {{"lucerna.seed", "17"},
                    {"lucerna.settings", "a text\nof two lines"},
                    {"lucerna.run.seconds", "1.5"}};
  return image;
}

std::string Encoded(const Image& image) {
  StatusOr<std::string> bytes = EncodeExr(image);
  EXPECT_TRUE(bytes.ok()) << bytes.status();
  return bytes.ok() ? *bytes : std::string();
}

TEST(ExrFileTest, EveryBitComesBack) {
  const Image image = Example();
  const StatusOr<Image> back = DecodeExr(Encoded(image));
  ASSERT_TRUE(back.ok()) << back.status();

  EXPECT_EQ(back->width, image.width);
  EXPECT_EQ(back->height, image.height);
  EXPECT_EQ(back->metadata, image.metadata);
  ASSERT_EQ(back->channels.size(), image.channels.size());
  for (const ImageChannel& channel : image.channels) {
    const ImageChannel* read = back->Find(channel.name);
    ASSERT_NE(read, nullptr) << channel.name;
    ASSERT_EQ(read->pixels.size(), channel.pixels.size());
    EXPECT_EQ(std::memcmp(read->pixels.data(), channel.pixels.data(),
                          channel.pixels.size() * sizeof(float)),
              0)
        << channel.name;
  }
  EXPECT_EQ(back->PixelDigest(), image.PixelDigest());
}

TEST(ExrFileTest, APartKeepsItsPlaceInTheWhole) {
  Image part = Example();
  const Digest digest = part.PixelDigest();
  part.x0 = 7;
  part.y0 = 20;
  part.whole_width = 64;
  part.whole_height = 400;
  const StatusOr<Image> back = DecodeExr(*EncodeExr(part));
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(back->x0, 7);
  EXPECT_EQ(back->y0, 20);
  EXPECT_EQ(back->whole_width, 64);
  EXPECT_EQ(back->whole_height, 400);
  EXPECT_EQ(back->PixelDigest(), digest) << "of pixels, wherever they lie";
  EXPECT_EQ(DecodeExr(*EncodeExr(Example()))->whole_width, 0);
}

TEST(ExrFileTest, TheSameImageGivesTheSameBytesWhateverTheOrderOfItsChannels) {
  Image image = Example();
  const std::string bytes = Encoded(image);
  std::swap(image.channels.front(), image.channels.back());
  EXPECT_EQ(Encoded(image), bytes);
}

TEST(ExrFileTest, DigestChangesWithAnyPixelSizeNameOrSettingAndWithNothingElse) {
  const Image image = Example();
  Image other = image;
  std::swap(other.channels[0], other.channels[1]);
  other.metadata["lucerna.run.seconds"] = "2.5";
  other.metadata["lucerna.run.machine"] = "elsewhere";
  EXPECT_EQ(other.PixelDigest(), image.PixelDigest());

  other = image;
  other.channels[3].pixels.back() = std::nextafter(other.channels[3].pixels.back(), 0.0F);
  EXPECT_NE(other.PixelDigest(), image.PixelDigest());
  other = image;
  std::swap(other.width, other.height);
  EXPECT_NE(other.PixelDigest(), image.PixelDigest());
  other = image;
  other.channels[3].name = "N.Y";
  EXPECT_NE(other.PixelDigest(), image.PixelDigest());
  other = image;
  other.metadata["lucerna.seed"] = "18";
  EXPECT_NE(other.PixelDigest(), image.PixelDigest());
}

// 300 rows of 1000 pixels are several bands.
TEST(ExrFileTest, BandsGiveTheSameBytesAsTheWhole) {
  Image image;
  image.width = 1000;
  image.height = 300;
  image.x0 = 7;
  image.y0 = 9;
  image.whole_width = 1100;
  image.whole_height = 400;
  image.metadata["lucerna.seed"] = "17";
  KeyedRng rng(5);
  for (const char* const name : {"R", "albedo.G", "Z"}) {
    image.channels.push_back({name, std::vector<float>(300'000)});
    for (float& value : image.channels.back().pixels)
      value = rng.Uniform() < 0.5F ? 0 : rng.Uniform();
  }
  const std::string whole = Encoded(image);
  const BandedImage bands = InBands(image);
  EXPECT_EQ(bands.Whole().PixelDigest(), image.PixelDigest());
  for (const int threads : {1, 3})
    EXPECT_EQ(EncodeExr(bands, threads).value(), whole) << threads;

  int asked = 0;
  BandedImage counted = bands;
  counted.rows = [&](int first, int last) {
    EXPECT_EQ(first, asked);
    EXPECT_LT(last - first, 300);
    asked = last;
    return bands.rows(first, last);
  };
  ASSERT_TRUE(EncodeExr(counted, 1).ok());
  EXPECT_EQ(asked, 300);
}

TEST(ExrFileTest, RefusesToWriteAnImageWithoutPixelsOrWithAnImpossibleAttribute) {
  EXPECT_EQ(EncodeExr(Image{}).status().code(), absl::StatusCode::kInvalidArgument);
  Image image = Example();
  image.metadata["channels"] = "a name the format keeps for itself";
  EXPECT_EQ(EncodeExr(image).status().code(), absl::StatusCode::kInvalidArgument);
  image = Example();
  image.metadata[std::string(300, 'x')] = "too long a name";
  EXPECT_EQ(EncodeExr(image).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(ExrFileTest, RefusesEveryTruncation) {
  const std::string bytes = Encoded(Example());
  for (std::size_t size = 0; size < bytes.size(); size += (size < 700 ? 1 : 37)) {
    const StatusOr<Image> image = DecodeExr(std::string_view(bytes).substr(0, size));
    ASSERT_EQ(image.status().code(), absl::StatusCode::kInvalidArgument) << size;
  }
}

TEST(ExrFileTest, SurvivesFlippedBytesAndGarbage) {
  const std::string bytes = Encoded(Example());
  std::mt19937 random(1);
  for (int trial = 0; trial < 1000; ++trial) {
    std::string damaged = bytes;
    for (int flips = 0; flips < 1 + trial % 4; ++flips) {
      damaged[random() % (trial % 2 == 0 ? 600 : damaged.size())] = static_cast<char>(random());
    }
    const StatusOr<Image> image = DecodeExr(damaged);
    if (image.ok()) continue;
    EXPECT_EQ(image.status().code(), absl::StatusCode::kInvalidArgument);
  }
  std::string garbage(4096, '\0');
  for (char& byte : garbage)
    byte = static_cast<char>(random());
  EXPECT_EQ(DecodeExr(garbage).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(DecodeExr("").status().code(), absl::StatusCode::kInvalidArgument);
}

// Overwrites the value of an attribute: `offset` counts from the first byte of the value.
std::string WithField(std::string bytes, const std::string& attribute, std::size_t offset,
                      std::int32_t value) {
  const std::size_t name = bytes.find(attribute + '\0');
  EXPECT_NE(name, std::string::npos);
  const std::size_t type = name + attribute.size() + 1;
  const std::size_t field = bytes.find('\0', type) + 1 + 4 + offset;
  std::memcpy(bytes.data() + field, &value, 4);
  return bytes;
}

TEST(ExrFileTest, RefusesAWindowThatIsEmptyInvertedOrTooLargeWithoutAllocatingIt) {
  const std::string bytes = Encoded(Example());
  constexpr std::int32_t kMax = std::numeric_limits<std::int32_t>::max();
  constexpr std::int32_t kMin = std::numeric_limits<std::int32_t>::min();
  for (const std::int32_t x1 : {-1, kMin, 1 << 28, kMax}) {
    const Status status = DecodeExr(WithField(bytes, "dataWindow", 8, x1)).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << x1;
  }
  // 2^28 pixels in one column: allowed by number, refused because the bytes cannot hold them.
  const std::string tall =
      WithField(WithField(bytes, "dataWindow", 8, 0), "dataWindow", 12, (1 << 28) - 1);
  const Status status = DecodeExr(tall).status();
  EXPECT_NE(std::string(status.message()).find("too short"), std::string::npos) << status;
}

TEST(ExrFileTest, ReadsPicturesThatOtherProgramsWrote) {
  const std::string folder = LUCERNA_SOURCE_DIR "/../shared/scenes";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "the reference images are not here";
  int read = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.path().filename() != "reference.exr") continue;
    const StatusOr<std::string> bytes = ReadFile(entry.path().string());
    ASSERT_TRUE(bytes.ok()) << bytes.status();
    const StatusOr<Image> image = DecodeExr(*bytes);
    ASSERT_TRUE(image.ok()) << entry.path() << ": " << image.status();
    EXPECT_GE(image->width, 192);
    for (const char* name : {"R", "G", "B"})
      ASSERT_NE(image->Find(name), nullptr) << name;
    ++read;
  }
  EXPECT_GT(read, 0);
}

}  // namespace
}  // namespace lucerna
