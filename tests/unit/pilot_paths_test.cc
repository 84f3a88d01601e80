// Pilot paths must find the emissions that the image needs, and what each of them brings.
#include "render/tracing/pilot_paths.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "gtest/gtest.h"

#include "tests/support/measure.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

struct TracedPilots {
  TracedPilots(Scene s, int max_depth, int threads = 2, std::uint64_t seed = 1)
      : scene(std::move(s)),
        settings(TestSettings(scene, 1000, 0.05, max_depth, seed)),
        needs(NeedsOf(scene, settings)),
        intersector(Intersector::Create(scene).value()),
        lights(scene, *intersector),
        tracer(scene, settings, needs, *intersector, lights) {
    ThreadTeam team(threads);
    reports = TracePilotPaths(tracer, needs, team);
  }

  Scene scene;
  RenderSettings settings;
  SceneNeeds needs;
  std::unique_ptr<Intersector> intersector;
  LightSet lights;
  EyePathTracer tracer;
  PilotReports reports;
};

// Inside a ball that emits 1 and reflects a half the radiance is 2, of which 1 is emitted, a half
// has been scattered once and needs no photons, and the rest is another half.
Scene Furnace() {
  Scene scene;
  AddSphere(scene, {0, 0, 0}, 1, AddMaterial(scene, DiffuseMaterial(0.5F)), AddAreaLight(scene, 1),
            /*inward=*/true);
  SetCamera(scene, {0.3, 0, 0}, {0, 1, 0}, {0, 0, 1}, 60, 16);
  return scene;
}

// Of photons that land so often at most: what is scattered k times before the hitpoint is a half to
// the power k + 1.
void ExpectBrought(int max_depth, double expected) {
  SCOPED_TRACE(max_depth);
  constexpr int kSeeds = 16;
  double sum = 0;
  double squares = 0;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    const TracedPilots traced(Furnace(), max_depth, 2, seed);
    ASSERT_GE(traced.reports.paths, 1024U);
    double brought = 0;
    for (const PilotReport& report : traced.reports.reports)
      brought += report.brought / static_cast<double>(traced.reports.paths);
    sum += brought;
    squares += brought * brought;
  }
  const double mean = sum / kSeeds;
  const double error = std::sqrt(std::max(0.0, squares / kSeeds - mean * mean) / (kSeeds - 1));
  // Where nothing varies there are the roundings of floats, some ten along a path.
  EXPECT_NEAR(mean, expected, StudentQuantile(1e-3, kSeeds) * error + 10 * 0x1p-24 * expected);
  EXPECT_LT(StudentQuantile(1e-3, kSeeds) * error, 0.05);
}

TEST(PilotPathsTest, BringWhatPhotonsBring) {
  ExpectBrought(60, 0.5);
  ExpectBrought(3, 0.25 + 0.125);
  ExpectBrought(2, 0.25);
  ExpectBrought(1, 0);
}

TEST(PilotPathsTest, DoNotDependOnThreads) {
  const TracedPilots one(Furnace(), 20, 1);
  const TracedPilots two(Furnace(), 20, 2);
  ASSERT_EQ(one.reports.reports.size(), two.reports.reports.size());
  for (std::size_t i = 0; i < one.reports.reports.size(); ++i) {
    EXPECT_EQ(one.reports.reports[i].numbers, two.reports.reports[i].numbers);
    EXPECT_EQ(one.reports.reports[i].pixel, two.reports.reports[i].pixel);
    EXPECT_EQ(one.reports.reports[i].brought, two.reports.reports[i].brought);
  }
}

// A room with a hole in its roof, a 25th of it, under a sun and a sky: photons that are drawn
// with the numbers that pilot paths found come through the hole.
TEST(PilotPathsTest, LeadThroughAHoleToTheSky) {
  Scene scene;
  const std::int32_t gray = AddMaterial(scene, DiffuseMaterial(0.5F));
  AddQuad(scene, {-1, -1, -1}, {2, 0, 0}, {0, 2, 0}, gray);
  for (const float side : {-1.0F, 1.0F}) {
    AddQuad(scene, {side, -1, -1}, {0, 2, 0}, {0, 0, 2}, gray);
    AddQuad(scene, {-1, side, -1}, {2, 0, 0}, {0, 0, 2}, gray);
  }
  AddQuad(scene, {-1, -1, 1}, {2, 0, 0}, {0, 0.8F, 0}, gray);
  AddQuad(scene, {-1, 0.2F, 1}, {2, 0, 0}, {0, 0.8F, 0}, gray);
  AddQuad(scene, {-1, -0.2F, 1}, {0.8F, 0, 0}, {0, 0.4F, 0}, gray);
  AddQuad(scene, {0.2F, -0.2F, 1}, {0.8F, 0, 0}, {0, 0.4F, 0}, gray);
  scene.distant_lights.push_back({Normalize({0.1F, 0.2F, -1}), Gray(5)});
  scene.infinite_lights.push_back({Gray(1)});
  SetCamera(scene, {0, -0.8, 0}, {0, 1, 0}, {0, 0, 1}, 60, 16);
  const TracedPilots traced(std::move(scene), 20);
  ASSERT_GT(traced.reports.reports.size(), 300U);
  int by_sun = 0;
  int by_sky = 0;
  int outside = 0;
  for (const PilotReport& report : traced.reports.reports) {
    const PrimaryNumbers& u = report.numbers;
    Emission emission;
    ASSERT_TRUE(traced.lights.SampleEmission(u[4], static_cast<float>(u[0]),
                                             static_cast<float>(u[1]), static_cast<float>(u[2]),
                                             static_cast<float>(u[3]), emission));
    Hit hit;
    const bool is_met = traced.intersector->Intersect(emission.ray, hit);
    const Vec3 place = emission.ray.origin + emission.ray.direction * hit.t;
    // From inside the roof is met at the hole alone.
    if (!is_met || place.z > 0.999F || MaxAbs(place) > 1.001F) {
      ++outside;
      continue;
    }
    const bool is_sun = traced.lights.emitter(emission.emitter).kind == EmitterKind::kDistant;
    ++(is_sun ? by_sun : by_sky);
  }
  EXPECT_GT(by_sun, 100);
  EXPECT_GT(by_sky, 100);
  // Numbers are found to about 1e-6, so that hardly any misses the hole's edge.
  EXPECT_LE(outside, 5);
}

// Further paths add to what there is, and reports say where light first lands and where it goes on.
TEST(PilotPathsTest, TellOfFirstScatterings) {
  TracedPilots traced(Furnace(), 20);
  ThreadTeam team(2);
  const std::size_t first = traced.reports.reports.size();
  PilotReports in_steps = traced.reports;
  AddPilotPaths(traced.tracer, traced.needs, 6000, team, in_steps);
  AddPilotPaths(traced.tracer, traced.needs, 10000, team, in_steps);
  AddPilotPaths(traced.tracer, traced.needs, 10000, team, traced.reports);
  EXPECT_GE(in_steps.paths, 10000U);
  EXPECT_EQ(in_steps.paths, traced.reports.paths);
  ASSERT_EQ(in_steps.reports.size(), traced.reports.reports.size());
  EXPECT_GT(in_steps.reports.size(), first);
  int diffuse = 0;
  for (std::size_t i = 0; i < in_steps.reports.size(); ++i) {
    const FirstScattering& scattering = in_steps.reports[i].scattering;
    ASSERT_EQ(scattering, traced.reports.reports[i].scattering);
    if (!(scattering.density > 0)) continue;
    ++diffuse;
    // On the ball, inward, with the density of a diffuse surface.
    ASSERT_NEAR(Length(scattering.position), 1, 1e-4F);
    const float cosine = -Dot(scattering.direction, scattering.position);
    ASSERT_NEAR(scattering.density, cosine / kPi, 1e-4F);
  }
  EXPECT_GT(diffuse, static_cast<int>(in_steps.reports.size() / 2));
  // However many paths are asked for, there are 2^16 reports and a few more.
  AddPilotPaths(traced.tracer, traced.needs, 1000000, team, in_steps);
  EXPECT_LT(in_steps.paths, 20000U);
  EXPECT_GE(in_steps.reports.size(), std::size_t{1} << 16);
}

// Media are left out.
TEST(PilotPathsTest, AreNotTracedInMedia) {
  Scene scene = Furnace();
  scene.media.emplace_back();
  scene.camera.medium = 0;
  const TracedPilots traced(std::move(scene), 20);
  EXPECT_TRUE(traced.needs.Uses(Part::kMedia));
  EXPECT_TRUE(traced.reports.reports.empty());
}

}  // namespace
}  // namespace lucerna
