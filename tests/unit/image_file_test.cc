// Every format gives its pixels, and no file is believed beyond its bytes.
#include "render/formats/image_file.h"

#include <cstring>
#include <map>
#include <string>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

#include "render/film/png_file.h"
#include "render/image/exr_file.h"

namespace lucerna {
namespace {

using ::testing::HasSubstr;

constexpr std::uint64_t kPlenty = std::uint64_t{1} << 30;

std::string Bytes(std::initializer_list<int> values) {
  std::string bytes;
  for (const int value : values)
    bytes += static_cast<char>(value);
  return bytes;
}

// Three by two pixels: red, green and blue above, and a ramp of greys below.
Image Source() {
  Image image;
  image.width = 3;
  image.height = 2;
  image.channels = {
      {"R", {1, 0, 0, 0, 0.5F, 1}}, {"G", {0, 1, 0, 0, 0.5F, 1}}, {"B", {0, 0, 1, 0, 0.5F, 1}}};
  return image;
}

std::string PfmBytes(const std::string& header, float scale = 1) {
  std::string bytes = header;
  const Image image = Source();
  for (const std::size_t row : {1U, 0U}) {
    for (std::size_t x = 0; x < 3; ++x) {
      for (const ImageChannel& channel : image.channels) {
        const float value = channel.pixels[3 * row + x] / scale;
        char raw[4];
        std::memcpy(raw, &value, 4);
        bytes.append(raw, 4);
      }
    }
  }
  return bytes;
}

// Little-endian 24-bit pixels in the order blue, green, red, from the top.
std::string TgaBytes(bool is_packed) {
  std::string bytes =
      Bytes({0, 0, is_packed ? 10 : 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 3, 0, 2, 0, 24, 0x20});
  if (is_packed) {
    bytes += Bytes({2, 0, 0, 255, 0, 255, 0, 255, 0, 0});  // three as they stand
    bytes += Bytes({0x80, 0, 0, 0, 0, 188, 188, 188, 0x80, 255, 255, 255});
  } else {
    bytes += Bytes({0, 0, 255, 0, 255, 0, 255, 0, 0});
    bytes += Bytes({0, 0, 0, 188, 188, 188, 255, 255, 255});
  }
  return bytes;
}

std::string HdrBytes() {
  return "#?RADIANCE\n# made by hand\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 3\n" +
         Bytes({128, 0, 0, 129, 0, 128, 0, 129, 0, 0, 128, 129}) +
         Bytes({0, 0, 0, 0, 128, 128, 128, 128, 128, 128, 128, 129});
}

// A row of ten: each component in runs and as it stands.
std::string PackedHdrBytes() {
  std::string bytes = "#?RGBE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 10\n" + Bytes({2, 2, 0, 10});
  bytes += Bytes({128 + 10, 128});                          // red everywhere
  bytes += Bytes({128 + 5, 0, 5, 128, 128, 128, 128, 64});  // green on the right
  bytes += Bytes({128 + 10, 0}) + Bytes({128 + 10, 129});
  return bytes;
}

std::map<std::string, std::string> Files() {
  return {{"a.png", EncodePng(Source()).value()}, {"a.exr", EncodeExr(Source()).value()},
          {"a.pfm", PfmBytes("PF\n3 2\n-1.0\n")}, {"raw.tga", TgaBytes(false)},
          {"packed.tga", TgaBytes(true)},         {"a.hdr", HdrBytes()}};
}

std::string Why(const std::string& bytes, const std::string& path,
                std::uint64_t max_size_bytes = kPlenty) {
  const StatusOr<Picture> picture = ReadPicture(bytes, path, {}, max_size_bytes);
  return picture.ok() ? "" : std::string(picture.status().message());
}

TEST(ImageFileTest, EveryFormatGivesTheSamePixels) {
  const Image source = Source();
  for (const auto& [path, bytes] : Files()) {
    const StatusOr<Picture> picture = ReadPicture(bytes, path, {}, kPlenty);
    ASSERT_TRUE(picture.ok()) << path << ": " << picture.status();
    ASSERT_EQ(picture->width, 3) << path;
    ASSERT_EQ(picture->height, 2) << path;
    const bool is_coded = path.ends_with(".png") || path.ends_with(".tga");
    EXPECT_EQ(picture->linear.empty(), is_coded) << path;
    for (int i = 0; i < 6; ++i) {
      for (int c = 0; c < 3; ++c) {
        // A grey of 188 is 0.5029 in sRGB.
        EXPECT_NEAR(
            picture->At(i % 3, i / 3)[c],
            source.channels[static_cast<std::size_t>(c)].pixels[static_cast<std::size_t>(i)],
            is_coded ? 4e-3F : 1e-6F)
            << path << " pixel " << i << " channel " << c;
      }
    }
  }
}

TEST(ImageFileTest, PackedHdrAndBigEndianAndGreyPfmAreRead) {
  const StatusOr<Picture> hdr = ReadPicture(PackedHdrBytes(), "a.hdr", {}, kPlenty);
  ASSERT_TRUE(hdr.ok()) << hdr.status();
  EXPECT_EQ(hdr->At(4, 0), (Rgb{1, 0, 0}));
  EXPECT_EQ(hdr->At(5, 0), (Rgb{1, 1, 0}));
  EXPECT_EQ(hdr->At(9, 0), (Rgb{1, 0.5F, 0}));

  const StatusOr<Picture> grey =
      ReadPicture(std::string("Pf\n1 2\n2.0\n") + Bytes({0x3F, 0x80, 0, 0, 0x3F, 0, 0, 0}), "A.PFM",
                  {}, kPlenty);
  ASSERT_TRUE(grey.ok()) << grey.status();
  EXPECT_EQ(grey->channels, 1);
  EXPECT_EQ(grey->At(0, 1), Gray(2));  // the file begins at the bottom
  EXPECT_EQ(grey->At(0, 0), Gray(1));
}

TEST(ImageFileTest, BytesMeanWhatTheEncodingSays) {
  const std::string png = EncodePng(Source()).value();
  const auto middle = [&](PixelEncoding encoding) {
    return ReadPicture(png, "a.png", encoding, kPlenty)->At(1, 1).g;
  };
  EXPECT_NEAR(middle({PixelEncoding::Kind::kLinear}), 188.0F / 255, 1e-6F);
  EXPECT_NEAR(middle({PixelEncoding::Kind::kGamma, 2}), 188.0F / 255 * 188.0F / 255, 1e-6F);
  EXPECT_NEAR(middle({}), 0.5029F, 1e-4F);
}

TEST(ImageFileTest, AFileCutOffAnywhereIsRefused) {
  std::map<std::string, std::string> files = Files();
  files["packed.hdr"] = PackedHdrBytes();
  for (const auto& [path, bytes] : files) {
    // The checksum of a PNG's last chunk is not asked for.
    const std::size_t enough = bytes.size() - (path.ends_with(".png") ? 4 : 0);
    for (std::size_t size = 0; size < enough; ++size) {
      EXPECT_NE(Why(bytes.substr(0, size), path), "") << path << " of " << size << " bytes";
    }
  }
}

TEST(ImageFileTest, SizesAreCheckedBeforeTheyAreBelieved) {
  std::string png = EncodePng(Source()).value();
  png.replace(16, 8, Bytes({0, 1, 0, 0, 0, 1, 0, 0}));  // 65536 x 65536 in the IHDR chunk
  EXPECT_THAT(Why(png, "a.png"), HasSubstr("2^28"));
  png.replace(16, 8, Bytes({0, 0, 0x40, 0, 0, 0, 0x40, 0}));  // 16384 x 16384
  EXPECT_THAT(Why(png, "a.png"), HasSubstr("too short for its size"));
  std::string chunk = EncodePng(Source()).value();
  chunk.replace(chunk.find("IDAT") - 4, 1, "\x3F");  // of 1 GB
  EXPECT_THAT(Why(chunk, "a.png"), HasSubstr("cut off"));
  EXPECT_THAT(Why(PfmBytes("PF\n65536 65536\n-1\n"), "a.pfm"), HasSubstr("2^28"));
  EXPECT_THAT(Why(PfmBytes("PF\n300 200\n-1\n"), "a.pfm"), HasSubstr("cut off"));
  EXPECT_THAT(Why("#?RGBE\nFORMAT=32-bit_rle_rgbe\n\n-Y 99999 +X 99999\n", "a.hdr"),
              HasSubstr("2^28"));
  EXPECT_THAT(Why(PfmBytes("PF\n3 2\n-1\n"), "a.pfm", 71), HasSubstr("72 bytes of memory"));
  EXPECT_EQ(Why(PfmBytes("PF\n3 2\n-1\n"), "a.pfm", 72), "");
}

TEST(ImageFileTest, OtherFormatsAndNamesAreRefused) {
  EXPECT_THAT(Why("GIF89a", "a.gif"), HasSubstr(".png, .jpg"));
  EXPECT_THAT(Why("GIF89a and more bytes than a header", "a.png"),
              HasSubstr("not begin like a PNG"));
  EXPECT_THAT(Why("GIF89a and more bytes than a header", "a.jpg"), HasSubstr("like a JPEG"));
  EXPECT_THAT(Why("GIF89a and more bytes than a header", "a.tga"), HasSubstr("like a TGA"));
  EXPECT_THAT(Why("P6 1 1 255 abc", "a.pfm"), HasSubstr("PFM"));
  EXPECT_THAT(Why("", "noextension"), HasSubstr(".png, .jpg"));
}

// Two pixels of 32 bits: blue, green, red and opacity.
std::string OpacityTga(const std::vector<int>& pixels) {
  std::string bytes = Bytes({0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 2, 0, 1, 0, 32, 0x28});
  for (const int value : pixels)
    bytes += static_cast<char>(value);
  return bytes;
}

// As pbrt-v4 has it: the opacity where it is not 1 everywhere, else the mean of the channels.
TEST(ImageFileTest, NumbersAreOpacitiesOrMeans) {
  const auto numbers = [](const std::string& bytes, const std::string& path) {
    const StatusOr<Picture> picture = ReadPicture(bytes, path, {}, kPlenty, PictureUse::kNumbers);
    EXPECT_TRUE(picture.ok()) << picture.status();
    EXPECT_EQ(picture->channels, 1);
    return *picture;
  };
  const Picture cut = numbers(OpacityTga({9, 9, 9, 255, 9, 9, 9, 0}), "a.tga");
  EXPECT_EQ(cut.At(0, 0).g, 1);
  EXPECT_EQ(cut.At(1, 0).g, 0);
  // 188 is 0.5029 in sRGB.
  const Picture mean = numbers(OpacityTga({0, 255, 188, 255, 188, 188, 188, 255}), "a.tga");
  EXPECT_NEAR(mean.At(0, 0).g, (0.5029 + 1) / 3, 1e-3);
  EXPECT_NEAR(mean.At(1, 0).g, 0.5029, 1e-3);

  Image image = Source();
  image.channels[1].pixels[2] = -0.25F;
  const auto mean_at_2 = [&] {
    return (image.channels[0].pixels[2] + image.channels[1].pixels[2] +
            image.channels[2].pixels[2]) /
           3;
  };
  EXPECT_FLOAT_EQ(numbers(EncodeExr(image).value(), "a.exr").At(2, 0).g, mean_at_2());
  image.channels.push_back({"A", image.channels[0].pixels});
  for (float& value : image.channels[3].pixels)
    value = 1;
  EXPECT_FLOAT_EQ(numbers(EncodeExr(image).value(), "a.exr").At(2, 0).g, mean_at_2());
  image.channels[3].pixels[2] = 0.25F;
  EXPECT_FLOAT_EQ(numbers(EncodeExr(image).value(), "a.exr").At(2, 0).g, 0.25F);
  EXPECT_FLOAT_EQ(numbers(EncodeExr(image).value(), "a.exr").At(0, 0).g, 1);
}

TEST(ImageFileTest, PixelsAreFiniteAndNotNegative) {
  Image image = Source();
  image.channels[1].pixels[2] = -0.25F;
  const StatusOr<Picture> picture = ReadPicture(EncodeExr(image).value(), "a.exr", {}, kPlenty);
  ASSERT_TRUE(picture.ok());
  EXPECT_EQ(picture->At(2, 0), (Rgb{0, 0, 1}));
  image.channels[1].pixels[2] = HUGE_VALF;
  EXPECT_THAT(Why(EncodeExr(image).value(), "a.exr"), HasSubstr("not finite"));
  image.channels[1].pixels[2] = NAN;
  EXPECT_THAT(Why(EncodeExr(image).value(), "a.exr"), HasSubstr("not finite"));
  image.channels[0].name = "Z";
  image.channels[1].pixels[2] = 0;
  EXPECT_THAT(Why(EncodeExr(image).value(), "a.exr"), HasSubstr("R, G and B"));
}

}  // namespace
}  // namespace lucerna
