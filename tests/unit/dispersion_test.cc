// Does glass bend each wavelength as catalogues say, and is light of all wavelengths white?
#include "render/math/dispersion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <string_view>

#include "gtest/gtest.h"

#include "render/formats/pbrt/optical_constants.h"
#include "render/transport/path_wavelength.h"
#include "tests/support/test_scenes.h"
#include "worker/photon_path.h"

namespace lucerna {
namespace {

constexpr float kFNm = 486.13F, kDNm = 587.6F, kCNm = 656.27F;  // Fraunhofer's lines

double AbbeNumber(const RefractiveIndex& index) {
  const auto at = [&](float nm) {
    return static_cast<double>(IndexAt(nm, index.at_d, index.dispersion));
  };
  return (at(kDNm) - 1) / (at(kFNm) - at(kCNm));
}

TEST(DispersionTest, GlassesHaveTheAbbeNumbersOfTheirCatalogue) {
  struct Glass {
    std::string_view name;
    double abbe;
  };
  for (const Glass& glass :
       {Glass{"glass-BK7", 64.17}, Glass{"glass-BAF10", 47.11}, Glass{"glass-FK51A", 84.47},
        Glass{"glass-LASF9", 32.17}, Glass{"glass-F5", 32.25}, Glass{"glass-F10", 28.53},
        Glass{"glass-F11", 25.68}}) {
    // Cauchy's three terms are off by 1e-4 of the index at most.
    EXPECT_NEAR(AbbeNumber(GlassNamed(glass.name).value()), glass.abbe, 0.01 * glass.abbe)
        << glass.name;
  }
}

TEST(DispersionTest, AFitKeepsWhatCauchysEquationSays) {
  const auto index_at = [](double nm) { return 1.6 + 4e3 / (nm * nm) + 2e8 / std::pow(nm, 4); };
  const Dispersion fitted = FitDispersion(index_at);
  for (const double nm : {400.0, 486.13, 550.0, 656.27, 700.0}) {
    EXPECT_NEAR(IndexAt(static_cast<float>(nm), static_cast<float>(index_at(kHeliumDNm)), fitted),
                index_at(nm), 1e-6);
  }
  EXPECT_TRUE(FitDispersion([](double) { return 1.33; }).is_none());
}

// The mean over evenly spaced numbers is off by what one of them brings at each of 300 steps.
TEST(PathWavelengthTest, TheMeanColorIsWhite) {
  constexpr int kDraws = 1 << 20;
  std::array<double, 3> sum{};
  for (int i = 0; i < kDraws; ++i) {
    const PathWavelength wavelength((static_cast<float>(i) + 0.5F) / kDraws);
    ASSERT_NEAR(wavelength.color().r + wavelength.color().g + wavelength.color().b, 3, 1e-5);
    for (std::size_t c = 0; c < 3; ++c)
      sum[c] += static_cast<double>(wavelength.color()[static_cast<int>(c)]) / kDraws;
  }
  for (const double channel : sum)
    EXPECT_NEAR(channel, 1, 300 * 3.0 / kDraws);
}

TEST(PathWavelengthTest, WavelengthsRiseAndHaveTheirColors) {
  float before = 0;
  for (float u = 0; u < 1; u += 1e-3F) {
    const PathWavelength wavelength(u);
    ASSERT_GT(wavelength.nm(), before);
    before = wavelength.nm();
    const Rgb color = wavelength.color();
    if (before > 610) {
      EXPECT_GT(color.r, 2) << before;
    } else if (before > 520 && before < 550) {
      EXPECT_GT(color.g, color.r + color.b) << before;
    } else if (before < 460) {
      EXPECT_GT(color.b, 2) << before;
    }
  }
  for (const float u : {0.0F, 0x1.fffffep-1F}) {
    EXPECT_GE(PathWavelength(u).nm(), kFirstVisibleNm);
    EXPECT_LE(PathWavelength(u).nm(), kLastVisibleNm);
  }
}

Material FlintGlass() {
  const RefractiveIndex index = GlassNamed("glass-F11").value();
  Material glass = DielectricMaterial(index.at_d);
  glass.dispersion = index.dispersion;
  return glass;
}

TEST(PathWavelengthTest, APathIsColoredOnceWhereGlassDisperses) {
  PathWavelength wavelength(0.9F);
  const Material plain = DielectricMaterial(1.5F);
  EXPECT_FALSE(wavelength.IsFirstUsedAt(plain));
  Material rough = FlintGlass();
  rough.alpha_u = rough.alpha_v = 0.1F;
  EXPECT_FALSE(wavelength.IsFirstUsedAt(rough));
  EXPECT_TRUE(wavelength.IsFirstUsedAt(FlintGlass()));
  EXPECT_FALSE(wavelength.IsFirstUsedAt(FlintGlass()));
  PathWavelength none;
  EXPECT_FALSE(none.IsFirstUsedAt(FlintGlass()));
}

// Each refraction of each photon, by Snell's law at its wavelength; reflections are those of any
// glass. Floats bend a direction by some 1e-6.
TEST(DispersionTest, PhotonsAreRefractedByTheIndexOfTheirWavelength) {
  Scene scene;
  const std::int32_t glass = AddMaterial(scene, FlintGlass());
  AddSphere(scene, {0, 0, 0}, 1, glass);
  AddQuad(scene, {-9, -9, -3}, {18, 0, 0}, {0, 18, 0}, AddMaterial(scene, DiffuseMaterial(0.5F)));
  scene.spot_lights.push_back({.position = {0.3F, 0.2F, 5},
                               .direction = {0, 0, -1},
                               .intensity = Gray(1),
                               .cos_falloff_start = 0.98F,
                               .cos_total_width = 0.97F});
  const RenderSettings settings = TestSettings(scene, 4096, 0.1, 6);
  const SceneNeeds needs = NeedsOf(scene, settings);
  ASSERT_TRUE(needs.Uses(Part::kDispersion));
  const std::unique_ptr<Intersector> intersector = Intersector::Create(scene).value();
  const LightSet lights(scene, *intersector);
  const PhotonPathTracer tracer(scene, *intersector, lights, settings, needs, nullptr, {});
  const RefractiveIndex index = GlassNamed("glass-F11").value();
  int refractions = 0;
  float lowest = kLastVisibleNm;
  float highest = 0;
  for (std::uint64_t number = 0; number < 4096; ++number) {
    const PhotonHistory history = tracer.Replay(0, number);
    Vec3 from = history.emission.ray.origin;
    for (const PhotonLanding& landing : history.landings) {
      const Vec3 at = landing.surface.position;
      if (landing.is_smooth && landing.transmits) {
        ++refractions;
        lowest = std::min(lowest, history.wavelength_nm);
        highest = std::max(highest, history.wavelength_nm);
        const Vec3 normal = landing.surface.shading_normal;
        const Vec3 along = Normalize(at - from);
        const float ratio = Dot(along, normal) < 0 ? 1 : -1;  // into the glass, or out of it
        const double n =
            static_cast<double>(IndexAt(history.wavelength_nm, index.at_d, index.dispersion));
        const auto sine = [&](Vec3 v) { return static_cast<double>(Length(Cross(v, normal))); };
        EXPECT_NEAR(sine(along) * std::pow(n, -static_cast<double>(ratio)), sine(landing.leaving),
                    1e-5);
      }
      from = at;
    }
    const bool meets_glass =
        std::ranges::any_of(history.landings, [](const PhotonLanding& landing) {
          return landing.material_kind == Material::Kind::kDielectric;
        });
    EXPECT_EQ(history.wavelength_nm > 0, meets_glass);
  }
  EXPECT_GT(refractions, 4096);
  EXPECT_LT(lowest, 430);
  EXPECT_GT(highest, 670);
}

}  // namespace
}  // namespace lucerna
