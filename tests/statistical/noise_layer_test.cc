// The `noise` layer is the deviation of each pixel over seeds, wherever in the image.
#include "gtest/gtest.h"

#include "tests/support/local_render.h"
#include "tests/support/noise_study.h"

namespace lucerna {
namespace {

class NoiseLayerTest : public testing::TestWithParam<const char*> {};

// The variance over 16 renders of one pixel has a relative deviation of sqrt(2/15) = 0.37, the root
// of its mean over the 410 pixels of a decile one of about 0.37 / 2 / sqrt(410 / 20) = 0.04 where
// twenty pixels share their photons. With one factor for the whole image the ratios were 1.4 to 2.0
// on glass-box.
TEST_P(NoiseLayerTest, IsTheDeviationOverSeedsInEveryDecileOfBrightness) {
  const NoiseStudySize size = {.side = 64, .renders = 16, .passes = 16};
  int decile_number = 0;
  for (const NoiseDecile& decile : StudyNoise(LoadScene(GetParam()), size)) {
    ++decile_number;
    EXPECT_GT(decile.Ratio(), 0.8) << decile_number;
    EXPECT_LT(decile.Ratio(), 1.25) << decile_number;
    EXPECT_GT(decile.median_ratio, 0.8) << decile_number;
    EXPECT_LT(decile.median_ratio, 1.25) << decile_number;
  }
}

INSTANTIATE_TEST_SUITE_P(Scenes, NoiseLayerTest, testing::Values("glass-box.pbrt", "corner.pbrt"));

}  // namespace
}  // namespace lucerna
