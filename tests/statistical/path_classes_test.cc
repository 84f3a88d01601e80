// No light is lost: one tiny scene for each class of paths (tests/support/path_classes.h).
//
// Each scene is rendered by the estimator and by the path tracer of tests/support, which shares
// nothing with it but geometry. Means over the image and over its quarters are compared; the
// standard errors of both come from independent repetitions, and Student's quantile bounds their
// difference. docs/path-classes.md has the table of classes, and names these tests.
//
// What the path tracer sees does not depend on the estimator: it is kept in
// tests/statistical/traced_light.csv, made by lucerna-trace-path-classes with more paths than a run
// of the tests has time for, and some of it is traced again here. A class whose scene changes, and
// a new one, need that file made again.
#include "tests/support/path_classes.h"

#include <cmath>
#include <cstddef>
#include <map>
#include <numbers>
#include <string>
#include <string_view>
#include <vector>

#include "gtest/gtest.h"

#include "render/scene/render_settings.h"
#include "tests/support/path_comparison.h"
#include "tests/support/path_tracer.h"
#include "tests/support/test_scenes.h"
#include "tests/support/traced_light.h"

namespace lucerna {
namespace {

constexpr int kParts = 16;
// At least as many comparisons as this file makes: cells times blocks.
constexpr int kQuestions = 1500;
constexpr double kLevel = 1e-2;

// --- the path tracer itself ----------------------------------------------------------------------

MeasuredMean TracedMean(const Scene& scene, float delta_radius, int paths = 20000) {
  PathTracerSettings settings;
  settings.paths_per_replica = paths;
  settings.delta_radius = delta_radius;
  settings.delta_angle_rad = delta_radius / 2;
  return TracePaths(scene, settings).MeanOver({0, 0, settings.width, settings.height}, 1);
}

// Six standard errors of 24 replicas: once in 250,000.
constexpr double kErrors = 6;

// Under a sky of radiance 1, smooth glass is as bright as the sky.
TEST(PathTracerTest, KeepsRadianceInAFurnace) {
  Scene scene;
  AddSphere(scene, {0, 0, 0}, 1, AddMaterial(scene, DielectricMaterial(1.5F)));
  scene.infinite_lights.push_back({Gray(1)});
  SetCamera(scene, {0, 0, -4}, {0, 0, 0}, {0, 1, 0}, 20, 8);
  const MeasuredMean mean = TracedMean(scene, 0.1F);
  EXPECT_NEAR(mean.mean, 1, kErrors * mean.standard_error + 1e-3);
  EXPECT_LT(mean.standard_error, 5e-3);
}

// ρ I cosθ / (π d²) below a point, and ρ E cosθ / π below the sun, whatever stands for them.
TEST(PathTracerTest, LightsADiffuseFloorByClosedForms) {
  for (const float size : {0.1F, 0.3F}) {
    SCOPED_TRACE(size);
    Scene point;
    AddQuad(point, {-3, -3, 0}, {6, 0, 0}, {0, 6, 0}, AddMaterial(point, DiffuseMaterial(0.5F)));
    SetCamera(point, {0, -1, 1}, {0, 0, 0}, {0, 0, 1}, 0.1, 8);
    Scene sun = point;
    point.point_lights.push_back({{1, 0, 1}, Gray(4)});
    MeasuredMean mean = TracedMean(point, size, 40000);
    double expected = 0.5 * 4 * std::sqrt(0.5) / (std::numbers::pi * 2);
    EXPECT_NEAR(mean.mean, expected, kErrors * mean.standard_error);
    EXPECT_LT(mean.standard_error, 0.02 * expected);
    sun.distant_lights.push_back({Normalize({1, 1, -1}), Gray(2)});
    mean = TracedMean(sun, size, 40000);
    expected = 0.5 * 2 / (std::sqrt(3.0) * std::numbers::pi);
    EXPECT_NEAR(mean.mean, expected, kErrors * mean.standard_error);
    EXPECT_LT(mean.standard_error, 0.02 * expected);
  }
}

// What stands for a point does not blur away light: half the size gives the same.
TEST(PathTracerTest, StandInsOfTwoSizesGiveTheSameLight) {
  for (const Chain chain : {Chain::kNone, Chain::kPane}) {
    const Scene scene = SceneOf({LightKind::kPoint, chain, Floor::kNarrowMetal});
    const MeasuredMean large = TracedMean(scene, 0.08F, 30000);
    const MeasuredMean small = TracedMean(scene, 0.04F, 110000);
    EXPECT_NEAR(large.mean, small.mean,
                kErrors * std::hypot(large.standard_error, small.standard_error));
    EXPECT_LT(small.standard_error, 0.02 * small.mean);
  }
}

// --- cells ---------------------------------------------------------------------------------------

const std::map<std::string, TracedLight>& Traced() {
  static const auto kTraced =
      ReadTracedLight(LUCERNA_SOURCE_DIR "/tests/statistical/traced_light.csv");
  return kTraced;
}

class PathClassTest : public testing::TestWithParam<PathClass> {};

std::string CellName(const testing::TestParamInfo<PathClass>& info) {
  return NameOf(info.param);
}

INSTANTIATE_TEST_SUITE_P(Cells, PathClassTest, testing::ValuesIn(AllPathClasses()), CellName);

TEST_P(PathClassTest, IsSampled) {
  const PathClass& cell = GetParam();
  const std::string name = NameOf(cell);
  const auto traced = Traced().find(name);
  ASSERT_NE(traced, Traced().end()) << "run lucerna-trace-path-classes";
  const Scene scene = SceneOf(cell);
  const Effort effort = EffortFor(cell);
  constexpr double kRadius = 0.04;
  RenderSettings settings =
      TestSettings(scene, effort.photons, kRadius, kDepthOfPathClasses, KeyOf(name));
  settings.alpha = 1 - 1e-7;  // the radius is held
  std::vector<PathComparison> blocks =
      EstimateBlocks(scene, settings, effort.passes, kParts, 2, "G");
  static const double quantile = StudentQuantile(SidakLevel(kLevel, kQuestions), kParts);
  ASSERT_EQ(blocks.size(), traced->second.size());
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    PathComparison& c = blocks[i];
    c.traced = traced->second[i];
    EXPECT_GT(c.traced.mean, 0);
    EXPECT_LT(std::abs(c.Deviation()), quantile)
        << "pixels from (" << c.block.x0 << ", " << c.block.y0 << "): " << c.estimated.mean
        << " +- " << c.estimated.standard_error << " estimated, " << c.traced.mean << " +- "
        << c.traced.standard_error << " traced";
  }
}

// The file is what the path tracer sees of these scenes: of one class in 47 it is traced again,
// with other random numbers.
TEST(PathTracerTest, SeesWhatIsWrittenDown) {
  const std::vector<PathClass> cells = AllPathClasses();
  EXPECT_EQ(Traced().size(), cells.size());
  constexpr std::size_t kOneIn = 47;
  constexpr int kReplicas = 24;
  const double quantile =
      StudentQuantile(SidakLevel(1e-3, static_cast<int>(cells.size() / kOneIn + 1) * 5), kReplicas);
  for (std::size_t i = 0; i < cells.size(); i += kOneIn) {
    const std::string name = NameOf(cells[i]);
    SCOPED_TRACE(name);
    const auto written = Traced().find(name);
    ASSERT_NE(written, Traced().end());
    const TracedLight again = TraceClass(cells[i], 1, 1);
    for (std::size_t block = 0; block < again.size(); ++block) {
      const MeasuredMean& before = written->second[block];
      EXPECT_LT(std::abs(again[block].mean - before.mean),
                quantile * std::hypot(again[block].standard_error, before.standard_error))
          << "block " << block << ": " << again[block].mean << ", written " << before.mean;
    }
  }
}

}  // namespace
}  // namespace lucerna
