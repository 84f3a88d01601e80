// A file that names a scene gives it another camera and another sky, whatever the scene's format
// and the handedness of its world; what is wrong with the file is said in one sentence.
#include "render/formats/view/view_reader.h"

#include <algorithm>
#include <array>
#include <bit>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

#include "render/formats/read_scene.h"
#include "render/math/equal_area_square.h"
#include "tests/support/memory_files.h"

namespace lucerna {
namespace {

using testing::HasSubstr;

constexpr const char* kPbrt =
    "LookAt 1 2 3  0 0 0  0 0 1 Camera \"perspective\" \"float lensradius\" 1\n"
    "WorldBegin LightSource \"infinite\"\n"
    "Shape \"sphere\"\n";
constexpr const char* kMitsuba =
    "<scene version=\"3.0.0\"><shape type=\"sphere\"><bsdf type=\"diffuse\"/></shape></scene>";
constexpr const char* kGltf =
    R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
                       "min": [0, 0, 0], "max": [1, 1, 0]}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"byteLength": 36, "uri": "data:application/octet-stream;base64,)"
    R"(AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]})";

constexpr Rgb kFront = {1, 2, 3}, kLeft = {4, 5, 6}, kRight = {7, 8, 9}, kBack = {10, 11, 12};
constexpr Rgb kTop = {13, 14, 15}, kBottom = {16, 17, 18};

// A sky of 32 x 16 pixels: quarters around, and 22.5 degrees at its top and bottom.
std::string Sky() {
  constexpr int kWidth = 32;
  constexpr int kHeight = 16;
  std::string bytes = "PF\n32 16\n-1.0\n";
  for (int row = kHeight - 1; row >= 0; --row) {
    for (int x = 0; x < kWidth; ++x) {
      const int eighth = x / (kWidth / 8);
      Rgb color = eighth == 1 || eighth == 2   ? kLeft
                  : eighth == 3 || eighth == 4 ? kFront
                  : eighth == 5 || eighth == 6 ? kRight
                                               : kBack;
      if (row < 2) color = kTop;
      if (row >= kHeight - 2) color = kBottom;
      for (const float channel : {color.r, color.g, color.b}) {
        const auto raw = std::bit_cast<std::array<char, sizeof(float)>>(channel);
        bytes.append(raw.data(), raw.size());
      }
    }
  }
  return bytes;
}

ParsedScene Read(const std::string& view) {
  MemoryFiles files(std::map<std::string, std::string>{{"room.view.json", view},
                                                       {"scene.pbrt", kPbrt},
                                                       {"scene.xml", kMitsuba},
                                                       {"scene.gltf", kGltf},
                                                       {"sky.pfm", Sky()}});
  return ReadScene(files, "room.view.json");
}

std::string ErrorOf(const std::string& view) {
  return std::string(Read(view).ToStatus().message());
}

// Of the scene's one infinite light.
Rgb SkyToward(const Scene& scene, Vec3 direction) {
  const InfiniteLight& light = scene.infinite_lights.at(0);
  const Vec3 in_map = {Dot(direction, light.axes.x), Dot(direction, light.axes.y),
                       Dot(direction, light.axes.z)};
  const Vec2 place = EqualAreaPlace(in_map);
  const int side = light.map->width;
  const auto pixel = [&](float at) {
    return std::min(static_cast<int>(at * static_cast<float>(side)), side - 1);
  };
  return light.map->At(pixel(place.x), pixel(place.y)) * light.radiance;
}

void ExpectNear(Vec3 a, Vec3 b) {
  EXPECT_LT(Length(a - b), 1e-5F) << a.x << " " << a.y << " " << a.z;
}

void ExpectColor(Rgb a, Rgb b) {
  EXPECT_LT(MaxChannel(a - b), 1e-4F) << a.r << " " << a.g << " " << a.b;
  EXPECT_LT(MaxChannel(b - a), 1e-4F) << a.r << " " << a.g << " " << a.b;
}

class ViewReaderTest : public testing::TestWithParam<const char*> {
 protected:
  std::string View(const std::string& rest) const {
    return std::string("{\"scene\": \"") + GetParam() + "\"" + rest + "}";
  }
  // Whether x × y = z looks as it does on paper.
  static bool IsRightHanded() { return std::string_view(GetParam()) != "scene.pbrt"; }
};

INSTANTIATE_TEST_SUITE_P(Formats, ViewReaderTest,
                         testing::Values("scene.pbrt", "scene.xml", "scene.gltf"));

TEST_P(ViewReaderTest, ACameraTakesThePlaceOfTheScenes) {
  const ParsedScene parsed =
      Read(View(R"(, "up": [0, 0, 2], "camera": {"from": [1, 2, 3], "to": [1, 7, 3], "fov": 25})"));
  ASSERT_TRUE(parsed.ok()) << parsed.ToStatus();
  const Camera& camera = parsed.scene.camera;
  EXPECT_EQ(camera.kind, Camera::Kind::kPerspective);
  EXPECT_EQ(camera.fov_deg, 25);
  EXPECT_EQ(camera.lens_radius, 0);
  ExpectNear(camera.camera_to_world.Point({0, 0, 0}), {1, 2, 3});
  ExpectNear(camera.camera_to_world.Vector({0, 0, 1}), {0, 1, 0});
  ExpectNear(camera.camera_to_world.Vector({0, 1, 0}), {0, 0, 1});
  // What the camera has on its right.
  ExpectNear(camera.camera_to_world.Vector({1, 0, 0}), {IsRightHanded() ? 1.0F : -1.0F, 0, 0});
}

TEST_P(ViewReaderTest, ThePictureIsTheSkyAndIsNotMirrored) {
  const ParsedScene parsed = Read(View(R"(, "camera": {"from": [0, 0, 5], "to": [0, 0, 0]},
                    "environment": {"image": "sky.pfm", "scale": 0.5})"));
  ASSERT_TRUE(parsed.ok()) << parsed.ToStatus();
  ASSERT_EQ(parsed.scene.infinite_lights.size(), 1U);
  const Transform& seen = parsed.scene.camera.camera_to_world;
  ExpectColor(SkyToward(parsed.scene, seen.Vector({0, 0, 1})), kFront * 0.5F);
  ExpectColor(SkyToward(parsed.scene, seen.Vector({1, 0, 0})), kRight * 0.5F);
  ExpectColor(SkyToward(parsed.scene, seen.Vector({-1, 0, 0})), kLeft * 0.5F);
  ExpectColor(SkyToward(parsed.scene, seen.Vector({0, 0, -1})), kBack * 0.5F);
  ExpectColor(SkyToward(parsed.scene, seen.Vector({0, 1, 0})), kTop * 0.5F);
  ExpectColor(SkyToward(parsed.scene, seen.Vector({0, -1, 0})), kBottom * 0.5F);
}

// Seen from above counter-clockwise: what was in front is on the left then.
TEST_P(ViewReaderTest, ThePictureTurnsAboutTheUpwardDirection) {
  const ParsedScene parsed =
      Read(View(R"(, "up": [0, 0, 1], "camera": {"from": [0, 0, 0], "to": [0, 3, 0]},
                    "environment": {"image": "sky.pfm", "turn": 90})"));
  ASSERT_TRUE(parsed.ok()) << parsed.ToStatus();
  const Transform& seen = parsed.scene.camera.camera_to_world;
  ExpectColor(SkyToward(parsed.scene, seen.Vector({-1, 0, 0})), kFront);
  ExpectColor(SkyToward(parsed.scene, seen.Vector({0, 0, 1})), kRight);
  ExpectColor(SkyToward(parsed.scene, {0, 0, 1}), kTop);
}

TEST_P(ViewReaderTest, AColorIsAnEvenSky) {
  const ParsedScene parsed = Read(View(R"(, "camera": {"from": [0, 0, 5], "to": [0, 0, 0]},
                    "environment": {"color": [1, 2, 3], "scale": 2})"));
  ASSERT_TRUE(parsed.ok()) << parsed.ToStatus();
  ASSERT_EQ(parsed.scene.infinite_lights.size(), 1U);
  EXPECT_EQ(parsed.scene.infinite_lights[0].radiance, Rgb(2, 4, 6));
}

// What a view gives is not added by the way, with a warning.
TEST(ViewsOfObjectsTest, WhatAViewGivesIsNotMissing) {
  const ParsedScene bare = Read(R"({"scene": "scene.gltf"})");
  const ParsedScene seen = Read(R"({"scene": "scene.gltf",
      "camera": {"from": [0, 0, 5], "to": [0, 0, 0]}, "environment": {"color": [1, 1, 1]}})");
  ASSERT_TRUE(bare.ok() && seen.ok());
  EXPECT_EQ(bare.diagnostics.size(), 2U);
  EXPECT_EQ(bare.scene.infinite_lights.size(), 1U);
  EXPECT_TRUE(seen.diagnostics.empty());
}

TEST(ViewsOfObjectsTest, AViewWithoutChangesIsTheScene) {
  const ParsedScene parsed = Read(R"({"scene": "scene.pbrt"})");
  ASSERT_TRUE(parsed.ok());
  EXPECT_EQ(parsed.scene.camera.lens_radius, 1);
  ExpectNear(parsed.scene.camera.camera_to_world.Point({0, 0, 0}), {1, 2, 3});
}

TEST(ViewFilesTest, WhatIsWrittenIsRead) {
  SceneView view;
  view.up = {0, 0, 1};
  view.from = {1, 2, 3};
  view.to = {1, 7, 3};
  view.fov_deg = 12.5;
  view.environment = "sky.pfm";
  view.scale = 4;
  const ParsedScene parsed = Read(ViewFile("scene.pbrt", view));
  ASSERT_TRUE(parsed.ok()) << parsed.ToStatus();
  EXPECT_EQ(parsed.scene.camera.fov_deg, 12.5);
  ExpectNear(parsed.scene.camera.camera_to_world.Vector({0, 0, 1}), {0, 1, 0});
  ExpectColor(SkyToward(parsed.scene, {0, 0, 1}), kTop * 4);
}

TEST(ViewFilesTest, WhatIsWrongIsSaid) {
  const std::string camera = R"({"scene": "scene.pbrt", "camera": )";
  const std::string sky = R"({"scene": "scene.pbrt", "environment": )";
  EXPECT_THAT(ErrorOf("{"), HasSubstr("the JSON is damaged"));
  EXPECT_THAT(ErrorOf("[]"), HasSubstr("no object"));
  EXPECT_THAT(ErrorOf("{}"), HasSubstr("needs \"scene\""));
  EXPECT_THAT(ErrorOf(R"({"scene": "none.pbrt"})"), HasSubstr("none.pbrt"));
  EXPECT_THAT(ErrorOf(R"({"scene": "scene.pbrt", "sky": 1})"), HasSubstr("\"sky\""));
  EXPECT_THAT(ErrorOf(R"({"scene": "scene.pbrt", "up": [0, 0, 0]})"), HasSubstr("up"));
  EXPECT_THAT(ErrorOf(camera + R"({"from": [0, 0, 0]}})"), HasSubstr("\"to\""));
  EXPECT_THAT(ErrorOf(camera + R"({"from": [0, 0, 0], "to": [0, 9, 0]}})"),
              HasSubstr("parallel to the view"));
  EXPECT_THAT(ErrorOf(camera + R"({"from": [0, 0, 0], "to": [0, 0, 0]}})"), HasSubstr("camera"));
  EXPECT_THAT(ErrorOf(camera + R"({"from": [0, 0], "to": [0, 0, 1]}})"), HasSubstr("3 numbers"));
  EXPECT_THAT(ErrorOf(camera + R"({"from": [0, 0, 0], "to": [0, 0, 1], "fov": 180}})"),
              HasSubstr("fov"));
  EXPECT_THAT(ErrorOf(sky + "{}}"), HasSubstr("either"));
  EXPECT_THAT(ErrorOf(sky + R"({"image": "sky.pfm", "color": [1, 1, 1]}})"), HasSubstr("either"));
  EXPECT_THAT(ErrorOf(sky + R"({"image": "none.pfm"}})"), HasSubstr("none.pfm"));
  EXPECT_THAT(ErrorOf(sky + R"({"image": "sky.pfm", "scale": 1e25}})"), HasSubstr("too bright"));
}

// However files name one another, reading ends.
TEST(ViewFilesTest, AViewOfAViewIsRefused) {
  EXPECT_THAT(ErrorOf(R"({"scene": "room.view.json"})"), HasSubstr("another format"));
  MemoryFiles files(std::map<std::string, std::string>{
      {"points",
       "ply\nformat ascii 1.0\ncomment lucerna scene points\n"
       "comment lucerna spacing 1\nelement vertex 1\nproperty float x\n"
       "property float y\nproperty float z\nproperty float nx\nproperty float ny\n"
       "property float nz\nend_header\n0 0 0 0 0 1\n"}});
  EXPECT_THAT(std::string(ReadScene(files, "points").ToStatus().message()),
              HasSubstr("another format"));
}

}  // namespace
}  // namespace lucerna
