// Orthographic and spherical cameras see what pbrt-v4's see.
#include <cmath>
#include <string>

#include "gtest/gtest.h"

#include "render/formats/read_scene.h"
#include "render/math/warp.h"
#include "tests/support/local_render.h"
#include "tests/support/memory_files.h"

namespace lucerna {
namespace {

Scene SceneOf(const std::string& text) {
  MemoryFiles files({{"s.pbrt", text}});
  ParsedScene parsed = ReadScene(files, "s.pbrt");
  EXPECT_TRUE(parsed.ok()) << parsed.ToStatus();
  return std::move(parsed.scene);
}

const std::string kFilm =
    "PixelFilter \"box\" Film \"rgb\" \"integer xresolution\" 64 \"integer yresolution\" 32\n";
const std::string kBall =
    "WorldBegin AreaLightSource \"diffuse\" \"rgb L\" [1 1 1] Shape \"sphere\" ";

// The share of pixels that see the light.
double LitShare(const Scene& scene) {
  RenderSettings settings = SettingsFor(scene);
  const Image image = RenderLocally(scene, settings, 4);
  double sum = 0;
  for (const float value : image.Find("G")->pixels)
    sum += static_cast<double>(value);
  return sum / (64 * 32);
}

TEST(CamerasTest, AnOrthographicCameraShowsDiscsAtAnyDistance) {
  // The window is 4 wide and 2 high.
  for (const char* distance : {"5", "50"}) {
    const Scene scene =
        SceneOf(std::string("LookAt 0 0 -") + distance + " 0 0 0 0 1 0 Camera \"orthographic\"" +
                kFilm + kBall + "\"float radius\" 0.5");
    EXPECT_NEAR(LitShare(scene), kPi64 * 0.25 / 8, 0.004) << distance;
  }
  const Scene windowed = SceneOf(
      "LookAt 0 0 -5 0 0 0 0 1 0 Camera \"orthographic\" \"float screenwindow\" [-2 0 -1 1]" +
      kFilm + kBall + "\"float radius\" 0.5");
  EXPECT_NEAR(LitShare(windowed), kPi64 * 0.25 / 2 / 4, 0.004);
}

TEST(CamerasTest, AnOrthographicWindowIsOfTheFilesUnit) {
  // So large a scene gets a unit of its own.
  const Scene scene = SceneOf(
      "LookAt 0 0 -5e9 0 0 0 0 1 0 Camera \"orthographic\" \"float "
      "screenwindow\" [-2e9 2e9 -1e9 1e9]" +
      kFilm + kBall + "\"float radius\" 5e8");
  EXPECT_GT(scene.unit, 1);
  EXPECT_NEAR(LitShare(scene), kPi64 * 0.25 / 8, 0.004);
}

TEST(CamerasTest, PixelFootprints) {
  Camera camera;
  camera.fov_deg = 90;
  EXPECT_NEAR(PixelFootprint(camera, 100, 100, 3), 3 * 0.02, 1e-12);
  camera.kind = Camera::Kind::kOrthographic;
  EXPECT_NEAR(PixelFootprint(camera, 100, 100, 3), 0.02, 1e-12);
  camera.kind = Camera::Kind::kEqualArea;
  EXPECT_NEAR(PixelFootprint(camera, 100, 100, 3), 3 * std::sqrt(4 * kPi64) / 100, 1e-12);
}

TEST(CamerasTest, ASphericalCameraSeesAllDirections) {
  // A ball of radius 1 at a distance of 2 fills a cone of 30 degrees: (1 - cos) / 2 of all.
  const double share = (1 - std::cos(kPi64 / 6)) / 2;
  for (const char* place : {"0 0 2", "2 0 0", "0 2 0", "-1.2 0 -1.6"}) {
    const Scene scene = SceneOf("Camera \"spherical\"" + kFilm + "WorldBegin Translate " + place +
                                " AreaLightSource \"diffuse\" \"rgb L\" [1 1 1] Shape \"sphere\"");
    EXPECT_NEAR(LitShare(scene), share, 0.006) << place;
  }
  // By longitude and latitude, the ball at the top fills the rows above 60 degrees.
  const Scene top = SceneOf(
      "Camera \"spherical\" \"string mapping\" \"equirectangular\"" + kFilm +
      "WorldBegin Translate 0 2 0 AreaLightSource \"diffuse\" \"rgb L\" [1 1 1] Shape \"sphere\"");
  EXPECT_NEAR(LitShare(top), 1.0 / 6, 0.006);
}

}  // namespace
}  // namespace lucerna
