// Direct light must be that of the lights in sight, no more and no less.
//
// Light sampling and BSDF sampling together estimate one integral: with the power heuristic the
// weights of the two ways to draw one direction sum to one. And a light must never stand in its
// own way: the shadow ray ends before it, however large the ground or small the light.
#include "render/tracing/direct_light.h"

#include <cmath>

#include "gtest/gtest.h"

#include "render/math/rng.h"
#include "render/math/warp.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

// The share of light samples at `from`, on a floor with normal +z, that find nothing in the way.
double VisibleShare(const Scene& scene, Vec3 from) {
  const auto intersector = Intersector::Create(scene).value();
  const LightSet lights(scene, *intersector);
  const Ray down = {from + Vec3{0, 0, 1e-3F * (1 + MaxAbs(from))}, {0, 0, -1}, HUGE_VALF};
  Hit hit;
  EXPECT_TRUE(intersector->Intersect(down, hit));
  const SurfacePoint surface = intersector->SurfaceAt(down, hit);
  const Frame frame(surface.shading_normal);
  const ShadingPoint point = {surface, scene.materials[surface.material], frame, {0, 0, 1}};
  KeyedRng rng(7);
  constexpr int kSamples = 20000;
  int seen = 0;
  int rays = 0;
  for (int i = 0; i < kSamples; ++i) {
    SobolPoint u{};
    for (float& number : u)
      number = rng.Uniform();
    seen += IsBlack(LightSampledRadiance(*intersector, lights, point, u, rays)) ? 0 : 1;
  }
  return static_cast<double>(seen) / kSamples;
}

Scene FloorOf(float side) {
  Scene scene;
  const std::int32_t white = AddMaterial(scene, DiffuseMaterial(0.5F));
  AddQuad(scene, {-side / 2, -side / 2, 0}, {side, 0, 0}, {0, side, 0}, white);
  return scene;
}

TEST(PowerHeuristicTest, WeightsOfTheTwoWaysSumToOne) {
  for (const float a : {0.0F, 1e-20F, 0.3F, 1.0F, 1e20F}) {
    for (const float b : {1e-20F, 0.7F, 1.0F, 1e20F}) {
      EXPECT_FLOAT_EQ(PowerHeuristic(a, b) + PowerHeuristic(b, a), 1) << a << " " << b;
    }
  }
  EXPECT_EQ(PowerHeuristic(2, 0), 1);
  EXPECT_EQ(PowerHeuristic(0, 0), 0);
  EXPECT_FLOAT_EQ(PowerHeuristic(3, 4), 9.0F / 25);
}

class LampOverFloor : public testing::TestWithParam<double> {};

// The larger the floor, the farther from it rays start (its clearance); what they start with must
// not carry them into the light.
TEST_P(LampOverFloor, IsSeenWholeFromALargeFloor) {
  Scene scene = FloorOf(static_cast<float>(GetParam()));
  const std::int32_t black = AddMaterial(scene, DiffuseMaterial(0));
  AddDisk(scene, {0.1F, 0.2F, 1}, {0, 0, -1}, 0.25F, black, AddAreaLight(scene, 1));
  EXPECT_EQ(VisibleShare(scene, {0.1F, 0.2F, 0}), 1) << "floor of side " << GetParam();
}
INSTANTIATE_TEST_SUITE_P(Sides, LampOverFloor, testing::Values(1.0, 10.0, 100.0, 1000.0));

class BulbOverFloor : public testing::TestWithParam<double> {};

// A small bulb covers so small a cone that cosines in float cannot tell its rim from its middle.
TEST_P(BulbOverFloor, IsSeenWholeHoweverSmall) {
  Scene scene = FloorOf(4);
  const std::int32_t black = AddMaterial(scene, DiffuseMaterial(0));
  AddSphere(scene, {0.1F, 0.2F, 1}, static_cast<float>(GetParam()), black, AddAreaLight(scene, 1));
  EXPECT_GE(VisibleShare(scene, {0.35F, -0.3F, 0}), 0.9995) << "bulb of radius " << GetParam();
}
INSTANTIATE_TEST_SUITE_P(Radii, BulbOverFloor,
                         testing::Values(1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.5));

// The light is small and faces along the surface; the receiver's coordinates are larger than those
// by which the light's own clearance goes.
TEST(LightSampledRadianceTest, FindsASmallLightWholeFromFarAlongAWall) {
  Scene scene;
  const std::int32_t white = AddMaterial(scene, DiffuseMaterial(0.5F));
  AddQuad(scene, {-1.28F, -1.25F, -1.27F}, {2.56F, 0, 0}, {0, 2.56F, 0}, white);
  AddQuad(scene, {1.27F, -0.1F, -0.1F}, {0, 0, 0.2F}, {0, 0.2F, 0}, white, AddAreaLight(scene, 3));
  for (float x = -1.213F; x < 1.2F; x += 0.31F) {
    for (float y = -1.207F; y < 1.2F; y += 0.37F)
      EXPECT_EQ(VisibleShare(scene, {x, y, -1.27F}), 1) << x << " " << y;
  }
}

TEST(LightSampledRadianceTest, GivesTheRadianceOfAPointLightInSightAndNoneBehindAScreen) {
  Scene scene = FloorOf(2);
  scene.point_lights.push_back({{0, 0, 2}, Gray(3)});
  const auto radiance = [](const Scene& lit) {
    const auto intersector = Intersector::Create(lit).value();
    const LightSet lights(lit, *intersector);
    const Ray down = {{0.5F, 0.25F, 0.5F}, {0, 0, -1}, HUGE_VALF};
    Hit hit;
    EXPECT_TRUE(intersector->Intersect(down, hit));
    const SurfacePoint surface = intersector->SurfaceAt(down, hit);
    const Frame frame(surface.shading_normal);
    int rays = 0;
    const Rgb value = LightSampledRadiance(
        *intersector, lights, {surface, lit.materials[surface.material], frame, {0, 0, 1}}, {},
        rays);
    EXPECT_EQ(rays, 1);
    return static_cast<double>(value.g);
  };
  const double squared = 0.5 * 0.5 + 0.25 * 0.25 + 4;
  const double expected = 0.5 / kPi64 * 3 * (2 / std::sqrt(squared)) / squared;
  EXPECT_NEAR(radiance(scene), expected, 1e-5 * expected);

  AddDisk(scene, {0.25F, 0.125F, 1}, {0, 0, 1}, 0.1F, 0);
  EXPECT_EQ(radiance(scene), 0);
}

}  // namespace
}  // namespace lucerna
