// A coated surface scatters what a walk through its coat brings, and loses no light of its own.
#include "render/transport/coat.h"

#include <array>
#include <cmath>
#include <numbers>

#include "gtest/gtest.h"

#include "render/math/color_space.h"
#include "render/math/rng.h"
#include "render/math/warp.h"
#include "render/transport/bsdf.h"
#include "render/transport/coat_tables.h"
#include "render/transport/media.h"
#include "render/transport/microfacet.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

// What the BSDF of a coated metal differs by from a walk at most, as measured and as
// docs/decisions/materials-in-parts.md states: in shares of flux, where the color of light that
// meets the metal more than once is approximate, and in the mean cosine with the mirror's
// direction, which such light keeps more of than a diffuse lobe does. The second at 0, 45 and 75
// degrees.
constexpr double kFluxError = 0.01;
constexpr std::array<double, 4> kDirectionErrors = {0.02, 0.03, 0.08, 0.09};

Vec3 AtAngle(double theta_deg) {
  const double theta = theta_deg * std::numbers::pi / 180;
  return {static_cast<float>(std::sin(theta)), 0, static_cast<float>(std::cos(theta))};
}

// The part of the light from `wo` that comes out of the coat, by integrating its BSDF over
// directions, which depends little on the azimuth.
double BaseAlbedo(Material material, Vec3 wo) {
  material.parts = Parts::kSecond;
  constexpr int kSteps = 4096;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    const float cosine = std::sqrt((static_cast<float>(i) + 0.5F) / kSteps);
    const float sine = std::sqrt(1 - cosine * cosine);
    const float azimuth = 2 * kPi * static_cast<float>(i % 16) / 16;
    const Vec3 wi = {sine * std::cos(azimuth), sine * std::sin(azimuth), cosine};
    sum += static_cast<double>(EvaluateBsdf(material, wo, wi, Carried::kFlux).g);
  }
  return std::numbers::pi * sum / kSteps;
}

// A white base under a coat that absorbs nothing gives back all that it gets, in the end: Fresnel's
// share at once, the rest from below.
TEST(CoatTest, SmoothCoatOverAWhiteBaseReflectsAllLight) {
  for (const float ior : {1.2F, 1.5F, 2.0F}) {
    Material material = CoatedMaterial(1, 0);
    material.ior = ior;
    material.base_hits = 10000;
    std::vector<Material> one = {material};
    PrepareCoats(one);
    for (const double angle : {0.0, 30.0, 60.0, 80.0, 88.0}) {
      const Vec3 wo = AtAngle(angle);
      float cos_t = 0;
      const auto reflected = static_cast<double>(FresnelDielectric(wo.z, ior, cos_t));
      // The midpoints of two integrals over 4096 angles: each within 1e-4.
      EXPECT_NEAR(reflected + BaseAlbedo(one[0], wo), 1, 1e-3) << ior << " " << angle;
    }
  }
}

// What a coat's facets reflect, by integrating its BSDF.
double CoatAlbedo(Material material, Vec3 wo) {
  material.parts = Parts::kFirst;
  KeyedRng rng(5);
  constexpr int kSamples = 1 << 16;
  double sum = 0;
  for (int i = 0; i < kSamples; ++i) {
    BsdfSample sample;
    const float u1 = rng.Uniform();
    const float u2 = rng.Uniform();
    if (SampleBsdf(material, wo, 0, u1, u2, Carried::kFlux, sample))
      sum += static_cast<double>(sample.weight.g);
  }
  return sum / kSamples;
}

// Under a coat that passes what it does not reflect a base reflects its share of that: no roughness
// loses light, as in the model of glTF 2.0 (appendix B), which mixes both by Fresnel's share.
TEST(CoatTest, WhatPassesAsAWholeReachesTheBaseAndLeaves) {
  for (const float alpha : {0.0F, 0.04F, 0.25F, 1.0F}) {
    for (const float base : {1.0F, 0.5F}) {
      Material material = CoatedMaterial(base, alpha);
      material.coat_passes_rest = true;
      std::vector<Material> one = {material};
      PrepareCoats(one);
      for (const double angle : {0.0, 30.0, 60.0, 80.0}) {
        const double reflected = CoatAlbedo(one[0], AtAngle(angle));
        EXPECT_NEAR(BaseAlbedo(one[0], AtAngle(angle)), static_cast<double>(base) * (1 - reflected),
                    0.01)
            << alpha << " " << base << " " << angle;
      }
    }
  }
}

// Between two tables of a texture's range: the flux that a table of its own gives, within 1 % of
// what falls in, over metals within three standard errors of two sets of 4096 random walks. Also
// where the texture is very rough in some place that is never met.
TEST(CoatTest, ATextureOfRoughnessIsAsGoodAsATableForEach) {
  for (const float widest : {0.5F, 30.0F}) {
    Material material = CoatedMaterial(0.8F, widest, 0.1F);
    material.roughness_textures = {0, 0, kNoTexture, kNoTexture};
    Material metal = CoatedMetal(Gray(0.2F), Gray(3), 0.5F, widest, 0.1F);
    metal.roughness_textures = {kNoTexture, kNoTexture, 0, 0};
    Material lacquered = CoatedMetal(Gray(0.2F), Gray(3), widest, 0.2F, 0.1F);
    lacquered.roughness_textures = {0, 0, kNoTexture, kNoTexture};
    std::vector<Material> prepared = {material, metal, lacquered};
    PrepareCoats(prepared);
    for (const float alpha : {0.0F, 0.01F, 0.07F, 0.2F, 0.33F, 0.5F}) {
      for (int kind = 0; kind < 3; ++kind) {
        // Light of more than one meeting is a random walk's, and few of it come back to a mirror.
        if (kind > 0 && (alpha > 0.3F || (kind == 2 && alpha < 0.05F))) continue;
        Material fitted = prepared[static_cast<std::size_t>(kind)];
        (kind == 1 ? fitted.base_alpha_u : fitted.alpha_u) = alpha;
        (kind == 1 ? fitted.base_alpha_v : fitted.alpha_v) = alpha;
        FitCoat(fitted);
        const Material own = kind == 0   ? CoatedMaterial(0.8F, alpha, 0.1F)
                             : kind == 1 ? CoatedMetal(Gray(0.2F), Gray(3), 0.5F, alpha, 0.1F)
                                         : CoatedMetal(Gray(0.2F), Gray(3), alpha, 0.2F, 0.1F);
        for (const double angle : {10.0, 45.0, 75.0}) {
          EXPECT_NEAR(BaseAlbedo(fitted, AtAngle(angle)), BaseAlbedo(own, AtAngle(angle)),
                      kind == 0 ? 0.01 : 0.02)
              << kind << " " << widest << " " << alpha << " " << angle;
        }
      }
    }
  }
}

// Between tables of several thicknesses a layer scatters and absorbs as one with a table of its
// own. Over metals both are of 4096 random walks for each angle, with deviations of some 0.3: three
// standard errors of the difference are 0.02.
TEST(CoatTest, ThicknessesBetweenTablesAreFitted) {
  constexpr float kMost = 3;
  const auto material = [](int kind, float thickness) {
    Material coated = kind < 2 ? CoatedMaterial(0.7F, kind == 0 ? 0 : 0.3F, thickness)
                               : CoatedMetal(Gray(0.2F), Gray(3), 0.2F, 0.3F, thickness);
    return kind == 1 ? coated : WithHaze(coated, 0.8F, 0.2F);
  };
  for (int kind = 0; kind < 3; ++kind) {
    std::vector<Material> one = {material(kind, kMost)};
    one[0].thickness_texture = 0;
    PrepareCoats(one);
    ASSERT_NE(one[0].coats, nullptr);
    for (const float thickness : {0.0F, 0.05F, 0.3F, 1.0F, 2.5F, 3.0F}) {
      Material fitted = one[0];
      fitted.thickness = thickness;
      FitCoat(fitted);
      const Material own = material(kind, thickness);
      for (const double angle : {10.0, 45.0, 75.0}) {
        EXPECT_NEAR(BaseAlbedo(fitted, AtAngle(angle)), BaseAlbedo(own, AtAngle(angle)),
                    kind < 2 ? 0.01 : 0.02)
            << kind << " " << thickness << " " << angle;
      }
    }
  }
}

// Without a coat's surface there is a diffuse one, seen through what absorbs.
TEST(CoatTest, CoatOfIndexOneIsALayerThatAbsorbs) {
  Material material = CoatedMaterial(0.5F, 0, 0.3F);
  material.ior = 1;
  std::vector<Material> one = {material};
  PrepareCoats(one);
  one[0].parts = Parts::kSecond;
  const Vec3 wo = AtAngle(60);
  const Vec3 wi = AtAngle(20);
  const double expected = 0.5 / std::numbers::pi * std::exp(-0.3 / std::cos(std::numbers::pi / 3)) *
                          std::exp(-0.3 / std::cos(std::numbers::pi / 9));
  EXPECT_NEAR(static_cast<double>(EvaluateBsdf(one[0], wo, wi, Carried::kRadiance).g), expected,
              1e-5);
}

// Light in the layer under a coat's surface, z up: goes on from the surface or the base to one of
// them. True at the base.
bool CrossLayer(const Material& material, KeyedRng& rng, Vec3& direction, double& weight) {
  const auto thickness = static_cast<double>(material.thickness);
  if (!material.HasHaze()) {
    weight *= std::exp(-thickness / static_cast<double>(std::abs(direction.z)));
    return direction.z < 0;
  }
  double height = direction.z < 0 ? thickness : 0;
  while (true) {
    height += static_cast<double>(direction.z) * -std::log1p(-static_cast<double>(rng.Uniform()));
    if (height <= 0) return true;
    if (height >= thickness) return false;
    weight *= static_cast<double>(material.coat_albedo.g);
    const float u1 = rng.Uniform();
    direction = SamplePhase(direction, material.phase_g, u1, rng.Uniform());
  }
}

// The share of flux from `wo` that leaves a coat after at least one meeting with the base or what
// is in the layer, by random walks through it.
struct Walked {
  double mean = 0, standard_error = 0;
};
Walked WalkThroughCoat(const Material& material, Vec3 wo, int walks) {
  Material interface = DielectricMaterial(material.ior);
  interface.alpha_u = material.alpha_u;
  interface.alpha_v = material.alpha_v;
  KeyedRng rng(77);
  const auto cross = [&](Vec3 from, BsdfSample& sample) {
    const float u0 = rng.Uniform();
    const float u1 = rng.Uniform();
    const float u2 = rng.Uniform();
    return SampleBsdf(interface, from, u0, u1, u2, Carried::kFlux, sample);
  };
  double sum = 0;
  double squares = 0;
  for (int i = 0; i < walks; ++i) {
    BsdfSample sample;
    if (!cross(wo, sample) || sample.wi.z > 0) continue;
    double weight = static_cast<double>(sample.weight.g);
    Vec3 direction = sample.wi;
    for (int hit = 0; weight > 1e-6;) {
      if (CrossLayer(material, rng, direction, weight)) {
        if (hit++ == material.base_hits) break;
        weight *= static_cast<double>(material.reflectance.g);
        const float u1 = rng.Uniform();
        const float u2 = rng.Uniform();
        direction = SquareToCosineHemisphere(u1, u2);
        continue;
      }
      // At the surface, where light comes from is below.
      if (!cross(-direction, sample)) break;
      weight *= static_cast<double>(sample.weight.g);
      if (sample.wi.z > 0) {
        sum += weight;
        squares += weight * weight;
        break;
      }
      direction = sample.wi;
    }
  }
  const double mean = sum / walks;
  return {mean, std::sqrt((squares / walks - mean * mean) / walks)};
}

TEST(CoatTest, IsWhatAWalkThroughItBrings) {
  const auto with = [](float reflectance, float alpha_u, float alpha_v, float thickness) {
    Material material = CoatedMaterial(reflectance, alpha_u, thickness);
    material.alpha_v = alpha_v;
    std::vector<Material> one = {material};
    PrepareCoats(one);
    return one[0];
  };
  const std::vector<Material> materials = {
      with(0.8F, 0, 0, 0.01F),       with(1, 0, 0, 0),
      with(0.8F, 0.1F, 0.1F, 0.01F), with(1, 0.3F, 0.3F, 0),
      with(0.8F, 0.7F, 0.7F, 0.5F),  with(0.8F, 0.5F, 0.1F, 0.01F)};
  // Tables are within this of the averages that they stand for.
  constexpr double kTables = 2e-3;
  for (std::size_t m = 0; m < materials.size(); ++m) {
    for (const double angle : {0.0, 45.0, 75.0}) {
      const Walked walked = WalkThroughCoat(materials[m], AtAngle(angle), 200000);
      EXPECT_NEAR(BaseAlbedo(materials[m], AtAngle(angle)), walked.mean,
                  4.5 * walked.standard_error + kTables)
          << "material " << m << ", " << angle << " degrees";
    }
  }
}

// Of a layer that scatters too, over a base and over black, and the same both ways.
TEST(CoatTest, ItsHazeIsWhatAWalkBrings) {
  const std::vector<Material> materials = {WithHaze(CoatedMaterial(0.8F, 0, 0.01F), 1, 0),
                                           WithHaze(CoatedMaterial(0.8F, 0, 0.5F), 0.9F, 0),
                                           WithHaze(CoatedMaterial(0.5F, 0.3F, 1), 0.8F, 0.5F),
                                           WithHaze(CoatedMaterial(0.9F, 0, 1), 0.97F, -0.4F),
                                           WithHaze(CoatedMaterial(0, 0, 2), 0.99F, 0)};
  for (std::size_t m = 0; m < materials.size(); ++m) {
    for (const double angle : {0.0, 45.0, 75.0}) {
      const Walked walked = WalkThroughCoat(materials[m], AtAngle(angle), 100000);
      // Tables are of 4096 walks for an angle: with deviations of at most a half, within 0.01.
      EXPECT_NEAR(BaseAlbedo(materials[m], AtAngle(angle)), walked.mean,
                  4.5 * walked.standard_error + kFluxError)
          << "material " << m << ", " << angle << " degrees";
    }
    Material below = materials[m];
    below.parts = Parts::kSecond;
    const float there = EvaluateBsdf(below, AtAngle(20), AtAngle(70), Carried::kFlux).g;
    const float back = EvaluateBsdf(below, AtAngle(70), AtAngle(20), Carried::kFlux).g;
    EXPECT_NEAR(there / back, 1, 1e-6F) << "material " << m;
  }
}

TEST(CoatTest, EqualCoatsShareATable) {
  std::vector<Material> materials = {CoatedMaterial(0.2F, 0.3F), CoatedMaterial(0.7F, 0.3F),
                                     CoatedMaterial(0.7F, 0.4F), DiffuseMaterial(0.5F)};
  PrepareCoats(materials);
  EXPECT_EQ(materials[0].coat, materials[1].coat);
  EXPECT_NE(materials[0].coat, materials[2].coat);
  EXPECT_EQ(materials[3].coat, nullptr);
}

TEST(CoatTest, ManyThreadsMakeTheSameTables) {
  // Copies: tables that are still in memory would not be made again.
  const auto made = [](int threads) {
    std::vector<Material> materials = {CoatedMaterial(0.2F, 0.3F), CoatedMaterial(0.7F, 0),
                                       WithHaze(CoatedMaterial(0.5F, 0.1F), 0.9F, 0.2F),
                                       CoatedMetal(Gray(0.2F), Gray(3), 0.1F, 0.3F, 0.1F)};
    Material textured = CoatedMaterial(0.5F, 0.4F);
    textured.roughness_textures[0] = textured.roughness_textures[1] = 0;
    materials.push_back(textured);
    for (Material& material : materials)
      material.owned_coat.reset();
    PrepareCoats(materials, threads);
    std::vector<CoatTable> tables = materials.back().coats->tables;
    EXPECT_GT(tables.size(), 1U);
    for (std::size_t i = 0; i + 1 < materials.size(); ++i)
      tables.push_back(*materials[i].coat);
    return tables;
  };
  const std::vector<CoatTable> one = made(1);
  const std::vector<CoatTable> four = made(4);
  ASSERT_EQ(one.size(), four.size());
  for (std::size_t i = 0; i < one.size(); ++i) {
    EXPECT_GT(one[i].inner, 0);
    EXPECT_EQ(one[i].entering, four[i].entering);
    EXPECT_EQ(one[i].inner, four[i].inner);
    EXPECT_EQ(one[i].leaving, four[i].leaving);
    EXPECT_EQ(one[i].residual, four[i].residual);
    EXPECT_EQ(one[i].scattering.entering, four[i].scattering.entering);
    EXPECT_EQ(one[i].scattering.inner, four[i].scattering.inner);
  }
}

TEST(CoatTest, EqualCoatsOfTwoScenesShareATable) {
  const auto of_a_scene = [](float roughness) {
    std::vector<Material> materials = {CoatedMaterial(0.2F, roughness)};
    materials.push_back(materials.front());
    materials.back().roughness_textures[0] = materials.back().roughness_textures[1] = 0;
    PrepareCoats(materials);
    return materials;
  };
  const std::vector<Material> here = of_a_scene(0.3F);
  const std::vector<Material> there = of_a_scene(0.3F);
  const std::vector<Material> other = of_a_scene(0.4F);
  EXPECT_EQ(here[0].coat, there[0].coat);
  EXPECT_EQ(here[1].coats, there[1].coats);
  EXPECT_NE(here[0].coat, other[0].coat);
  EXPECT_NE(here[1].coats, other[1].coats);
}

// Two mirrors: the closed sum of all orders in one direction.
TEST(CoatedMetalTest, SmoothOnSmoothIsAMirrorOfAllOrders) {
  const Rgb eta = {0.2F, 0.5F, 1.2F};
  const Rgb k = {3.6F, 2.5F, 2.0F};
  Material material = CoatedMetal(eta, k, 0, 0, 0.2F);
  material.base_hits = 1000;
  EXPECT_TRUE(PropertiesOf(material).is_smooth);
  EXPECT_FALSE(PropertiesOf(material).has_parts);
  const Vec3 wo = AtAngle(50);
  BsdfSample sample;
  ASSERT_TRUE(SampleBsdf(material, wo, 0.5F, 0.5F, 0.5F, Carried::kRadiance, sample));
  EXPECT_TRUE(sample.is_delta);
  EXPECT_EQ(sample.wi, (Vec3{-wo.x, -wo.y, wo.z}));
  float cos_t = 0;
  const float r = FresnelDielectric(wo.z, 1.5F, cos_t);
  const Rgb metal = FresnelConductor(cos_t, eta * (1 / 1.5F), k * (1 / 1.5F));
  const auto below = [&](float reflectance) {
    const float way = reflectance * std::exp(-2 * 0.2F / cos_t);
    return (1 - r) * (1 - r) * way / (1 - r * way);
  };
  const Rgb expected = Gray(r) + ToWorking(Rgb{below(metal.r), below(metal.g), below(metal.b)});
  for (int c = 0; c < 3; ++c)
    EXPECT_NEAR(sample.weight[c], expected[c], 1e-5F);
}

// A metal that is given as it is in its coat has its reflectance at right angles there.
TEST(CoatedMetalTest, AMetalGivenInItsCoatReflectsWhatItSaysThere) {
  constexpr float kReflectance = 0.6F;
  Material material = CoatedMetal(Gray(1), Gray(AbsorptionFor(kReflectance)), 0, 0, 0);
  material.is_metal_in_coat = true;
  material.base_hits = 1000;
  BsdfSample sample;
  ASSERT_TRUE(SampleBsdf(material, {0, 0, 1}, 0.5F, 0.5F, 0.5F, Carried::kRadiance, sample));
  constexpr float kCoat = 0.04F;  // of an index of 1.5
  const float expected =
      kCoat + (1 - kCoat) * (1 - kCoat) * kReflectance / (1 - kCoat * kReflectance);
  for (int c = 0; c < 3; ++c)
    EXPECT_NEAR(sample.weight[c], expected, 1e-5F);
}

// Flux from `wo` that leaves a coated metal after meeting the metal or what is in the layer, and
// its mean direction along the mirror's, by random walks between a dielectric and a metal, whose
// BSDFs have tests of their own.
struct WalkedMetal {
  double flux = 0, standard_error = 0;
  double along = 0;  // mean cosine between the directions of the flux and of the mirror
};
WalkedMetal WalkOverMetal(const Material& material, Vec3 wo, int walks) {
  Material interface = DielectricMaterial(material.ior);
  interface.alpha_u = material.alpha_u;
  interface.alpha_v = material.alpha_v;
  const Material metal =
      ConductorMaterial(material.eta * (1 / material.ior), material.k * (1 / material.ior),
                        material.base_alpha_u, material.base_alpha_v);
  const Vec3 mirror = {-wo.x, -wo.y, wo.z};
  KeyedRng rng(78);
  const auto scatter = [&](const Material& at, Vec3 from, BsdfSample& sample) {
    const float u0 = rng.Uniform();
    const float u1 = rng.Uniform();
    const float u2 = rng.Uniform();
    return SampleBsdf(at, from, u0, u1, u2, Carried::kFlux, sample);
  };
  double sum = 0;
  double squares = 0;
  double along = 0;
  for (int i = 0; i < walks; ++i) {
    BsdfSample sample;
    if (!scatter(interface, wo, sample) || sample.wi.z > 0) continue;
    double weight = static_cast<double>(sample.weight.g);
    Vec3 direction = sample.wi;
    for (int hit = 0; weight > 1e-6;) {
      const bool is_at_base = CrossLayer(material, rng, direction, weight);
      if (is_at_base && hit++ == material.base_hits) break;
      if (!scatter(is_at_base ? metal : interface, -direction, sample)) break;
      weight *= static_cast<double>(sample.weight.g);
      if (!is_at_base && sample.wi.z > 0) {
        sum += weight;
        squares += weight * weight;
        along += weight * static_cast<double>(Dot(sample.wi, mirror));
        break;
      }
      direction = sample.wi;
    }
  }
  const double mean = sum / walks;
  return {mean, std::sqrt((squares / walks - mean * mean) / walks), along / sum};
}

// The same of the BSDF, without what the coat's surface reflects.
WalkedMetal OfBsdf(Material material, Vec3 wo, int samples) {
  if (material.alpha_u == 0) material.parts = Parts::kSecond;
  const Vec3 mirror = {-wo.x, -wo.y, wo.z};
  KeyedRng rng(79);
  WalkedMetal result;
  double squares = 0;
  for (int i = 0; i < samples; ++i) {
    const float u0 = rng.Uniform();
    const float u1 = rng.Uniform();
    const float u2 = rng.Uniform();
    BsdfSample sample;
    if (!SampleBsdf(material, wo, u0, u1, u2, Carried::kFlux, sample)) continue;
    double weight = static_cast<double>(sample.weight.g);
    if (material.alpha_u > 0) {
      // Both are reflections at facets: the coat's is that of a metal times Fresnel's share.
      const Vec3 m = Normalize(wo + sample.wi);
      float cos_t = 0;
      const Ggx ggx(material);
      weight -= static_cast<double>(FresnelDielectric(Dot(wo, m), material.ior, cos_t) * ggx.D(m) *
                                    ggx.G2(wo, sample.wi) / (4 * wo.z) / sample.pdf);
    }
    result.flux += weight / samples;
    squares += weight * weight / samples;
    result.along += weight * static_cast<double>(Dot(sample.wi, mirror)) / samples;
  }
  result.along /= result.flux;
  result.standard_error = std::sqrt((squares - result.flux * result.flux) / samples);
  return result;
}

TEST(CoatedMetalTest, IsAboutWhatAWalkThroughItBrings) {
  const auto with = [](Rgb eta, Rgb k, float alpha, float base_alpha, float thickness) {
    return CoatedMetal(eta, k, alpha, base_alpha, thickness);
  };
  const std::vector<Material> materials = {
      with({0, 0, 0}, Gray(1), 0, 0.2F, 0.01F),     with({0, 0, 0}, Gray(1), 0, 0.5F, 0),
      with(Gray(0.5F), Gray(2.5F), 0, 0.1F, 0.1F),  with(Gray(0.5F), Gray(2.5F), 0, 0.5F, 0.01F),
      with(Gray(0.5F), Gray(2.5F), 0.1F, 0, 0.01F), with(Gray(0.5F), Gray(2.5F), 0.2F, 0.2F, 0),
      with(Gray(0.5F), Gray(2.5F), 0.5F, 0.3F, 0)};
  for (std::size_t m = 0; m < materials.size(); ++m) {
    for (std::size_t a = 0; a < kDirectionErrors.size(); ++a) {
      const double angle = std::array{0.0, 45.0, 75.0, 85.0}[a];
      const WalkedMetal walked = WalkOverMetal(materials[m], AtAngle(angle), 100000);
      const WalkedMetal ours = OfBsdf(materials[m], AtAngle(angle), 100000);
      EXPECT_NEAR(ours.flux, walked.flux,
                  4.5 * std::hypot(walked.standard_error, ours.standard_error) + kFluxError)
          << "material " << m << ", " << angle << " degrees";
      EXPECT_NEAR(ours.along, walked.along, kDirectionErrors[a])
          << "material " << m << ", " << angle << " degrees";
    }
  }
}

// To first order, light that crosses the coat's facets twice has half vectors whose slope is the
// sum of those of two facets, each times (1 - 1/ior) / 2. The GGX width w of such sums s that is
// likeliest is where w² / (w² + s²) is a half on average.
TEST(CoatedMetalTest, ANarrowCoatWidensAMirrorAsSumsOfTwoSlopesAreWider) {
  const float alpha = 0.02F;
  const Material material = CoatedMetal({0, 0, 0}, Gray(1), alpha, 0, 0);
  constexpr int kSums = 100000;
  KeyedRng rng(80);
  std::vector<double> squares;
  const auto slope = [&](double& x, double& y) {
    const auto u = static_cast<double>(rng.Uniform());
    const double length = std::sqrt(u / (1 - u)) / 2;
    const double turn = 2 * std::numbers::pi * static_cast<double>(rng.Uniform());
    x += length * std::cos(turn);
    y += length * std::sin(turn);
  };
  for (int i = 0; i < kSums; ++i) {
    double x = 0;
    double y = 0;
    slope(x, y);
    slope(x, y);
    squares.push_back(x * x + y * y);
  }
  double low = 0;
  double high = 4;
  for (int i = 0; i < 40; ++i) {
    const double middle = (low + high) / 2;
    double sum = 0;
    for (const double square : squares)
      sum += middle / (middle + square);
    (sum < kSums / 2.0 ? low : high) = middle;
  }
  // The fit has 4096 walks; each term has a deviation of 0.29 about its mean, and the mean changes
  // by a sixth of a relative change of w².
  const double deviation = 6 * 0.29 / std::sqrt(4096.0);
  EXPECT_GT(low, 0.6);
  EXPECT_NEAR(static_cast<double>(CoatWidening(material)) / low, 1, 3 * deviation);
}

// Where the metal reflects all, its colour has no part in it: what is left are errors of tables.
TEST(CoatedMetalTest, OverAMetalThatReflectsAllTheFluxIsThatOfTheWalk) {
  constexpr double kTables = 3e-3;
  for (const float alpha : {0.1F, 0.18F, 0.3F, 0.5F}) {
    for (const float base_alpha : {0.0F, 0.2F}) {
      const Material material = CoatedMetal({0, 0, 0}, Gray(1), alpha, base_alpha, 0.01F);
      for (const double angle : {0.0, 45.0, 60.0}) {
        const WalkedMetal walked = WalkOverMetal(material, AtAngle(angle), 400000);
        const WalkedMetal ours = OfBsdf(material, AtAngle(angle), 400000);
        EXPECT_NEAR(ours.flux, walked.flux,
                    4.5 * std::hypot(walked.standard_error, ours.standard_error) + kTables)
            << alpha << " over " << base_alpha << ", " << angle << " degrees; errors "
            << walked.standard_error << ", " << ours.standard_error;
      }
    }
  }
}

// `relative`: what the model may be off by, of the flux.
void ExpectFluxOfWalk(const Material& material, double angle, int walks, double relative) {
  const WalkedMetal walked = WalkOverMetal(material, AtAngle(angle), walks);
  const WalkedMetal ours = OfBsdf(material, AtAngle(angle), walks);
  const double noise = 4.5 * std::hypot(walked.standard_error, ours.standard_error);
  EXPECT_NEAR(ours.flux, walked.flux, noise + relative * walked.flux)
      << material.alpha_u << " over " << material.base_alpha_u << ", " << angle << " degrees";
}

// What is left after several meetings depends on where light comes from: along the surface it meets
// the metal more often, and more slanted.
TEST(CoatedMetalTest, OfAColouredMetalUnderASmoothCoatTheFluxIsThatOfTheWalk) {
  constexpr double kMeetings = 5e-3;  // relative, of geometric series and of mean cosines
  for (const float base_alpha : {0.1F, 0.17F, 0.4F}) {
    // Copper in green.
    const Material material = CoatedMetal(Gray(0.96F), Gray(2.57F), 0, base_alpha, 0);
    for (const double angle : {0.0, 45.0, 60.0, 75.0}) {
      ExpectFluxOfWalk(material, angle, 400000, kMeetings);
    }
  }
}

// Facets of a coat turn light so that it meets the metal more slanted than light that the mean
// surface refracts, and a metal reflects more of that.
TEST(CoatedMetalTest, OfAColouredMetalUnderARoughCoatTheFluxIsThatOfTheWalk) {
  constexpr double kModel = 1.5e-2;  // relative: 0.7 % of tables, the rest of colours
  for (const float alpha : {0.1F, 0.3F, 0.5F}) {
    for (const float base_alpha : {0.05F, 0.2F}) {
      const Material material = CoatedMetal(Gray(0.96F), Gray(2.57F), alpha, base_alpha, 0);
      for (const double angle : {0.0, 45.0, 60.0, 75.0}) {
        ExpectFluxOfWalk(material, angle, 150000, kModel);
      }
    }
  }
}

// The flux alone: haze has no direction that the model knows.
TEST(CoatedMetalTest, ItsHazeBringsWhatAWalkBrings) {
  const std::vector<Material> materials = {
      WithHaze(CoatedMetal({0, 0, 0}, Gray(1), 0, 0.2F, 0.5F), 0.9F, 0),
      WithHaze(CoatedMetal(Gray(0.5F), Gray(2.5F), 0, 0.3F, 0.2F), 0.7F, 0.3F),
      WithHaze(CoatedMetal(Gray(0.5F), Gray(2.5F), 0.3F, 0.3F, 1), 0.95F, 0)};
  for (std::size_t m = 0; m < materials.size(); ++m) {
    for (const double angle : {0.0, 45.0, 75.0}) {
      const WalkedMetal walked = WalkOverMetal(materials[m], AtAngle(angle), 100000);
      const WalkedMetal ours = OfBsdf(materials[m], AtAngle(angle), 100000);
      EXPECT_NEAR(ours.flux, walked.flux,
                  4.5 * std::hypot(walked.standard_error, ours.standard_error) + 2 * kFluxError)
          << "material " << m << ", " << angle << " degrees";
    }
  }
}

}  // namespace
}  // namespace lucerna
