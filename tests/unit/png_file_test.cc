// A PNG must show the pixels it was given: sRGB encoded, clipped, in the right order, with the
// exposure applied before the curve.
#include "render/film/png_file.h"

#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "gtest/gtest.h"
#include <zlib.h>

namespace lucerna {
namespace {

Image FromRed(int width, int height, std::vector<float> red) {
  Image image;
  image.width = width;
  image.height = height;
  std::vector<float> black(red.size(), 0);
  image.channels = {{"R", std::move(red)}, {"G", black}, {"B", black}};
  return image;
}

std::uint32_t BigEndian(const std::string& bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    value = value << 8 | static_cast<std::uint8_t>(bytes[at + i]);
  }
  return value;
}

// The rows of an 8 bit RGB picture, with the row filters of the format undone.
std::vector<std::uint8_t> Pixels(const std::string& png) {
  EXPECT_EQ(png.substr(0, 8), "\x89PNG\r\n\x1a\n");
  const std::size_t width = BigEndian(png, 16);
  const std::size_t height = BigEndian(png, 20);
  EXPECT_EQ(png[24], 8);
  EXPECT_EQ(png[25], 2);
  std::string packed;
  for (std::size_t at = 8; at < png.size(); at += 12 + BigEndian(png, at)) {
    if (png.substr(at + 4, 4) == "IDAT") packed += png.substr(at + 8, BigEndian(png, at));
  }
  const std::size_t stride = 3 * width;
  std::vector<std::uint8_t> rows(height * (stride + 1));
  uLongf size = rows.size();
  EXPECT_EQ(
      uncompress(rows.data(), &size, reinterpret_cast<const Bytef*>(packed.data()), packed.size()),
      Z_OK);
  EXPECT_EQ(size, rows.size());
  std::vector<std::uint8_t> pixels(height * stride);
  for (std::size_t y = 0; y < height; ++y) {
    const std::uint8_t filter = rows[y * (stride + 1)];
    for (std::size_t x = 0; x < stride; ++x) {
      const int left = x >= 3 ? pixels[y * stride + x - 3] : 0;
      const int up = y > 0 ? pixels[(y - 1) * stride + x] : 0;
      const int corner = x >= 3 && y > 0 ? pixels[(y - 1) * stride + x - 3] : 0;
      const int guess = left + up - corner;
      const int paeth = std::abs(guess - left) <= std::abs(guess - up) &&
                                std::abs(guess - left) <= std::abs(guess - corner)
                            ? left
                        : std::abs(guess - up) <= std::abs(guess - corner) ? up
                                                                           : corner;
      const int predicted = filter == 0   ? 0
                            : filter == 1 ? left
                            : filter == 2 ? up
                            : filter == 3 ? (left + up) / 2
                                          : paeth;
      pixels[y * stride + x] =
          static_cast<std::uint8_t>(rows[y * (stride + 1) + 1 + x] + predicted);
    }
  }
  return pixels;
}

TEST(PngFileTest, EncodesTheSrgbCurveAndClips) {
  const StatusOr<std::string> png = EncodePng(FromRed(
      8, 1, {0, 0.002F, 0.2158605F, 0.5F, 1, 7, -3, std::numeric_limits<float>::quiet_NaN()}));
  ASSERT_TRUE(png.ok()) << png.status();
  std::vector<int> red;
  const auto pixels = Pixels(*png);
  for (std::size_t i = 0; i < pixels.size(); i += 3)
    red.push_back(pixels[i]);
  // 0.002 lies on the straight part: 12.92 * 0.002 * 255 = 6.6; 0.2158605 is what 128 stands for.
  EXPECT_EQ(red, (std::vector<int>{0, 7, 128, 188, 255, 255, 0, 0}));
}

TEST(PngFileTest, ExposureIsInStopsOfLinearLight) {
  const StatusOr<std::string> png =
      EncodePng(FromRed(2, 1, {0.05396513F, 4}), {.exposure_stops = 2});
  ASSERT_TRUE(png.ok());
  EXPECT_EQ(Pixels(*png)[0], 128);
  const StatusOr<std::string> darker =
      EncodePng(FromRed(2, 1, {0.05396513F, 4}), {.exposure_stops = -2});
  ASSERT_TRUE(darker.ok());
  EXPECT_EQ(Pixels(*darker)[3], 255);
}

TEST(PngFileTest, KeepsRowsAndChannelsInOrder) {
  Image image;
  image.width = 2;
  image.height = 2;
  image.channels = {{"B", {0, 0, 0, 1}}, {"G", {0, 1, 0, 0}}, {"R", {1, 0, 0, 0}}};
  const StatusOr<std::string> png = EncodePng(image);
  ASSERT_TRUE(png.ok());
  EXPECT_EQ(Pixels(*png), (std::vector<std::uint8_t>{255, 0, 0, 0, 255, 0, 0, 0, 0, 0, 0, 255}));
}

TEST(PngFileTest, RefusesAnImageWithoutColour) {
  Image image = FromRed(1, 1, {1});
  image.channels.pop_back();
  EXPECT_EQ(EncodePng(image).status().code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace lucerna
