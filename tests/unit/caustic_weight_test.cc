// The two ways to find light behind smooth surfaces share it out, and the darker way gets less.
#include "render/transport/caustic_weight.h"

#include <cmath>

#include "gtest/gtest.h"

namespace lucerna {
namespace {

CausticWeight WeightOf(std::int64_t photons, double radius) {
  RenderSettings settings;
  settings.width = settings.height = 100;
  settings.photons_per_pass = photons;
  settings.initial_radius = radius;
  Bounds bounds;
  bounds.Add({-1, -1, -1});
  bounds.Add({1, 1, 1});
  return CausticWeight(Scene(), settings, bounds);
}

TEST(CausticWeightTest, PhotonsOfPointsCountInFullAndRaysFindNone) {
  const CausticWeight weight = WeightOf(1000, 0.01);
  EXPECT_EQ(weight.OfPhotons(HUGE_VALF, 0.5F, 1e6F), 1);
  EXPECT_EQ(weight.OfRays(HUGE_VALF, 0.5F, 1e6F), 0);
}

TEST(CausticWeightTest, LightThatSendsNoPhotonsIsForRays) {
  const CausticWeight weight = WeightOf(1000, 0.01);
  EXPECT_EQ(weight.OfRays(0, 0.5F, 1), 1);
  EXPECT_EQ(weight.OfRays(1, 0, 1), 1);
  EXPECT_EQ(weight.OfRays(0, 0, 0), 1);
}

TEST(CausticWeightTest, SharesAddUpAndFollowTheDensities) {
  const CausticWeight weight = WeightOf(1000, 0.01);
  float before = 0;
  for (float density = 1e-6F; density < 1e9F; density *= 10) {
    const float photons = weight.OfPhotons(density, -0.3F, 2);
    EXPECT_EQ(photons + weight.OfRays(density, -0.3F, 2), 1);
    EXPECT_GE(photons, before);
    before = photons;
  }
  EXPECT_GT(before, 0.999F);
  // Twice the photons are worth twice the density.
  EXPECT_FLOAT_EQ(WeightOf(2000, 0.01).OfPhotons(5, 0.5F, 2), weight.OfPhotons(10, 0.5F, 2));
}

// Automatic radii follow the size of the scene, so that a scene in other units has the same shares.
TEST(CausticWeightTest, IsTheSameInOtherUnits) {
  const auto share = [](float unit) {
    RenderSettings settings;
    settings.width = settings.height = 100;
    settings.photons_per_pass = 1000;
    Bounds bounds;
    bounds.Add(Vec3{-1, -1, 2} * unit);
    bounds.Add(Vec3{1, 1, 4} * unit);
    // Densities are over areas.
    return CausticWeight(Scene(), settings, bounds).OfPhotons(3 / (unit * unit), 0.5F, 0.5F);
  };
  EXPECT_GT(share(1), 0);
  EXPECT_LT(share(1), 1);
  EXPECT_FLOAT_EQ(share(1024), share(1));
}

}  // namespace
}  // namespace lucerna
