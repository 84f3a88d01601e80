// What a screen shows of radiance.
#include "render/film/display.h"

#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "gtest/gtest.h"

namespace lucerna {
namespace {

Image GreyImage(const std::vector<float>& values) {
  Image image{
      .width = static_cast<int>(values.size()), .height = 1, .channels = {}, .metadata = {}};
  image.channels = {{"R", values}, {"G", values}, {"B", values}};
  return image;
}

// [channel][pixel].
StatusOr<std::array<ImageChannel, 3>> DisplayedChannels(const Image& image,
                                                        const Display& display) {
  LUCERNA_ASSIGN_OR_RETURN(const DisplayedImage shown, DisplayedImage::Create(image, display));
  std::array<ImageChannel, 3> channels;
  for (std::size_t i = 0; i < image.channels[0].pixels.size(); ++i) {
    for (std::size_t c = 0; c < 3; ++c)
      channels[c].pixels.push_back(static_cast<float>(shown.At(i)[c]));
  }
  return channels;
}

constexpr ToneCurve kAll[] = {ToneCurve::kClip, ToneCurve::kReinhard, ToneCurve::kFilmic,
                              ToneCurve::kAces};

TEST(DisplayTest, CurvesRiseFromBlackAndNeverLeaveTheScreen) {
  std::vector<float> values = {0};
  for (float value = 1e-4F; value < 1e6F; value *= 1.2F)
    values.push_back(value);
  values.push_back(std::numeric_limits<float>::infinity());
  for (const ToneCurve curve : kAll) {
    const auto shown = DisplayedChannels(GreyImage(values), {.curve = curve});
    ASSERT_TRUE(shown.ok());
    const std::vector<float>& red = (*shown)[0].pixels;
    EXPECT_NEAR(red[0], 0, 1e-6);
    for (std::size_t i = 1; i < red.size(); ++i) {
      EXPECT_GE(red[i], red[i - 1]);
      EXPECT_LE(red[i], 1);
    }
    EXPECT_GT(red.back(), 0.99F);
    // Twice white is brighter than white, but for the curve that clips.
    const auto bright = DisplayedChannels(GreyImage({1, 2}), {.curve = curve}).value();
    EXPECT_EQ(bright[0].pixels[0] < bright[0].pixels[1], curve != ToneCurve::kClip);
  }
}

TEST(DisplayTest, WhatIsNoNumberIsBlack) {
  for (const ToneCurve curve : kAll) {
    const auto shown = DisplayedChannels(GreyImage({std::nanf(""), -3}), {.curve = curve}).value();
    EXPECT_NEAR(shown[0].pixels[0], 0, 1e-6);
    EXPECT_NEAR(shown[0].pixels[1], 0, 1e-6);
  }
}

// Eq. 4 of its source for luminance 1 and a white of 4: 1 (1 + 1/16) / 2.
TEST(DisplayTest, ReinhardsCurveKeepsHues) {
  Image image = GreyImage({1});
  EXPECT_NEAR(DisplayedChannels(image, {.curve = ToneCurve::kReinhard}).value()[0].pixels[0],
              0.53125, 1e-6);
  image.channels[0].pixels[0] = 0.5F;
  const auto shown = DisplayedChannels(image, {.curve = ToneCurve::kReinhard}).value();
  EXPECT_NEAR(shown[0].pixels[0] / shown[1].pixels[0], 0.5, 1e-6);
}

TEST(DisplayTest, ExposureIsFoundForImagesThatAreFarFromWhite) {
  EXPECT_EQ(AutoExposure(GreyImage({0.18F, 0.18F})), 0);
  EXPECT_EQ(AutoExposure(GreyImage({0.01F})), 0) << "dark, but meant so";
  EXPECT_EQ(AutoExposure(GreyImage({0.9F, 0, 0, 0})), 0);
  EXPECT_EQ(AutoExposure(GreyImage({0.18F * 1024})), -10);
  EXPECT_EQ(AutoExposure(GreyImage({0.18F / 1024})), 10);
  // One speck does not decide.
  std::vector<float> values(1000, 0.2F);
  values[7] = 1e9F;
  EXPECT_EQ(AutoExposure(GreyImage(values)), 0);
  EXPECT_EQ(AutoExposure(GreyImage({0, 0})), 0);
  EXPECT_EQ(AutoExposure(GreyImage({std::nanf(""), std::numeric_limits<float>::infinity()})), 0);
  EXPECT_EQ(AutoExposure(Image()), 0);
  // Of many pixels only some are looked at, unless these are black.
  std::vector<float> many(1'000'003, 0.18F / 1024);
  EXPECT_EQ(AutoExposure(GreyImage(many)), 10);
  many.assign(many.size(), 0);
  many[1] = 0.18F * 1024;
  EXPECT_EQ(AutoExposure(GreyImage(many)), -10);
}

TEST(DisplayTest, ExposureAboveAllIsThatOfAuto) {
  const Image bright = GreyImage({0.18F * 256});
  const auto automatic = DisplayedChannels(bright, {.exposure_stops = std::nullopt}).value();
  EXPECT_NEAR(automatic[0].pixels[0], 0.18, 1e-6);
  EXPECT_EQ(DisplayedChannels(bright, {}).value()[0].pixels[0], 1);
}

TEST(DisplayTest, CurvesHaveNames) {
  EXPECT_EQ(ParseToneCurve("filmic").value(), ToneCurve::kFilmic);
  EXPECT_EQ(ParseToneCurve("aces").value(), ToneCurve::kAces);
  EXPECT_EQ(ParseToneCurve("reinhard").value(), ToneCurve::kReinhard);
  EXPECT_EQ(ParseToneCurve("clip").value(), ToneCurve::kClip);
  EXPECT_FALSE(ParseToneCurve("Filmic").ok());
}

}  // namespace
}  // namespace lucerna
