// Nothing that is left out changes the image: with everything forced on, the same bits while the
// eye paths are the same, and the same image within its noise afterwards.
#include <cmath>
#include <string>

#include "gtest/gtest.h"

#include "render/image/image.h"
#include "tests/support/local_render.h"
#include "tests/support/measure.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

RenderSettings SmallSettings(const Scene& scene, bool use_everything) {
  RenderOverrides overrides;
  overrides.width = 32;
  overrides.height = 32;
  overrides.initial_radius = 0;
  overrides.max_depth = 8;
  overrides.use_everything = use_everything;
  return SettingsFor(scene, overrides);
}

class LeanTest : public testing::TestWithParam<const char*> {};

TEST_P(LeanTest, ForcingEverythingOnChangesNoBit) {
  const Scene scene = LoadScene(GetParam());
  EXPECT_EQ(RenderLocally(scene, SmallSettings(scene, false), 3).PixelDigest(),
            RenderLocally(scene, SmallSettings(scene, true), 3).PixelDigest());
}

INSTANTIATE_TEST_SUITE_P(Scenes, LeanTest,
                         testing::Values("penumbra.pbrt", "corner.pbrt", "hard-shadow.pbrt",
                                         "caustic.pbrt", "glass-box.pbrt", "glass-sphere.pbrt",
                                         "lamp-in-glass.pbrt", "water-sun.pbrt", "water-lamp.pbrt",
                                         "textured.pbrt", "rough-metal.pbrt", "cardioid.pbrt",
                                         "furnace.pbrt", "locks.pbrt"));

// A light behind closed walls, a hundred times as bright, is unreachable from the view: with
// photons from it as without them, and with them nearly all photons are spent in vain.
TEST(ShutOutTest, LeavingOutALightNextDoorChangesNothingButNoise) {
  Scene scene;
  const std::int32_t wall = AddMaterial(scene, DiffuseMaterial(0.5F));
  AddBox(scene, {-1, -1, -1}, {1, 1, 1}, wall);
  AddDisk(scene, {0, 0, 0.9F}, {0, 0, -1}, 0.4F, wall, AddAreaLight(scene, 1));
  AddDisk(scene, {5, 0, 0.9F}, {0, 0, -1}, 0.4F, wall, AddAreaLight(scene, 100));
  SetCamera(scene, {-0.9, -0.8, 0}, {0.5, 0.2, -0.3}, {0, 0, 1}, 60, 16);
  RenderSettings settings = TestSettings(scene, 20000, 0.2, 8);
  ASSERT_EQ(NeedsOf(scene, settings).unreachable_lights().of_photons.size(), 1U);
  const MeasuredMean lean = Measure(scene, settings, 8, 8, "G");
  settings.use_everything = true;
  const MeasuredMean full = Measure(scene, settings, 8, 8, "G");
  EXPECT_LT(std::abs(lean.mean - full.mean),
            StudentQuantile(1e-4, 8) * std::hypot(lean.standard_error, full.standard_error));
  EXPECT_LT(lean.standard_error, full.standard_error);
}

// After 64 passes the sets of eye paths take turns; after 320 every one has been used five times.
TEST(EyePathsInTurnTest, AgreeWithFreshOnesWithinTheNoise) {
  const Scene scene = LoadScene("corner.pbrt");
  const Image lean = RenderLocally(scene, SmallSettings(scene, false), 320);
  RenderSettings everything = SmallSettings(scene, true);
  everything.seed = 7;
  const Image full = RenderLocally(scene, everything, 320);
  const ImageChannel& a = *lean.Find("G");
  const ImageChannel& b = *full.Find("G");
  const ImageChannel& noise_a = *lean.Find("noise");
  const ImageChannel& noise_b = *full.Find("noise");
  double off = 0;
  double variance = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    off += static_cast<double>(a.pixels[i]) - static_cast<double>(b.pixels[i]);
    variance += std::pow(static_cast<double>(noise_a.pixels[i]), 2) +
                std::pow(static_cast<double>(noise_b.pixels[i]), 2);
  }
  // Neighbours share photons, at most some thirty pixels' worth: the sum spreads by the root more.
  EXPECT_LT(std::abs(off), 4 * std::sqrt(30 * variance));
}

}  // namespace
}  // namespace lucerna
