// The image depends on the scene and the settings alone: not on threads, batches, or when eye
// paths are traced.
#include "server/job_estimator.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <memory>
#include <optional>
#include <ostream>

#include "gtest/gtest.h"

#include "render/estimate/evidence.h"
#include "render/estimate/slice_tree.h"
#include "render/math/color_space.h"
#include "render/wire/slice_codec.h"
#include "tests/support/local_render.h"
#include "tests/support/measure.h"
#include "tests/support/test_scenes.h"
#include "worker/batch_tracer.h"

namespace lucerna {
namespace {

constexpr std::array kAllControllers = {
#define LUCERNA_KIND(Name, name, evidence) RadiusControllerKind::k##Name,
    LUCERNA_RADIUS_CONTROLLERS(LUCERNA_KIND)
#undef LUCERNA_KIND
};

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

// The film's white balance multiplies the image, and no figure of errors by more than what it does
// to luminances.
TEST(JobEstimatorTest, BalancesTheWhiteOfTheImage) {
  Scene scene = Room();
  scene.area_lights[0].radiance = {10, 8, 4};
  const RenderSettings settings = TestSettings(scene, 5000, 0.1, 8);
  const auto render = [&] {
    LocalRender local(scene, settings, 2);
    for (int pass = 0; pass < 4; ++pass)
      local.AddPass();
    return local.MakeImage();
  };
  const Image plain = render();
  const ColorMatrix matrix = {{{0.9, 0.05, 0}, {0.02, 1, 0.01}, {-0.01, 0.1, 1.3}}};
  scene.film.white_balance = matrix;
  const Image balanced = render();
  constexpr std::array<const char*, 3> kChannels = {"R", "G", "B"};
  double noise = 0;
  double plain_noise = 0;
  for (std::size_t i = 0; i < plain.Find("R")->pixels.size(); ++i) {
    std::array<double, 3> before{};
    for (std::size_t c = 0; c < 3; ++c)
      before[c] = static_cast<double>(plain.Find(kChannels[c])->pixels[i]);
    const auto expected = Transformed(matrix, before);
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_NEAR(static_cast<double>(balanced.Find(kChannels[c])->pixels[i]), expected[c],
                  1e-5 * (before[0] + before[1] + before[2]));
    }
    noise += static_cast<double>(balanced.Find("noise")->pixels[i]);
    plain_noise += static_cast<double>(plain.Find("noise")->pixels[i]);
  }
  EXPECT_NEAR(noise / plain_noise, 1, 0.1);
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

// A round of several passes that is not whole is traced again, and the number of photons that later
// passes have still follows from the first ones.
TEST(JobEstimatorTest, GoesOnFromACheckpointWithTheSameBits) {
  const Scene scene = Room();
  for (const RadiusControllerKind kind : kAllControllers) {
    RenderSettings settings = TestSettings(scene, 2000, 0.1, 8);
    settings.radius_controller = kind;
    settings.adaptive_photons = true;
    for (const auto& [killed_after, whole] : {std::pair{5, 5}, std::pair{19, 16}}) {
      LocalRender quiet(scene, settings, 2);
      LocalRender killed(scene, settings, 2);
      LocalRender restored(scene, settings, 2);
      for (int pass = 0; pass < 23; ++pass)
        quiet.AddPass();
      for (int pass = 0; pass < killed_after; ++pass)
        killed.AddPass();
      const std::string checkpoint = killed.Save();
      ASSERT_TRUE(restored.Restore(checkpoint).ok());
      EXPECT_TRUE(restored.Save() == checkpoint);
      for (int pass = whole; pass < 23; ++pass)
        restored.AddPass();
      EXPECT_EQ(restored.MakeImage().PixelDigest(), quiet.MakeImage().PixelDigest());
      EXPECT_TRUE(restored.Save() == quiet.Save());
      EXPECT_EQ(restored.EstimateError(2).relative.high, quiet.EstimateError(2).relative.high);
    }
  }
}

// What eye paths see through a ball of glass varies more than what they see beside it.
TEST(JobEstimatorTest, GoesOnFromACheckpointWithTheSameNumbersOfEyePaths) {
  const Scene scene = LoadScene("glass-sphere.pbrt");
  RenderOverrides overrides;
  overrides.width = 64;
  overrides.height = 48;
  const RenderSettings settings = SettingsFor(scene, overrides);
  const auto next_counts = [](const LocalRender& render) {
    const JobEstimator& estimator = render.estimator();
    return estimator.PlanFor(RoundOf(estimator.whole_passes()))->eye_paths;
  };
  LocalRender killed(scene, settings, 2);
  LocalRender restored(scene, settings, 2);
  for (int pass = 0; pass < 16; ++pass) {
    killed.AddPass();
    const bool has_counts = next_counts(killed) != nullptr;
    // Of the passes that compare; what is chosen after them is for the round after the next.
    EXPECT_EQ(has_counts, pass >= 3 && pass != 7 && pass != 8) << pass;
  }
  ASSERT_TRUE(restored.Restore(killed.Save()).ok());
  ASSERT_NE(next_counts(restored), nullptr);
  EXPECT_EQ(*next_counts(restored), *next_counts(killed));
  EXPECT_GT(std::ranges::max(*next_counts(killed)), 1);
}

// A room with a window in its front wall, over ground that a light beyond its roof shines on: what
// comes in has been scattered outside.
Scene RoomOverLitGround() {
  Scene scene;
  const std::int32_t gray = AddMaterial(scene, DiffuseMaterial(0.6F));
  AddQuad(scene, {-20, -20, -0.01F}, {40, 0, 0}, {0, 40, 0}, gray);
  AddQuad(scene, {-1, 0, 0}, {2, 0, 0}, {0, 2, 0}, gray);
  AddQuad(scene, {-1, 0, 2}, {2, 0, 0}, {0, 2, 0}, gray);
  AddQuad(scene, {-1, 0, 0}, {0, 2, 0}, {0, 0, 2}, gray);
  AddQuad(scene, {1, 0, 0}, {0, 2, 0}, {0, 0, 2}, gray);
  AddQuad(scene, {-1, 2, 0}, {2, 0, 0}, {0, 0, 2}, gray);
  AddQuad(scene, {-1, 0, 0}, {2, 0, 0}, {0, 0, 0.8F}, gray);
  AddQuad(scene, {-1, 0, 1.2F}, {2, 0, 0}, {0, 0, 0.8F}, gray);
  scene.distant_lights.push_back({Normalize({0, -1, -1}), Gray(10)});
  SetCamera(scene, {0, 0.1, 1}, {0, 2, 0.9}, {0, 0, 1}, 80, 24);
  return scene;
}

// Of the round that comes next.
std::shared_ptr<const PhotonGuide> NextGuide(const LocalRender& render) {
  const JobEstimator& estimator = render.estimator();
  return estimator.PlanFor(RoundOf(static_cast<std::uint64_t>(estimator.whole_passes())))->guide;
}

TEST(JobEstimatorTest, LeadsPhotonsThroughAWindowFromWhereTheyFirstLand) {
  const Scene scene = RoomOverLitGround();
  RenderSettings settings = TestSettings(scene, 4000, 0.1, 8);
  settings.adaptive_photons = false;
  constexpr int kPasses = 13;
  LocalRender quiet(scene, settings, 2);
  for (int pass = 0; pass < kPasses; ++pass) {
    // First passes tell too little of what photons bring.
    if (pass == 3) {
      EXPECT_EQ(NextGuide(quiet)->scatterings(), nullptr);
    }
    quiet.AddPass();
  }
  EXPECT_NE(NextGuide(quiet)->scatterings(), nullptr);
  // The same from a checkpoint: pilot paths are traced again.
  LocalRender killed(scene, settings, 2);
  for (int pass = 0; pass < 5; ++pass)
    killed.AddPass();
  LocalRender restored(scene, settings, 1);
  ASSERT_TRUE(restored.Restore(killed.Save()).ok());
  for (int pass = 5; pass < kPasses; ++pass)
    restored.AddPass();
  EXPECT_EQ(restored.MakeImage().PixelDigest(), quiet.MakeImage().PixelDigest());
  EXPECT_TRUE(restored.Save() == quiet.Save());
}

// A light in the room that brings most of what photons bring: the window is not worth it.
TEST(JobEstimatorTest, LeadsNoPhotonsThroughAWindowThatHardlyMatters) {
  Scene scene = RoomOverLitGround();
  AddQuad(scene, {-0.2F, 1.2F, 1.99F}, {0, 0.4F, 0}, {0.4F, 0, 0}, 0, AddAreaLight(scene, 100));
  RenderSettings settings = TestSettings(scene, 4000, 0.1, 8);
  settings.adaptive_photons = false;
  LocalRender render(scene, settings, 2);
  for (int pass = 0; pass < 13; ++pass) {
    render.AddPass();
    EXPECT_EQ(NextGuide(render)->scatterings(), nullptr) << pass;
  }
}

// Of as many photons without a guide and with one the mean is the same, and the error far less.
TEST(JobEstimatorTest, PhotonsLedThroughAWindowBringTheSameLight) {
  const Scene scene = RoomOverLitGround();
  constexpr int kSeeds = 8;
  struct Mean {
    double sum = 0, squares = 0;
    void Add(double value) {
      sum += value / kSeeds;
      squares += value * value / kSeeds;
    }
    [[nodiscard]] double Variance() const { return (squares - sum * sum) / (kSeeds - 1); }
  };
  const auto mean_of = [&](bool unguided) {
    Mean mean;
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
      RenderSettings settings = TestSettings(scene, 4000, 0.1, 8, seed);
      settings.adaptive_photons = false;
      settings.unguided = unguided;
      LocalRender render(scene, settings, 2);
      for (int pass = 0; pass < 16; ++pass)
        render.AddPass();
      mean.Add(render.estimator().Snapshot().luminance);
    }
    return mean;
  };
  const Mean with = mean_of(false);
  const Mean without = mean_of(true);
  const double error = std::sqrt(with.Variance() + without.Variance());
  EXPECT_NEAR(with.sum, without.sum, StudentQuantile(1e-4, kSeeds) * error);
  EXPECT_LT(with.Variance(), without.Variance() / 2);
}

TEST(JobEstimatorTest, RefusesACheckpointOfAnotherShapeAndIsAsBefore) {
  const Scene scene = Room();
  RenderSettings settings = TestSettings(scene, 2000, 0.1, 8);
  LocalRender render(scene, settings, 1);
  for (int pass = 0; pass < 3; ++pass)
    render.AddPass();
  const std::string checkpoint = render.Save();
  LocalRender other(scene, settings, 1);
  const std::string before = other.Save();
  for (const std::size_t size :
       {std::size_t{0}, std::size_t{10}, checkpoint.size() / 2, checkpoint.size() - 1}) {
    EXPECT_TRUE(absl::IsInvalidArgument(other.Restore(checkpoint.substr(0, size)))) << size;
  }
  EXPECT_TRUE(absl::IsInvalidArgument(other.Restore(checkpoint + "x")));
  EXPECT_EQ(other.Save(), before);
  settings.crop_x1 -= 1;
  LocalRender narrower(scene, settings, 1);
  EXPECT_TRUE(absl::IsInvalidArgument(narrower.Restore(checkpoint)));
}

TEST(JobEstimatorTest, TracesTheEyePathsOfAPassAtAnyTime) {
  const Scene scene = Room();
  const RenderSettings settings = TestSettings(scene, 1000, 0.1, 8);
  const auto early = JobEstimator::Create(scene, settings, NeedsOf(scene, settings), 1).value();
  const auto late = JobEstimator::Create(scene, settings, NeedsOf(scene, settings), 3).value();
  for (std::uint64_t pass = 0; pass < 3; ++pass) {
    EyePass now = late->TraceEyePaths(pass).value();
    const std::size_t rows = now.block.size();
    const std::size_t columns = EvidenceColumns(EvidenceOf(settings.radius_controller, pass));
    const RoundPlan plan = late->PlanFor(RoundOf(pass)).value();
    late->AddRound(std::make_shared<const SliceSums>(
                       late->SliceOf(std::move(now), plan, PassSums(rows, columns))),
                   plan);
  }
  const EyePass a = early->TraceEyePaths(3).value();
  const EyePass b = late->TraceEyePaths(3).value();
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
  const EyePass pass = estimator->TraceEyePaths(0).value();
  const RadiusColumn radii = HitpointRadii(pass, estimator->PlanFor({0, 1}).value());
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

// Slices and rounds
// ---------------------------------------------------------------------------------------------

// The room with metal so smooth that photons of caustics are gathered beyond it.
Scene RoomWithNarrowMetal() {
  Scene scene = Room();
  for (Material& material : scene.materials) {
    if (material.kind == Material::Kind::kConductor) material.alpha_u = material.alpha_v = 0.1F;
  }
  return scene;
}

// A ball and a floor under a sky, at which some eye paths go past them.
Scene Outdoors() {
  Scene scene;
  AddQuad(scene, {-1, -1, -1}, {0, 0, 2}, {2, 0, 0}, AddMaterial(scene, DiffuseMaterial(0.6F)));
  AddSphere(scene, {0, -0.5F, 0}, 0.4F, AddMaterial(scene, DielectricMaterial(1.5F)));
  InfiniteLight sky;
  sky.radiance = {0.3F, 0.2F, 0.5F};
  scene.infinite_lights.push_back(sky);
  SetCamera(scene, {0, 0, -3}, {0, 0, 0}, {0, 1, 0}, 60, 16);
  return scene;
}

Scene WithoutLight() {
  Scene scene = Outdoors();
  scene.infinite_lights.clear();
  return scene;
}

Scene WithNothingInView() {
  Scene scene = Room();
  SetCamera(scene, {0, 0, -3}, {0, 0, -6}, {0, 1, 0}, 60, 16);
  return scene;
}

// Radii between a half and three halves, another for each pixel, and one to three eye paths.
RoundPlan UnevenPlan(const RenderSettings& settings) {
  RadiusColumn radii(static_cast<std::size_t>(settings.crop_width() * settings.crop_height()));
  EyePathCounts counts(radii.size());
  for (std::size_t pixel = 0; pixel < radii.size(); ++pixel) {
    radii[pixel] = 3 * (0.5F + static_cast<float>(pixel % 17) / 16);
    counts[pixel] = static_cast<std::uint8_t>(1 + pixel % 3);
  }
  return {.photons_per_pass = static_cast<std::uint64_t>(settings.photons_per_pass),
          .radii = std::make_shared<const RadiusColumn>(std::move(radii)),
          .caustic_radius = 2.5F,
          .eye_paths = std::make_shared<const EyePathCounts>(std::move(counts))};
}

// What the coordinator makes of a pass whose photons came in `batches`.
SliceSums SplitSlice(const JobEstimator& estimator, BatchTracer& tracer,
                     const RenderSettings& settings, std::uint64_t pass, const RoundPlan& plan,
                     std::uint64_t batches) {
  const std::atomic<bool> stop = false;
  EyePass eye = estimator.TraceEyePaths(pass, plan.eye_paths.get()).value();
  PassSums sums(eye.block.size(), EvidenceColumns(EvidenceOf(settings.radius_controller, pass)));
  if (eye.block.size() > 0 && estimator.needs().Uses(Part::kPhotons)) {
    for (std::uint64_t b = batches; b-- > 0;) {
      const Accumulation batch =
          tracer
              .Run(settings, estimator.needs(), pass, plan.photons_per_pass * b / batches,
                   plan.photons_per_pass * (b + 1) / batches, eye.block, HitpointRadii(eye, plan),
                   stop)
              .value();
      EXPECT_TRUE(sums.Add(batch).ok());
    }
  }
  return estimator.SliceOf(std::move(eye), plan, std::move(sums));
}

struct SliceCase {
  const char* name;
  Scene (*scene)();
};
void PrintTo(const SliceCase& c, std::ostream* out) {
  *out << c.name;
}

class SlicesTest : public testing::TestWithParam<SliceCase> {};

// A pass is the same whoever traced it: the coordinator and several workers, or one worker.
TEST_P(SlicesTest, APassThatIsSplitEqualsOneThatAWorkerTraces) {
  const Scene scene = GetParam().scene();
  const std::atomic<bool> stop = false;
  for (const RadiusControllerKind controller : kAllControllers) {
    RenderSettings settings = TestSettings(scene, 1500, 0, 8);
    settings.radius_controller = controller;
    const SceneNeeds needs = NeedsOf(scene, settings);
    const auto estimator = JobEstimator::Create(scene, settings, needs, 2).value();
    BatchTracer splitter(scene, 2);
    BatchTracer worker(scene, 1);
    const RoundPlan plan = UnevenPlan(settings);
    for (const std::uint64_t pass : {0, 5, 16, 36}) {
      const SliceSums split = SplitSlice(*estimator, splitter, settings, pass, plan, 3);
      SliceSums whole = worker.RunSlice(settings, needs, {pass, pass + 1}, plan, stop).value();
      EXPECT_EQ(whole.dropped_photons.size(), whole.tally.dropped);
      whole.dropped_photons.clear();  // of a split pass they are named with each batch
      EXPECT_EQ(whole, split) << NameOf(controller) << ", pass " << pass;
    }
  }
}

// A slice of several passes is the sum of theirs, for any threads.
TEST_P(SlicesTest, ASliceIsTheSumOfItsPasses) {
  const Scene scene = GetParam().scene();
  const std::atomic<bool> stop = false;
  RenderSettings settings = TestSettings(scene, 1500, 0, 8);
  settings.radius_controller = RadiusControllerKind::kAppm;
  const SceneNeeds needs = NeedsOf(scene, settings);
  BatchTracer alone(scene, 1);
  BatchTracer team(scene, 3);
  const RoundPlan plan = UnevenPlan(settings);
  const auto pass_of = [&](std::uint64_t pass) {
    return team.RunSlice(settings, needs, {pass, pass + 1}, plan, stop).value();
  };
  SliceSums sum = pass_of(33);
  SliceSums second = pass_of(35);
  ASSERT_TRUE(MergeSibling(sum, pass_of(32)).ok());
  ASSERT_TRUE(MergeSibling(second, pass_of(34)).ok());
  ASSERT_TRUE(MergeSibling(second, sum).ok());
  EXPECT_EQ(alone.RunSlice(settings, needs, {32, 36}, plan, stop).value(), second);
  EXPECT_EQ(team.RunSlice(settings, needs, {32, 36}, plan, stop).value(), second);
}

// What a worker sends is what the coordinator takes.
TEST_P(SlicesTest, WhatAWorkerSendsIsAccepted) {
  const Scene scene = GetParam().scene();
  const std::atomic<bool> stop = false;
  const RenderSettings settings = TestSettings(scene, 1500, 0, 8);
  const SceneNeeds needs = NeedsOf(scene, settings);
  const auto estimator = JobEstimator::Create(scene, settings, needs, 2).value();
  BatchTracer worker(scene, 1);
  for (const PassRange& passes : {PassRange{1, 2}, PassRange{16, 18}}) {
    const RoundPlan plan = UnevenPlan(settings);
    const SliceSums slice = worker.RunSlice(settings, needs, passes, plan, stop).value();
    const auto decoded = DecodeSlice(EncodeSlice(slice), estimator->ShapeOf(passes, plan));
    ASSERT_TRUE(decoded.ok()) << decoded.status();
    EXPECT_EQ(*decoded, slice);
  }
}

INSTANTIATE_TEST_SUITE_P(Scenes, SlicesTest,
                         testing::Values(SliceCase{"room", Room},
                                         SliceCase{"narrow metal", RoomWithNarrowMetal},
                                         SliceCase{"outdoors", Outdoors},
                                         SliceCase{"without light", WithoutLight},
                                         SliceCase{"nothing in view", WithNothingInView}));

TEST(SlicesTest, TheScenesHaveWhatTheyAreNamedFor) {
  const auto needs = [](const Scene& scene) {
    return NeedsOf(scene, TestSettings(scene, 1500, 0, 8));
  };
  EXPECT_TRUE(needs(Room()).Uses(Part::kPhotonDirections));
  EXPECT_FALSE(needs(Room()).Uses(Part::kCausticHitpoints));
  EXPECT_TRUE(needs(RoomWithNarrowMetal()).Uses(Part::kCausticHitpoints));
  EXPECT_TRUE(needs(Outdoors()).Uses(Part::kPhotons));
  EXPECT_FALSE(needs(WithoutLight()).Uses(Part::kPhotons));
}

TEST(SlicesTest, RefusesWhatDoesNotFitItsJobAndEndsSoonWhenStopped) {
  const Scene scene = Room();
  const RenderSettings settings = TestSettings(scene, 1500, 0, 8);
  const SceneNeeds needs = NeedsOf(scene, settings);
  BatchTracer worker(scene, 1);
  const std::atomic<bool> stop = false;
  const RoundPlan plan = UnevenPlan(settings);
  const auto status_of = [&](const PassRange& passes, const RoundPlan& p) {
    return worker.RunSlice(settings, needs, passes, p, stop).status();
  };
  for (const PassRange& passes :
       {PassRange{3, 3}, PassRange{33, 35}, PassRange{32, 35}, PassRange{0, 2}, PassRange{5, 4}})
    EXPECT_TRUE(absl::IsInvalidArgument(status_of(passes, plan))) << passes.first;
  RoundPlan other = plan;
  other.radii = nullptr;
  EXPECT_TRUE(absl::IsInvalidArgument(status_of({3, 4}, other)));
  other.radii = std::make_shared<const RadiusColumn>(7, 1.0F);
  EXPECT_TRUE(absl::IsInvalidArgument(status_of({3, 4}, other)));
  const std::atomic<bool> stopped = true;
  EXPECT_TRUE(
      absl::IsCancelled(worker.RunSlice(settings, needs, {32, 36}, plan, stopped).status()));
}

// A job whose passes workers trace, round by round.
class RoundJob {
 public:
  RoundJob(const Scene& scene, const RenderSettings& settings)
      : settings_(settings),
        needs_(NeedsOf(scene, settings)),
        estimator_(JobEstimator::Create(scene, settings, needs_, 1).value()),
        tracer_(scene, 1) {}

  // Goes on until there are `last` passes, some of which may be of a round that is not whole.
  void RenderTo(std::uint64_t last) {
    while (estimator_->whole_passes() < last) {
      const PassRange round = RoundOf(estimator_->whole_passes());
      const RoundPlan plan = PlanOf(round);
      SliceTree tree(round);
      const std::uint64_t end = std::min(round.last, last);
      // From the back, so that slices come out of order.
      for (std::uint64_t pass = end; pass-- > round.first;)
        EXPECT_TRUE(tree.Add(Traced({pass, pass + 1}, plan)).ok());
      if (!tree.IsWhole()) return estimator_->SetTail(tree.Prefix(), plan);
      estimator_->AddRound(tree.Whole(), plan);
    }
  }
  RoundPlan PlanOf(const PassRange& round) const { return estimator_->PlanFor(round).value(); }
  std::optional<RoundPlan> PlanIfKnown(const PassRange& round) const {
    return estimator_->PlanFor(round);
  }
  JobEstimator& estimator() { return *estimator_; }
  double MissingShare() { return estimator_->FindMissingLight(estimator_->Snapshot()).share; }
  ErrorEstimate ErrorAtLook(int look) {
    const EstimatorSnapshot snapshot = estimator_->Snapshot();
    return estimator_->EstimateError(snapshot, estimator_->FindMissingLight(snapshot), look);
  }

 private:
  SliceSums Traced(const PassRange& passes, const RoundPlan& plan) {
    const std::atomic<bool> stop = false;
    return tracer_.RunSlice(settings_, needs_, passes, plan, stop).value();
  }

  RenderSettings settings_;
  SceneNeeds needs_;
  std::unique_ptr<JobEstimator> estimator_;
  BatchTracer tracer_;
};

Scene SmallRoom() {
  Scene scene = Room();
  SetCamera(scene, {0, 0, -0.95}, {0, 0, 0}, {0, 1, 0}, 80, 8);
  return scene;
}

// Passes 16 to 31 are in rounds of four, and those from 32 on in rounds of eight.
TEST(RoundsOfAJobTest, GoingOnAfterAnEndWithinARoundLeavesNoTrace) {
  const Scene scene = SmallRoom();
  for (const RadiusControllerKind controller :
       {RadiusControllerKind::kAppm, RadiusControllerKind::kPpm,
        RadiusControllerKind::kFrequencyMse}) {
    RenderSettings settings = TestSettings(scene, 300, 0, 8);
    settings.radius_controller = controller;
    RoundJob in_one_go(scene, settings);
    in_one_go.RenderTo(47);
    RoundJob in_parts(scene, settings);
    for (const std::uint64_t passes : {1U, 21U, 21U, 33U, 34U, 46U, 47U})
      in_parts.RenderTo(passes);
    EXPECT_EQ(in_parts.estimator().passes(), 47);
    EXPECT_EQ(in_parts.estimator().whole_passes(), 40U);
    EXPECT_EQ(in_parts.estimator().photons(), 47U * 300);
    EXPECT_EQ(in_parts.estimator().MakeImage().PixelDigest(),
              in_one_go.estimator().MakeImage().PixelDigest())
        << NameOf(controller);
    EXPECT_EQ(in_parts.estimator().eye_rays(), in_one_go.estimator().eye_rays());
    const ErrorEstimate a = in_parts.ErrorAtLook(3);
    const ErrorEstimate b = in_one_go.ErrorAtLook(3);
    EXPECT_EQ(a.relative.total(), b.relative.total());
    EXPECT_EQ(a.relative.high, b.relative.high);
  }
}

// Where later passes have more photons, every photon counts alike, in jobs that end on the way and
// go on too.
TEST(RoundsOfAJobTest, EveryPhotonCountsAlikeWhereTheirNumberRises) {
  const Scene scene = LoadScene("water-lamp.pbrt");
  RenderOverrides overrides;
  overrides.width = overrides.height = 32;
  overrides.photons_per_pass = 32 * 32;
  overrides.adaptive_photons = true;
  const RenderSettings settings = SettingsFor(scene, overrides);
  BatchTracer tracer(scene, 1);
  const std::atomic<bool> stop = false;
  // In rounds of one pass: sums of several are rounded.
  constexpr std::uint64_t kPasses = 9;
  RoundJob job(scene, settings);
  RgbSum weighted{};  // over the pixels
  double photons = 0;
  for (std::uint64_t pass = 0; pass < kPasses; ++pass) {
    const RoundPlan plan = job.PlanOf(RoundOf(pass));
    const SliceSums slice =
        tracer.RunSlice(settings, NeedsOf(scene, settings), {pass, pass + 1}, plan, stop).value();
    const auto count = static_cast<double>(plan.photons_per_pass);
    photons += count;
    for (std::size_t i = 0; i < slice.pixels(); ++i) {
      for (std::size_t c = 0; c < 3; ++c)
        weighted[c] += count * static_cast<double>(slice.At(kPhotonRadiance + c, i));
    }
    job.RenderTo(pass + 1);
  }
  ASSERT_GT(photons, 2.0 * kPasses * 32 * 32) << "their number rises";
  const Image image = job.estimator().MakeImage();
  double green = 0;
  for (const float pixel : image.Find("photons.G")->pixels)
    green += static_cast<double>(pixel);
  const double expected = scene.film.exposure * ToRec709(weighted)[1] / photons;
  EXPECT_NEAR(green, expected, 1e-6 * expected);
  RoundJob in_one_go(scene, settings);
  in_one_go.RenderTo(kPasses);
  EXPECT_EQ(image.PixelDigest(), in_one_go.estimator().MakeImage().PixelDigest());
}

// The passes of a tail count as those of a whole round do: the image of 20 passes is the same
// whether the last four came as a round or as a tail of the round that ends there.
TEST(RoundsOfAJobTest, ATailCountsAsItsRoundWould) {
  const Scene scene = SmallRoom();
  const RenderSettings settings = TestSettings(scene, 300, 0, 8);
  RoundJob whole(scene, settings);
  whole.RenderTo(20);
  RoundJob tailed(scene, settings);
  tailed.RenderTo(16);
  const RoundPlan plan = tailed.PlanOf({16, 20});
  BatchTracer tracer(scene, 1);
  const std::atomic<bool> stop = false;
  tailed.estimator().SetTail(
      {std::make_shared<const SliceSums>(
          tracer.RunSlice(settings, NeedsOf(scene, settings), {16, 20}, plan, stop).value())},
      plan);
  EXPECT_EQ(tailed.estimator().passes(), 20);
  EXPECT_EQ(tailed.estimator().whole_passes(), 16U);
  EXPECT_EQ(tailed.estimator().photons(), whole.estimator().photons());
  EXPECT_EQ(tailed.MissingShare(), whole.MissingShare());
  // Which of the two a job ends with is a matter of moments, so no layer may tell.
  const Image a = tailed.estimator().MakeImage();
  const Image b = whole.estimator().MakeImage();
  ASSERT_EQ(a.channels.size(), b.channels.size());
  for (const ImageChannel& channel : b.channels)
    EXPECT_EQ(a.Find(channel.name)->pixels, channel.pixels) << channel.name;
}

// Workers trace a round as soon as its radii are known, or when the job goes on after all others
// have come.
TEST(RoundsOfAJobTest, APlanIsTheSameWheneverItIsMade) {
  const Scene scene = SmallRoom();
  RenderSettings settings = TestSettings(scene, 300, 0, 8);
  settings.radius_controller = RadiusControllerKind::kAppm;
  settings.adaptive_photons = true;
  RoundJob early(scene, settings);
  RoundJob late(scene, settings);
  int ahead = 0;
  for (std::uint64_t pass = 0; pass < 64; pass = RoundOf(pass).last) {
    const PassRange round = RoundOf(pass);
    const std::uint64_t from = RadiiFrom(round);
    early.RenderTo(from);
    late.RenderTo(round.first);
    const RoundPlan of_early = early.PlanOf(round);
    const RoundPlan of_late = late.PlanOf(round);
    EXPECT_EQ(*of_early.radii, *of_late.radii) << round.first;
    EXPECT_EQ(of_early.caustic_radius, of_late.caustic_radius);
    EXPECT_EQ(of_early.photons_per_pass, of_late.photons_per_pass);
    if (from < round.first) ++ahead;
    // Not before all passes that its radii follow from have come.
    for (PassRange next = RoundOf(round.last); next.first < 100; next = RoundOf(next.last))
      EXPECT_EQ(early.PlanIfKnown(next).has_value(), RadiiFrom(next) <= from) << next.first;
    // And not again once it has.
    if (round.first > 0) {
      EXPECT_FALSE(late.PlanIfKnown(RoundOf(round.first - 1)));
    }
  }
  EXPECT_GT(ahead, 10);
}

}  // namespace
}  // namespace lucerna
