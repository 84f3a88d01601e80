// The image depends on the scene and the settings alone: not on threads, batches, or when eye
// paths are traced.
#include "server/job_estimator.h"

#include <cmath>

#include "gtest/gtest.h"

#include "render/estimate/evidence.h"
#include "tests/support/local_render.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

// A glass ball, a glossy metal ball and a light in a box.
Scene Room() {
  Scene scene;
  AddBox(scene, {-1, -1, -1}, {1, 1, 1}, AddMaterial(scene, DiffuseMaterial(0.6F)));
  AddSphere(scene, {0.4F, -0.6F, 0.2F}, 0.4F, AddMaterial(scene, DielectricMaterial(1.5F)));
  AddSphere(scene, {-0.5F, -0.6F, 0.3F}, 0.4F,
            AddMaterial(scene, ConductorMaterial(Gray(0.2F), Gray(3), 0.3F, 0.3F)));
  AddDisk(scene, {0, 0.99F, 0}, {0, -1, 0}, 0.3F, 0, AddAreaLight(scene, 10));
  SetCamera(scene, {0, 0, -0.95}, {0, 0, 0}, {0, 1, 0}, 80, 32);
  return scene;
}

Digest Render(const Scene& scene, const RenderSettings& settings, int threads, int batches) {
  LocalRender render(scene, settings, threads);
  for (int pass = 0; pass < 4; ++pass)
    render.AddPass(batches);
  return render.MakeImage().PixelDigest();
}

TEST(JobEstimatorTest, GivesTheSameBitsForAnyThreadsAndBatches) {
  const Scene scene = Room();
  for (const double radius : {0.0, 0.1}) {
    const RenderSettings settings = TestSettings(scene, 5000, radius, 8);
    const Digest one = Render(scene, settings, 1, 1);
    EXPECT_EQ(Render(scene, settings, 2, 1), one);
    EXPECT_EQ(Render(scene, settings, 3, 7), one);
    RenderSettings other = settings;
    other.seed = 2;
    EXPECT_NE(Render(scene, other, 1, 1), one);
  }
}

TEST(JobEstimatorTest, TracesTheEyePathsOfAPassAtAnyTime) {
  const Scene scene = Room();
  const RenderSettings settings = TestSettings(scene, 1000, 0.1, 8);
  const auto early = JobEstimator::Create(scene, settings, NeedsOf(scene, settings), 1).value();
  const auto late = JobEstimator::Create(scene, settings, NeedsOf(scene, settings), 3).value();
  for (int pass = 0; pass < 3; ++pass) {
    const EyePass now = late->TraceEyePaths(static_cast<std::uint64_t>(pass));
    late->Apply(now, late->Radii(now), PassSums(now.block.size(), kCommonColumns));
  }
  const EyePass a = early->TraceEyePaths(3);
  const EyePass b = late->TraceEyePaths(3);
  EXPECT_EQ(a.block, b.block);
  EXPECT_EQ(a.pixels, b.pixels);
  EXPECT_EQ(a.rays, b.rays);
  for (std::size_t i = 0; i < a.direct.size(); ++i)
    ASSERT_EQ(a.direct[i], b.direct[i]);
}

TEST(JobEstimatorTest, PutsHitpointsOnSurfacesWithEveryPixelAtMostOnce) {
  const Scene scene = Room();
  const RenderSettings settings = TestSettings(scene, 1000, 0, 8);
  const auto estimator = JobEstimator::Create(scene, settings, NeedsOf(scene, settings), 2).value();
  const EyePass pass = estimator->TraceEyePaths(0);
  const RadiusColumn radii = estimator->Radii(pass);
  std::vector<int> hitpoints(32 * 32);
  for (const std::uint32_t pixel : pass.pixels)
    ++hitpoints[pixel];
  for (const int count : hitpoints)
    EXPECT_LE(count, 1);
  EXPECT_GT(pass.block.size(), 900U);
  EXPECT_GT(pass.block.glossy.size(), 10U);
  for (std::size_t row = 0; row < pass.block.size(); ++row) {
    EXPECT_LT(MaxAbs(pass.block.positions[row]), 1 + 1e-5F);
    EXPECT_GT(radii[row], 0);
    EXPECT_TRUE(std::isfinite(radii[row]));
  }
}

TEST(JobEstimatorTest, RendersACropAsThePartOfTheWhole) {
  Scene scene = Room();
  scene.filter.radius_x = 0.5F;
  RenderSettings settings = TestSettings(scene, 1, 0.1, 4);
  const Image whole = RenderLocally(scene, settings, 1);
  settings.crop_x0 = 5;
  settings.crop_x1 = 12;
  settings.crop_y0 = 20;
  settings.crop_y1 = 31;
  const Image part = RenderLocally(scene, settings, 1);
  ASSERT_EQ(part.width, 7);
  ASSERT_EQ(part.height, 11);
  const auto& of_whole = whole.Find("direct.G")->pixels;
  const auto& of_part = part.Find("direct.G")->pixels;
  for (std::size_t y = 0; y < 11; ++y) {
    for (std::size_t x = 0; x < 7; ++x) {
      EXPECT_EQ(of_part[y * 7 + x], of_whole[(y + 20) * 32 + x + 5]);
    }
  }
}

TEST(JobEstimatorTest, AddsPhotonsToDirectLight) {
  const Scene scene = Room();
  const Image image = RenderLocally(scene, TestSettings(scene, 5000, 0.1, 8), 3);
  for (std::size_t i = 0; i < 32 * 32; ++i) {
    const float sum = image.Find("direct.R")->pixels[i] + image.Find("photons.R")->pixels[i];
    ASSERT_NEAR(image.Find("R")->pixels[i], sum, 1e-5F * (1 + sum));
  }
}

}  // namespace
}  // namespace lucerna
