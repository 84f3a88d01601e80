// A scene of any size must reach the floors above the parser with lengths whose fourth powers are
// floats, exactly as its file has them but for a power of two.
#include "render/formats/scene_unit.h"

#include <cmath>
#include <string>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

#include "render/formats/read_scene.h"
#include "render/scene/render_settings.h"
#include "render/scene/scene_extent.h"
#include "tests/support/memory_files.h"

namespace lucerna {
namespace {

using testing::HasSubstr;

ParsedScene Parse(const std::string& text) {
  MemoryFiles files({{"scene.pbrt", text}});
  return ReadScene(files, "scene.pbrt");
}

// A triangle, a sphere and a point light, all lengths times `scale`, moved by `offset` of them.
ParsedScene SceneOfSize(const std::string& scale, const std::string& offset = "0",
                        const std::string& intensity = "1") {
  const std::string scaled = "\nScale " + scale + " " + scale + " " + scale + "\n";
  return Parse("Camera \"perspective\"\nWorldBegin" + scaled + "Translate " + offset +
               " 0 0\n"
               "LightSource \"point\" \"point3 from\" [0 0 -1] \"float scale\" [" +
               intensity +
               "]\n"
               "Shape \"trianglemesh\" \"point3 P\" [-1 -1 0  1 -1 0  0 1.5 0]\n"
               "Shape \"sphere\" \"float radius\" [0.75]\n");
}

TEST(SceneUnitTest, CommonSizesKeepTheUnitOfTheFile) {
  for (const char* scale : {"0.001", "1", "1000"}) {
    const ParsedScene parsed = SceneOfSize(scale);
    ASSERT_TRUE(parsed.ok()) << parsed.ToStatus();
    EXPECT_EQ(parsed.scene.unit, 1) << scale;
  }
}

TEST(SceneUnitTest, EveryOtherSizeIsBroughtToTheSameExactly) {
  const double powers[] = {0x1p-100, 0x1p-66, 0x1p-30, 0x1p30, 0x1p66, 0x1p100};
  const char* texts[] = {"7.888609052210118e-31", "1.3552527156068805e-20",
                         "9.313225746154785e-10", "1073741824",
                         "7.378697629483821e19",  "1.2676506002282294e30"};
  for (std::size_t i = 0; i < 6; ++i) {
    const ParsedScene parsed = SceneOfSize(texts[i], "0", "0");
    ASSERT_TRUE(parsed.ok()) << parsed.ToStatus();
    // 1.5 becomes 1.5 * 2^10.
    EXPECT_EQ(parsed.scene.unit, powers[i] * 0x1p-10) << texts[i];
    EXPECT_EQ(parsed.scene.meshes[0].positions[2], Vec3(0, 1536, 0)) << texts[i];
    EXPECT_EQ(parsed.scene.spheres[0].radius, 768) << texts[i];
    EXPECT_EQ(parsed.scene.point_lights[0].position, Vec3(0, 0, -1024)) << texts[i];
  }
}

TEST(SceneUnitTest, ARadiusIsCheckedInTheUnitOfTheScene) {
  const ParsedScene parsed = SceneOfSize("1.3552527156068805e-20", "0", "0");
  RenderOverrides overrides;
  overrides.initial_radius = 1e-22;
  EXPECT_TRUE(ResolveSettings(overrides, parsed.scene).ok());
  overrides.initial_radius = 1e-2;
  EXPECT_FALSE(ResolveSettings(overrides, parsed.scene).ok());
}

TEST(SceneUnitTest, ALightThatIsTooStrongForSoSmallASceneIsRefused) {
  const ParsedScene parsed = SceneOfSize("1.3552527156068805e-20");
  EXPECT_FALSE(parsed.ok());
  EXPECT_THAT(std::string(parsed.ToStatus().message()), HasSubstr("too strong for the size"));
}

// A ray that begins beyond the range that Embree takes would end the coordinator.
TEST(SceneUnitTest, CamerasAndLightsStayWhereRaysMayBegin) {
  constexpr float kFarthest = 0x1p51F;
  const ParsedScene light = SceneOfSize("1", "1e30", "0");
  ASSERT_TRUE(light.ok()) << light.ToStatus();
  EXPECT_LE(MaxAbs(light.scene.point_lights[0].position), kFarthest);
  const ParsedScene camera = Parse(
      "LookAt 1e30 0 -4  1e30 0 0  0 1 0\n"
      "Camera \"perspective\" \"float lensradius\" [1e35]\nWorldBegin\nShape \"sphere\"\n");
  ASSERT_TRUE(camera.ok()) << camera.ToStatus();
  const auto lens = static_cast<float>(camera.scene.camera.lens_radius);
  EXPECT_LE(MaxAbs(camera.scene.camera.camera_to_world.Point({lens, lens, 0})), kFarthest);
}

TEST(SceneExtentTest, AFarSceneIsToldSoAndANearOneIsNot) {
  const auto said = [](const ParsedScene& parsed) {
    std::string all;
    for (const Diagnostic& diagnostic : parsed.diagnostics)
      all += diagnostic.ToString() + "\n";
    return all;
  };
  EXPECT_THAT(said(SceneOfSize("1", "300000")), HasSubstr("its own size from the origin"));
  EXPECT_THAT(said(SceneOfSize("1", "3000")), testing::Not(HasSubstr("from the origin")));
}

TEST(SceneExtentTest, CountsRoundShapesAsFarAsTheyReach) {
  const SceneExtent extent = ExtentOf(SceneOfSize("2", "3").scene);
  EXPECT_EQ(extent.largest, 8);
  EXPECT_DOUBLE_EQ(extent.from_origin, std::hypot(6, 0.5));
}

}  // namespace
}  // namespace lucerna
