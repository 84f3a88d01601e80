// Media as pbrt files name them.
#include <map>
#include <string>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

#include "render/formats/read_scene.h"
#include "render/scene/density_grid.h"
#include "render/wire/block_codec.h"
#include "tests/support/pbrt_text.h"

namespace lucerna {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kTriangle =
    "Shape \"trianglemesh\" \"point3 P\" [0 0 0  1 0 0  0 1 0] \"integer indices\" [0 1 2]\n";
constexpr const char* kFog =
    "MakeNamedMedium \"fog\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [0.1 0.2 0.3] "
    "\"rgb sigma_s\" [1 2 3] \"float scale\" 2 \"float g\" -0.4\n";

TEST(PbrtMediaTest, HaveTheirCoefficients) {
  const Scene scene =
      ReadPbrt(std::string("Camera \"perspective\" WorldBegin\n") + kFog +
               "MediumInterface \"fog\" \"\" Material \"dielectric\"\n" + kTriangle);
  ASSERT_EQ(scene.media.size(), 1U);
  EXPECT_EQ(scene.media[0].name, "fog");
  EXPECT_FLOAT_EQ(scene.media[0].absorption.g, 0.4F);
  EXPECT_FLOAT_EQ(scene.media[0].scattering.b, 6);
  EXPECT_FLOAT_EQ(scene.media[0].g, -0.4F);
}

TEST(PbrtMediaTest, AreAroundCameraAndLightsAndOnTheSidesOfShapes) {
  const Scene scene = ReadPbrt(std::string(kFog) +
                               "MediumInterface \"\" \"fog\" Camera \"perspective\" WorldBegin\n"
                               "LightSource \"point\" AttributeBegin MediumInterface \"\" \"\"\n"
                               "LightSource \"spot\" AttributeEnd\n" +
                               kTriangle + "MediumInterface \"fog\"\n" + kTriangle);
  EXPECT_EQ(scene.camera.medium, 0);
  EXPECT_EQ(scene.point_lights[0].medium, 0);
  EXPECT_EQ(scene.spot_lights[0].medium, kNoMedium);
  EXPECT_EQ(scene.meshes[0].traits.medium_inside, kNoMedium);
  EXPECT_EQ(scene.meshes[0].traits.medium_outside, 0);
  EXPECT_TRUE(scene.meshes[0].traits.SeparatesMedia());
  EXPECT_FALSE(scene.meshes[1].traits.SeparatesMedia());
}

TEST(PbrtMediaTest, AreForgottenWhereNothingIsInThem) {
  const Scene scene =
      ReadPbrt(std::string("Camera \"perspective\" WorldBegin\n") + kFog + kTriangle);
  EXPECT_TRUE(scene.media.empty());
}

TEST(PbrtMediaTest, InterfacesThatSeparateNoneAreDropped) {
  for (const char* name : {"interface", "none", ""}) {
    const std::string interface = std::string("Material \"") + name + "\"\n";
    const Scene scene =
        ReadPbrt(std::string("Camera \"perspective\" WorldBegin\n") + kFog + kTriangle + interface +
                 kTriangle + "MediumInterface \"fog\" \"\"\n" + kTriangle);
    ASSERT_EQ(scene.meshes.size(), 2U) << name;
    EXPECT_TRUE(scene.meshes[1].traits.SeparatesMedia());
  }
  EXPECT_THAT(
      SaidOfWorld(std::string("AreaLightSource \"diffuse\" Material \"interface\"\n") + kTriangle),
      HasSubstr("warning: shapes of the material interface emit no light: 1"));
}

TEST(PbrtMediaTest, AnEndlessMediumHidesLightsFromInfinity) {
  const std::string dark = "the medium \"fog\" around the scene has no end";
  const auto said = [](const std::string& before, const std::string& world) {
    return SaidOfPbrt(kFog + before + " Camera \"perspective\" WorldBegin " + world);
  };
  const std::string sky = "LightSource \"infinite\" ";
  const std::string ball = "Shape \"sphere\" ";
  EXPECT_THAT(said("MediumInterface \"\" \"fog\"", sky + ball), HasSubstr(dark));
  EXPECT_THAT(said("", sky + "MediumInterface \"\" \"fog\" " + ball), HasSubstr(dark));
  EXPECT_THAT(said("MediumInterface \"\" \"fog\"", "LightSource \"distant\" " + ball),
              HasSubstr(dark));
  EXPECT_THAT(said("MediumInterface \"\" \"fog\"", "LightSource \"point\" " + ball),
              Not(HasSubstr(dark)));
  // A room of fog.
  EXPECT_THAT(said("MediumInterface \"\" \"fog\"", sky + "MediumInterface \"fog\" \"\" " + ball),
              Not(HasSubstr(dark)));
  EXPECT_THAT(said("", sky + "AttributeBegin MediumInterface \"fog\" \"\" " + ball +
                           "AttributeEnd MediumInterface \"\" \"fog\" " + ball),
              Not(HasSubstr(dark)));
  // What takes no red lets it through.
  EXPECT_THAT(SaidOfPbrt("MakeNamedMedium \"fog\" \"string type\" \"homogeneous\" \"rgb sigma_a\" "
                         "[0 1 1] \"rgb sigma_s\" [0 0 0] MediumInterface \"fog\" Camera "
                         "\"perspective\" WorldBegin " +
                         sky + ball),
              Not(HasSubstr(dark)));
}

// The unit of a scene that is a million kilometres wide is not a metre: coefficients follow.
TEST(PbrtMediaTest, KeepTheirOpticalThicknessInAnotherUnit) {
  const Scene scene = ReadPbrt(
      std::string("Camera \"perspective\" WorldBegin\n") + kFog +
      "MediumInterface \"fog\" \"\" Material \"dielectric\" Scale 1e15 1e15 1e15\n" + kTriangle);
  ASSERT_NE(scene.unit, 1);
  EXPECT_FLOAT_EQ(scene.media[0].scattering.r, static_cast<float>(2 * scene.unit));
}

TEST(PbrtMediaTest, WhatIsWrongIsSaid) {
  EXPECT_THAT(SaidOfWorld("MakeNamedMedium \"m\""), HasSubstr("needs \"string type\""));
  for (const char* const grid : {"rgbgrid", "nanovdb"}) {
    const std::string type = std::string("\"") + grid + "\"";
    EXPECT_THAT(SaidOfWorld("MakeNamedMedium \"m\" \"string type\" " + type),
                AllOf(HasSubstr(type + ", which is not supported"), HasSubstr("uniformgrid here")));
  }
  EXPECT_THAT(
      SaidOfWorld("MakeNamedMedium \"m\" \"string type\" \"smoke\""),
      HasSubstr("\"smoke\", which is not supported; there are homogeneous, uniformgrid and cloud"));
  EXPECT_THAT(SaidOfWorld("MediumInterface \"m\" \"\" Shape \"sphere\""),
              HasSubstr("error: there is no medium \"m\""));
  EXPECT_THAT(SaidOfPbrt("MediumInterface \"m\" Camera \"perspective\" WorldBegin"),
              HasSubstr("error: there is no medium \"m\""));
  EXPECT_THAT(SaidOfWorld("MediumInterface \"m\" LightSource \"point\""),
              HasSubstr("error: there is no medium \"m\""));
  EXPECT_THAT(SaidOfWorld("AttributeBegin MediumInterface \"m\" AttributeEnd Shape \"sphere\""),
              HasSubstr("warning: there is no medium \"m\"; nothing is in it"));
  EXPECT_THAT(SaidOfWorld(std::string(kFog) + kFog), HasSubstr("is defined twice"));
  EXPECT_THAT(
      SaidOfWorld(
          "MakeNamedMedium \"m\" \"string type\" \"homogeneous\" \"string preset\" \"Milk\""),
      HasSubstr("\"Milk\", which is not known; there are Apple"));
  const Scene milk = ReadWorld(
      "MakeNamedMedium \"m\" \"string type\" \"homogeneous\" \"string preset\" \"Wholemilk\" "
      "\"float scale\" 2 MediumInterface \"m\" \"\" Material \"interface\" Shape \"sphere\"");
  ASSERT_EQ(milk.media.size(), 1U);
  EXPECT_NEAR(milk.media[0].scattering.r, 2 * 2.55F, 1e-5F);
  EXPECT_NEAR(milk.media[0].absorption.b, 2 * 0.014F, 1e-6F);
  EXPECT_THAT(
      SaidOfWorld("MakeNamedMedium \"m\" \"string type\" \"homogeneous\" \"rgb Le\" [1 1 1]"),
      HasSubstr("media do not emit light"));
  EXPECT_THAT(
      SaidOfWorld("MakeNamedMedium \"m\" \"string type\" \"homogeneous\" \"float g\" 0.995"),
      HasSubstr("g"));
}

// pbrt-v4's defaults: one point in the unit cube of the directive's space.
TEST(PbrtMediaTest, DensitiesLieInTheSpaceOfTheirDirective) {
  const Scene scene = ReadWorld(
      "AttributeBegin Translate 10 0 0 Scale 2 2 2 MakeNamedMedium \"m\" \"string type\" "
      "\"uniformgrid\" \"integer nx\" 2 \"integer nz\" 1 \"point3 p0\" [1 1 1] \"point3 p1\" [0 0 "
      "0] "
      "\"float density\" [0.5 4] \"rgb sigma_s\" [1 2 3] \"float scale\" 3 AttributeEnd "
      "MediumInterface \"m\" \"\" Material \"interface\" Shape \"sphere\"");
  ASSERT_EQ(scene.media.size(), 1U);
  const Medium& medium = scene.media[0];
  ASSERT_NE(medium.density, nullptr);
  EXPECT_FLOAT_EQ(medium.scattering.b, 9);
  EXPECT_FLOAT_EQ(medium.absorption.b, 3);
  EXPECT_NEAR(medium.density->At({10.5F, 1, 1}), 0.5, 1e-6);
  EXPECT_NEAR(medium.density->At({11.5F, 1, 1}), 4, 1e-6);
  EXPECT_NEAR(medium.density->At({11, 1, 1}), 2.25, 1e-6);
  EXPECT_EQ(medium.density->At({12.1F, 1, 1}), 0);
  // Lengths are the world's: a column of world length at density.
  EXPECT_NEAR(medium.Column({10.5F, 1, -5}, {0, 0, 1}, HUGE_VALF), 0.5 * 0.75 * 2, 1e-5);
}

TEST(PbrtMediaTest, DensitiesFollowTheUnitOfTheScene) {
  const Scene scene = ReadWorld(
      "Scale 1e15 1e15 1e15 MakeNamedMedium \"m\" \"string type\" \"uniformgrid\" "
      "\"float density\" 2 MediumInterface \"m\" \"\" Material \"interface\" Shape \"sphere\"");
  ASSERT_NE(scene.unit, 1);
  const auto middle = static_cast<float>(0.5e15 / scene.unit);
  EXPECT_NEAR(scene.media[0].density->At({middle, middle, middle}), 2, 1e-5);
  EXPECT_NEAR(
      static_cast<double>(scene.media[0].Column({-middle, middle, middle}, {1, 0, 0}, HUGE_VALF)) *
          scene.unit / 1e15,
      1.5, 1e-5);
}

TEST(PbrtMediaTest, WhatIsWrongInAGridIsSaid) {
  const auto said = [](const std::string& rest) {
    return SaidOfWorld("MakeNamedMedium \"m\" \"string type\" \"uniformgrid\" " + rest);
  };
  EXPECT_THAT(said(""), HasSubstr("needs \"float density\""));
  EXPECT_THAT(said("\"float density\" [1 2 3] \"integer nx\" 2 \"integer ny\" 2"),
              HasSubstr("has 3 values; nx * ny * nz is 4"));
  EXPECT_THAT(said("\"float density\" [1 -2] \"integer nx\" 2"),
              HasSubstr("has the negative value -2"));
  EXPECT_THAT(said("\"float density\" 1 \"integer nx\" 0"), HasSubstr("nx"));
  EXPECT_THAT(said("\"float density\" 1 \"integer nx\" 1000000 \"integer ny\" 1000000 "
                   "\"integer nz\" 1000000"),
              HasSubstr("nx * ny * nz is 1000000000000000000"));
  EXPECT_THAT(said("\"float density\" 1 \"point3 p1\" [1 0 1]"), HasSubstr("flat"));
  EXPECT_THAT(said("\"float density\" 0"), HasSubstr("0 everywhere"));
  EXPECT_THAT(said("\"float density\" 1e30 \"float scale\" 1e30"), HasSubstr("too large"));
  EXPECT_THAT(said("\"float density\" 1 \"rgb Le\" [1 1 1]"), HasSubstr("media do not emit light"));
  EXPECT_THAT(said("\"float density\" 1 \"float temperature\" 900"),
              HasSubstr("media do not emit light"));
  EXPECT_EQ(said("\"float density\" 1 \"rgb Le\" [1 1 1] \"float Lescale\" 0").find("Le"),
            std::string::npos);
  EXPECT_THAT(SaidOfWorld("Scale 1 0 1 MakeNamedMedium \"m\" \"string type\" \"uniformgrid\" "
                          "\"float density\" 1"),
              HasSubstr("has no place"));
}

HitpointBlock BlockWithSegments() {
  HitpointBlock block;
  block.positions = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  block.normals_oct = {0, 0, 0};
  block.segments = {{{4, 5, 6}, 1, 0.5F}, {{7, 8, 9}, 0, 1}};
  return block;
}

TEST(BlockCodecTest, BringsSegmentsBack) {
  const HitpointBlock block = BlockWithSegments();
  EXPECT_EQ(block.first_segment(), 1U);
  const auto decoded = DecodeHitpointBlock(EncodeHitpointBlock(block), block.size());
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(*decoded, block);
}

TEST(BlockCodecTest, RefusesSegmentsThatAreNone) {
  const auto is_refused = [](const HitpointBlock& block) {
    return DecodeHitpointBlock(EncodeHitpointBlock(block), 3).status().code() ==
           absl::StatusCode::kInvalidArgument;
  };
  HitpointBlock block = BlockWithSegments();
  block.segments[0].end.x = HUGE_VALF;
  EXPECT_TRUE(is_refused(block));
  block = BlockWithSegments();
  block.segments[1].narrowing = 1.5F;
  EXPECT_TRUE(is_refused(block));
  block.segments[1].narrowing = 0;
  EXPECT_TRUE(is_refused(block));
  block = BlockWithSegments();
  block.segments.push_back({});
  block.segments.push_back({});
  EXPECT_TRUE(is_refused(block));
}

}  // namespace
}  // namespace lucerna
