// The error estimate of a render is true: near the true error, and its intervals hold the truth at
// all looks in at least nineteen renders of twenty.
#include <algorithm>
#include <cmath>

#include "gtest/gtest.h"

#include "render/film/image_metrics.h"
#include "render/image/image.h"
#include "tests/support/local_render.h"

namespace lucerna {
namespace {

constexpr int kSize = 48;
constexpr int kRenders = 200;
constexpr int kPasses = 16;

RenderSettings SmallSettings(const Scene& scene, std::uint64_t seed) {
  RenderOverrides overrides;
  overrides.width = kSize;
  overrides.height = kSize;
  overrides.photons_per_pass = kSize * kSize;
  overrides.initial_radius = 0;
  overrides.max_depth = 12;
  overrides.seed = seed;
  return SettingsFor(scene, overrides);
}

// A reference whose radius falls so fast that its bias is a hundredth of a small render's, with so
// many photons that its noise is below a thirtieth of that.
Image Reference(const Scene& scene) {
  RenderSettings settings = SmallSettings(scene, 12345);
  settings.radius_controller = RadiusControllerKind::kPppm;
  settings.alpha = 0.2;
  settings.photons_per_pass = 64 * kSize * kSize;
  LocalRender render(scene, settings);
  for (int pass = 0; pass < 150; ++pass)
    render.AddPass();
  return render.MakeImage();
}

struct Outcome {
  int covered = 0;   // renders whose intervals held the truth at every look
  double ratio = 0;  // of mean estimate to mean truth at the last look, as a root
};

// Every render looks at 4, 5, 6, 7, 8, 9, 10, 11, 12, 14, ... passes, as a job does.
Outcome RenderMany(const Scene& scene, const Image& reference) {
  Outcome outcome;
  double estimate_sum = 0;
  double truth_sum = 0;
  for (int i = 0; i < kRenders; ++i) {
    LocalRender render(scene, SmallSettings(scene, 1000 + static_cast<std::uint64_t>(i)));
    bool holds = true;
    int look = 0;
    int next = 4;
    for (int pass = 1; pass <= kPasses; ++pass) {
      render.AddPass();
      if (pass != next && pass != kPasses) continue;
      next = std::max(pass + 1, pass * 7 / 6);
      const SquaredError e = render.EstimateError(++look).relative;
      const double truth = Compare(render.MakeImage(), reference).value().rel_mse;
      holds = holds && truth >= e.low && truth <= e.high;
      if (pass == kPasses) {
        estimate_sum += e.total();
        truth_sum += truth;
      }
    }
    outcome.covered += holds ? 1 : 0;
  }
  outcome.ratio = std::sqrt(estimate_sum / truth_sum);
  return outcome;
}

class ErrorEstimateTest : public testing::TestWithParam<const char*> {};

TEST_P(ErrorEstimateTest, IsTrueAndItsIntervalsHoldTheTruthAtAllLooks) {
  const Scene scene = LoadScene(GetParam());
  const Outcome outcome = RenderMany(scene, Reference(scene));
  RecordProperty("covered", outcome.covered);
  EXPECT_GE(outcome.covered, kRenders * 95 / 100);
  EXPECT_GT(outcome.ratio, 0.8);
  EXPECT_LT(outcome.ratio, 1.25);
}

INSTANTIATE_TEST_SUITE_P(Scenes, ErrorEstimateTest,
                         testing::Values("penumbra.pbrt", "corner.pbrt"));

}  // namespace
}  // namespace lucerna
