// Which scenes are rendered with wavelengths unless a job says otherwise?
#include "render/scene/saturated_colors.h"

#include <string>
#include <vector>

#include "gtest/gtest.h"

#include "render/scene/render_settings.h"
#include "tests/support/pbrt_text.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

Scene WallScene(Rgb reflectance) {
  Scene scene;
  Material wall = DiffuseMaterial(0);
  wall.reflectance = reflectance;
  AddMaterial(scene, wall);
  return scene;
}

TEST(SaturatedColorsTest, OfReflectances) {
  EXPECT_TRUE(HasSaturatedColors(WallScene({0.63F, 0.065F, 0.05F})));
  EXPECT_FALSE(HasSaturatedColors(WallScene({0.6F, 0.3F, 0.2F})));
  EXPECT_FALSE(HasSaturatedColors(WallScene({0.5F, 0.5F, 0.5F})));
  // As good as black.
  EXPECT_FALSE(HasSaturatedColors(WallScene({0.01F, 0, 0})));
}

TEST(SaturatedColorsTest, OfWhatATextureReplacesNothingIsSaid) {
  Scene scene = WallScene({1, 0, 0});
  scene.materials[0].texture = 0;
  EXPECT_FALSE(HasSaturatedColors(scene));
}

TEST(SaturatedColorsTest, OfLightsHoweverFaint) {
  Scene scene;
  scene.point_lights.push_back({.position = {}, .intensity = {1e-5F, 1e-5F, 1e-5F}});
  EXPECT_FALSE(HasSaturatedColors(scene));
  scene.point_lights.push_back({.position = {}, .intensity = {1e-6F, 1e-6F, 1e-5F}});
  EXPECT_TRUE(HasSaturatedColors(scene));
}

// Copper has three reflectances that are its colour, gold has not.
TEST(SaturatedColorsTest, OfMetalsByWavelength) {
  const auto scene_with = [](const std::string& metal) {
    return ReadWorld("Material \"conductor\" " + metal + " Shape \"sphere\"");
  };
  const auto named = [](const std::string& name) {
    return "\"spectrum eta\" \"metal-" + name + "-eta\" \"spectrum k\" \"metal-" + name + "-k\"";
  };
  EXPECT_TRUE(HasSaturatedColors(scene_with(named("Au"))));
  EXPECT_FALSE(HasSaturatedColors(scene_with(named("Cu"))));
  EXPECT_FALSE(HasSaturatedColors(scene_with(named("Al"))));
  EXPECT_FALSE(HasSaturatedColors(scene_with("\"rgb reflectance\" [0.9 0.7 0.3]")));
}

TEST(SaturatedColorsTest, OfGlassThatDisperses) {
  Scene scene;
  Material glass = DielectricMaterial(1.5F);
  AddMaterial(scene, glass);
  EXPECT_FALSE(HasSaturatedColors(scene));
  glass.dispersion = {0.01F, 0};
  AddMaterial(scene, glass);
  EXPECT_TRUE(HasSaturatedColors(scene));
}

TEST(SaturatedColorsTest, DecideTheSettingUnlessItIsGiven) {
  const Scene red = WallScene({0.6F, 0.05F, 0.05F});
  const Scene gray = WallScene({0.6F, 0.6F, 0.6F});
  EXPECT_TRUE(ResolveSettings({}, red)->spectral);
  EXPECT_FALSE(ResolveSettings({}, gray)->spectral);
  RenderOverrides given;
  given.spectral = false;
  EXPECT_FALSE(ResolveSettings(given, red)->spectral);
  given.spectral = true;
  EXPECT_TRUE(ResolveSettings(given, gray)->spectral);
}

}  // namespace
}  // namespace lucerna
