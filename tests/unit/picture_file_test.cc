// Files for other programs: what is written must be what they read.
#include "render/film/picture_file.h"

#include <cmath>
#include <cstring>

#include "gtest/gtest.h"

#include "render/formats/image_file.h"
#include "render/image/exr_file.h"

namespace lucerna {
namespace {

Image SomeImage() {
  Image image{.width = 2, .height = 2, .channels = {}, .metadata = {{"lucerna.seed", "1"}}};
  image.channels = {{"R", {1, 2, 3, 4}},        {"G", {0.5F, 0, 0, 1e-3F}},
                    {"B", {1e4F, 7, 0, 2}},     {"N.X", {1, 0, -1, 0}},
                    {"N.Y", {0, 1, 0, -1}},     {"N.Z", {0, 0, 0, 0}},
                    {"radius", {9, 8, 7, 6}},   {"direct.R", {5, 5, 5, 5}},
                    {"direct.G", {6, 6, 6, 6}}, {"direct.B", {7, 7, 7, 7}}};
  return image;
}

TEST(PictureFileTest, TheEndingOfTheNameIsTheFormat) {
  EXPECT_EQ(PictureFormatOf("a.exr").value(), PictureFormat::kExr);
  EXPECT_EQ(PictureFormatOf("b.c/a.PNG").value(), PictureFormat::kPng);
  EXPECT_EQ(PictureFormatOf("a.exr.pfm").value(), PictureFormat::kPfm);
  EXPECT_EQ(PictureFormatOf("a.Hdr").value(), PictureFormat::kHdr);
  for (const char* name : {"a", "exr", "a.jpg", "a.exr/b", ""})
    EXPECT_FALSE(PictureFormatOf(name).ok()) << name;
}

TEST(PictureFileTest, FloatMapsAreRowsFromTheBottom) {
  const std::string bytes = EncodePicture(SomeImage(), PictureFormat::kPfm, {}).value();
  const std::string head = "PF\n2 2\n-1.0\n";
  ASSERT_EQ(bytes.substr(0, head.size()), head);
  ASSERT_EQ(bytes.size(), head.size() + 12 * sizeof(float));
  float values[12];
  std::memcpy(values, bytes.data() + head.size(), sizeof(values));
  EXPECT_EQ(values[0], 3);
  EXPECT_EQ(values[5], 2);
  EXPECT_EQ(values[6], 1);
  EXPECT_EQ(values[8], 1e4F);
}

TEST(PictureFileTest, RadianceFilesHoldTheLightToAPartIn256) {
  Image image = SomeImage();
  image.channels[0].pixels[0] = -5;
  const std::string bytes = EncodePicture(image, PictureFormat::kHdr, {}).value();
  ASSERT_EQ(bytes.find("#?RADIANCE\n"), 0U);
  const std::size_t rows = bytes.find("-Y 2 +X 2\n") + 10;
  ASSERT_EQ(bytes.size(), rows + 16);
  const auto value = [&](std::size_t pixel, std::size_t channel) {
    const auto byte = [&](std::size_t i) {
      return static_cast<unsigned char>(bytes[rows + 4 * pixel + i]);
    };
    return std::ldexp(static_cast<double>(byte(channel)), byte(3) - 136);
  };
  EXPECT_EQ(value(0, 0), 0);
  EXPECT_NEAR(value(0, 2), 1e4, 1e4 / 128);
  EXPECT_NEAR(value(3, 0), 4, 4.0 / 128);
  EXPECT_NEAR(value(3, 2), 2, 4.0 / 128);
}

TEST(PictureFileTest, LayersAreColoursDirectionsOrGrey) {
  const Image image = SomeImage();
  const Image direct = PictureOfLayer(image, "direct").value();
  EXPECT_EQ(direct.Find("G")->pixels[0], 6);
  const Image normals = PictureOfLayer(image, "N").value();
  EXPECT_EQ(normals.Find("R")->pixels, (std::vector<float>{1, 0.5F, 0, 0.5F}));
  const Image radius = PictureOfLayer(image, "radius").value();
  EXPECT_EQ(radius.Find("B")->pixels[1], 8);
  const Status none = PictureOfLayer(image, "depth").status();
  EXPECT_TRUE(absl::IsNotFound(none));
  EXPECT_EQ(none.message(), "there is no layer depth; there are N, direct, radius");
}

TEST(PictureFileTest, KnowsItsOwnFiles) {
  for (const PictureFormat format :
       {PictureFormat::kExr, PictureFormat::kPng, PictureFormat::kHdr}) {
    const std::string bytes = EncodePicture(SomeImage(), format, {}).value();
    EXPECT_TRUE(IsOwnPicture(bytes.substr(0, kBytesThatTell)));
  }
  Image foreign = SomeImage();
  foreign.metadata.clear();
  EXPECT_FALSE(IsOwnPicture(EncodeExr(foreign).value()));
  EXPECT_FALSE(IsOwnPicture("my notes"));
}

}  // namespace
}  // namespace lucerna
