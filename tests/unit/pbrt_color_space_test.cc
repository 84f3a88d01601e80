// Colours of other primaries, and options, as pbrt-v4 texts give them.
#include <string>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

#include "render/formats/read_scene.h"
#include "render/math/color_space.h"
#include "render/scene/texture.h"
#include "tests/support/pbrt_text.h"

namespace lucerna {
namespace {

using ::testing::HasSubstr;

// Of the last point light.
Rgb IntensityOf(const std::string& world) {
  const ParsedScene parsed = ParseWorld(world);
  EXPECT_TRUE(parsed.ok()) << parsed.ToStatus();
  EXPECT_FALSE(parsed.scene.point_lights.empty());
  return parsed.scene.point_lights.back().intensity;
}

void ExpectNear(Rgb color, double r, double g, double b, double tolerance) {
  EXPECT_NEAR(color.r, r, tolerance);
  EXPECT_NEAR(color.g, g, tolerance);
  EXPECT_NEAR(color.b, b, tolerance);
}

std::string LightIn(const std::string& space, const std::string& color) {
  return "ColorSpace \"" + space + "\" LightSource \"point\" \"rgb I\" [" + color + "]";
}

TEST(PbrtColorSpaceTest, WhiteStaysWhite) {
  for (const char* space : {"srgb", "rec2020", "dci-p3", "aces2065-1"}) {
    SCOPED_TRACE(space);
    ExpectNear(IntensityOf(LightIn(space, "3 3 3")), 3, 3, 3, 2e-5);
  }
}

// Matrices of ITU-R BT.2087 (four digits), and of math/color_space.h for P3.
TEST(PbrtColorSpaceTest, PrimariesBecomeThoseOfRec709) {
  ExpectNear(IntensityOf(LightIn("rec2020", "0.5 1 0.25")), 0.5 * 1.6605 - 0.5876 - 0.25 * 0.0728,
             -0.5 * 0.1246 + 1.1329 - 0.25 * 0.0083, -0.5 * 0.0182 - 0.1006 + 0.25 * 1.1187, 2e-4);
  const auto p3 = ToRec709(std::array<double, 3>{1, 0.5, 0.75});
  ExpectNear(IntensityOf(LightIn("dci-p3", "1 0.5 0.75")), p3[0], p3[1], p3[2], 2e-4);
  // Green that no screen of Rec. 709 shows.
  ExpectNear(IntensityOf(LightIn("rec2020", "0 1 0")), 0, 1.1329, 0, 2e-4);
}

TEST(PbrtColorSpaceTest, ReflectancesAreNeverAboveOne) {
  const ParsedScene parsed = ParseWorld(
      "ColorSpace \"rec2020\" Material \"diffuse\" \"rgb reflectance\" [1 0 0] Shape \"sphere\"");
  ASSERT_TRUE(parsed.ok()) << parsed.ToStatus();
  const Rgb color = parsed.scene.materials.back().reflectance;
  EXPECT_EQ(color.r, 1);
  EXPECT_EQ(color.g, 0);
}

TEST(PbrtColorSpaceTest, IsThatOfTexturesToo) {
  const ParsedScene parsed = ParseWorld(
      "LightSource \"infinite\" ColorSpace \"rec2020\" Texture \"t\" \"spectrum\" \"checkerboard\" "
      "\"rgb tex1\" [0.5 0.4 0.25] \"rgb tex2\" [0.5 0.4 0.25] "
      "Material \"diffuse\" \"texture reflectance\" \"t\" Shape \"sphere\"");
  ASSERT_TRUE(parsed.ok()) << parsed.ToStatus();
  const Rgb color = TextureColor(parsed.scene.textures,
                                 static_cast<std::int32_t>(parsed.scene.textures.size()) - 1, {});
  ExpectNear(color, 0.5 * 1.6605 - 0.4 * 0.5876 - 0.25 * 0.0728,
             -0.5 * 0.1246 + 0.4 * 1.1329 - 0.25 * 0.0083,
             -0.5 * 0.0182 - 0.4 * 0.1006 + 0.25 * 1.1187, 2e-4);
}

TEST(PbrtColorSpaceTest, BelongsToTheGraphicsState) {
  ExpectNear(IntensityOf("AttributeBegin ColorSpace \"rec2020\" AttributeEnd "
                         "LightSource \"point\" \"rgb I\" [1 0 0]"),
             1, 0, 0, 0);
  ExpectNear(IntensityOf("ColorSpace \"rec2020\" Attribute \"light\" \"rgb I\" [0 0 1] "
                         "ColorSpace \"srgb\" LightSource \"point\""),
             0, 0, 1.1187, 2e-4);
}

TEST(PbrtColorSpaceTest, AnotherOneIsIgnoredWithAWarning) {
  const ParsedScene parsed = ParseWorld("ColorSpace \"cmyk\" LightSource \"point\"");
  EXPECT_TRUE(parsed.ok());
  EXPECT_THAT(SaidOf(parsed),
              HasSubstr("warning: there is no colour space \"cmyk\", ColorSpace is ignored; there "
                        "are srgb, rec2020, dci-p3 and aces2065-1"));
}

TEST(PbrtOptionTest, ANameAndAValueAreRead) {
  for (const char* option :
       {"Option \"disablepixeljitter\" true", "Option \"seed\" 5",
        "Option \"rendercoordsys\" \"world\"", "Option \"bool disablepixeljitter\" true"}) {
    SCOPED_TRACE(option);
    const ParsedScene parsed =
        ParseWorld(std::string(option) + " Shape \"sphere\" LightSource \"point\"");
    EXPECT_TRUE(parsed.ok()) << parsed.ToStatus();
    EXPECT_EQ(parsed.scene.point_lights.size(), 1U);
    EXPECT_THAT(parsed.diagnostics.front().ToString(), HasSubstr("is ignored"));
  }
  EXPECT_FALSE(ParseWorld("Option \"x\"").ok());
  // It would make another picture.
  for (const char* const option : {"\"forcediffuse\" true", "\"bool forcediffuse\" true"})
    EXPECT_THAT(SaidOfWorld(std::string("Option ") + option),
                HasSubstr("warning: Option \"forcediffuse\" is ignored"));
  EXPECT_THAT(SaidOfWorld("Option \"forcediffuse\" false"), HasSubstr("note: Option"));
}

}  // namespace
}  // namespace lucerna
