// A scene of any size must reach the floors above the parser with lengths whose fourth powers are
// floats, exactly as its file has them but for a power of two.
#include "render/scene/scene_unit.h"

#include <cmath>
#include <string>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

#include "render/scene/pbrt_parser.h"
#include "render/scene/render_settings.h"
#include "render/scene/scene_extent.h"
#include "tests/support/memory_files.h"

namespace lucerna {
namespace {

using testing::HasSubstr;

// A triangle, a sphere and lights, all lengths times `scale`, moved by `offset` of them.
ParsedScene SceneOfSize(const std::string& scale, const std::string& offset = "0",
                        const std::string& intensity = "1") {
  const std::string text = "LookAt 0 0 -4  0 0 0  0 1 0\nScale " + scale + " " + scale + " " +
                           scale +
                           "\nCamera \"perspective\" \"float lensradius\" [0]\nWorldBegin\nScale " +
                           scale + " " + scale + " " + scale + "\nTranslate " + offset +
                           " 0 0\n"
                           "LightSource \"point\" \"point3 from\" [0 0 -1] \"float scale\" [" +
                           intensity +
                           "]\n"
                           "Shape \"trianglemesh\" \"point3 P\" [-1 -1 0  1 -1 0  0 1.5 0]\n"
                           "Shape \"sphere\" \"float radius\" [0.75]\n";
  const std::string text =
      "LookAt 1e30 0 -4  1e30 0 0  0 1 0\n"
      "Camera \"perspective\" \"float lensradius\" [1e35]\nWorldBegin\nShape \"sphere\"\n";
  MemoryFiles files({{"scene.pbrt", text}});
  const ParsedScene camera = ParsePbrt(files, "scene.pbrt");
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
