// What the user gives wins over the scene file, the scene file over the defaults; every value out
// of range is refused by the name of its setting.
#include "render/scene/render_settings.h"

#include <cmath>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace lucerna {
namespace {

using ::testing::HasSubstr;

Scene SmallScene() {
  Scene scene;
  scene.film.width = scene.film.crop_x1 = 40;
  scene.film.height = scene.film.crop_y1 = 30;
  return scene;
}

std::string Why(const RenderOverrides& overrides) {
  const StatusOr<RenderSettings> settings = ResolveSettings(overrides, SmallScene());
  return settings.ok() ? "" : std::string(settings.status().message());
}

TEST(RenderSettingsTest, DefaultsStandWhereNothingIsGiven) {
  const RenderSettings settings = ResolveSettings({}, SmallScene()).value();
  RenderSettings expected;
  expected.width = expected.crop_x1 = 40;
  expected.height = expected.crop_y1 = 30;
  expected.passes = 16;
  expected.photons_per_pass = 1200;  // as many as pixels
  expected.adaptive_photons = true;
  expected.max_depth = 5;
  expected.initial_radius = 0;
  EXPECT_EQ(settings, expected);
}

TEST(RenderSettingsTest, TheSceneWinsOverDefaultsAndTheUserOverTheScene) {
  Scene scene = SmallScene();
  scene.integrator = {"sppm", 7, 5000, 0.25, 9, 3};
  const RenderSettings from_scene = ResolveSettings({}, scene).value();
  EXPECT_EQ(from_scene.max_depth, 7);
  EXPECT_EQ(from_scene.photons_per_pass, 5000);
  EXPECT_EQ(from_scene.initial_radius, 0.25);
  EXPECT_EQ(from_scene.seed, 9U);
  EXPECT_EQ(from_scene.passes, 3);

  RenderOverrides user;
  user.max_depth = 8;
  user.photons_per_pass = 6000;
  user.initial_radius = 0;  // auto
  user.initial_footprints = 1.5;
  user.seed = 10;
  user.passes = 4;
  user.kernel = KernelKind::kConstant;
  user.radius_controller = RadiusControllerKind::kPppm;
  user.alpha = 0.5;
  const RenderSettings settings = ResolveSettings(user, scene).value();
  EXPECT_EQ(settings.max_depth, 8);
  EXPECT_EQ(settings.photons_per_pass, 6000);
  EXPECT_EQ(settings.initial_radius, 0);
  EXPECT_EQ(settings.initial_footprints, 1.5);
  EXPECT_EQ(settings.seed, 10U);
  EXPECT_EQ(settings.passes, 4);
  EXPECT_EQ(settings.kernel, KernelKind::kConstant);
  EXPECT_EQ(settings.radius_controller, RadiusControllerKind::kPppm);
  EXPECT_EQ(settings.alpha, 0.5);
}

TEST(RenderSettingsTest, ATimeAloneLiftsTheLimitOfPasses) {
  RenderOverrides user;
  user.time_s = 3;
  EXPECT_EQ(ResolveSettings(user, SmallScene())->passes, 0);
  user.passes = 5;
  EXPECT_EQ(ResolveSettings(user, SmallScene())->passes, 5);
}

TEST(RenderSettingsTest, StopCriteriaAreReplacedAsAWhole) {
  RenderSettings settings;
  settings.error = 0.5;
  RenderOverrides until;
  EXPECT_THAT(std::string(SetStopCriteria(until, settings).message()),
              HasSubstr("setting \"time_s\""));
  EXPECT_EQ(settings.error, 0.5) << "unchanged";
  until.passes = 0;
  EXPECT_FALSE(SetStopCriteria(until, settings).ok()) << "no passes and no other criterion";
  until.photons = 1000;
  ASSERT_TRUE(SetStopCriteria(until, settings).ok());
  EXPECT_EQ(settings.photons, 1000U);
  EXPECT_EQ(settings.passes, 0);
  EXPECT_EQ(settings.error, 0);
  until.photons = 0;
  EXPECT_THAT(std::string(SetStopCriteria(until, settings).message()),
              HasSubstr("setting \"photons\" must be at least 1, not 0"));
  EXPECT_EQ(settings.photons, 1000U) << "unchanged";
}

TEST(RenderSettingsTest, TheCropWindowFollowsTheSize) {
  Scene scene = SmallScene();
  scene.film.crop_x0 = 10;
  scene.film.crop_x1 = 20;
  scene.film.crop_y0 = 15;
  RenderOverrides user;
  user.width = 400;
  user.height = 300;
  const RenderSettings settings = ResolveSettings(user, scene).value();
  EXPECT_EQ(settings.crop_x0, 100);
  EXPECT_EQ(settings.crop_x1, 200);
  EXPECT_EQ(settings.crop_y0, 150);
  EXPECT_EQ(settings.crop_y1, 300);
  EXPECT_EQ(settings.photons_per_pass, 100 * 150);
  user.width = user.height = 1;
  const RenderSettings tiny = ResolveSettings(user, scene).value();
  EXPECT_EQ(tiny.crop_width(), 1);
  EXPECT_EQ(tiny.crop_height(), 1);
}

TEST(RenderSettingsTest, RefusesWhatIsOutOfRangeByTheSettingsName) {
  const auto with = [](auto member, auto value) {
    RenderOverrides user;
    user.*member = value;
    return Why(user);
  };
  EXPECT_THAT(with(&RenderOverrides::width, 10), HasSubstr("setting \"size\""));
  EXPECT_THAT(with(&RenderOverrides::passes, 0), HasSubstr("setting \"passes\""));
  EXPECT_THAT(with(&RenderOverrides::passes, -1), HasSubstr("setting \"passes\""));
  EXPECT_THAT(with(&RenderOverrides::photons_per_pass, 0),
              HasSubstr("setting \"photons_per_pass\""));
  EXPECT_THAT(with(&RenderOverrides::photons_per_pass, 1'000'000'000'001),
              HasSubstr("setting \"photons_per_pass\""));
  EXPECT_THAT(with(&RenderOverrides::time_s, 0.0), HasSubstr("setting \"time_s\""));
  EXPECT_THAT(with(&RenderOverrides::time_s, HUGE_VAL), HasSubstr("setting \"time_s\""));
  EXPECT_THAT(with(&RenderOverrides::alpha, 0.0), HasSubstr("setting \"alpha\""));
  EXPECT_THAT(with(&RenderOverrides::alpha, 1.0), HasSubstr("setting \"alpha\""));
  EXPECT_THAT(with(&RenderOverrides::alpha, std::nan("")), HasSubstr("setting \"alpha\""));
  EXPECT_THAT(with(&RenderOverrides::initial_radius, -1.0),
              HasSubstr("setting \"initial_radius\""));
  EXPECT_THAT(with(&RenderOverrides::initial_footprints, 0.0), HasSubstr("0.001px"));
  EXPECT_THAT(with(&RenderOverrides::max_depth, 0), HasSubstr("setting \"max_depth\""));
  EXPECT_THAT(with(&RenderOverrides::max_depth, 10'001), HasSubstr("setting \"max_depth\""));
  RenderOverrides user;
  user.width = 65537;
  user.height = 1;
  EXPECT_THAT(Why(user), HasSubstr("setting \"size\""));
  user.width = 16384;
  user.height = 16384;
  EXPECT_EQ(Why(user), "");
  user.height = 16385;
  EXPECT_THAT(Why(user), HasSubstr("more than the 268435456 of one job"));
}

TEST(RenderSettingsTest, NamesAreReadBack) {
  for (const auto kind : {RadiusControllerKind::kPpm, RadiusControllerKind::kPppm}) {
    EXPECT_EQ(ParseRadiusController(NameOf(kind)).value(), kind);
  }
  for (const auto kind : {KernelKind::kConstant, KernelKind::kEpanechnikov}) {
    EXPECT_EQ(ParseKernel(NameOf(kind)).value(), kind);
  }
  EXPECT_THAT(std::string(ParseKernel("box").status().message()),
              HasSubstr("constant, epanechnikov"));
}

}  // namespace
}  // namespace lucerna
