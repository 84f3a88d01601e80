// A bake asks for the same rounds whenever the same is measured, and each round ends as it should.
#include "render/bake/bake_rounds.h"

#include <cmath>
#include <string>
#include <vector>

#include "gtest/gtest.h"

#include "render/bake/mesh_file.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

Scene Box() {
  Scene scene;
  AddMaterial(scene, DiffuseMaterial(0.5F));
  AddBox(scene, {0, 0, 0}, {1, 2, 3}, 0);
  return scene;
}

// The image of a round: a light that falls off around the middle of the box's top.
Image ImageOf(const BakeRound& round, float scale = 1) {
  Image image;
  image.width = static_cast<int>(round.set.sensors.size());
  image.height = 1;
  std::vector<float> pixels;
  for (const Sensor& sensor : round.set.sensors) {
    const Vec3 off = sensor.position - Vec3{0.5F, 1, 3};
    pixels.push_back(scale / (0.05F + Dot(off, off)));
  }
  for (const char* const name : {"R", "G", "B", "photons.R", "photons.G", "photons.B"})
    image.channels.push_back({name, pixels});
  return image;
}

BakeRounds Begun(const BakeSettings& settings, const RenderOverrides& overrides = {}) {
  StatusOr<BakeRounds> rounds = BakeRounds::Begin(Box(), settings, overrides);
  EXPECT_TRUE(rounds.ok()) << rounds.status();
  return *std::move(rounds);
}

BakeSettings Fine() {
  BakeSettings settings;
  settings.spacing = 0.05;
  return settings;
}

TEST(BakeRoundsTest, ASurveyComesFirstAndHasPassesOfItsOwn) {
  RenderOverrides overrides;
  overrides.error = 0.01;
  BakeRounds rounds = Begun(Fine(), overrides);
  ASSERT_TRUE(rounds.round());
  EXPECT_EQ(rounds.round()->name, kSurveyName);
  EXPECT_EQ(rounds.round()->overrides.passes, 16);
  EXPECT_FALSE(rounds.round()->overrides.error);
  ASSERT_TRUE(rounds.TakeIn(ImageOf(*rounds.round()), 16).ok());
  EXPECT_EQ(rounds.round()->name, "round 1");
  EXPECT_EQ(rounds.round()->overrides.error, 0.01);
  EXPECT_FALSE(rounds.round()->overrides.passes);
}

TEST(BakeRoundsTest, LaterRoundsHaveAsManyPassesAsTheFirst) {
  RenderOverrides overrides;
  overrides.error = 0.01;
  BakeRounds rounds = Begun(Fine(), overrides);
  ASSERT_TRUE(rounds.TakeIn(ImageOf(*rounds.round()), 16).ok());
  ASSERT_TRUE(rounds.TakeIn(ImageOf(*rounds.round()), 23).ok());
  ASSERT_TRUE(rounds.round());
  EXPECT_EQ(rounds.round()->name, "round 2");
  EXPECT_EQ(rounds.round()->overrides.passes, 23);
  EXPECT_FALSE(rounds.round()->overrides.error);
}

TEST(BakeRoundsTest, AMeshThatIsTooLargeIsRefusedBeforeItIsMade) {
  BakeSettings settings = Fine();
  EXPECT_TRUE(BakeRounds::Check(Box(), settings, std::uint64_t{1} << 30).ok());
  settings.spacing = 1e-6;
  EXPECT_TRUE(
      absl::IsResourceExhausted(BakeRounds::Check(Box(), settings, std::uint64_t{1} << 30)));
  EXPECT_TRUE(absl::IsResourceExhausted(
      BakeRounds::Begin(Box(), settings, {}, std::uint64_t{1} << 30).status()));
  settings.materials = {"none"};
  EXPECT_TRUE(absl::IsNotFound(BakeRounds::Check(Box(), settings, std::uint64_t{1} << 30)));
}

TEST(BakeRoundsTest, WithoutAnEndRoundsHave64Passes) {
  BakeSettings settings = Fine();
  settings.sides = MeasuredSides::kFront;
  settings.tolerance = 0;
  const BakeRounds rounds = Begun(settings);
  EXPECT_EQ(rounds.round()->name, "round 1") << "nothing to survey";
  EXPECT_EQ(rounds.round()->overrides.passes, 64);
  EXPECT_EQ(rounds.round()->overrides.photons_per_pass, 1 << 16);
}

// To its end; the sensor files of its rounds.
std::vector<std::string> Measure(BakeRounds& rounds, float scale = 1) {
  std::vector<std::string> files;
  while (rounds.round()) {
    files.push_back(SensorsFile("scene.pbrt", rounds.round()->set));
    const Status taken = rounds.TakeIn(ImageOf(*rounds.round(), scale), 4);
    EXPECT_TRUE(taken.ok()) << taken;
    if (!taken.ok()) break;
  }
  return files;
}

TEST(BakeRoundsTest, TheSameMeasurementsAskForTheSameRoundsAndMakeTheSameFile) {
  BakeRounds one = Begun(Fine());
  BakeRounds other = Begun(Fine());
  const std::vector<std::string> files = Measure(one);
  EXPECT_GT(files.size(), 3U);
  EXPECT_EQ(Measure(other), files);
  const BakeResult result = one.Finish("scene.pbrt", 0.5, {}).value();
  EXPECT_EQ(other.Finish("scene.pbrt", 0.5, {})->file, result.file);
  ASSERT_TRUE(ReadMeshGlb("a.glb", result.file).ok());
  EXPECT_TRUE(result.interpolation_error);
  EXPECT_FALSE(result.figures.empty());
  EXPECT_TRUE(result.uv_mesh.empty());
  BakeRounds brighter = Begun(Fine());
  (void)Measure(brighter, 2);
  EXPECT_NE(brighter.Finish("scene.pbrt", 0.5, {})->file, result.file);
}

TEST(BakeRoundsTest, OneThatStopsMeasuresOnlyWhatTheMeshNeeds) {
  BakeRounds whole = Begun(Fine());
  const std::size_t all = Measure(whole).size();
  BakeRounds stopped = Begun(Fine());
  ASSERT_TRUE(stopped.TakeIn(ImageOf(*stopped.round()), 16).ok());
  stopped.StopRefining();
  EXPECT_LT(1 + Measure(stopped).size(), all);
  EXPECT_TRUE(stopped.Finish("scene.pbrt", 0, {}).ok());
}

TEST(BakeRoundsTest, HistogramsAndLightMapsAreOneRound) {
  BakeSettings settings = Fine();
  settings.sides = MeasuredSides::kFront;
  settings.estimator = BakeEstimator::kHistogram;
  BakeRounds histogram = Begun(settings);
  EXPECT_FALSE(histogram.round()->set.buckets.empty());
  EXPECT_EQ(Measure(histogram).size(), 1U);
  EXPECT_FALSE(histogram.Finish("scene.pbrt", 0, {})->interpolation_error);
  settings.estimator = BakeEstimator::kKernel;
  settings.is_light_map = true;
  BakeRounds map = Begun(settings);
  EXPECT_EQ(Measure(map).size(), 1U);
  const BakeResult result = map.Finish("scene.pbrt", 0, {{"who", "me"}}).value();
  EXPECT_TRUE(ReadMeshGlb("a.glb", result.uv_mesh).ok());
  EXPECT_NE(result.file.find("who"), std::string::npos);
}

TEST(BakeRoundsTest, AnImageOfAnotherRoundIsRefused) {
  BakeRounds rounds = Begun(Fine());
  Image image = ImageOf(*rounds.round());
  image.channels.erase(image.channels.begin());
  EXPECT_TRUE(absl::IsDataLoss(rounds.TakeIn(image, 16)));
  image = ImageOf(*rounds.round());
  for (ImageChannel& channel : image.channels)
    channel.pixels.pop_back();
  EXPECT_TRUE(absl::IsDataLoss(rounds.TakeIn(image, 16)));
}

TEST(BakeSettingsTest, SaysWhatDoesNotGoTogether) {
  const auto check = [](auto change) {
    BakeSettings settings;
    RenderOverrides overrides;
    change(settings, overrides);
    return CheckBake(settings, overrides);
  };
  EXPECT_TRUE(check([](BakeSettings&, RenderOverrides&) {}).ok());
  for (const Status& status :
       {check([](BakeSettings&s, RenderOverrides&) { s.spacing = 0; }),
        check([](BakeSettings&s, RenderOverrides&) { s.spacing = std::nan(""); }),
        check([](BakeSettings&s, RenderOverrides&) { s.tolerance = -1; }),
        check([](BakeSettings&s, RenderOverrides&) {
          s.is_light_map = true;
          s.estimator = BakeEstimator::kHistogram;
        }),
        check([](BakeSettings&s, RenderOverrides&) {
          s.is_light_map = true;
          s.elements = MeshElements::kQuadratic;
        }),
        check([](BakeSettings&s, RenderOverrides&) {
          s.estimator = BakeEstimator::kHistogram;
          s.elements = MeshElements::kQuadratic;
        }),
        check([](BakeSettings&s, RenderOverrides&o) {
          s.estimator = BakeEstimator::kHistogram;
          o.kernel = KernelKind::kConstant;
        }),
        check([](BakeSettings&, RenderOverrides&o) { o.width = 8; }),
        check([](BakeSettings&, RenderOverrides&o) { o.crop = CropWindow(); })}) {
    EXPECT_TRUE(absl::IsInvalidArgument(status)) << status;
  }
}

}  // namespace
}  // namespace lucerna
