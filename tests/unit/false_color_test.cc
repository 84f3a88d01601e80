// A number of a layer must have the colour of its place on the scale, and the density of photons
// must be the count over the area of the disc.
#include "render/film/false_color.h"

#include <cmath>
#include <limits>
#include <numbers>

#include "gtest/gtest.h"

namespace lucerna {
namespace {

Image OneRow(const std::string& name, std::vector<float> values) {
  Image image;
  image.width = static_cast<int>(values.size());
  image.height = 1;
  image.channels.push_back({name, std::move(values)});
  return image;
}

// As the file shows it, after sRGB's transfer function.
std::array<int, 3> Shown(const FalseColors& colors, std::size_t pixel) {
  std::array<int, 3> shown{};
  for (std::size_t c = 0; c < 3; ++c) {
    const auto linear = static_cast<double>(colors.picture.channels[c].pixels[pixel]);
    const double coded =
        linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
    shown[c] = static_cast<int>(std::lround(255 * coded));
  }
  return shown;
}

std::array<int, 3> ColorAt(double share) {
  std::array<int, 3> color{};
  for (std::size_t c = 0; c < 3; ++c)
    color[c] = static_cast<int>(std::lround(FalseColor(share)[c]));
  return color;
}

TEST(FalseColorTest, ALinearScaleGoesFromLowToHigh) {
  const auto colors =
      FalseColorsOf(OneRow("radius", {1, 2, 3, -5, 9}), "radius", std::pair(1.0, 3.0));
  ASSERT_TRUE(colors.ok()) << colors.status();
  EXPECT_FALSE(colors->scale.is_logarithmic);
  EXPECT_EQ(Shown(*colors, 0), ColorAt(0));
  EXPECT_EQ(Shown(*colors, 1), ColorAt(0.5));
  EXPECT_EQ(Shown(*colors, 2), ColorAt(1));
  EXPECT_EQ(Shown(*colors, 3), ColorAt(0)) << "below the range";
  EXPECT_EQ(Shown(*colors, 4), ColorAt(1)) << "above it";
}

TEST(FalseColorTest, ALayerOverDecadesHasALogarithmicScale) {
  std::vector<float> values;
  for (int i = 0; i <= 100; ++i)
    values.push_back(static_cast<float>(std::pow(10, -2 + 0.04 * i)));
  const auto colors = FalseColorsOf(OneRow("radius", values), "radius");
  ASSERT_TRUE(colors.ok());
  EXPECT_TRUE(colors->scale.is_logarithmic);
  EXPECT_NEAR(colors->scale.low, std::pow(10, -1.96), 1e-6) << "without the first percent";
  EXPECT_NEAR(colors->scale.high, std::pow(10, 1.96), 1e-4);
  EXPECT_EQ(Shown(*colors, 50), ColorAt(0.5)) << "the geometric mean is in the middle";
}

TEST(FalseColorTest, DensityIsCountOverArea) {
  Image image = OneRow("photon_count", {10, 40, 7});
  image.channels.push_back({"radius", {1, 2, 0}});
  const double density = 10 / std::numbers::pi;
  const auto colors = FalseColorsOf(image, "density", std::pair(density, 2 * density));
  ASSERT_TRUE(colors.ok());
  EXPECT_EQ(Shown(*colors, 0), Shown(*colors, 1)) << "four times the count on four times the area";
  EXPECT_EQ(Shown(*colors, 0), ColorAt(0));
  EXPECT_EQ(Shown(*colors, 2), (std::array{0, 0, 0})) << "without a disc there is none";
}

TEST(FalseColorTest, EvenAndEmptyLayersHaveOneColor) {
  EXPECT_TRUE(FalseColorsOf(OneRow("radius", {2, 2, 2}), "radius").ok());
  EXPECT_TRUE(FalseColorsOf(OneRow("radius", {0, 0}), "radius").ok());
  const float infinite = std::numeric_limits<float>::infinity();
  const auto colors = FalseColorsOf(OneRow("Zed", {infinite, NAN}), "Zed");
  ASSERT_TRUE(colors.ok());
  EXPECT_EQ(Shown(*colors, 0), (std::array{0, 0, 0}));
}

TEST(FalseColorTest, WhatCannotBeShownIsASentence) {
  EXPECT_EQ(FalseColorsOf(OneRow("radius", {1}), "bandwidth").status().code(),
            absl::StatusCode::kNotFound);
  EXPECT_EQ(FalseColorsOf(OneRow("radius", {1}), "density").status().code(),
            absl::StatusCode::kNotFound);
  EXPECT_EQ(FalseColorsOf(OneRow("radius", {1}), "radius", std::pair(2.0, 1.0)).status().code(),
            absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace lucerna
