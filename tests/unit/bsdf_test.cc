// Surfaces scatter by their own density, both ways alike, and never more light than they get.
#include "render/transport/bsdf.h"

#include <cmath>
#include <complex>
#include <numbers>
#include <string>
#include <vector>

#include "gtest/gtest.h"

#include "render/math/rng.h"
#include "render/math/warp.h"
#include "render/transport/coat.h"
#include "render/transport/coat_tables.h"
#include "tests/support/chi_square.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

Vec3 Direction(double theta_deg, double phi_deg) {
  const double theta = theta_deg * std::numbers::pi / 180;
  const double phi = phi_deg * std::numbers::pi / 180;
  return {static_cast<float>(std::sin(theta) * std::cos(phi)),
          static_cast<float>(std::sin(theta) * std::sin(phi)), static_cast<float>(std::cos(theta))};
}

Material Anisotropic(Material material, float alpha_u, float alpha_v) {
  material.alpha_u = alpha_u;
  material.alpha_v = alpha_v;
  return material;
}

Material OnePart(const Material& material, Parts part) {
  Material one = material;
  one.parts = part;
  return one;
}

// A coated material whose coat is as rough as a texture says at some place.
Material FittedCoat(Material material, float widest, float here) {
  material.alpha_u = material.alpha_v = widest;
  material.roughness_textures = {0, 0, kNoTexture, kNoTexture};
  std::vector<Material> one = {material};
  PrepareCoats(one);
  one[0].alpha_u = one[0].alpha_v = here;
  FitCoat(one[0]);
  return one[0];
}

Material Tinted(Material material) {
  material.reflection_tint = {0.9F, 0.5F, 0.1F};
  material.transmission_tint = {0.2F, 0.7F, 0.4F};
  material.is_tinted = true;
  return material;
}

// A coat that passes what it does not reflect.
Material Passing(Material material) {
  material.coat_passes_rest = true;
  material.thickness = 0;
  std::vector<Material> one = {material};
  PrepareCoats(one);
  return one[0];
}

const Rgb kGoldEta = {0.15F, 0.4F, 1.4F};
const Rgb kGoldK = {3.5F, 2.4F, 1.8F};

std::vector<Material> RoughMaterials() {
  return {DiffuseMaterial(0.7F),
          ConductorMaterial(kGoldEta, kGoldK, 0.15F, 0.15F),
          ConductorMaterial(kGoldEta, kGoldK, 0.5F, 0.5F),
          ConductorMaterial(kGoldEta, kGoldK, 0.6F, 0.2F),
          DielectricMaterial(1.5F, 0.2F),
          DielectricMaterial(1.5F, 0.6F),
          DielectricMaterial(0.75F, 0.4F),
          Anisotropic(DielectricMaterial(1.33F), 0.5F, 0.2F),
          CoatedMaterial(0.7F, 0.3F, 0.1F),
          CoatedMaterial(0.2F, 0.1F),
          OnePart(CoatedMaterial(0.7F, 0.4F), Parts::kFirst),
          OnePart(CoatedMaterial(0.7F, 0.4F), Parts::kSecond),
          OnePart(CoatedMaterial(0.9F, 0), Parts::kSecond),
          CoatedMetal(kGoldEta, kGoldK, 0.3F, 0.2F, 0.1F),
          CoatedMetal(kGoldEta, kGoldK, 0.4F, 0),
          OnePart(CoatedMetal(kGoldEta, kGoldK, 0, 0.3F), Parts::kSecond),
          OnePart(SubsurfaceMaterial(0.8F, 0.1F), Parts::kSecond),
          OnePart(SubsurfaceMaterial(0.6F, 0.1F, 0.4F), Parts::kFirst),
          OnePart(SubsurfaceMaterial(0.6F, 0.1F, 0.4F), Parts::kSecond),
          OnePart(WithHaze(CoatedMaterial(0.7F, 0, 0.4F), 0.8F, 0.3F), Parts::kSecond),
          WithHaze(CoatedMaterial(0.7F, 0.3F, 0.4F), 0.8F, 0.3F),
          WithHaze(CoatedMetal(kGoldEta, kGoldK, 0.3F, 0.2F, 0.4F), 0.9F, 0),
          SheetMaterial(0.3F, 0.6F),
          OnePart(SheetMaterial(0.3F, 0.6F), Parts::kFirst),
          OnePart(SheetMaterial(0.3F, 0.6F), Parts::kSecond),
          Passing(CoatedMaterial(0.7F, 0.3F)),
          Passing(CoatedMaterial(0.7F, 1)),
          OnePart(Passing(CoatedMaterial(0.9F, 0)), Parts::kSecond),
          FittedCoat(Passing(CoatedMaterial(0.7F, 0.3F)), 0.5F, 0.17F),
          Tinted(ConductorMaterial(kGoldEta, kGoldK, 0.6F, 0.2F)),
          Tinted(DielectricMaterial(1.5F, 0.6F)),
          FittedCoat(CoatedMaterial(0.7F, 0.3F, 0.1F), 0.5F, 0.17F),
          FittedCoat(CoatedMetal(kGoldEta, kGoldK, 0.3F, 0.2F, 0.1F), 0.4F, 0.23F)};
}

const std::vector<Vec3> kViews = {Direction(0, 0),    Direction(30, 20),   Direction(60, 200),
                                  Direction(85, 70),  Direction(110, 300), Direction(150, 10),
                                  Direction(135, 45), Direction(179, 0)};

TEST(BsdfTest, SamplesByItsOwnDensity) {
  const auto materials = RoughMaterials();
  const double level = SidakLevel(1e-3, static_cast<int>(materials.size() * kViews.size()));
  std::uint64_t key = 100;
  for (std::size_t m = 0; m < materials.size(); ++m) {
    for (std::size_t v = 0; v < kViews.size(); ++v) {
      const Material& material = materials[m];
      const Vec3 wo = kViews[v];
      const double p_value = DirectionsPValue(
          [&](float u_lobe, float u1, float u2, Vec3& direction) {
            BsdfSample sample;
            if (!SampleBsdf(material, wo, u_lobe, u1, u2, Carried::kFlux, sample)) return false;
            direction = sample.wi;
            return true;
          },
          [&](Vec3 wi) { return static_cast<double>(PdfBsdf(material, wo, wi)); }, 100000, ++key);
      EXPECT_GT(p_value, level) << "material " << m << ", view " << v;
    }
  }
}

TEST(BsdfTest, ADensityOfAnotherRoughnessIsRefused) {
  const Material material = DielectricMaterial(1.5F, 0.3F);
  const Material other = DielectricMaterial(1.5F, 0.32F);
  const Vec3 wo = Direction(40, 0);
  EXPECT_LT(DirectionsPValue(
                [&](float u_lobe, float u1, float u2, Vec3& direction) {
                  BsdfSample sample;
                  if (!SampleBsdf(material, wo, u_lobe, u1, u2, Carried::kFlux, sample)) {
                    return false;
                  }
                  direction = sample.wi;
                  return true;
                },
                [&](Vec3 wi) { return static_cast<double>(PdfBsdf(other, wo, wi)); }, 200000, 1),
            1e-6);
}

TEST(BsdfTest, WeighsASampleByValueOverDensity) {
  KeyedRng rng(9);
  const auto materials = RoughMaterials();
  for (std::size_t m = 0; m < materials.size(); ++m) {
    for (const Vec3 wo : kViews) {
      for (const Carried carried : {Carried::kRadiance, Carried::kFlux}) {
        for (int i = 0; i < 300; ++i) {
          const float u_lobe = rng.Uniform();
          const float u1 = rng.Uniform();
          const float u2 = rng.Uniform();
          BsdfSample sample;
          if (!SampleBsdf(materials[m], wo, u_lobe, u1, u2, carried, sample)) continue;
          ASSERT_NEAR(Length(sample.wi), 1, 1e-5);
          // At the horizon float leaves few digits of the cosine.
          if (std::abs(sample.wi.z) < 0.02F) continue;
          const float pdf = PdfBsdf(materials[m], wo, sample.wi);
          ASSERT_NEAR(pdf / sample.pdf, 1, 5e-3) << "material " << m;
          const Rgb f = EvaluateBsdf(materials[m], wo, sample.wi, carried);
          for (int c = 0; c < 3; ++c) {
            ASSERT_NEAR(f[c] * std::abs(sample.wi.z) / pdf, sample.weight[c],
                        5e-3F * sample.weight[c])
                << "material " << m;
          }
        }
      }
    }
  }
}

TEST(BsdfTest, IsReciprocal) {
  KeyedRng rng(10);
  const auto materials = RoughMaterials();
  int transmitted = 0;
  for (std::size_t m = 0; m < materials.size(); ++m) {
    for (int i = 0; i < 5000; ++i) {
      const float a1 = rng.Uniform();
      const float a2 = rng.Uniform();
      const float b1 = rng.Uniform();
      const float b2 = rng.Uniform();
      const Vec3 a = SquareToSphere(a1, a2);
      const Vec3 b = SquareToSphere(b1, b2);
      if (std::abs(a.z) < 0.02F || std::abs(b.z) < 0.02F) continue;
      const float there = EvaluateBsdf(materials[m], a, b, Carried::kRadiance).g;
      const float back = EvaluateBsdf(materials[m], b, a, Carried::kRadiance).g;
      // Radiance over the squared index is what is conserved: f(a→b) / η_a² is symmetric.
      float expected = back;
      if (materials[m].kind == Material::Kind::kDielectric && a.z * b.z < 0) {
        const float squared = materials[m].ior * materials[m].ior;
        expected *= b.z < 0 ? 1 / squared : squared;
        if (back > 0) ++transmitted;
        // Flux and radiance are each other's adjoint, up to what 1 - Fresnel keeps of its digits.
        const float flux = EvaluateBsdf(materials[m], b, a, Carried::kFlux).g;
        ASSERT_NEAR(there, flux, 2e-3F * flux + 3e-6F);
      }
      ASSERT_NEAR(there, expected, 2e-3F * expected + 3e-6F) << "material " << m;
    }
  }
  EXPECT_GT(transmitted, 1000);
}

// What a sample carries on average, of flux 1 that falls in.
double MeanWeight(const Material& material, Vec3 wo, Carried carried) {
  KeyedRng rng(12);
  constexpr int kSamples = 20000;
  double sum = 0;
  for (int i = 0; i < kSamples; ++i) {
    const float u_lobe = rng.Uniform();
    const float u1 = rng.Uniform();
    const float u2 = rng.Uniform();
    BsdfSample sample;
    if (SampleBsdf(material, wo, u_lobe, u1, u2, carried, sample)) {
      sum += static_cast<double>(MaxChannel(sample.weight));
    }
  }
  return sum / kSamples;
}

TEST(BsdfTest, NeverScattersMoreThanItGets) {
  for (const Vec3 wo : kViews) {
    for (const float alpha : {0.05F, 0.3F, 0.8F}) {
      EXPECT_LE(MeanWeight(DielectricMaterial(1.5F, alpha), wo, Carried::kFlux), 1 + 1e-5);
      // A mean of weights that differ: five standard errors more.
      EXPECT_LE(MeanWeight(CoatedMaterial(1, alpha), wo, Carried::kFlux), 1 + 5e-3);
      EXPECT_LE(MeanWeight(CoatedMetal({0, 0, 0}, Gray(1), alpha, alpha), wo, Carried::kFlux),
                1 + 5e-3);
      EXPECT_LE(MeanWeight(CoatedMetal({0, 0, 0}, Gray(1), 0, alpha), wo, Carried::kFlux),
                1 + 5e-3);
      EXPECT_LE(MeanWeight(ConductorMaterial({0, 0, 0}, Gray(1), alpha, alpha), wo, Carried::kFlux),
                1 + 1e-5);
    }
    EXPECT_EQ(MeanWeight(DielectricMaterial(1.5F), wo, Carried::kFlux), 1);
    EXPECT_EQ(MeanWeight(DiffuseMaterial(1), wo, Carried::kFlux), 1);
  }
  // A smooth-enough rough one loses next to nothing, seen from above.
  EXPECT_GT(MeanWeight(DielectricMaterial(1.5F, 0.05F), Direction(10, 0), Carried::kFlux), 0.995);
  // A perfect metal reflects all but what its facets hide.
  EXPECT_GT(MeanWeight(ConductorMaterial({0, 0, 0}, Gray(1), 0.1F, 0.1F), Direction(10, 0),
                       Carried::kFlux),
            0.98);
}

// What a separable part says of itself is its BSDF.
TEST(BsdfTest, SeparablePartsAreTheProductOfTheirFactors) {
  KeyedRng rng(11);
  for (const Material& material :
       {DiffuseMaterial(0.7F), OnePart(CoatedMaterial(0.7F, 0.4F, 0.2F), Parts::kSecond),
        OnePart(CoatedMaterial(0.9F, 0), Parts::kSecond),
        OnePart(SheetMaterial(0.3F, 0.6F), Parts::kFirst),
        OnePart(SheetMaterial(0.3F, 0.6F), Parts::kSecond)}) {
    ASSERT_TRUE(PropertiesOf(material).is_separable);
    const float side = PropertiesOf(material).transmits ? -1 : 1;
    for (int i = 0; i < 100; ++i) {
      const float a1 = rng.Uniform();
      const float a2 = rng.Uniform();
      const Vec3 wo = SquareToSphere(a1, a2);
      Vec3 wi = SquareToSphere(a2, a1);
      if (wo.z * wi.z * side < 0) wi.z = -wi.z;
      const Rgb product = EyeFactor(material, wo) * PhotonFactor(material, wi);
      EXPECT_FLOAT_EQ(product.g, EvaluateBsdf(material, wo, wi, Carried::kRadiance).g);
      wi.z = -wi.z;
      EXPECT_EQ(EvaluateBsdf(material, wo, wi, Carried::kRadiance).g, 0);
    }
  }
}

// Both parts together are the whole.
TEST(BsdfTest, PartsAddUpToTheWhole) {
  KeyedRng rng(13);
  for (const Material& material :
       {CoatedMaterial(0.7F, 0.4F, 0.2F), CoatedMetal(kGoldEta, kGoldK, 0, 0.3F),
        SheetMaterial(0.3F, 0.6F)}) {
    for (int i = 0; i < 100; ++i) {
      const float a1 = rng.Uniform();
      const float a2 = rng.Uniform();
      const Vec3 wo = SquareToSphere(a1, a2);
      const Vec3 wi = SquareToSphere(a2, a1);
      const Carried carried = Carried::kRadiance;
      EXPECT_FLOAT_EQ(EvaluateBsdf(OnePart(material, Parts::kFirst), wo, wi, carried).g +
                          EvaluateBsdf(OnePart(material, Parts::kSecond), wo, wi, carried).g,
                      EvaluateBsdf(material, wo, wi, carried).g);
    }
  }
}

TEST(ThinDielectricTest, ReflectsAllOrdersAndSendsTheRestStraightOn) {
  Material sheet;
  sheet.kind = Material::Kind::kThinDielectric;
  sheet.ior = 1.5F;
  // R + T²R/(1 - R²) at right angles, R = 0.04.
  EXPECT_NEAR(ReflectedShare(sheet, 1), 0.04 + 0.96 * 0.96 * 0.04 / (1 - 0.0016), 1e-6);
  EXPECT_NEAR(ReflectedShare(sheet, -1), ReflectedShare(sheet, 1), 1e-7);
  for (const Vec3 wo : kViews) {
    BsdfSample sample;
    ASSERT_TRUE(SampleBsdf(sheet, wo, 0.9999F, 0, 0, Carried::kRadiance, sample));
    EXPECT_TRUE(sample.is_delta);
    EXPECT_EQ(sample.wi, -wo);
    EXPECT_EQ(sample.weight.g, 1);
    ASSERT_TRUE(SampleBsdf(sheet, wo, 0, 0, 0, Carried::kRadiance, sample));
    EXPECT_EQ(sample.wi, (Vec3{-wo.x, -wo.y, wo.z}));
  }
}

// What files multiply the two lobes of glass by, and the one of a metal.
TEST(TintTest, MultipliesWhatIsReflectedAndWhatGoesThrough) {
  BsdfSample sample;
  for (const Material& glass : {Tinted(DielectricMaterial(1.5F)), Tinted([] {
                                  Material thin = DielectricMaterial(1.5F);
                                  thin.kind = Material::Kind::kThinDielectric;
                                  return thin;
                                }())}) {
    ASSERT_TRUE(SampleBsdf(glass, Direction(30, 0), 0, 0, 0, Carried::kFlux, sample));
    EXPECT_EQ(sample.weight, glass.reflection_tint);
    ASSERT_TRUE(SampleBsdf(glass, Direction(30, 0), 0.999F, 0, 0, Carried::kFlux, sample));
    EXPECT_EQ(sample.weight, glass.transmission_tint);
  }
  const Material metal = ConductorMaterial(kGoldEta, kGoldK, 0, 0);
  BsdfSample of_tinted;
  ASSERT_TRUE(SampleBsdf(metal, Direction(30, 0), 0, 0, 0, Carried::kFlux, sample));
  ASSERT_TRUE(SampleBsdf(Tinted(metal), Direction(30, 0), 0, 0, 0, Carried::kFlux, of_tinted));
  EXPECT_EQ(of_tinted.weight, sample.weight * Tinted(metal).reflection_tint);
}

TEST(SmoothDielectricTest, BendsBySnellAndCompressesRadianceOnly) {
  for (const Vec3 wo : kViews) {
    const Material glass = DielectricMaterial(1.5F);
    BsdfSample sample;
    ASSERT_TRUE(SampleBsdf(glass, wo, 0.9999F, 0, 0, Carried::kRadiance, sample));
    EXPECT_TRUE(sample.is_delta);
    const float eta = wo.z > 0 ? 1.5F : 1 / 1.5F;
    const float sine = std::hypot(wo.x, wo.y);
    if (sine / eta >= 1) {  // total reflection
      EXPECT_GT(sample.wi.z * wo.z, 0);
      EXPECT_EQ(sample.weight.g, 1);
      continue;
    }
    EXPECT_LT(sample.wi.z * wo.z, 0);
    EXPECT_NEAR(std::hypot(sample.wi.x, sample.wi.y), sine / eta, 1e-6);
    EXPECT_NEAR(sample.weight.g, 1 / (eta * eta), 1e-6);
    ASSERT_TRUE(SampleBsdf(glass, wo, 0.9999F, 0, 0, Carried::kFlux, sample));
    EXPECT_EQ(sample.weight.g, 1);
    ASSERT_TRUE(SampleBsdf(glass, wo, 0, 0, 0, Carried::kRadiance, sample));
    EXPECT_EQ(sample.wi, (Vec3{-wo.x, -wo.y, wo.z}));
  }
}

TEST(FresnelTest, DielectricHasItsClosedForms) {
  float cos_t = 0;
  EXPECT_NEAR(FresnelDielectric(1, 1.5F, cos_t), 0.04F, 1e-6);
  EXPECT_NEAR(FresnelDielectric(-1, 1.5F, cos_t), 0.04F, 1e-6);
  EXPECT_EQ(FresnelDielectric(0, 1.5F, cos_t), 1);
  // At Brewster's angle, tan θ = η, only perpendicular light is reflected: ((η²-1)/(η²+1))².
  const float brewster = std::cos(std::atan(1.5F));
  const float rs = (1.5F * 1.5F - 1) / (1.5F * 1.5F + 1);
  EXPECT_NEAR(FresnelDielectric(brewster, 1.5F, cos_t), 0.5F * rs * rs, 1e-6);
  const float critical = std::sqrt(1 - 1 / (1.5F * 1.5F));
  EXPECT_EQ(FresnelDielectric(-(critical - 1e-3F), 1.5F, cos_t), 1);
  EXPECT_EQ(cos_t, 0);
  EXPECT_LT(FresnelDielectric(-(critical + 1e-3F), 1.5F, cos_t), 1);
  EXPECT_LT(FresnelDielectric(0.3F, 1, cos_t), 1e-12F);
  // The same crossing from its two sides.
  for (const float c : {0.1F, 0.5F, 0.9F}) {
    const float outside = FresnelDielectric(c, 1.5F, cos_t);
    float back = 0;
    EXPECT_NEAR(FresnelDielectric(-cos_t, 1.5F, back), outside, 2e-6);
    EXPECT_NEAR(back, c, 2e-6);
  }
}

TEST(FresnelTest, ConductorIsTheComplexFormula) {
  using Complex = std::complex<double>;
  for (const double n : {0.1, 0.4, 1.0, 2.9}) {
    for (const double k : {0.0, 0.5, 3.5, 7.0}) {
      for (const double c : {0.01, 0.2, 0.5, 0.8, 1.0}) {
        const Complex index(n, k);
        const Complex cos_t = std::sqrt(1.0 - (1 - c * c) / (index * index));
        const double expected = 0.5 * (std::norm((c - index * cos_t) / (c + index * cos_t)) +
                                       std::norm((index * c - cos_t) / (index * c + cos_t)));
        const Rgb actual = FresnelConductor(static_cast<float>(c), Gray(static_cast<float>(n)),
                                            Gray(static_cast<float>(k)));
        EXPECT_NEAR(static_cast<double>(actual.g), expected, 3e-5) << n << " " << k << " " << c;
      }
    }
  }
}

TEST(FresnelTest, ConductorIsANumberAtTheHorizon) {
  for (const float c : {0.0F, 1e-20F, 1e-10F, 1e-4F}) {
    for (const float k : {0.0F, 1e-6F, 3.0F}) {
      const Rgb reflectance = FresnelConductor(c, Gray(1), Gray(k));
      EXPECT_TRUE(reflectance.g >= 0 && reflectance.g <= 1)
          << c << " " << k << " " << reflectance.g;
    }
  }
}

TEST(GathersTest, SeparatesWhatPhotonsFindFromWhatEyePathsFind) {
  EXPECT_TRUE(Gathers(DiffuseMaterial(0.1F)));
  EXPECT_FALSE(Gathers(DiffuseMaterial(0)));
  EXPECT_FALSE(Gathers(DielectricMaterial(1.5F)));
  EXPECT_FALSE(Gathers(DielectricMaterial(1.5F, kGatherAlpha)));
  EXPECT_TRUE(Gathers(DielectricMaterial(1.5F, kGatherAlphaDielectric)));
  Material metal;
  metal.kind = Material::Kind::kConductor;
  metal.alpha_u = kGatherAlpha / 2;
  EXPECT_FALSE(Gathers(metal));
  metal.alpha_v = kGatherAlpha;
  EXPECT_TRUE(Gathers(metal));
}

// Between equal media nothing is reflected and nothing bent, down to 89.999999 degrees: there
// 1 - cos² is 1 in float.
TEST(FresnelTest, EqualMediaAreNoSurfaceAtAnyIncidence) {
  for (const float cosine : {1.0F, 0.5F, 1e-2F, 1e-4F, 1e-6F, 2e-8F}) {
    for (const float side : {1.0F, -1.0F}) {
      float cos_t = 0;
      EXPECT_LT(FresnelDielectric(side * cosine, 1, cos_t), 1e-12F) << cosine;
      EXPECT_FLOAT_EQ(cos_t, cosine);
    }
  }
}

}  // namespace
}  // namespace lucerna
