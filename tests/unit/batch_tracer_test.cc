// What a batch brings depends on its photons alone: not on threads, nor on how a range is cut.
#include "worker/batch_tracer.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <memory>
#include <thread>

#include "gtest/gtest.h"

#include "render/base/clock.h"
#include "render/estimate/evidence.h"
#include "render/math/octahedral.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

// A light in a glass ball in a white box.
Scene GlassLight() {
  Scene scene;
  const std::int32_t white = AddMaterial(scene, DiffuseMaterial(0.7F));
  const std::int32_t glass = AddMaterial(scene, DielectricMaterial(1.5F));
  const std::int32_t black = AddMaterial(scene, DiffuseMaterial(0));
  AddBox(scene, {-1, -1, -1}, {1, 1, 1}, white);
  AddSphere(scene, {0.1F, 0, 0.2F}, 0.3F, glass);
  AddSphere(scene, {0.1F, 0, 0.2F}, 0.1F, black, AddAreaLight(scene, 10));
  SetCamera(scene, {0, 0, 0.9}, {0, 0, 0}, {0, 1, 0}, 60, 8);
  return scene;
}

// A lattice of hitpoints on the floor z = -1.
HitpointBlock FloorBlock(int side) {
  HitpointBlock block;
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const auto at = [&](int i) {
        return 2 * (static_cast<float>(i) + 0.5F) / static_cast<float>(side) - 1;
      };
      block.positions.push_back({at(x), at(y), -1});
      block.normals_oct.push_back(EncodeOctahedral({0, 0, 1}));
    }
  }
  return block;
}

struct Fixture {
  Scene scene = GlassLight();
  RenderSettings settings = TestSettings(scene, 20000, 0.1, 6);
  HitpointBlock block = FloorBlock(40);
  RadiusColumn radii = RadiusColumn(block.size(), 0.07F);
  std::atomic<bool> stop = false;

  Accumulation Run(int threads, std::uint64_t pass, std::uint64_t first, std::uint64_t last,
                   const PhotonGuide* guide = nullptr) {
    BatchTracer tracer(scene, threads);
    return tracer
        .Run(settings, NeedsOf(scene, settings), pass, first, last, block, radii, stop,
             /*photons_per_pass=*/0, guide)
        .value();
  }
};

TEST(BatchTracerTest, GivesTheSameForAnyThreadsAndCuts) {
  Fixture f;
  PassSums whole(f.block.size(), kCommonColumns);
  const Accumulation one = f.Run(1, 3, 0, 20000);
  ASSERT_TRUE(whole.Add(one).ok());
  EXPECT_EQ(f.Run(3, 3, 0, 20000), one);
  EXPECT_EQ(one.tally.photons, 20000U);
  EXPECT_GT(one.size(), f.block.size() / 2);
  EXPECT_GT(one.tally.deposits, 0U);
  EXPECT_GT(one.tally.rays, 20000U);
  EXPECT_EQ(one.tally.dropped, 0U);

  PassSums parts(f.block.size(), kCommonColumns);
  const std::uint64_t cuts[] = {0, 1, 2049, 7000, 7000, 19999, 20000};
  for (std::size_t i = 0; i + 1 < std::size(cuts); ++i) {
    ASSERT_TRUE(parts.Add(f.Run(i % 2 == 0 ? 2 : 1, 3, cuts[i], cuts[i + 1])).ok());
  }
  EXPECT_EQ(parts.counts(), whole.counts());
  for (int c = 0; c < 3; ++c)
    EXPECT_EQ(parts.flux(c), whole.flux(c));
  EXPECT_EQ(parts.tally(), whole.tally());
}

TEST(BatchTracerTest, GivesOtherPhotonsToOtherPassesAndSeeds) {
  Fixture f;
  const Accumulation first = f.Run(1, 0, 0, 5000);
  EXPECT_NE(f.Run(1, 1, 0, 5000), first);
  f.settings.seed = 77;
  EXPECT_NE(f.Run(1, 0, 0, 5000), first);
}

// Parts of 2^20 photons are merged inside one call.
TEST(BatchTracerTest, MergesTheLargePartsOfARange) {
  Fixture f;
  f.settings.photons_per_pass = 1 << 21;
  constexpr std::uint64_t kPart = std::uint64_t{1} << 20;
  PassSums whole(f.block.size(), kCommonColumns);
  PassSums parts(f.block.size(), kCommonColumns);
  ASSERT_TRUE(whole.Add(f.Run(2, 0, kPart - 1000, 2 * kPart + 500)).ok());
  ASSERT_TRUE(parts.Add(f.Run(2, 0, kPart - 1000, kPart + 100)).ok());
  ASSERT_TRUE(parts.Add(f.Run(2, 0, kPart + 100, 2 * kPart + 500)).ok());
  EXPECT_EQ(parts.counts(), whole.counts());
  for (int c = 0; c < 3; ++c)
    EXPECT_EQ(parts.flux(c), whole.flux(c));
}

// A second light in a box of its own next door, from which nothing comes into view.
TEST(BatchTracerTest, CountsThePhotonsOfEachLightThatHitpointsFound) {
  Fixture f;
  AddBox(f.scene, {3, -1, -1}, {5, 1, 1}, 0);
  f.scene.point_lights.push_back({{4, 0, 0}, Gray(0.01F)});
  // Were it proved unreachable, it would send nothing.
  const SceneNeeds needs(NeedsOf(f.scene, f.settings).parts(), 0, {});
  BatchTracer tracer(f.scene, 2);
  const auto run = [&](std::uint64_t first, std::uint64_t last) {
    return tracer.Run(f.settings, needs, 0, first, last, f.block, f.radii, f.stop).value();
  };
  const std::vector<LightTally> lights = run(0, 20000).tally.lights;
  ASSERT_EQ(lights.size(), 2U);
  EXPECT_EQ(lights[0].sent + lights[1].sent, 20000U);
  EXPECT_GT(lights[1].sent, 20000U / 40) << "its even share";
  EXPECT_GT(lights[0].InView(PathClass::kCaustic), 1000U) << "through glass alone";
  EXPECT_GT(lights[0].InView(PathClass::kOther), 1000U);
  EXPECT_EQ(lights[1].in_view, (LightTally().in_view));

  // One by one: a photon counts in a class when it is found, and once.
  LightTally sum;
  int found = 0;
  for (std::uint64_t i = 0; i < 400; ++i) {
    const BatchTally tally = run(i, i + 1).tally;
    std::uint64_t counted = 0;
    for (const LightTally& light : tally.lights) {
      for (std::size_t path = 0; path < kPathClasses; ++path) {
        counted += light.in_view[path];
        sum.in_view[path] += light.in_view[path];
        EXPECT_LE(light.in_view[path], 1U);
      }
    }
    EXPECT_EQ(counted > 0, tally.pairs > 0) << i;
    found += tally.pairs > 0 ? 1 : 0;
  }
  EXPECT_GT(found, 100);
  EXPECT_EQ(run(0, 400).tally.lights[0].in_view, sum.in_view);
}

// A scatter guide makes the flux of some photons up to twice as large. Here it has cells where no
// photon comes: photons are the same, each of factor 1, and a quarter of them is reported.
TEST(BatchTracerTest, ReportsPhotonsOfWeakFluxLessOftenWhereDirectionsAreGuided) {
  using Kind = ScatterGuide::Node::Kind;
  const auto elsewhere = std::make_shared<const ScatterGuide>(
      ScatterGuide::Create(
          {{.kind = Kind::kX, .place = 100}, {}, {.kind = Kind::kU, .low_share = 100}, {}, {}})
          .value());
  const PhotonGuide all = PhotonGuide::Create({}, UINT32_MAX).value();
  const PhotonGuide fewer = PhotonGuide::Create({}, UINT32_MAX, elsewhere).value();
  Fixture fixture;
  const Accumulation a = fixture.Run(2, 0, 0, 20000, &all);
  const Accumulation b = fixture.Run(2, 0, 0, 20000, &fewer);
  EXPECT_EQ(a.flux, b.flux);
  ASSERT_GT(a.found.size(), 1000U);
  const auto expected = static_cast<double>(a.found.size()) / 4;
  EXPECT_NEAR(static_cast<double>(b.found.size()), expected, 5 * std::sqrt(expected));
  EXPECT_TRUE(
      std::ranges::includes(a.found, b.found, {}, &FoundPhoton::index, &FoundPhoton::index));
}

TEST(BatchTracerTest, TakesEmptyRangesAndBlocks) {
  Fixture f;
  EXPECT_EQ(f.Run(1, 0, 5, 5).size(), 0U);
  f.block = {};
  f.radii = {};
  const Accumulation nothing = f.Run(1, 0, 0, 100);
  EXPECT_EQ(nothing.size(), 0U);
  EXPECT_EQ(nothing.tally.photons, 100U);
}

// A worker keeps its tracer of a scene for other jobs, which may need other parts of it.
TEST(BatchTracerTest, MakesForEveryJobWhatItNeeds) {
  Fixture f;
  f.scene.point_lights.push_back({{0.5F, 0.5F, 0}, Gray(10)});
  const SceneNeeds all = NeedsOf(f.scene, f.settings);
  const LightNumbers numbers(f.scene);
  const SceneNeeds less(all.parts(), all.eye_sample_sets(), {{numbers.point_lights}, {}});
  const auto run = [&](BatchTracer& tracer, const SceneNeeds& needs) {
    return tracer.Run(f.settings, needs, 0, 0, 2000, f.block, f.radii, f.stop).value();
  };
  BatchTracer kept(f.scene, 1);
  const Accumulation with_all = run(kept, all);
  const Accumulation with_less = run(kept, less);
  EXPECT_NE(with_less, with_all);
  EXPECT_EQ(run(kept, all), with_all);
  BatchTracer fresh(f.scene, 1);
  EXPECT_EQ(run(fresh, less), with_less);
}

TEST(BatchTracerTest, RefusesHitpointsThatTheJobDoesNotKnowOf) {
  Fixture f;
  f.block.glossy = {{0, 0, 0, 0}};
  BatchTracer tracer(f.scene, 1);
  const SceneNeeds needs = NeedsOf(f.scene, f.settings);
  ASSERT_FALSE(needs.Uses(Part::kPhotonDirections));
  EXPECT_TRUE(absl::IsInvalidArgument(
      tracer.Run(f.settings, needs, 0, 0, 10, f.block, f.radii, f.stop).status()));
}

TEST(BatchTracerTest, RefusesColumnsThatDoNotFit) {
  Fixture f;
  BatchTracer tracer(f.scene, 1);
  const SceneNeeds needs = NeedsOf(f.scene, f.settings);
  const auto code = [&](const HitpointBlock& block, const RadiusColumn& radii) {
    return tracer.Run(f.settings, needs, 0, 0, 10, block, radii, f.stop).status().code();
  };
  RadiusColumn radii = f.radii;
  radii.pop_back();
  EXPECT_EQ(code(f.block, radii), absl::StatusCode::kInvalidArgument);
  for (const float bad : {0.0F, -1.0F, HUGE_VALF, NAN}) {
    radii = f.radii;
    radii[7] = bad;
    EXPECT_EQ(code(f.block, radii), absl::StatusCode::kInvalidArgument) << bad;
  }
  HitpointBlock block = f.block;
  block.glossy = {{5, 0, 0, 0}, {5, 0, 0, 0}};
  EXPECT_EQ(code(block, f.radii), absl::StatusCode::kInvalidArgument);
  block.glossy = {{5, 99, 0, 0}};
  EXPECT_EQ(code(block, f.radii), absl::StatusCode::kInvalidArgument);
}

TEST(BatchTracerTest, GivesUpWhenStoppedBeforeItStarts) {
  Fixture f;
  f.stop = true;
  BatchTracer tracer(f.scene, 2);
  const SceneNeeds needs = NeedsOf(f.scene, f.settings);
  EXPECT_EQ(tracer.Run(f.settings, needs, 0, 0, 20000, f.block, f.radii, f.stop).status().code(),
            absl::StatusCode::kCancelled);
}

// With radii as large as the room every photon meets every hitpoint, and gathering takes far
// longer than tracing: a worker that must leave must not finish it first.
TEST(BatchTracerTest, GivesUpSoonAlsoWhileHitpointsGather) {
  Fixture f;
  f.block = FloorBlock(300);
  f.radii.assign(f.block.size(), 4);
  BatchTracer tracer(f.scene, 2);
  const SceneNeeds needs = NeedsOf(f.scene, f.settings);
  std::thread stopper([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(400));
    f.stop = true;
  });
  const SteadyTime before = SystemClock().Steady();
  const auto result = tracer.Run(f.settings, needs, 0, 0, 20000, f.block, f.radii, f.stop);
  const double waited_s = Seconds(SystemClock().Steady() - before);
  stopper.join();
  EXPECT_EQ(result.status().code(), absl::StatusCode::kCancelled);
  // On an idle machine 0.5 s; all pairs would take far longer than the bound, which a busy one
  // needs.
  EXPECT_LT(waited_s, 6);
}

}  // namespace
}  // namespace lucerna
