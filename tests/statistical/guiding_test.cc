// Guided photons must bring the same light, with less noise.
#include <cmath>
#include <vector>

#include "gtest/gtest.h"

#include "render/transport/photon_guide.h"
#include "render/transport/scatter_guide.h"
#include "tests/support/local_render.h"
#include "tests/support/measure.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

constexpr int kParts = 8;
constexpr int kPasses = 32;

// Of renders that differ in their seed alone.
struct Measured {
  MeasuredMean mean;    // over the pixels
  double variance = 0;  // of pixels, relative to their squared means with a floor; the mean
};

Measured MeasureImages(const Scene& scene, RenderSettings settings) {
  std::vector<std::vector<double>> images;
  std::vector<double> means;
  for (int part = 0; part < kParts; ++part) {
    settings.seed = static_cast<std::uint64_t>(part) + 1;
    const Image image = RenderLocally(scene, settings, kPasses);
    const std::vector<float>& green = image.Find("G")->pixels;
    images.emplace_back(green.begin(), green.end());
    means.push_back(ChannelMean(image, "G"));
  }
  Measured measured;
  measured.mean = MeanOf(means);
  const std::size_t pixels = images[0].size();
  for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
    double mean = 0;
    double squares = 0;
    for (const std::vector<double>& image : images) {
      mean += image[pixel] / kParts;
      squares += image[pixel] * image[pixel] / kParts;
    }
    const double floor = 0.01 * measured.mean.mean * measured.mean.mean;
    measured.variance +=
        (squares - mean * mean) / (mean * mean + floor) / static_cast<double>(pixels);
  }
  return measured;
}

struct Compared {
  Measured guided, unguided;
};

Compared CompareGuiding(const Scene& scene, RenderSettings settings) {
  Compared compared;
  settings.unguided = false;
  compared.guided = MeasureImages(scene, settings);
  settings.unguided = true;
  compared.unguided = MeasureImages(scene, settings);
  return compared;
}

// Two comparisons, a false alarm in a thousand runs.
void ExpectSameMean(const Compared& compared) {
  const double quantile = StudentQuantile(SidakLevel(1e-3, 2), kParts);
  const MeasuredMean& guided = compared.guided.mean;
  const MeasuredMean& unguided = compared.unguided.mean;
  const double error = std::hypot(guided.standard_error, unguided.standard_error);
  EXPECT_NEAR(guided.mean, unguided.mean, quantile * error);
  EXPECT_LT(quantile * error, 0.2 * unguided.mean) << "the bound would let a wrong result pass";
}

// A sun over a floor of which a hundredth is seen, and a white wall that sends its light on.
TEST(GuidingTest, PhotonsOfASunGoWhereItIsSeen) {
  Scene scene;
  const std::int32_t white = AddMaterial(scene, DiffuseMaterial(0.7F));
  AddQuad(scene, {-50, -50, 0}, {100, 0, 0}, {0, 100, 0}, white);
  AddQuad(scene, {-2, 2, 0}, {4, 0, 0}, {0, 0, 3}, white);
  DistantLight sun;
  sun.direction = Normalize({0.2F, 0.5F, -0.8F});
  sun.irradiance = {3, 3, 3};
  scene.distant_lights.push_back(sun);
  SetCamera(scene, {0, -3, 2}, {0, 1, 0.5}, {0, 0, 1}, 40, 24);
  RenderSettings settings = TestSettings(scene, 20000, 0.2, 4);
  const Compared compared = CompareGuiding(scene, settings);
  ExpectSameMean(compared);
  EXPECT_LT(compared.guided.variance, 0.55 * compared.unguided.variance);
}

// Two lights, of which one is hidden, so that guides choose between lights too.
TEST(GuidingTest, LightsThatAreNotSeenGetFewPhotons) {
  Scene scene;
  const std::int32_t white = AddMaterial(scene, DiffuseMaterial(0.6F));
  AddBox(scene, {-1, -1, -1}, {1, 1, 1}, white);  // closed around the second light
  AddQuad(scene, {3, -1, -1}, {0, 2, 0}, {0, 0, 2}, white);
  AddQuad(scene, {3, -1, -1}, {3, 0, 0}, {0, 2, 0}, white);
  PointLight seen;
  seen.position = {4.5F, 0, 1};
  seen.intensity = {1, 1, 1};
  scene.point_lights.push_back(seen);
  PointLight beside;
  beside.position = {-3, 0, 0};
  beside.intensity = {5, 5, 5};
  scene.point_lights.push_back(beside);
  SetCamera(scene, {6, 0, 1}, {4, 0, -0.6}, {0, 0, 1}, 60, 24);
  RenderSettings settings = TestSettings(scene, 20000, 0.1, 5);
  const Compared compared = CompareGuiding(scene, settings);
  ExpectSameMean(compared);
  EXPECT_LT(compared.guided.variance, compared.unguided.variance);

  // What stands for photons without a guide, for light that was not found, is a quarter of the
  // photons and more, half of that where directions are guided too (as here, from the wall to the
  // floor), and says of each light what they would say.
  settings.unguided = false;
  LocalRender guided(scene, settings);
  settings.unguided = true;
  LocalRender unguided(scene, settings);
  for (int pass = 0; pass < 40; ++pass) {
    guided.AddPass();
    unguided.AddPass();
  }
  ASSERT_EQ(guided.tally().lights.size(), 2U);
  for (std::size_t light = 0; light < 2; ++light) {
    const LightTally& some = guided.tally().lights[light];
    const LightTally& all = unguided.tally().lights[light];
    const auto sent = static_cast<double>(some.sent);
    EXPECT_GT(sent, kUnguidedShare * (1 - kGuidedScatterings) * static_cast<double>(all.sent));
    EXPECT_LT(sent, 0.5 * static_cast<double>(all.sent));
    const double share =
        static_cast<double>(all.InView(PathClass::kOther)) / static_cast<double>(all.sent);
    const double deviation = std::sqrt(share / sent + share / static_cast<double>(all.sent));
    EXPECT_NEAR(static_cast<double>(some.InView(PathClass::kOther)) / sent, share,
                5 * deviation + 1e-9);
  }
}

// What was learned is part of a checkpoint, and batches see as much as whole passes.
TEST(GuidingTest, AJobThatIsRestoredLearnsOn) {
  const Scene scene = LoadScene("water-sun.pbrt");
  RenderOverrides overrides;
  overrides.width = 24;
  overrides.height = 18;
  const RenderSettings settings = SettingsFor(scene, overrides);
  LocalRender whole(scene, settings, 2);
  for (int pass = 0; pass < 28; ++pass)
    whole.AddPass(0);
  LocalRender first(scene, settings, 1);
  for (int pass = 0; pass < 12; ++pass)
    first.AddPass(3);
  LocalRender second(scene, settings, 1);
  ASSERT_TRUE(second.Restore(first.Save()).ok());
  for (int pass = 12; pass < 28; ++pass)
    second.AddPass(1 + pass % 2);
  EXPECT_EQ(second.Save(), whole.Save());
  RenderSettings unguided = settings;
  unguided.unguided = true;
  LocalRender other(scene, unguided, 1);
  for (int pass = 0; pass < 28; ++pass)
    other.AddPass();
  EXPECT_NE(ChannelMean(other.MakeImage(), "G"), ChannelMean(whole.MakeImage(), "G"))
      << "nothing was learned";
}

}  // namespace
}  // namespace lucerna
