// What does one eye path bring?
#include "render/tracing/eye_path.h"

#include <cmath>

#include "gtest/gtest.h"

#include "render/transport/bsdf.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

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
  const double deviation = std::sqrt(squares / kPaths - mean * mean);
  EXPECT_LT(deviation, 0.5 * mean);
  // What both faces reflect, and the inner ones again: 2 r / (1 + r).
  const float cosine = std::sqrt(0.5F);
  float cos_t = 0;
  const auto r = static_cast<double>(FresnelDielectric(cosine, 1.5F, cos_t));
  const auto metal = static_cast<double>(FresnelConductor(cosine, Gray(0.2F), Gray(3)).g);
  EXPECT_NEAR(mean, static_cast<double>(kRadiance) * metal * 2 * r / (1 + r), 0.1 * mean);
}

}  // namespace
}  // namespace lucerna
