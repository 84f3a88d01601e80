// Every row of the table of settings must be complete, and text of a value must read back to the
// same bits: flags, the wire and image headers use nothing else.
#include "render/scene/setting_table.h"

#include <cmath>
#include <limits>
#include <set>
#include <string>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace lucerna {
namespace {

using ::testing::HasSubstr;

std::string WhyRefused(std::string_view name, std::string_view text) {
  RenderOverrides overrides;
  return std::string(ParseSetting(*FindSetting(name), text, overrides).message());
}

RenderSettings WithBack(const RenderSettings& settings) {
  RenderOverrides given;
  RenderSettings back;
  for (const Setting& setting : AllSettings()) {
    EXPECT_TRUE(ParseSetting(setting, SettingText(setting, settings), given).ok()) << setting.name;
    ResolveSetting(setting, given, nullptr, back);
  }
  return back;
}

TEST(SettingTableTest, EveryRowIsCompleteAndItsDefaultInItsRange) {
  RenderSettings settings;
  settings.width = settings.height = 1;
  settings.crop_x1 = settings.crop_y1 = 1;
  settings.photons_per_pass = 1;
  settings.time_s = settings.error = 1;
  settings.photons = 1;
  std::set<std::string_view> names;
  for (const Setting& setting : AllSettings()) {
    EXPECT_TRUE(names.insert(setting.name).second) << setting.name;
    EXPECT_EQ(FindSetting(setting.name), &setting);
    EXPECT_EQ(setting.name.find_first_not_of("abcdefghijklmnopqrstuvwxyz_"),
              std::string_view::npos);
    EXPECT_FALSE(setting.meaning.empty()) << setting.name;
    EXPECT_FALSE(DefaultText(setting).empty()) << setting.name;
    EXPECT_TRUE(CheckSetting(setting, settings).ok()) << CheckSetting(setting, settings);
  }
  EXPECT_EQ(FindSetting("no_such_setting"), nullptr);
}

TEST(SettingTableTest, ACropIsFourNumbersOfPixels) {
  RenderOverrides overrides;
  const Setting& crop = *FindSetting("crop");
  ASSERT_TRUE(ParseSetting(crop, "0,320,10,240", overrides).ok());
  EXPECT_EQ(overrides.crop, (CropWindow{0, 320, 10, 240}));
  EXPECT_EQ(SettingText(crop, overrides), "0,320,10,240");
  for (const char* text : {"", "0,1,0", "0,1,0,1,2", "0,1,0,", "a,1,0,1", "0 1 0 1", "0,1,0,0.5"})
    EXPECT_THAT(WhyRefused("crop", text), HasSubstr("X0,X1,Y0,Y1")) << text;
}

TEST(SettingTableTest, TextReadsBackToTheSameBits) {
  RenderSettings settings;
  settings.width = 640;
  settings.height = 480;
  settings.crop_x0 = 1;
  settings.crop_x1 = 640;
  settings.crop_y0 = 2;
  settings.crop_y1 = 3;
  settings.passes = std::numeric_limits<std::int64_t>::max();
  settings.time_s = 0.1;
  settings.error = std::nextafter(3.0, 4.0);
  settings.photons = settings.seed = std::numeric_limits<std::uint64_t>::max();
  settings.photons_per_pass = 1'000'000'000'000;
  settings.radius_controller = RadiusControllerKind::kFrequencyConsistent;
  settings.alpha = std::nextafter(1.0, 0.0);
  settings.kernel = KernelKind::kGaussian;
  settings.initial_radius = 1e-18;
  settings.max_depth = 10'000;
  settings.bias = 1.0 / 3;
  settings.frequency_share = 5e-324;
  settings.use_everything = true;
  settings.spectral = true;
  EXPECT_EQ(WithBack(settings), settings);
  settings.initial_radius = 0;
  settings.initial_footprints = 1.0 / 3;
  EXPECT_EQ(WithBack(settings), settings);
  settings = RenderSettings();
  settings.width = settings.height = 1;
  EXPECT_EQ(WithBack(settings), settings) << "defaults";
}

TEST(SettingTableTest, RefusesWhatIsNotOfTheTypeByTheSettingsName) {
  for (const char* size : {"", "x", "640", "640x", "x480", "640*480", "0x1", "-1x5", "1x1x1",
                           "1 x 1", "99999999999x1"}) {
    EXPECT_THAT(WhyRefused("size", size), HasSubstr("setting \"size\"")) << size;
  }
  for (const char* radius : {"", "automatic", "0", "-1", "nan", "inf", "1m", "px", "0px", "-1px"}) {
    EXPECT_THAT(WhyRefused("initial_radius", radius), HasSubstr("setting \"initial_radius\""))
        << radius;
  }
  for (const char* number : {"", "x", "1x", "nan", "inf", "1e999", " 1", "0x1"}) {
    EXPECT_THAT(WhyRefused("alpha", number), HasSubstr("setting \"alpha\" must be a number"))
        << number;
  }
  for (const char* number : {"", "1.5", "99999999999", "5%"}) {
    EXPECT_THAT(WhyRefused("max_depth", number), HasSubstr("must be a whole number")) << number;
  }
  EXPECT_THAT(WhyRefused("seed", "-1"),
              HasSubstr("setting \"seed\" must be a whole number from 0"));
  EXPECT_THAT(WhyRefused("error", "%"), HasSubstr("must be a share, like 2% or 0.02"));
  EXPECT_THAT(WhyRefused("use_everything", "yes"), HasSubstr("must be true or false"));
  EXPECT_THAT(WhyRefused("radius_controller", "sppm"), HasSubstr("ppm, pppm, appm"));
  EXPECT_THAT(WhyRefused("kernel", "box"), HasSubstr("constant, epanechnikov"));
  EXPECT_LT(WhyRefused("alpha", std::string(100'000, 'x')).size(), 200U);
}

TEST(SettingTableTest, TimesAndCountsMayHaveUnits) {
  const auto overrides = [](const char* name, const char* text) {
    RenderOverrides given;
    EXPECT_TRUE(ParseSetting(*FindSetting(name), text, given).ok()) << text;
    return given;
  };
  EXPECT_EQ(overrides("time_s", "90").time_s, 90);
  EXPECT_EQ(overrides("time_s", "90s").time_s, 90);
  EXPECT_EQ(overrides("time_s", "500ms").time_s, 0.5);
  EXPECT_EQ(overrides("time_s", "5m").time_s, 300);
  EXPECT_EQ(overrides("time_s", "1.5h").time_s, 5400);
  EXPECT_EQ(overrides("photons", "10M").photons, 10'000'000U);
  EXPECT_EQ(overrides("photons", "1.5k").photons, 1500U);
  EXPECT_EQ(overrides("passes", "2k").passes, 2000);
  for (const char* text : {"5x", "m", "5 m", "5M", "-", "1e400h", "5mm"})
    EXPECT_THAT(WhyRefused("time_s", text), HasSubstr("must be a time, like 90, 90s, 5m")) << text;
  for (const char* text : {"1.0005k", "-1k", "10m", "1e300M", "nanM", "k"})
    EXPECT_THAT(WhyRefused("photons", text), HasSubstr("must be a whole number")) << text;
}

TEST(SettingTableTest, ARadiusIsALengthOrPixelWidthsOrAutomatic) {
  const auto parsed = [](std::string_view text) {
    RenderOverrides overrides;
    overrides.initial_footprints = 7;  // as another text gave it before
    EXPECT_TRUE(ParseSetting(*FindSetting("initial_radius"), text, overrides).ok()) << text;
    return std::pair(overrides.initial_radius, overrides.initial_footprints);
  };
  EXPECT_EQ(parsed("auto"), std::pair(std::optional(0.0), std::optional<double>()));
  EXPECT_EQ(parsed("0.25"), std::pair(std::optional(0.25), std::optional<double>()));
  EXPECT_EQ(parsed("1.5px"), std::pair(std::optional(0.0), std::optional(1.5)))
      << "also where the scene gives a radius";
}

TEST(SettingsTextTest, NamesWhatDecidesThePixelsAndNothingElse) {
  RenderSettings settings;
  settings.width = settings.crop_x1 = 64;
  settings.height = settings.crop_y1 = 32;
  settings.photons_per_pass = 1000;
  const std::string text = SettingsText(settings);
  RenderSettings same = settings;
  same.time_s = 7;
  same.passes = 3;
  EXPECT_EQ(SettingsText(same), text);
  const auto differs = [&](auto change) {
    RenderSettings other = settings;
    change(other);
    return SettingsText(other) != text;
  };
  EXPECT_TRUE(differs([](RenderSettings& s) { s.alpha = std::nextafter(s.alpha, 1.0); }));
  EXPECT_TRUE(differs([](RenderSettings& s) { s.seed = 1; }));
  EXPECT_TRUE(differs([](RenderSettings& s) { s.crop_x0 = 1; }));
  EXPECT_TRUE(differs([](RenderSettings& s) { s.max_depth = 6; }));
  EXPECT_TRUE(differs([](RenderSettings& s) { s.initial_radius = 1e-30; }));
  EXPECT_TRUE(differs([](RenderSettings& s) { s.initial_footprints = 1; }));
  EXPECT_EQ(text,
            "size=64x32 crop=0,0,64,32 photons-per-pass=1000 seed=0 radius-controller=appm "
            "alpha=0.6666666666666666 kernel=epanechnikov initial-radius=auto max-depth=5")
      << "digests of images from before depend on the form";
  EXPECT_FALSE(differs([](RenderSettings& s) { s.bias = 0.5; })) << "not used by appm";
  settings.radius_controller = RadiusControllerKind::kFrequencyMse;
  settings.use_everything = true;
  EXPECT_THAT(SettingsText(settings),
              HasSubstr(" max-depth=5 bias=0.02 frequency-share=0.05 use-everything"));
  settings = RenderSettings();
  EXPECT_TRUE(differs([](RenderSettings& s) { s.kernel = KernelKind::kConstant; }));
  EXPECT_TRUE(
      differs([](RenderSettings& s) { s.radius_controller = RadiusControllerKind::kPppm; }));
  EXPECT_TRUE(differs([](RenderSettings& s) { s.photons_per_pass = 1001; }));
}

}  // namespace
}  // namespace lucerna
