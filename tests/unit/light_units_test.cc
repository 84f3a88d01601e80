// Powers and illuminances that a pbrt-v4 text gives are those of the light, whatever its kind.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

#include "render/formats/read_scene.h"
#include "render/geometry/intersector.h"
#include "render/math/color_space.h"
#include "render/math/rng.h"
#include "render/math/warp.h"
#include "render/transport/light.h"
#include "render/transport/working_space.h"
#include "tests/support/memory_files.h"

namespace lucerna {
namespace {

using ::testing::HasSubstr;

// Colours, rows from the top.
std::string Pfm(int width, int height, float factor) {
  std::string bytes = "PF\n" + std::to_string(width) + " " + std::to_string(height) + "\n-1\n";
  for (int i = 0; i < width * height; ++i) {
    const float value = factor * static_cast<float>(i * 5 % 7);
    for (const float channel : {value, 0.5F * value, 0.2F}) {
      char raw[4];
      std::memcpy(raw, &channel, 4);
      bytes.append(raw, 4);
    }
  }
  return bytes;
}

ParsedScene Parse(const std::string& world) {
  // Disks far below and above, so that photons have a scene.
  MemoryFiles files({{"s.pbrt", "Camera \"perspective\" WorldBegin\nAttributeBegin " + world +
                                    "\nAttributeEnd Shape \"disk\" \"float height\" -20 "
                                    "Shape \"disk\" \"float height\" 20"},
                     {"a.pfm", Pfm(5, 4, 1)},
                     {"square.pfm", Pfm(6, 6, 1)},
                     {"black.pfm", Pfm(2, 2, 0)},
                     {"huge.pfm", Pfm(2, 2, 1e25F)}});
  return ReadScene(files, "s.pbrt");
}

struct LitWorld {
  explicit LitWorld(const std::string& world) {
    const ParsedScene parsed = Parse(world);
    EXPECT_TRUE(parsed.ok()) << world << parsed.ToStatus();
    scene = std::make_unique<Scene>(InWorkingSpace(parsed.scene));
    intersector = Intersector::Create(*scene).value();
    lights = std::make_unique<LightSet>(*scene, *intersector);
  }
  [[nodiscard]] double Power() const {
    const Rgb working = lights->TotalPower();
    const auto power = ToRec709({static_cast<double>(working.r), static_cast<double>(working.g),
                                 static_cast<double>(working.b)});
    return 0.2126 * power[0] + 0.7152 * power[1] + 0.0722 * power[2];
  }

  std::unique_ptr<Scene> scene;
  std::unique_ptr<Intersector> intersector;
  std::unique_ptr<LightSet> lights;
};

const char* const kShapes =
    " Shape \"trianglemesh\" \"integer indices\" [ 0 1 2 0 2 3 ] \"point2 uv\" [ 0 0 1 0 1 1 0 1 ] "
    "\"point3 P\" [ 0 0 0 3 0 0 3 2 0 0 2 0 ]";

TEST(LightUnitsTest, PowerIsThatOfTheLight) {
  const auto area = [](const std::string& parameters, const std::string& shape) {
    return "AreaLightSource \"diffuse\" " + parameters + shape;
  };
  const std::string picture = "\"string filename\" \"a.pfm\" ";
  const std::string even = "\"rgb L\" [ 1 1 1 ] ";
  struct Case {
    std::string world;
    double expected;
  };
  const std::vector<Case> cases = {
      {"LightSource \"point\" \"float power\" 7", 7},
      {"LightSource \"point\" \"float power\" 7 \"float scale\" 3 \"rgb I\" [ 2 2 2 ]", 42},
      {"LightSource \"point\" \"float power\" 7 \"blackbody I\" 3000", 7},
      {"LightSource \"spot\" \"float power\" 7", 7},
      {"LightSource \"spot\" \"float power\" 7 \"float coneangle\" 80 \"float conedeltaangle\" 80",
       7},
      {"LightSource \"goniometric\" \"string filename\" \"square.pfm\" \"float power\" 7", 7},
      {"LightSource \"projection\" \"float fov\" 120 \"float power\" 7 " + picture, 7},
      {area(even + "\"float power\" 7", " Shape \"sphere\" \"float radius\" 3"), 7},
      {area(even + "\"float power\" 7 \"bool twosided\" true", " Shape \"disk\""), 7},
      {area(even + "\"float power\" 7", kShapes), 7},
      {area(picture + "\"float power\" 7", kShapes), 7},
      {area(picture + "\"float power\" 7 \"bool twosided\" true \"float scale\" 2", kShapes), 14},
      {area(picture, kShapes), 6 * kPi64 * (3.05 * (0.2126 + 0.5 * 0.7152) + 0.2 * 0.0722)},
  };
  for (const Case& c : cases) {
    EXPECT_NEAR(LitWorld(c.world).Power(), c.expected, 1e-3 * c.expected) << c.world;
  }
}

// On a plane that looks up, near the origin.
double IlluminanceOf(const std::string& world) {
  const LitWorld lit(world);
  KeyedRng rng(3);
  constexpr int kSamples = 200'000;
  double sum = 0;
  for (int i = 0; i < kSamples; ++i) {
    LightSample sample;
    const auto choice = static_cast<double>(rng.Uniform());
    const float u1 = rng.Uniform();
    if (!lit.lights->SampleDirect({0, 0, 0}, choice, u1, rng.Uniform(), sample)) continue;
    const Rgb working = sample.radiance_over_pdf * std::max(0.0F, sample.wi.z);
    const auto light = ToRec709({static_cast<double>(working.r), static_cast<double>(working.g),
                                 static_cast<double>(working.b)});
    sum += 0.2126 * light[0] + 0.7152 * light[1] + 0.0722 * light[2];
  }
  return sum / kSamples;
}

TEST(LightUnitsTest, IlluminanceIsWhatArrives) {
  struct Case {
    std::string world;
    double expected;
  };
  const std::string down = "\"point3 from\" [ 0 0 1 ] \"point3 to\" [ 0 0 0 ] ";
  const std::vector<Case> cases = {
      {"LightSource \"distant\" \"float illuminance\" 5 " + down, 5},
      {"LightSource \"distant\" \"float illuminance\" 5 \"rgb L\" [ 2 2 2 ] \"float scale\" 3 " +
           down,
       30},
      {"LightSource \"distant\" \"float illuminance\" 5 \"blackbody L\" 3000 " + down, 5},
      {"LightSource \"infinite\" \"float illuminance\" 5", 5},
      {"LightSource \"infinite\" \"float illuminance\" 5 \"rgb L\" [ 2 2 2 ]", 10},
      // pbrt-v4 takes half the illuminance of a map, and so makes it twice as bright.
      {"LightSource \"infinite\" \"float illuminance\" 5 \"string filename\" \"square.pfm\"", 10},
      {"LightSource \"infinite\" \"float illuminance\" 5 \"float scale\" 2 \"string filename\" "
       "\"square.pfm\"",
       20},
      // Through a portal that takes up nearly all of the sky.
      {"LightSource \"infinite\" \"float illuminance\" 5 \"string filename\" \"square.pfm\" "
       "\"point3 portal\" [ -1e4 -1e4 1  -1e4 1e4 1  1e4 1e4 1  1e4 -1e4 1 ]",
       10},
      // To pbrt-v4 a map of one pixel, whose middle looks up.
      {"LightSource \"infinite\" \"float illuminance\" 5 \"rgb L\" [ 2 2 2 ] "
       "\"point3 portal\" [ -1e4 -1e4 1  -1e4 1e4 1  1e4 1e4 1  1e4 -1e4 1 ]",
       2.5},
  };
  for (const Case& c : cases) {
    // Of the samples' cosines the mean has a standard error of about a part in a thousand; a map's
    // own figure is that of its pixels cut into 512 by 512.
    EXPECT_NEAR(IlluminanceOf(c.world), c.expected, 0.01 * c.expected) << c.world;
  }
}

// As in pbrt-v4 these have no such parameter, and it is said.
TEST(LightUnitsTest, OtherUnitsAreNotKnown) {
  const auto said = [](const std::string& world) {
    std::string all;
    for (const Diagnostic& diagnostic : Parse(world).diagnostics)
      all += diagnostic.ToString() + "\n";
    return all;
  };
  for (const std::string world :
       {"LightSource \"point\" \"float illuminance\" 1",
        "LightSource \"distant\" \"float power\" 1", "LightSource \"infinite\" \"float power\" 1",
        "AreaLightSource \"diffuse\" \"float illuminance\" 1"}) {
    EXPECT_THAT(said(world), HasSubstr("warning")) << world;
  }
}

TEST(LightUnitsTest, PicturesOfAreaLightsAreChecked) {
  const auto said = [](const std::string& parameters, const std::string& shape = "") {
    std::string all;
    for (const Diagnostic& diagnostic :
         Parse("AreaLightSource \"diffuse\" " + parameters + shape).diagnostics)
      all += diagnostic.ToString() + "\n";
    return all;
  };
  EXPECT_THAT(said("\"string filename\" \"a.pfm\" \"rgb L\" [ 1 1 1 ]"),
              HasSubstr("exclude each other"));
  EXPECT_THAT(said("\"string filename\" \"none.pfm\""), HasSubstr("cannot be read"));
  EXPECT_THAT(said("\"string filename\" \"huge.pfm\""), HasSubstr("too bright"));
  EXPECT_THAT(said("\"string filename\" \"a.pfm\" \"float scale\" 1e30"), HasSubstr("too bright"));
  EXPECT_THAT(said("\"string filename\" \"a.pfm\"",
                   " Shape \"trianglemesh\" \"point3 P\" [ 0 0 0 1 0 0 1 1 0 ]"),
              HasSubstr("no uv"));
  EXPECT_EQ(said("\"string filename\" \"a.pfm\"", kShapes), "");
  const ParsedScene parsed = Parse(std::string("AreaLightSource \"diffuse\" \"string filename\" "
                                               "\"a.pfm\" \"float scale\" 2") +
                                   kShapes);
  ASSERT_TRUE(parsed.ok()) << parsed.ToStatus();
  const AreaLight& light = parsed.scene.area_lights.at(0);
  EXPECT_EQ(light.radiance, Gray(2));
  ASSERT_NE(light.picture, nullptr);
  EXPECT_EQ(light.largest_pixel, 6);
}

}  // namespace
}  // namespace lucerna
