// Is an image of a job that carries wavelengths the one of all wavelengths together?
//
// Closed forms at each wavelength, integrated here over the observer's curves, against renders that
// know nothing of that integral; means and bounds as in closed_form_test.cc.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <string_view>
#include <vector>

#include "gtest/gtest.h"

#include "render/formats/wavelength_color.h"
#include "render/math/color_matching.h"
#include "render/math/color_space.h"
#include "render/math/dispersion.h"
#include "render/transport/bsdf.h"
#include "tests/support/glass_balls.h"
#include "tests/support/local_render.h"
#include "tests/support/measure.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

using Triple = std::array<double, 3>;
constexpr std::array<std::string_view, 3> kChannels = {"R", "G", "B"};

// Rec. 709 of D65's light between two wavelengths, of which all of it is white.
Triple DaylightBetween(double from_nm, double to_nm) {
  constexpr int kSteps = 200;
  Triple color{};
  Triple white{};
  const auto add = [](double nm, double weight, Triple& sum) {
    const Triple rec709 = Rec709(CieObserver(nm));
    for (std::size_t c = 0; c < 3; ++c)
      sum[c] += rec709[c] * D65At(nm) * weight;
  };
  const double step = (to_nm - from_nm) / kSteps;
  for (int i = 0; i < kSteps; ++i)
    add(from_nm + (i + 0.5) * step, step, color);
  for (double nm = kFirstObservedNm; nm < kLastObservedNm; nm += 0.5)
    add(nm + 0.25, 0.5, white);
  for (std::size_t c = 0; c < 3; ++c)
    color[c] /= white[c];
  return color;
}

// Of the light f(λ)·D65(λ).
Triple ColorOf(const std::function<double(double nm)>& f) {
  Triple color{};
  for (double nm = kFirstObservedNm; nm < kLastObservedNm; nm += 2) {
    const Triple part = DaylightBetween(nm, nm + 2);
    for (std::size_t c = 0; c < 3; ++c)
      color[c] += part[c] * f(nm + 1);
  }
  return color;
}

// --- furnaces ----------------------------------------------------------------------------------

constexpr int kParts = 12;
// Comparisons of this file.
constexpr int kComparisons = 40;

// Of the mean of each channel over renders of different seeds.
void ExpectColor(const Scene& scene, RenderSettings settings, int passes, const Triple& expected,
                 double most_of_bound) {
  const double quantile = StudentQuantile(SidakLevel(1e-3, kComparisons), kParts);
  for (std::size_t c = 0; c < 3; ++c) {
    const MeasuredMean measured = Measure(scene, settings, passes, kParts, kChannels[c]);
    // Float arithmetic is good for about 1e-5 along a path, and lines over 2 nm for 1e-4.
    const double bound = quantile * measured.standard_error + 2e-4 * std::abs(expected[c]);
    EXPECT_NEAR(measured.mean, expected[c], bound)
        << kChannels[c] << ", ratio " << measured.mean / expected[c];
    EXPECT_LT(bound, most_of_bound * expected[c]) << "the bound would let a wrong result pass";
  }
}

double RedWall(double nm) {
  return 0.1 + 0.6 / (1 + std::exp(-(nm - 590) / 15));
}

std::shared_ptr<const WavelengthCurve> CurveOf(const std::function<double(double nm)>& f) {
  WavelengthCurve curve;
  for (double nm = 360; nm <= 830; nm += 2) {
    curve.wavelength_nm.push_back(nm);
    curve.value.push_back(f(nm));
  }
  return std::make_shared<const WavelengthCurve>(std::move(curve));
}

// A closed sphere that shines everywhere: each depth adds reflectance times the one before.
Scene Furnace(const Material& wall) {
  Scene scene;
  AddSphere(scene, {0.5F, 0, 0}, 2, AddMaterial(scene, wall), AddAreaLight(scene, 1),
            /*inward=*/true);
  SetCamera(scene, {0, 0, 0.3}, {1, 0.2, 0}, {0, 1, 0}, 80, 6);
  return scene;
}

RenderSettings Spectral(const Scene& scene, std::int64_t photons, double radius, int depth,
                        std::uint64_t seed = 1) {
  RenderSettings settings = TestSettings(scene, photons, radius, depth, seed);
  settings.spectral = true;
  return settings;
}

TEST(SpectralFurnaceTest, AWhiteOneIsGreyInEveryPass) {
  const Scene scene = Furnace(DiffuseMaterial(0.5F));
  const Image image = RenderLocally(scene, Spectral(scene, 2000, 0.6, 40), 3);
  for (std::size_t i = 0; i < image.Find("G")->pixels.size(); ++i) {
    const float g = image.Find("G")->pixels[i];
    // Photons are counted in quanta of each channel, 2^-18 of the power, and slices have 16 bits.
    EXPECT_NEAR(image.Find("R")->pixels[i], g, 2e-4F * g) << i;
    EXPECT_NEAR(image.Find("B")->pixels[i], g, 2e-4F * g) << i;
  }
}

TEST(SpectralFurnaceTest, AddsUpTheReflectionsOfEachWavelength) {
  Material wall = DiffuseMaterial(0);
  MaterialSpectra given;
  given.reflectance = {CurveOf(RedWall)};
  wall.reflectance = ReflectanceColor(*given.reflectance.curve);
  wall.given = OwnedSpectra(std::move(given));
  const Scene scene = Furnace(wall);
  const Triple expected = ColorOf([](double nm) { return 1 / (1 - RedWall(nm)); });
  ExpectColor(scene, Spectral(scene, 4000, 0.6, 60), 64, expected, 0.005);
  // What three colours make of it is something else.
  RenderSettings settings = TestSettings(scene, 4000, 0.6, 60);
  settings.spectral = false;
  const MeasuredMean three = Measure(scene, settings, 16, kParts, "G");
  EXPECT_GT(std::abs(three.mean - expected[1]), 0.005 * expected[1]);
}

// Light and wall both coloured, and the wall as a texture: its polynomial is looked up.
TEST(SpectralFurnaceTest, ATexturesColorIsUplifted) {
  const Rgb color = {0.5F, 0.25F, 0.1F};
  Scene scene = Furnace(DiffuseMaterial(0.5F));
  Texture constant;
  constant.color = color;
  scene.textures = {constant};
  scene.materials[0].texture = 0;
  const SigmoidPolynomial polynomial = FitReflectance(color);
  const auto reflectance = [&](double nm) {
    return static_cast<double>(polynomial.At(static_cast<float>(PolynomialPlace(nm))));
  };
  scene.area_lights[0].spectrum = {
      CurveOf([](double nm) { return D65At(nm) * (1 + (nm - 560) / 400); })};
  Triple expected =
      ColorOf([&](double nm) { return (1 + (nm - 560) / 400) / (1 - reflectance(nm)); });
  const Triple light = ColorOf([](double nm) { return 1 + (nm - 560) / 400; });
  // Lights have the luminance of their three colours, which is 1.
  for (double& channel : expected)
    channel /= 0.2126 * light[0] + 0.7152 * light[1] + 0.0722 * light[2];
  ExpectColor(scene, Spectral(scene, 4000, 0.6, 60), 64, expected, 0.02);
}

// --- dispersion --------------------------------------------------------------------------------

constexpr int kSeeds = 12;
// Cells of the visible range, each rendered with the index in its middle.
constexpr int kCells = 20;
constexpr double kLowNm = 400, kHighNm = 700;

// Which paths meet glass: photons on their way to a floor, eye paths to a wall, or both.
enum class View : std::uint8_t { kPhotons, kEyePaths, kBoth };

Scene BallScene(const Material& glass, View view) {
  if (view == View::kPhotons) return FocusOfBall(glass);
  if (view == View::kEyePaths) return WallThroughBall(glass);
  // A light in a ball, whose light is seen through another one.
  Scene scene;
  const std::int32_t ball = AddMaterial(scene, glass);
  AddQuad(scene, {-4, -4, 0}, {8, 0, 0}, {0, 8, 0}, AddMaterial(scene, DiffuseMaterial(0.7F)));
  AddSphere(scene, {0, 0, 2}, 0.5F, ball);
  scene.point_lights.push_back({.position = {0.2F, 0, 2}, .intensity = Gray(50)});
  AddSphere(scene, {0, -3, 3}, 0.5F, ball);
  SetCamera(scene, {0, -6, 6}, {0, 0, 0}, {0, 0, 1}, 6, 12);
  return scene;
}

class SpectralDispersionTest : public testing::TestWithParam<View> {
 protected:
  static Halves Render(const Material& glass, std::uint64_t seed, bool is_spectral) {
    const Scene scene = BallScene(glass, GetParam());
    const std::int64_t photons = GetParam() == View::kPhotons ? 10000 : 2000;
    RenderSettings settings = TestSettings(scene, photons, 0.1, 8, seed);
    // Radii that shrink would be others after so many more passes.
    settings.radius_controller = RadiusControllerKind::kFixed;
    settings.spectral = is_spectral;
    return HalvesOf(RenderLocally(scene, settings, is_spectral ? 64 : 4));
  }
};

TEST_P(SpectralDispersionTest, TheImageIsThatOfPlainGlassesOfAllWavelengths) {
  Material strong = DielectricMaterial(kStrongIndexAtD);
  strong.dispersion = kStrongDispersion;
  std::array<std::vector<double>, 6> dispersed;
  std::array<std::vector<double>, 6> together;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const Halves whole = Render(strong, seed, true);
    Halves sum{};
    for (int i = 0; i < kCells; ++i) {
      const double step = (kHighNm - kLowNm) / kCells;
      const double low = i == 0 ? kFirstObservedNm : kLowNm + i * step;
      const double high = i == kCells - 1 ? kLastObservedNm : kLowNm + (i + 1) * step;
      const auto middle = static_cast<float>(kLowNm + (i + 0.5) * step);
      const Triple color = DaylightBetween(low, high);
      const Halves plain =
          Render(DielectricMaterial(IndexAt(middle, kStrongIndexAtD, kStrongDispersion)),
                 1000 * seed + static_cast<std::uint64_t>(i), false);
      for (std::size_t k = 0; k < 6; ++k)
        sum[k] += color[k % 3] * plain[k];
    }
    for (std::size_t k = 0; k < 6; ++k) {
      dispersed[k].push_back(whole[k]);
      together[k].push_back(sum[k]);
    }
  }
  const double quantile = StudentQuantile(SidakLevel(1e-3, kComparisons), kSeeds);
  bool is_seen = false;
  Halves expected{};
  Halves bound{};
  for (std::size_t k = 0; k < 6; ++k) {
    const MeasuredMean a = MeanOf(dispersed[k]);
    const MeasuredMean b = MeanOf(together[k]);
    expected[k] = b.mean;
    bound[k] = quantile * std::hypot(a.standard_error, b.standard_error);
    EXPECT_NEAR(a.mean, b.mean, bound[k]) << k << " ratio " << a.mean / b.mean;
    for (std::size_t l = k / 3 * 3; l < k; ++l)
      is_seen = is_seen || std::abs(expected[k] - expected[l]) > bound[k] + bound[l];
  }
  if (GetParam() == View::kBoth) {
    // A wrong weight of paths that meet glass twice would be off by a factor of three.
    for (std::size_t k = 0; k < 6; ++k)
      EXPECT_LT(bound[k], 0.3 * expected[k]) << "the bound would let a wrong result pass";
  } else {
    // With one index all channels of a half are equal.
    EXPECT_TRUE(is_seen) << "the bound would let a wrong result pass";
  }
}

INSTANTIATE_TEST_SUITE_P(Views, SpectralDispersionTest,
                         testing::Values(View::kPhotons, View::kEyePaths, View::kBoth),
                         [](const testing::TestParamInfo<View>& view) {
                           return view.param == View::kPhotons    ? "OfPhotons"
                                  : view.param == View::kEyePaths ? "OfEyePaths"
                                                                  : "OfBoth";
                         });

}  // namespace
}  // namespace lucerna
