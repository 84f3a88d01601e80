// A coated surface scatters what a walk through its coat brings, and loses no light of its own.
#include "render/transport/coat.h"

#include <cmath>
#include <numbers>

#include "gtest/gtest.h"

#include "render/math/rng.h"
#include "render/transport/bsdf.h"
#include "render/transport/microfacet.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

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

// The share of flux from `wo` that leaves a coat after at least one meeting with the base, by
// random walks through it.
struct Walked {
  double mean = 0, standard_error = 0;
};
Walked WalkThroughCoat(const Material& material, Vec3 wo, int walks) {
  Material interface = DielectricMaterial(material.ior);
  interface.alpha_u = material.alpha_u;
  interface.alpha_v = material.alpha_v;
  const auto absorbed = [&](Vec3 w) {
    return std::exp(-static_cast<double>(material.thickness) / static_cast<double>(std::abs(w.z)));
  };
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
    Vec3 down = sample.wi;
    for (int hit = 0; hit < material.base_hits; ++hit) {
      weight *= absorbed(down) * static_cast<double>(material.reflectance.g);
      const float u1 = rng.Uniform();
      const float u2 = rng.Uniform();
      const Vec3 rising = SquareToCosineHemisphere(u1, u2);
      weight *= absorbed(rising);
      // At the surface, where light comes from is below.
      if (!cross(-rising, sample)) break;
      weight *= static_cast<double>(sample.weight.g);
      if (sample.wi.z > 0) {
        sum += weight;
        squares += weight * weight;
        break;
      }
      down = sample.wi;
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

TEST(CoatTest, EqualCoatsShareATable) {
  std::vector<Material> materials = {CoatedMaterial(0.2F, 0.3F), CoatedMaterial(0.7F, 0.3F),
                                     CoatedMaterial(0.7F, 0.4F), DiffuseMaterial(0.5F)};
  PrepareCoats(materials);
  EXPECT_EQ(materials[0].coat, materials[1].coat);
  EXPECT_NE(materials[0].coat, materials[2].coat);
  EXPECT_EQ(materials[3].coat, nullptr);
}

}  // namespace
}  // namespace lucerna
