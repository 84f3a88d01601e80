// Which values have colours, metals, media and lights at a pass's wavelengths?
#include "render/transport/pass_colors.h"

#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "gtest/gtest.h"

#include "render/analysis/prepared_scene.h"
#include "render/formats/pbrt/optical_constants.h"
#include "render/formats/wavelength_color.h"
#include "render/math/color_matching.h"
#include "render/math/color_space.h"
#include "render/transport/bsdf.h"
#include "render/transport/working_space.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

using Triple = std::array<double, 3>;

Triple ToDoubles(Rgb c) {
  return {static_cast<double>(c.r), static_cast<double>(c.g), static_cast<double>(c.b)};
}

// Rec. 709 of values at a pass's wavelengths, over many passes.
Triple MeanColor(const std::function<Rgb(const PassWavelengths&)>& values_at) {
  constexpr int kPasses = 512;
  Triple mean{};
  for (int i = 0; i < kPasses; ++i) {
    const PassWavelengths wavelengths = WavelengthsAt((i + 0.5) / kPasses);
    const Triple color = ToRec709(wavelengths.ToWorking(ToDoubles(values_at(wavelengths))));
    for (std::size_t c = 0; c < 3; ++c)
      mean[c] += color[c] / kPasses;
  }
  return mean;
}

// Rec. 709 of a spectrum of light, of which daylight D65 is white: a sum over 1 nm.
Triple ColorOf(const std::function<double(double nm)>& light) {
  Triple color{};
  Triple white{};
  for (double nm = kFirstObservedNm; nm <= kLastObservedNm; nm += 1) {
    const Triple rec709 = Rec709(CieObserver(nm));
    for (std::size_t c = 0; c < 3; ++c) {
      color[c] += rec709[c] * light(nm);
      white[c] += rec709[c] * D65At(nm);
    }
  }
  for (std::size_t c = 0; c < 3; ++c)
    color[c] /= white[c];
  return color;
}

double Luminance709(const Triple& c) {
  return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
}

// At right angles.
double FresnelOf(double eta, double k) {
  return ((eta - 1) * (eta - 1) + k * k) / ((eta + 1) * (eta + 1) + k * k);
}

GivenSpectrum CurveFrom(std::vector<double> nm, std::vector<double> values) {
  return {
      std::make_shared<const WavelengthCurve>(WavelengthCurve{std::move(nm), std::move(values)})};
}

Material Copper() {
  Material copper =
      ConductorMaterial({0.200438F, 0.924033F, 1.102212F}, {3.912949F, 2.452848F, 2.142188F}, 0, 0);
  MaterialSpectra given;
  given.eta = MetalSpectrumNamed("metal-Cu-eta");
  given.k = MetalSpectrumNamed("metal-Cu-k");
  copper.given = OwnedSpectra(std::move(given));
  return copper;
}

// Copper in blue light of 20 nm, and in daylight. Three colours make the reflectance of the channel
// blue of all of the light.
TEST(PassColorsTest, CopperReflectsEachWavelengthOfItsLight) {
  const GivenSpectrum blue = CurveFrom({440, 450, 470, 480}, {0, 1, 1, 0});
  Scene scene;
  AddMaterial(scene, Copper());
  scene.point_lights.push_back({.position = {0, 0, 1}, .intensity = EmissionColor(*blue.curve)});
  scene.point_lights[0].spectrum = blue;
  scene.point_lights.push_back({.position = {0, 0, 2}, .intensity = Gray(3)});
  Scene working = InWorkingSpace(scene);
  PassColors colors(working);
  const auto lit_by = [&](std::size_t light) {
    return MeanColor([&](const PassWavelengths& wavelengths) {
      colors.SetAt(wavelengths, working);
      BsdfSample sample;
      EXPECT_TRUE(SampleBsdf(working.materials[0], {0, 0, 1}, 0, 0, 0, {}, sample));
      return sample.weight * working.point_lights[light].intensity;
    });
  };
  const auto copper = [&](double nm) {
    return FresnelOf(MetalSpectrumNamed("metal-Cu-eta").curve->At(nm),
                     MetalSpectrumNamed("metal-Cu-k").curve->At(nm));
  };
  const Triple of_blue = ColorOf([&](double nm) { return blue.curve->At(nm); });
  Triple expected = ColorOf([&](double nm) { return blue.curve->At(nm) * copper(nm); });
  const Triple in_blue = lit_by(0);
  for (std::size_t c = 0; c < 3; ++c) {
    // Lights have the luminance of their three colours.
    const double scaled = expected[c] / Luminance709(of_blue);
    EXPECT_NEAR(in_blue[c], scaled, 0.005 * std::abs(expected[2] / Luminance709(of_blue))) << c;
  }
  expected = ColorOf([&](double nm) { return 3 * D65At(nm) * copper(nm); });
  const Triple in_daylight = lit_by(1);
  for (std::size_t c = 0; c < 3; ++c)
    EXPECT_NEAR(in_daylight[c], expected[c], 1e-3 * expected[0]) << c;
}

TEST(PassColorsTest, ABlackBodyIsOneOfItsLuminance) {
  Scene scene;
  scene.area_lights.push_back({.radiance = BlackbodyColor(2800) * 7});
  scene.area_lights[0].spectrum = {std::make_shared<const WavelengthCurve>(BlackbodyCurve(2800))};
  Scene working = InWorkingSpace(scene);
  PassColors colors(working);
  const Triple mean = MeanColor([&](const PassWavelengths& wavelengths) {
    colors.SetAt(wavelengths, working);
    return working.area_lights[0].radiance;
  });
  EXPECT_NEAR(Luminance709(mean), 7, 0.007);
  // As the three numbers that jobs without wavelengths have, up to the steps of both curves.
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_NEAR(mean[c], static_cast<double>(scene.area_lights[0].radiance[static_cast<int>(c)]),
                1e-3 * mean[0]);
  }
  EXPECT_GT(colors.largest_power(), 1);
}

TEST(PassColorsTest, WhiteLightAndGreyAreTheSameInEveryPass) {
  Scene scene;
  AddMaterial(scene, DiffuseMaterial(0.7F));
  AddAreaLight(scene, 5);
  scene.infinite_lights.push_back({.radiance = Gray(0.25F)});
  Scene working = InWorkingSpace(scene);
  PassColors colors(working);
  for (const double t : {0.0, 0.3, 0.9}) {
    colors.SetAt(WavelengthsAt(t), working);
    EXPECT_EQ(working.materials[0].reflectance, Gray(working.materials[0].reflectance.g));
    EXPECT_NEAR(working.materials[0].reflectance.g, 0.7F, 1e-6F);
    EXPECT_EQ(working.area_lights[0].radiance, Gray(5));
    EXPECT_EQ(working.infinite_lights[0].radiance, Gray(0.25F));
  }
  EXPECT_EQ(colors.largest_power(), 1);
}

TEST(PassColorsTest, ReflectancesAndMediaHaveTheirColorsOnAverage) {
  const Rgb wall = {0.63F, 0.065F, 0.05F};
  Scene scene;
  Material material = DiffuseMaterial(0);
  material.reflectance = wall;
  AddMaterial(scene, material);
  Medium medium;
  medium.absorption = {0.1F, 0.4F, 3};
  scene.media.push_back(medium);
  medium.absorption_spectrum = CurveFrom({500, 600}, {1, 2});
  medium.absorption_spectrum.factor = 3;
  scene.media.push_back(medium);
  Scene working = InWorkingSpace(scene);
  PassColors colors(working);
  const auto mean_of = [&](const std::function<Rgb()>& value) {
    return MeanColor([&](const PassWavelengths& wavelengths) {
      colors.SetAt(wavelengths, working);
      return value();
    });
  };
  const Triple of_wall = mean_of([&] { return working.materials[0].reflectance; });
  const Triple of_medium = mean_of([&] { return working.media[0].absorption; });
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_NEAR(of_wall[c], ToDoubles(wall)[c], 1e-3);
    EXPECT_NEAR(of_medium[c], ToDoubles(scene.media[0].absorption)[c], 6e-3);
  }
  const PassWavelengths wavelengths = WavelengthsAt(0.5);
  colors.SetAt(wavelengths, working);
  // Beyond its ends a curve of coefficients goes on as it ends.
  EXPECT_EQ(working.media[1].absorption.r, 6);
  EXPECT_NEAR(working.media[1].absorption.g,
              static_cast<float>(3 * (1 + (wavelengths.nm[1] - 500) / 100)), 1e-5F);
  EXPECT_EQ(working.media[1].absorption.b, 3);
}

// Factors of lobes are reflectances.
TEST(PassColorsTest, TintsAreThoseOfASurfaceOfThatColor) {
  Scene scene;
  AddSphere(scene, {0, 0, 0}, 1, AddMaterial(scene, DiffuseMaterial(0.5F)));
  scene.materials[0].reflectance = {0.9F, 0.3F, 0.1F};
  Material glass = DielectricMaterial(1.5F);
  glass.is_tinted = true;
  glass.transmission_tint = scene.materials[0].reflectance;
  AddMaterial(scene, glass);
  AddMaterial(scene, DielectricMaterial(1.5F));
  PassColors colors(scene);
  for (const double place : {0.1, 0.5, 0.8}) {
    colors.SetAt(WavelengthsAt(place), scene);
    EXPECT_EQ(scene.materials[1].transmission_tint, scene.materials[0].reflectance);
    EXPECT_NE(scene.materials[1].transmission_tint, (Rgb{0.9F, 0.3F, 0.1F}));
    EXPECT_EQ(scene.materials[2].transmission_tint, Gray(1));
  }
  colors.SetThree(scene);
  EXPECT_EQ(scene.materials[1].transmission_tint, (Rgb{0.9F, 0.3F, 0.1F}));
}

TEST(PassColorsTest, ThreeColorsComeBackToTheBit) {
  Scene scene;
  AddMaterial(scene, Copper());
  Material red = DiffuseMaterial(0);
  red.reflectance = {0.6F, 0.1F, 0.2F};
  AddMaterial(scene, red);
  scene.area_lights.push_back({.radiance = {3, 2, 1}});
  AddQuad(scene, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 1, 0);
  AddQuad(scene, {0, 0, 1}, {1, 0, 0}, {0, 1, 0}, 1);
  scene.infinite_lights.push_back({.radiance = {0.1F, 0.2F, 0.4F}});
  RenderSettings settings = TestSettings(scene, 100, 0.1, 4);
  settings.spectral = true;
  PreparedScene prepared(scene);
  ASSERT_TRUE(prepared.PrepareFor(NeedsOf(scene, settings)).ok());
  const std::vector<Material> materials = prepared.scene().materials;
  const Rgb light = prepared.scene().area_lights[0].radiance;
  const Rgb power = prepared.lights().emitter(0).power;
  const Rgb sky = prepared.lights().InfiniteRadiance({}, {0, 0, 1});
  const Rgb total = prepared.lights().TotalPower();
  {
    const PreparedScene::AtPass at_pass(prepared, 1, 3);
    EXPECT_NE(prepared.scene().materials, materials);
    EXPECT_NE(prepared.scene().area_lights[0].radiance, light);
    EXPECT_NE(prepared.lights().emitter(0).power, power);
    EXPECT_NE(prepared.lights().InfiniteRadiance({}, {0, 0, 1}), sky);
    EXPECT_EQ(prepared.lights().TotalPower(), total);
  }
  EXPECT_EQ(prepared.scene().materials, materials);
  EXPECT_EQ(prepared.scene().area_lights[0].radiance, light);
  EXPECT_EQ(prepared.lights().emitter(0).power, power);
  EXPECT_EQ(prepared.lights().InfiniteRadiance({}, {0, 0, 1}), sky);
}

TEST(PassColorsTest, ScenesOfOtherJobsStayAsTheyAre) {
  Scene scene;
  Material red = DiffuseMaterial(0);
  red.reflectance = {0.6F, 0.1F, 0.2F};
  AddMaterial(scene, red);
  AddQuad(scene, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0, AddAreaLight(scene, 1));
  RenderSettings settings = TestSettings(scene, 100, 0.1, 4);
  settings.spectral = false;
  PreparedScene prepared(scene);
  ASSERT_TRUE(prepared.PrepareFor(NeedsOf(scene, settings)).ok());
  const std::vector<Material> materials = prepared.scene().materials;
  const PreparedScene::AtPass at_pass(prepared, 1, 3);
  EXPECT_EQ(prepared.scene().materials, materials);
  EXPECT_EQ(prepared.scene().uplift, nullptr);
}

// The three values are of catalogues of their own, and stand for a channel each.
TEST(MetalSpectrumTest, ReflectsAboutAsMuchAsTheThreeValuesOfOtherJobs) {
  for (const char* const metal : {"Ag", "Al", "Au", "Cu", "CuZn", "MgO", "TiO2"}) {
    const std::string name = std::string("metal-") + metal;
    const Rgb eta = MetalCurveNamed(name + "-eta").value();
    const Rgb k = MetalCurveNamed(name + "-k").value();
    const GivenSpectrum eta_spectrum = MetalSpectrumNamed(name + "-eta");
    const GivenSpectrum k_spectrum = MetalSpectrumNamed(name + "-k");
    const auto expect = [&](double nm, float eta_of_channel, float k_of_channel) {
      EXPECT_NEAR(FresnelOf(eta_spectrum.curve->AtClamped(nm), k_spectrum.curve->AtClamped(nm)),
                  FresnelOf(static_cast<double>(eta_of_channel), static_cast<double>(k_of_channel)),
                  0.07)
          << name << " at " << nm;
    };
    expect(kRedNm, eta.r, k.r);
    expect(kGreenNm, eta.g, k.g);
    expect(kBlueNm, eta.b, k.b);
  }
  EXPECT_FALSE(MetalSpectrumNamed("metal-Fe-eta").is_given());
}

}  // namespace
}  // namespace lucerna
