// The energy that photons were emitted with is known from the lights: what workers really count
// passes, for every kind of light, and what is zero, doubled or absurd does not.
#include "server/emission_check.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <string>

#include "gtest/gtest.h"

#include "tests/support/local_render.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

RenderOverrides FewPhotons() {
  RenderOverrides overrides;
  overrides.photons_per_pass = 20'000;
  return overrides;
}

// A spot, a faint and a strong mesh, and an even sky: photons of each carry different powers.
Scene ManyLights() {
  Scene scene;
  const std::int32_t white = AddMaterial(scene, DiffuseMaterial(0.5F));
  AddBox(scene, {-1, -1, -1}, {1, 1, -0.9F}, white);
  AddQuad(scene, {-1, -1, 1}, {0, 2, 0}, {2, 0, 0}, white, AddAreaLight(scene, 5));
  AddSphere(scene, {0, 0, 0.5F}, 0.1F, white, AddAreaLight(scene, 0.001F));
  SpotLight spot;
  spot.position = {0, 0, 0.8F};
  spot.direction = {0, 0, -1};
  spot.cos_total_width = 0.5F;
  spot.cos_falloff_start = 0.9F;
  spot.intensity = {3, 2, 1};
  scene.spot_lights.push_back(spot);
  InfiniteLight sky;
  sky.radiance = {0.1F, 0.2F, 0.3F};
  scene.infinite_lights.push_back(sky);
  SetCamera(scene, {0, 0, 3}, {0, 0, 0}, {0, 1, 0}, 40, 8);
  return scene;
}

TEST(SceneEmissionTest, WhatWorkersCountPassesForEverySceneOfTheTests) {
  int scenes = 0;
  for (const auto& file : std::filesystem::directory_iterator(LUCERNA_SOURCE_DIR "/tests/scenes")) {
    if (file.path().extension() != ".pbrt") continue;
    const Scene scene = LoadScene(file.path());
    LocalRender render(scene, SettingsFor(scene, FewPhotons()));
    render.AddPass(1);
    const Status checked = render.emission_check().Check(render.tally());
    EXPECT_TRUE(checked.ok()) << file.path() << ": " << checked.message();
    EXPECT_EQ(render.tally().photons, 20'000U);
    ++scenes;
  }
  EXPECT_GE(scenes, 10);
}

// Of a light whose alpha is a texture some photons carry nothing: nearly none, or half of them.
TEST(SceneEmissionTest, MaskedLightsPass) {
  for (const float dark : {1.0F, 0.99F, 0.0F}) {
    for (const float bright : {1.0F, 0.99F}) {
      Scene scene = ManyLights();
      TextureMapping halves;
      halves.scale_u = 2;
      const std::int32_t mask = AddStripes(scene, dark, bright, halves);
      scene.meshes.back().uvs = {{0, 0}, {1, 0}, {1, 0.9F}, {0, 0.9F}};
      scene.meshes.back().traits.alpha_texture = mask;
      scene.spheres[0].traits.alpha_texture = mask;
      LocalRender render(scene, SettingsFor(scene, FewPhotons()));
      render.AddPass(1);
      const Status checked = render.emission_check().Check(render.tally());
      EXPECT_TRUE(checked.ok()) << dark << " " << bright << ": " << checked.message();
    }
  }
}

// A red and a blue light have more power in some passes and less in others: what workers count
// passes in all, and what no pass can have does not.
TEST(SceneEmissionTest, LightsOfSaturatedColorsPassAtAllWavelengths) {
  Scene scene = ManyLights();
  scene.area_lights[0].radiance = {5, 0.3F, 0.2F};
  scene.spot_lights[0].intensity = {0.1F, 0.3F, 3};
  RenderSettings settings = TestSettings(scene, 20'000, 0.1, 6);
  ASSERT_TRUE(settings.spectral);
  double least = HUGE_VAL;
  double most = 0;
  LocalRender render(scene, settings);
  std::int64_t before = 0;
  for (int pass = 0; pass < 16; ++pass) {
    render.AddPass(1);
    const auto emitted = static_cast<double>(render.tally().energy.emitted - before);
    before = render.tally().energy.emitted;
    least = std::min(least, emitted);
    most = std::max(most, emitted);
    const Status checked = render.emission_check().Check(render.tally());
    EXPECT_TRUE(checked.ok()) << pass << ": " << checked.message();
  }
  EXPECT_GT(most, 1.1 * least);
  BatchTally absurd = render.tally();
  absurd.energy.emitted *= 20;
  EXPECT_FALSE(render.emission_check().Check(absurd).ok());
}

class EmissionCheckTest : public testing::Test {
 protected:
  EmissionCheckTest() {
    const Scene scene = ManyLights();
    LocalRender render(scene, TestSettings(scene, 100'000, 0.1, 6));
    render.AddPass(1);
    tally_ = render.tally();
    check_ = render.emission_check();
  }
  // With another energy, which escapes, so that the counters balance.
  bool Passes(double factor) const {
    BatchTally changed = tally_;
    const std::int64_t emitted = changed.energy.emitted;
    changed.energy.emitted = static_cast<std::int64_t>(static_cast<double>(emitted) * factor);
    changed.energy.escaped += changed.energy.emitted - emitted;
    EXPECT_TRUE(changed.energy.Balance());
    return check_.Check(changed).ok();
  }

  BatchTally tally_;
  EmissionCheck check_;
};

TEST_F(EmissionCheckTest, PassesWhatLightsOfAllKindsEmit) {
  EXPECT_EQ(tally_.lights.size(), 4U);
  EXPECT_TRUE(Passes(1));
}

TEST_F(EmissionCheckTest, RefusesNothingTwiceAndTheAbsurd) {
  EXPECT_FALSE(Passes(0));
  EXPECT_FALSE(Passes(2));
  EXPECT_FALSE(Passes(-1));
  BatchTally absurd = tally_;
  absurd.energy = {.emitted = std::int64_t{1} << 62, .escaped = std::int64_t{1} << 62};
  EXPECT_TRUE(absurd.energy.Balance());
  EXPECT_FALSE(check_.Check(absurd).ok());
}

TEST_F(EmissionCheckTest, RefusesPhotonsOfNoLightAndOfLightsThatAreNotThere) {
  BatchTally missing = tally_;
  missing.lights[1].sent -= 1;
  EXPECT_FALSE(check_.Check(missing).ok());
  BatchTally none = tally_;
  none.lights.clear();
  EXPECT_FALSE(check_.Check(none).ok());
  BatchTally more = tally_;
  more.lights[0].sent -= 1;
  more.lights.push_back({.sent = 1});
  EXPECT_FALSE(check_.Check(more).ok());
}

// Where every photon of a light carries the same power, the check is exact but for rounding.
TEST(OneLightTest, IsCheckedToAThousandth) {
  Scene scene;
  const std::int32_t white = AddMaterial(scene, DiffuseMaterial(0.5F));
  AddQuad(scene, {-1, -1, 1}, {0, 2, 0}, {2, 0, 0}, white, AddAreaLight(scene, 5));
  AddQuad(scene, {-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, white);
  SetCamera(scene, {0, -3, 0.5}, {0, 0, 0}, {0, 0, 1}, 40, 8);
  LocalRender render(scene, TestSettings(scene, 100'000, 0.1, 6));
  render.AddPass(1);
  BatchTally tally = render.tally();
  const EmissionCheck check = render.emission_check();
  EXPECT_TRUE(check.Check(tally).ok()) << check.Check(tally).message();
  const std::int64_t emitted = tally.energy.emitted;
  for (const double factor : {0.999, 1.001}) {
    tally.energy.emitted = static_cast<std::int64_t>(static_cast<double>(emitted) * factor);
    EXPECT_FALSE(check.Check(tally).ok()) << factor;
  }
}

// Of photons that guides draw, a known share counts for their lights.
TEST_F(EmissionCheckTest, KnowsHowManyPhotonsOfAGuideCount) {
  Scene scene;
  AddBox(scene, {-1, -1, -1}, {1, 1, 1}, AddMaterial(scene, DiffuseMaterial(0.5F)));
  scene.point_lights.push_back({{0, 0, 0}, Gray(1)});
  SetCamera(scene, {0, 0, -0.9}, {0, 0, 0}, {0, 1, 0}, 60, 8);
  LocalRender render(scene, TestSettings(scene, 10000, 0.1, 3), 1);
  render.AddPass();
  BatchTally tally = render.tally();
  const EmissionCheck check = render.emission_check();
  EXPECT_TRUE(check.Check(tally).ok());
  tally.lights[0].sent /= 2;
  EXPECT_FALSE(check.Check(tally).ok());
  EXPECT_TRUE(check.Check(tally, 0.5).ok());
  tally.lights[0].sent /= 2;
  EXPECT_FALSE(check.Check(tally, 0.5).ok());
  EXPECT_TRUE(check.Check(tally, 0.25).ok());
}

}  // namespace
}  // namespace lucerna
