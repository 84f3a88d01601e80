// A measured surface scatters as the surface that was measured, is drawn from by its own density,
// and a file that is damaged is refused with what is wrong.
#include "render/scene/measured_table.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

#include "render/formats/measured_file.h"
#include "render/math/pass_wavelengths.h"
#include "render/math/rng.h"
#include "render/scene/saturated_colors.h"
#include "render/transport/bsdf.h"
#include "tests/support/chi_square.h"
#include "tests/support/measured_file.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

using testing::HasSubstr;

Vec3 Towards(double theta_deg, double phi_deg) {
  const double theta = theta_deg * std::numbers::pi / 180;
  const double phi = phi_deg * std::numbers::pi / 180;
  return {static_cast<float>(std::sin(theta) * std::cos(phi)),
          static_cast<float>(std::sin(theta) * std::sin(phi)), static_cast<float>(std::cos(theta))};
}

// Reflects all light that its facets do not hide.
Material WhiteMetal(float alpha_u, float alpha_v) {
  return ConductorMaterial({0, 0, 0}, Gray(1), alpha_u, alpha_v);
}

MetalToMeasure Isotropic(float alpha) {
  MetalToMeasure metal;
  metal.alpha_u = metal.alpha_v = alpha;
  return metal;
}

MetalToMeasure Anisotropic(float turn) {
  MetalToMeasure metal;
  metal.alpha_u = 0.5F;
  metal.alpha_v = 0.25F;
  metal.phis = turn == 1 ? 17 : turn == 0.5F ? 9 : 5;
  metal.turn = turn;
  return metal;
}

// --- the grids ---------------------------------------------------------------------------------

constexpr GridSize kSmall = {4, 3};
const std::vector<float> kDensities = {1, 2, 0, 4, 3, 1, 5, 2, 0, 0, 1, 2,  // one
                                       2, 2, 2, 2, 1, 1, 1, 1, 4, 4, 4, 4,  // another
                                       0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0};

TEST(BilinearDensitiesTest, AreDrawnFromByTheirDensityAndFoundAgain) {
  const BilinearDensities densities(kSmall, kDensities);
  for (const GridMixture& mixture :
       {GridMixture{{0, 0, 0, 0}, {1, 0, 0, 0}}, GridMixture{{0, 1, 2, 0}, {0.3F, 0.5F, 0.2F, 0}},
        GridMixture{{2, 0, 0, 0}, {1, 0, 0, 0}}}) {
    KeyedRng rng(4);
    constexpr int kDraws = 20000;
    constexpr int kParts = 5;  // of each side of the square, beside the knots
    std::array<double, kParts* kParts> counts = {};
    const auto part_of = [](Vec2 at) {
      const auto of = [](float place) { return std::min(static_cast<int>(place * kParts), 4); };
      return static_cast<std::size_t>(of(at.y) * kParts + of(at.x));
    };
    for (int i = 0; i < kDraws; ++i) {
      const float u1 = rng.Uniform();
      const float u2 = rng.Uniform();
      const BilinearDensities::Place drawn = densities.Sample(mixture, {u1, u2});
      ASSERT_NEAR(drawn.density, densities.Density(mixture, drawn.at), 1e-4F * (1 + drawn.density));
      const BilinearDensities::Place found = densities.Find(mixture, drawn.at);
      ASSERT_NEAR(found.density, drawn.density, 1e-4F * (1 + drawn.density));
      // Where the density is near zero, many numbers lead to about the same place.
      if (drawn.density > 0.05F) {
        ASSERT_NEAR(found.at.x, u1, 1e-4F);
        ASSERT_NEAR(found.at.y, u2, 1e-4F);
      }
      counts[part_of(drawn.at)] += 1;
    }
    std::array<double, kParts* kParts> expected = {};
    constexpr int kSide = 500;
    for (int i = 0; i < kSide * kSide; ++i) {
      const Vec2 at = {(static_cast<float>(i % kSide) + 0.5F) / kSide,
                       (static_cast<float>(i / kSide) + 0.5F) / kSide};
      expected[part_of(at)] +=
          static_cast<double>(densities.Density(mixture, at)) * kDraws / (kSide * kSide);
    }
    // 75 questions: five standard deviations.
    for (std::size_t i = 0; i < counts.size(); ++i)
      EXPECT_NEAR(counts[i], expected[i], 5 * std::sqrt(expected[i]) + 1) << i;
  }
}

TEST(BilinearDensitiesTest, AMixtureHasTheMixedDensity) {
  const BilinearDensities densities(kSmall, kDensities);
  const GridMixture first = {{0, 0, 0, 0}, {1, 0, 0, 0}};
  const GridMixture second = {{1, 0, 0, 0}, {1, 0, 0, 0}};
  const GridMixture both = {{0, 1, 0, 0}, {0.25F, 0.75F, 0, 0}};
  const Vec2 place = {0.3F, 0.6F};
  EXPECT_NEAR(densities.Density(both, place),
              0.25F * densities.Density(first, place) + 0.75F * densities.Density(second, place),
              1e-5F);
}

TEST(BilinearGridsTest, AreLinearBetweenTheirKnots) {
  const BilinearGrids grids({2, 2}, {0, 1, 2, 5});
  EXPECT_FLOAT_EQ(grids.At(0, {0, 0}), 0);
  EXPECT_FLOAT_EQ(grids.At(0, {1, 0}), 1);
  EXPECT_FLOAT_EQ(grids.At(0, {0, 1}), 2);
  EXPECT_FLOAT_EQ(grids.At(0, {1, 1}), 5);
  EXPECT_FLOAT_EQ(grids.At(0, {0.5F, 0.25F}), 0.75F * 0.5F + 0.25F * 3.5F);
  EXPECT_FLOAT_EQ(grids.At(0, {2, -1}), 1) << "beyond the square: its border";
}

// --- the BSDF ----------------------------------------------------------------------------------

TEST(MeasuredTableTest, ScattersAsTheMetalThatWasMeasured) {
  const auto expect = [](const Material& measured, const Material& metal) {
    // Eyes at knots of the table and between them.
    for (const double theta : {0.0, 20.0, 50.0}) {
      for (const double phi : {-180.0, -100.0, -10.0, 45.0, 120.0}) {
        const Vec3 wo = Towards(theta, phi);
        for (const double theta_i : {5.0, 30.0, 55.0}) {
          for (const double phi_i : {-170.0, -60.0, 0.0, 100.0}) {
            const Vec3 wi = Towards(theta_i, phi_i);
            const Rgb expected = EvaluateBsdf(metal, wo, wi, Carried::kRadiance);
            const Rgb found = EvaluateBsdf(measured, wo, wi, Carried::kRadiance);
            // Lines between 32 knots.
            EXPECT_NEAR(found.g, expected.g, 0.05F * expected.g + 0.004F)
                << theta << ", " << phi << ", " << theta_i << ", " << phi_i;
            EXPECT_NEAR(found.r, found.g, 1e-3F * found.g);
          }
        }
      }
    }
  };
  {
    SCOPED_TRACE("isotropic");
    expect(MeasuredMaterial(MeasureMetal(Isotropic(0.4F))), WhiteMetal(0.4F, 0.4F));
  }
  for (const float turn : {1.0F, 0.5F, 0.25F}) {
    SCOPED_TRACE(turn);
    expect(MeasuredMaterial(MeasureMetal(Anisotropic(turn))), WhiteMetal(0.5F, 0.25F));
  }
}

TEST(MeasuredTableTest, IsDrawnFromByItsOwnDensity) {
  const std::vector<Material> materials = {MeasuredMaterial(MeasureMetal(Isotropic(0.4F))),
                                           MeasuredMaterial(MeasureMetal(Isotropic(0.15F))),
                                           MeasuredMaterial(MeasureMetal(Anisotropic(1))),
                                           MeasuredMaterial(MeasureMetal(Anisotropic(0.25F)))};
  const std::vector<Vec3> views = {Towards(0, 0), Towards(30, 20), Towards(60, 200),
                                   Towards(150, 10)};
  const double level = SidakLevel(1e-3, static_cast<int>(materials.size() * views.size()));
  std::uint64_t key = 500;
  for (std::size_t m = 0; m < materials.size(); ++m) {
    for (const Vec3 wo : views) {
      const double p_value = DirectionsPValue(
          [&](float u_lobe, float u1, float u2, Vec3& direction) {
            BsdfSample sample;
            if (!SampleBsdf(materials[m], wo, u_lobe, u1, u2, Carried::kFlux, sample)) return false;
            direction = sample.wi;
            return true;
          },
          [&](Vec3 wi) { return static_cast<double>(PdfBsdf(materials[m], wo, wi)); }, 100000,
          ++key);
      EXPECT_GT(p_value, level) << "material " << m;
    }
  }
}

TEST(MeasuredTableTest, WeighsASampleByValueOverDensityAndIsTheSameBothWays) {
  KeyedRng rng(9);
  for (const Material& material : {MeasuredMaterial(MeasureMetal(Isotropic(0.3F))),
                                   MeasuredMaterial(MeasureMetal(Anisotropic(0.5F)))}) {
    for (const Vec3 wo : {Towards(10, 0), Towards(50, 70), Towards(120, 200)}) {
      for (const Carried carried : {Carried::kRadiance, Carried::kFlux}) {
        for (int i = 0; i < 300; ++i) {
          const float u1 = rng.Uniform();
          const float u2 = rng.Uniform();
          BsdfSample sample;
          if (!SampleBsdf(material, wo, 0, u1, u2, carried, sample)) continue;
          if (std::abs(sample.wi.z) < 0.05F) continue;
          ASSERT_NEAR(Length(sample.wi), 1, 1e-5);
          const float pdf = PdfBsdf(material, wo, sample.wi);
          ASSERT_NEAR(pdf / sample.pdf, 1, 0.02);
          const Rgb f = EvaluateBsdf(material, wo, sample.wi, carried);
          ASSERT_NEAR(f.g * std::abs(sample.wi.z) / sample.pdf, sample.weight.g,
                      0.02F * sample.weight.g + 1e-5F);
          EXPECT_FLOAT_EQ(EvaluateBsdf(material, -wo, -sample.wi, carried).g, f.g) << "both sides";
          const Carried other = carried == Carried::kFlux ? Carried::kRadiance : Carried::kFlux;
          EXPECT_FLOAT_EQ(EvaluateBsdf(material, sample.wi, wo, other).g, f.g);
        }
      }
    }
  }
}

TEST(MeasuredTableTest, KnowsItsAlbedoAndWidth) {
  for (const float alpha : {0.1F, 0.2F, 0.3F, 0.6F}) {
    const MeasuredTable table(MeasureMetal(Isotropic(alpha)));
    // Of wide lobes, what facets hide or send below is not scattered, and was on their outside.
    EXPECT_NEAR(table.lobe_width() / alpha, 1, alpha < 0.5F ? 0.1 : 0.3);
    const Material metal = WhiteMetal(alpha, alpha);
    double expected = 0;
    constexpr int kSide = 100;
    for (int i = 0; i < kSide * kSide; ++i) {
      BsdfSample sample;
      if (SampleBsdf(metal, {0, 0, 1}, 0, (static_cast<float>(i % kSide) + 0.5F) / kSide,
                     (static_cast<float>(i / kSide) + 0.5F) / kSide, Carried::kRadiance, sample)) {
        expected += static_cast<double>(sample.weight.g) / (kSide * kSide);
      }
    }
    EXPECT_NEAR(table.Albedo(table.WorkingSpace()).g, expected, 0.02);
  }
  EXPECT_TRUE(PropertiesOf(MeasuredMaterial(MeasureMetal(Isotropic(0.3F)))).gathers);
  EXPECT_FALSE(PropertiesOf(MeasuredMaterial(MeasureMetal(Isotropic(0.1F)))).gathers);
}

// Light that comes from above alone does not say whether a surface is black.
TEST(MeasuredTableTest, IsBlackOnlyWhereNothingIsScatteredFromAnywhere) {
  MeasuredData data = MeasureMetal(Isotropic(0.3F));
  const std::size_t of_theta = data.values.size() / data.theta_rad.size();
  for (std::size_t i = 0; i < of_theta; ++i)
    data.values[i] = 0;
  const Material dark_above = MeasuredMaterial(data);
  EXPECT_TRUE(IsBlack(AlbedoOf(dark_above)));
  EXPECT_FALSE(PropertiesOf(dark_above).is_black);
  EXPECT_GT(EvaluateBsdf(dark_above, Towards(50, 0), Towards(50, 180), Carried::kRadiance).g, 0);
  data.values.assign(data.values.size(), 0.0F);
  EXPECT_TRUE(PropertiesOf(MeasuredMaterial(data)).is_black);
}

TEST(MeasuredTableTest, HasTheColorOfItsSpectrumAndItsValuesAtWavelengths) {
  MetalToMeasure metal = Isotropic(0.3F);
  const Material white = MeasuredMaterial(MeasureMetal(metal));
  metal.reflectance = {0, 0.25F, 0.5F, 1};
  Material red = MeasuredMaterial(MeasureMetal(metal));
  const Vec3 wo = Towards(20, 10);
  const Vec3 wi = Towards(25, 170);
  const float all = EvaluateBsdf(white, wo, wi, Carried::kRadiance).g;
  const Rgb color = EvaluateBsdf(red, wo, wi, Carried::kRadiance);
  EXPECT_GT(color.r, color.g);
  EXPECT_GT(color.g, color.b);
  red.measured_planes = red.measured->At({650, 550, 300});
  const Rgb values = EvaluateBsdf(red, wo, wi, Carried::kRadiance);
  EXPECT_NEAR(values.r / all, 0.75F, 1e-3F);
  EXPECT_NEAR(values.g / all, 0.375F, 1e-3F);
  EXPECT_NEAR(values.b / all, 0, 1e-3F);
  // The mean over passes is the colour.
  Rgb mean;
  constexpr int kPasses = 400;
  for (int i = 0; i < kPasses; ++i) {
    const PassWavelengths wavelengths = WavelengthsAt((i + 0.5) / kPasses);
    red.measured_planes = red.measured->At(wavelengths.nm);
    const Rgb at = EvaluateBsdf(red, wo, wi, Carried::kRadiance);
    const auto working = wavelengths.ToWorking(
        {static_cast<double>(at.r), static_cast<double>(at.g), static_cast<double>(at.b)});
    mean += Rgb{static_cast<float>(working[0]), static_cast<float>(working[1]),
                static_cast<float>(working[2])} *
            (1.0F / kPasses);
  }
  // Two models of the observer.
  EXPECT_NEAR(mean.r / color.r, 1, 0.02F);
  EXPECT_NEAR(mean.g / color.g, 1, 0.02F);
  EXPECT_NEAR(mean.b / color.b, 1, 0.02F);
}

// --- the file ----------------------------------------------------------------------------------

MetalToMeasure Tiny() {
  MetalToMeasure metal;
  metal.knots = 3;
  metal.thetas = 2;
  metal.wavelength_nm = {450, 550};
  metal.reflectance = {0.25F, 0.5F};
  return metal;
}

TEST(MeasuredFileTest, HoldsTheTable) {
  const MeasuredData data = MeasureMetal(Tiny());
  const StatusOr<MeasuredTable> read = ParseMeasured(MeasuredFile(data));
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(*read, MeasuredTable(data));
}

TEST(MeasuredFileTest, EveryCutIsRefused) {
  const std::string bytes = MeasuredFile(MeasureMetal(Tiny()));
  for (std::size_t length = 0; length < bytes.size(); ++length)
    ASSERT_FALSE(ParseMeasured(std::string_view(bytes).substr(0, length)).ok()) << length;
}

TEST(MeasuredFileTest, SaysWhatIsWrong) {
  const auto said = [](const std::string& bytes) {
    const StatusOr<MeasuredTable> read = ParseMeasured(bytes);
    return read.ok() ? std::string("nothing") : std::string(read.status().message());
  };
  const auto changed = [&](const auto& change) {
    MeasuredData data = MeasureMetal(Tiny());
    change(data);
    return said(MeasuredFile(data));
  };
  EXPECT_THAT(said("ply\n"), HasSubstr("does not begin with \"tensor_file\""));
  EXPECT_THAT(changed([](MeasuredData& d) { d.values[5] = NAN; }),
              HasSubstr("the array \"spectra\" has a number that is none, or above 1e9"));
  EXPECT_THAT(
      changed([](MeasuredData& d) { d.luminance[5] = std::numeric_limits<float>::infinity(); }),
      HasSubstr("\"luminance\""));
  EXPECT_THAT(changed([](MeasuredData& d) {
                d.theta_rad = {0.5F, 0.5F};
              }),
              HasSubstr("\"theta_i\" must have increasing numbers"));
  EXPECT_THAT(changed([](MeasuredData& d) {
                d.theta_rad = {0.5F, NAN};
              }),
              HasSubstr("\"theta_i\" must have increasing numbers"));
  std::string sizes = MeasuredFile(MeasureMetal(Tiny()));
  sizes[sizes.find("wavelengths") + 11 + 2 + 1 + 8] = 1;
  EXPECT_THAT(said(sizes),
              HasSubstr("\"spectra\" has 2 in dimension 2, where other arrays have 1"));
  MetalToMeasure many = Tiny();
  many.wavelength_nm.clear();
  for (int i = 0; i < 5000; ++i)
    many.wavelength_nm.push_back(300 + 0.1F * static_cast<float>(i));
  many.reflectance.assign(5000, 0.5F);
  EXPECT_THAT(said(MeasuredFile(MeasureMetal(many))), HasSubstr("more than 4096 wavelengths"));
  std::string named = MeasuredFile(MeasureMetal(Tiny()));
  named.replace(named.find("sigma"), 5, "gamma");
  EXPECT_THAT(said(named), HasSubstr("the array \"sigma\" is missing"));
  std::string colors = MeasuredFile(MeasureMetal(Tiny()));
  colors[colors.find("spectra") + 7 + 2] = 11;  // another type of numbers
  EXPECT_THAT(said(colors), HasSubstr("the array \"spectra\" is missing, or of other numbers"));
  std::string version = MeasuredFile(MeasureMetal(Tiny()));
  version[12] = 2;
  EXPECT_THAT(said(version), HasSubstr("its version is 2"));
}

// What measurements leave below zero, by their noise, is zero.
TEST(MeasuredFileTest, NothingIsBelowZero) {
  MeasuredData data = MeasureMetal(Tiny());
  for (float& value : data.values)
    value = -value;
  const StatusOr<MeasuredTable> read = ParseMeasured(MeasuredFile(data));
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_TRUE(IsBlack(read->Albedo(read->WorkingSpace())));
}

}  // namespace
}  // namespace lucerna
