// What the camera's rays meet is found once for each set of eye paths, and changes nothing.
#include "render/tracing/first_hits.h"

#include <atomic>
#include <cmath>
#include <cstdint>

#include "gtest/gtest.h"

#include "render/tracing/hitpoint_pass.h"
#include "render/transport/working_space.h"
#include "server/job_estimator.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

TEST(FirstHitsTest, BelongToTheSetOfAPass) {
  constexpr int kSets = 4;
  constexpr std::uint64_t kNextRound = kSets * kRoundsOfSets;
  FirstHits hits(kSets, 10);
  FirstHitsOfSet* first = hits.Of(1);
  ASSERT_NE(first, nullptr);
  EXPECT_FALSE(first->is_known);
  ASSERT_EQ(first->shapes.size(), 10U);
  first->is_known = true;
  EXPECT_FALSE(hits.Of(2)->is_known);
  // Sets take turns in another order each time.
  ASSERT_EQ(EyeSetOf(kSets + 3, kSets), 1U);
  EXPECT_TRUE(hits.Of(kSets + 3)->is_known);
  EXPECT_TRUE(hits.Of(kNextRound - kSets + 3)->is_known);
  EXPECT_FALSE(hits.Of(1 + kNextRound)->is_known) << "new sets are drawn";
}

TEST(FirstHitsTest, AreNotKeptWhereEyePathsAreNew) {
  EXPECT_EQ(FirstHits(0, 10).Of(0), nullptr);
}

TEST(FirstHitsTest, TakeNoMoreThanTheirBytes) {
  constexpr int kSets = 64;
  constexpr std::size_t kPixels = std::size_t{1} << 20U;
  const std::size_t kept = KeptSets(kSets, kPixels);
  EXPECT_EQ(kept, 16U);
  FirstHits hits(kSets, kPixels);
  EXPECT_NE(hits.Of(kept - 1), nullptr);
  EXPECT_EQ(hits.Of(kept), nullptr);
  EXPECT_EQ(hits.Of(kSets + kept), nullptr) << "of the same set in its next turn";
  EXPECT_EQ(KeptSets(kSets, 1), 64U);
  EXPECT_EQ(KeptSets(kSets, std::size_t{1} << 28U), 0U);
}

// A floor, seen in part, and a light.
Scene Floor() {
  Scene scene;
  AddQuad(scene, {-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, AddMaterial(scene, DiffuseMaterial(0.5F)));
  AddDisk(scene, {0, 0, 1}, {0, 0, -1}, 0.3F, 0, AddAreaLight(scene, 3));
  SetCamera(scene, {0, -2, 1}, {0, 0, 0}, {0, 0, 1}, 70, 16);
  return scene;
}

TEST(FirstHitsTest, GiveThePassThatTracingGives) {
  const Scene scene = Floor();
  const RenderSettings settings = TestSettings(scene, 1000, 0.1, 8);
  const auto fresh = JobEstimator::Create(scene, settings, NeedsOf(scene, settings), 1).value();
  const auto warm = JobEstimator::Create(scene, settings, NeedsOf(scene, settings), 2).value();
  const int sets = warm->needs().eye_sample_sets();
  ASSERT_GT(sets, 0);
  const EyePass before = warm->TraceEyePaths(0).value();
  const auto next_turn = static_cast<std::uint64_t>(sets) + 2;
  ASSERT_EQ(EyeSetOf(next_turn, sets), 0U);
  const EyePass again = warm->TraceEyePaths(next_turn).value();
  const EyePass traced = fresh->TraceEyePaths(next_turn).value();
  EXPECT_EQ(again.block, before.block);
  EXPECT_EQ(again.block, traced.block);
  EXPECT_EQ(again.pixels, traced.pixels);
  EXPECT_LT(again.pixels.size(), 256U) << "some rays meet nothing";
  bool differs = false;
  for (std::size_t i = 0; i < traced.direct.size(); ++i) {
    EXPECT_EQ(again.direct[i].g, traced.direct[i].g);
    differs = differs || before.direct[i].g != again.direct[i].g;
  }
  EXPECT_TRUE(differs) << "direct light is drawn anew";
}

TEST(FirstHitsTest, AreWhatEyePathsGoBy) {
  const Scene scene = InWorkingSpace(Floor());
  const RenderSettings settings = TestSettings(scene, 1000, 0.1, 8);
  const SceneNeeds needs = NeedsOf(scene, settings);
  const auto intersector = Intersector::Create(scene).value();
  const LightSet lights(scene, *intersector);
  const EyePathTracer tracer(scene, settings, needs, *intersector, lights);
  ThreadTeam team(1);
  FirstHitsOfSet known;
  known.shapes.resize(256);
  FilmSpread spread(tracer);
  const EyePass traced = TraceHitpointPass(tracer, 0, &known, spread, team);
  ASSERT_TRUE(known.is_known);
  for (std::uint32_t& shape : known.shapes)
    shape = kNoShape;
  EXPECT_FALSE(traced.pixels.empty());
  EXPECT_TRUE(TraceHitpointPass(tracer, 0, &known, spread, team).pixels.empty());
}

// Between two questions at most 256 pixels are traced, and a pass that is given up leaves nothing
// behind.
TEST(FirstHitsTest, APassIsGivenUpWithinATileAndTellsNothing) {
  const Scene scene = InWorkingSpace(Floor());
  RenderSettings settings = TestSettings(scene, 1000, 0.1, 8);
  settings.width = settings.height = settings.crop_x1 = settings.crop_y1 = 160;
  const SceneNeeds needs = NeedsOf(scene, settings);
  const auto intersector = Intersector::Create(scene).value();
  const LightSet lights(scene, *intersector);
  const EyePathTracer tracer(scene, settings, needs, *intersector, lights);
  ThreadTeam team(1);
  FilmSpread spread(tracer);
  const EyePass whole = TraceHitpointPass(tracer, 0, nullptr, spread, team);
  ASSERT_TRUE(whole.is_whole);
  const double rays_of_tile = static_cast<double>(whole.rays) / 100;
  FirstHitsOfSet known;
  known.shapes.resize(160 * 160);
  for (const int tiles : {0, 1, 7}) {
    SCOPED_TRACE(tiles);
    std::atomic<int> questions = 0;
    const EyePass given_up =
        TraceHitpointPass(tracer, 0, &known, spread, team, [&] { return ++questions > tiles; });
    EXPECT_FALSE(given_up.is_whole);
    EXPECT_EQ(questions, tiles + 1) << "once it is true nobody asks again";
    EXPECT_FALSE(known.is_known);
  }
  // Rays are those of the tiles between the questions; none of them needs more than twice the mean.
  int questions = 0;
  EXPECT_LE(
      TraceHitpointPass(tracer, 0, nullptr, spread, team, [&] { return ++questions > 7; }).rays,
      static_cast<std::uint64_t>(2 * 7 * rays_of_tile));
  const EyePass again = TraceHitpointPass(tracer, 0, &known, spread, team);
  EXPECT_TRUE(again.is_whole);
  EXPECT_EQ(again.block, whole.block);
}

}  // namespace
}  // namespace lucerna
