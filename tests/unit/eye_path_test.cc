// What does one eye path bring?
#include "render/tracing/eye_path.h"

#include <cmath>

#include "gtest/gtest.h"

#include "render/transport/bsdf.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

struct Measured {
  double mean = 0, deviation = 0;
};

// Of the direct light of a scene's first pixel over many passes.
Measured DirectLightOf(const Scene& scene) {
  const RenderSettings settings = TestSettings(scene, 1000, 0.01, 40);
  const SceneNeeds needs = NeedsOf(scene, settings);
  const auto intersector = Intersector::Create(scene).value();
  const LightSet lights(scene, *intersector);
  const EyePathTracer tracer(scene, settings, needs, *intersector, lights);

  constexpr int kPaths = 512;
  double sum = 0;
  double squares = 0;
  for (std::uint64_t pass = 0; pass < kPaths; ++pass) {
    const double seen = static_cast<double>(tracer.Trace(0, 0, pass, {}).direct.g);
    sum += seen;
    squares += seen * seen;
  }
  const double mean = sum / kPaths;
  return {mean, std::sqrt(squares / kPaths - mean * mean)};
}

// Brushed metal, in which a pane of glass is seen that reflects a light, which is nowhere else. A
// path that chose between reflection and refraction would find it one time in ten, ten times as
// bright.
TEST(EyePathTest, FollowsAllBranchesOfGlassSeenInRoughMetal) {
  constexpr float kRadiance = 2;
  Scene scene;
  AddQuad(scene, {-5, -5, 0}, {10, 0, 0}, {0, 10, 0},
          AddMaterial(scene, ConductorMaterial({0.2F, 0.2F, 0.2F}, {3, 3, 3}, 0.02F, 0.02F)));
  AddBox(scene, {2, -5, 0.1F}, {2.2F, 5, 5}, AddMaterial(scene, DielectricMaterial(1.5F)));
  AddQuad(scene, {-9, -9, 6}, {0, 18, 0}, {10.5F, 0, 0}, AddMaterial(scene, DiffuseMaterial(0)),
          AddAreaLight(scene, kRadiance));
  SetCamera(scene, {-2, 0, 2}, {0, 0, 0}, {0, 0, 1}, 0.5, 1);

  const auto [mean, deviation] = DirectLightOf(scene);
  EXPECT_LT(deviation, 0.5 * mean);
  // What both faces reflect, and the inner ones again: 2 r / (1 + r).
  const float cosine = std::sqrt(0.5F);
  float cos_t = 0;
  const auto r = static_cast<double>(FresnelDielectric(cosine, 1.5F, cos_t));
  const auto metal = static_cast<double>(FresnelConductor(cosine, Gray(0.2F), Gray(3)).g);
  EXPECT_NEAR(mean, static_cast<double>(kRadiance) * metal * 2 * r / (1 + r), 0.1 * mean);
}

// A pane in which a floor is seen that a light shines on; nothing is behind the pane. A path that
// chose between reflection and refraction would see the floor one time in three.
TEST(EyePathTest, SamplesDirectLightAtTheEndsOfAllBranchesOfGlass) {
  constexpr float kAlbedo = 0.6F;
  constexpr float kIntensity = 100;
  constexpr float kHeight = 20;
  Scene scene;
  AddBox(scene, {2, -5, 0.1F}, {2.2F, 5, 9}, AddMaterial(scene, DielectricMaterial(2.5F)));
  AddQuad(scene, {-9, -9, 0}, {10.5F, 0, 0}, {0, 18, 0},
          AddMaterial(scene, DiffuseMaterial(kAlbedo)));
  scene.point_lights.push_back({{0, 0, kHeight}, Gray(kIntensity)});
  SetCamera(scene, {0, 0, 4}, {2, 0, 2}, {0, 0, 1}, 0.5, 1);

  const auto [mean, deviation] = DirectLightOf(scene);
  // Weak branches, of three reflections and more, are sampled now and then.
  EXPECT_LT(deviation, 0.2 * mean);
  // What both faces reflect, and the inner ones again: 2 r / (1 + r).
  float cos_t = 0;
  const auto r = static_cast<double>(FresnelDielectric(std::sqrt(0.5F), 2.5F, cos_t));
  const double lit =
      static_cast<double>(kAlbedo * kIntensity) / (3.14159265358979 * kHeight * kHeight);
  EXPECT_NEAR(mean, lit * 2 * r / (1 + r), 0.05 * mean);
}

// Water over a floor under a point light, and a wall that the water mirrors. Light passes the water
// by caustics alone: only where the wall is lit are both branches followed, which takes another
// ray.
TEST(EyePathTest, FollowsBranchesOnlyWhereTheyFindDirectLight) {
  const auto most_rays = [](bool is_wall_there) {
    Scene scene;
    const std::uint32_t white = AddMaterial(scene, DiffuseMaterial(0.5F));
    AddQuad(scene, {-90, -90, 0}, {180, 0, 0}, {0, 180, 0}, white);
    AddQuad(scene, {-90, -90, 1}, {180, 0, 0}, {0, 180, 0},
            AddMaterial(scene, DielectricMaterial(1.33F)));
    if (is_wall_there) AddQuad(scene, {9, -90, 1.5F}, {0, 0, 90}, {0, 180, 0}, white);
    scene.point_lights.push_back({{0, 0, 9}, Gray(100)});
    SetCamera(scene, {0, 0, 5}, {4, 0, 1}, {0, 0, 1}, 0.5, 1);
    const RenderSettings settings = TestSettings(scene, 1000, 0.01, 40);
    const SceneNeeds needs = NeedsOf(scene, settings);
    const auto intersector = Intersector::Create(scene).value();
    const LightSet lights(scene, *intersector);
    const EyePathTracer tracer(scene, settings, needs, *intersector, lights);
    int rays = 0;
    for (std::uint64_t pass = 0; pass < 100; ++pass)
      rays = std::max(rays, tracer.Trace(0, 0, pass, {}).rays);
    return rays;
  };
  // Camera, refraction, shadow.
  EXPECT_EQ(most_rays(false), 3);
  // Also the reflection, and another shadow.
  EXPECT_EQ(most_rays(true), 5);
}

// The first disc, of three widths of a pixel, is no wider than what turns by 45 degrees, and no
// narrower than a pixel; on what is flat or bent less it is as wide as it was.
TEST(EyePathTest, DiscsOnBentSurfacesAreNarrower) {
  constexpr double kDistance = 2;
  constexpr double kPi = 3.14159265358979;
  const double pixel = 2 * kDistance * std::tan(0.25 * kPi / 180);
  const auto unit_on_a_ball = [&](double radius_px) {
    Scene scene;
    const auto radius = static_cast<float>(radius_px * pixel);
    AddMaterial(scene, DiffuseMaterial(0.5F));
    if (radius > 0) {
      AddSphere(scene, {0, 0, -radius}, radius, 0);
    } else {
      AddQuad(scene, {-5, -5, 0}, {10, 0, 0}, {0, 10, 0}, 0);
    }
    AddQuad(scene, {-1, -1, 3}, {0, 2, 0}, {2, 0, 0}, 0, AddAreaLight(scene, 1));
    SetCamera(scene, {0, 0, kDistance}, {0, 0, 0}, {0, 1, 0}, 0.5, 1);
    RenderSettings settings = TestSettings(scene, 1000, 0.01, 40);
    settings.initial_radius = 0;
    settings.initial_footprints = 3;
    const SceneNeeds needs = NeedsOf(scene, settings);
    const auto intersector = Intersector::Create(scene).value();
    const LightSet lights(scene, *intersector);
    const EyePathTracer tracer(scene, settings, needs, *intersector, lights);
    EyeHitpoint hitpoint;
    for (std::uint64_t pass = 0; IsBlack(hitpoint.weight) && pass < 100; ++pass)
      hitpoint = tracer.Trace(0, 0, pass, {}).hitpoint;
    return static_cast<double>(hitpoint.footprint) / pixel;
  };
  // Rays of a pixel meet the ball up to a pixel's width further away.
  constexpr double kSlack = 0.01;
  const double turn = 2 * std::sin(kPi / 8);
  EXPECT_NEAR(unit_on_a_ball(0), 1, kSlack) << "flat";
  EXPECT_NEAR(unit_on_a_ball(4.5), 1, kSlack);
  EXPECT_NEAR(unit_on_a_ball(3), turn * 3 / 3, kSlack);
  EXPECT_NEAR(unit_on_a_ball(1.5), turn * 1.5 / 3, kSlack);
  EXPECT_NEAR(unit_on_a_ball(0.75), 1.0 / 3, kSlack);
}

}  // namespace
}  // namespace lucerna
