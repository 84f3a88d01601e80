// A file of points on surfaces takes the place of a scene's camera; what is wrong with it is said
// in one sentence.
#include "render/formats/sensors/sensors_reader.h"

#include <array>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

#include "render/formats/read_scene.h"
#include "tests/support/memory_files.h"

namespace lucerna {
namespace {

using testing::HasSubstr;

constexpr const char* kScene =
    "LookAt 1 2 3  0 0 0  0 0 1 Camera \"perspective\" "
    "Film \"rgb\" \"integer xresolution\" 640 \"float iso\" 400 \"float cropwindow\" [0 .5 0 1]\n"
    "WorldBegin LightSource \"point\"\n"
    "Shape \"sphere\"\n";

ParsedScene Read(const std::string& sensors, const std::string& scene = kScene) {
  std::map<std::string, std::string> named;
  named["points.ply"] = sensors;
  named["scene.pbrt"] = scene;
  MemoryFiles files(std::move(named));
  return ReadScene(files, "points.ply");
}

std::string File(const std::string& comments, const std::string& rows, int count) {
  return "ply\nformat ascii 1.0\n" + comments + "element vertex " + std::to_string(count) +
         "\nproperty float x\nproperty float y\nproperty float z\n"
         "property float nx\nproperty float ny\nproperty float nz\nend_header\n" +
         rows;
}
constexpr const char* kComments =
    "comment lucerna scene scene.pbrt\ncomment lucerna spacing 0.25\n";

std::string ErrorOf(const std::string& sensors) {
  return std::string(Read(sensors).ToStatus().message());
}

TEST(SensorsReaderTest, PointsReplaceTheCamera) {
  const ParsedScene parsed =
      Read(File(kComments, "0 0 1 0 0 1\n1 0 0 1 0 0\n0 1 0 0 2.001 0\n", 2));
  ASSERT_TRUE(parsed.ok()) << parsed.ToStatus();
  const Scene& scene = parsed.scene;
  EXPECT_EQ(scene.camera.kind, Camera::Kind::kSensors);
  EXPECT_EQ(PixelFootprint(scene.camera, 1, 2, 9), 0.25);
  ASSERT_EQ(scene.sensors.size(), 2U);
  EXPECT_EQ(scene.sensors[1], (Sensor{{1, 0, 0}, {1, 0, 0}, 0.25F}));
  EXPECT_EQ(scene.film.width * scene.film.height, 2);
  EXPECT_EQ(scene.film.crop_x1, scene.film.width);
  EXPECT_EQ(scene.film.exposure, 1);
  EXPECT_EQ(scene.spheres.size(), 1U);
}

TEST(SensorsReaderTest, WhatIsWrittenIsRead) {
  const std::vector<Sensor> sensors = {
      {{1, 2, 3}, {0, 0, 1}, 0.5F}, {{4, 5, 6}, {0.6F, 0.8F, 0}, 2}, {{7, 8, 9}, {-1, 0, 0}, 1}};
  const std::vector<std::array<Vec3, 2>> borders = {{Vec3{0, 1, 2}, Vec3{3, 4, 5}}};
  const std::vector<SensorBucket> buckets = {
      {{Vec3{0, 0, 0}, Vec3{1, 0, 0}, Vec3{0, 1, 0}}, {}, 0},
      {{Vec3{0, 0, 1}, Vec3{1, 0, 1}, Vec3{0, 1, 1}}, {1, 2, 3}, 4},
      {{Vec3{5, 6, 7}, Vec3{8, 9, 10}, Vec3{11, 12, 13}}, {}, 0}};
  const ParsedScene parsed = Read(SensorsFile("scene.pbrt", {sensors, buckets, borders}));
  ASSERT_TRUE(parsed.ok()) << parsed.ToStatus();
  EXPECT_EQ(parsed.scene.sensors, sensors);
  EXPECT_EQ(parsed.scene.sensor_buckets, buckets);
  EXPECT_EQ(parsed.scene.sensor_borders, borders);
  EXPECT_EQ(parsed.scene.film.width, 2);
  EXPECT_EQ(parsed.scene.film.height, 2);
}

TEST(SensorsReaderTest, FollowTheUnitOfTheScene) {
  const SensorBucket bucket = {
      {Vec3{0, 0, 3e10F}, Vec3{0, 0, 0}, Vec3{0, 0, 0}}, {0, 0, 3e10F}, 3e10F};
  const ParsedScene parsed = Read(SensorsFile("scene.pbrt", {{{{0, 0, 3e10F}, {0, 0, 1}, 1e9F}},
                                                             {bucket},
                                                             {{Vec3{0, 0, 0}, Vec3{0, 0, 3e10F}}}}),
                                  "Camera \"perspective\" WorldBegin LightSource \"distant\"\n"
                                  "Shape \"sphere\" \"float radius\" 3e10\n");
  ASSERT_TRUE(parsed.ok()) << parsed.ToStatus();
  const Scene& scene = parsed.scene;
  ASSERT_NE(scene.unit, 1);
  EXPECT_EQ(static_cast<double>(scene.sensors[0].position.z) * scene.unit, 3e10F);
  EXPECT_EQ(static_cast<double>(scene.sensors[0].spacing) * scene.unit, 1e9F);
  EXPECT_EQ(scene.sensor_borders[0][1].z, scene.sensors[0].position.z);
  EXPECT_EQ(scene.sensor_buckets[0].corners[0], scene.sensors[0].position);
  EXPECT_EQ(scene.sensor_buckets[0].ball_center, scene.sensors[0].position);
  EXPECT_EQ(scene.sensor_buckets[0].ball_radius, scene.sensors[0].position.z);
  EXPECT_EQ(scene.spheres[0].radius, scene.sensors[0].position.z);
}

TEST(SensorsReaderTest, SaysWhatIsMissing) {
  const std::string row = "0 0 1 0 0 1\n";
  EXPECT_THAT(ErrorOf(File("", row, 1)), HasSubstr("does not name a scene"));
  EXPECT_THAT(ErrorOf(File("comment lucerna scene scene.pbrt\n", row, 1)),
              HasSubstr("no distance between points"));
  for (const std::string spacing : {"0", "-1", "nan", "inf", "far"}) {
    EXPECT_THAT(
        ErrorOf(File("comment lucerna scene scene.pbrt\ncomment lucerna spacing " + spacing + "\n",
                     row, 1)),
        HasSubstr("no distance between points"))
        << spacing;
  }
  EXPECT_THAT(
      ErrorOf(File("comment lucerna scene other.pbrt\ncomment lucerna spacing 1\n", row, 1)),
      HasSubstr("other.pbrt"));
  EXPECT_THAT(ErrorOf(File("comment lucerna scene ../x.pbrt\ncomment lucerna spacing 1\n", row, 1)),
              HasSubstr(".."));
  EXPECT_THAT(
      ErrorOf(File("comment lucerna scene points.ply\ncomment lucerna spacing 1\n", row, 1)),
      HasSubstr("name one in another format"));
  EXPECT_THAT(ErrorOf(File(kComments, "", 0)), HasSubstr("no points"));
  EXPECT_THAT(ErrorOf(File(kComments, "0 0 1 0 0 0\n", 1)), HasSubstr("normal of point 0"));
  EXPECT_THAT(ErrorOf(File(kComments, "0 0 1 0 0 3\n", 1)), HasSubstr("normal of point 0"));
  EXPECT_THAT(ErrorOf(SensorsFile(
                  "scene.pbrt", {{{{}, {0, 0, 1}, 1}, {{}, {0, 0, 1}, 1}}, {SensorBucket()}, {}})),
              HasSubstr("1 buckets for 2 points"));
  SensorBucket infinite;
  infinite.corners[1].y = HUGE_VALF;
  EXPECT_THAT(ErrorOf(SensorsFile("scene.pbrt", {{{{}, {0, 0, 1}, 1}}, {infinite}, {}})),
              HasSubstr("bucket 0 is not finite"));
  const std::string segments =
      "ply\nformat ascii 1.0\ncomment lucerna scene scene.pbrt\ncomment lucerna spacing 1\n"
      "element segment 1\nproperty float ax\nproperty float ay\nproperty float az\n"
      "property float bx\nproperty float by\nproperty float bz\nend_header\n0 0 0 1 inf 1\n";
  EXPECT_THAT(ErrorOf(segments), HasSubstr("segment 0 is not finite"));
  EXPECT_THAT(ErrorOf(File(kComments, "nan 0 1 0 0 1\n", 1)), HasSubstr("position of vertex 0"));
  EXPECT_THAT(ErrorOf(File(kComments, row, 4000000)), HasSubstr("more than its"));
  EXPECT_THAT(ErrorOf("ply\n"), HasSubstr("end_header"));
}

}  // namespace
}  // namespace lucerna
