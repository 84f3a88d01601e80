// The error estimate of a render is true: near the true error, its intervals hold the truth at all
// estimates in at least nineteen renders of twenty, and stopping on it keeps the promise as often.
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "gtest/gtest.h"

#include "tests/support/error_study.h"
#include "tests/support/local_render.h"

namespace lucerna {
namespace {

struct EstimatedScene {
  const char* file;
  // The most by which the estimate may be too large.
  double most;
  int renders = 100;
  int least_covered = 95;  // of them
};

class ErrorEstimateTest : public testing::TestWithParam<EstimatedScene> {};

TEST_P(ErrorEstimateTest, IsTrueAndItsIntervalsHoldTheTruthAtAllLooks) {
  const StudySize size = {.renders = GetParam().renders};
  const Scene scene = LoadScene(GetParam().file);
  const ErrorStudy study = StudyErrors(scene, HalvedReference(scene, size.side, 200, 10), size);
  RecordProperty("covered", study.Covered());
  EXPECT_GE(study.Covered(), GetParam().least_covered);
  for (const double ratio : study.Ratios()) {
    EXPECT_GT(ratio, 0.8);
    EXPECT_LT(ratio, GetParam().most);
  }
}

// Under waves the estimate is up to 1.33 times too large in the first passes, a known fault on the
// safe side: bias is relative to values that are guessed from few photons, and the mean of 1/x²
// over noisy x is too large. Giving noise more weight in the guess mends that and makes the
// estimate too small at hard shadows (0.7), which is worse.
//
// Rare bright paths decide whether the interval of a caustic holds: 1,513 of 1,600 did, 94.6 % with
// a deviation of 0.6, and 375 of the first 400. Of 200, nineteen of twenty are 180 but for one set
// in a thousand. (With the noise of random branches on glass, which is gone, it was 773 of 800.)
INSTANTIATE_TEST_SUITE_P(Scenes, ErrorEstimateTest,
                         testing::Values(EstimatedScene{"penumbra.pbrt", 1.25},
                                         EstimatedScene{"caustic.pbrt", 1.25, 200, 180},
                                         EstimatedScene{"glass-box.pbrt", 1.25},
                                         EstimatedScene{"water-sun.pbrt", 1.35}),
                         [](const auto& scene) {
                           std::string name = scene.param.file;
                           std::ranges::replace_if(
                               name, [](char c) { return c == '-' || c == '.'; }, '_');
                           return name;
                         });

// Where kernels cross steps: one, many side by side, and the bright folds under waves. The relative
// error on the dark side was said as a third of what it is while bias counted relative to blurred
// values and was smoothed over steps.
class ErrorEstimateAtStepsTest : public testing::TestWithParam<const char*> {};

TEST_P(ErrorEstimateAtStepsTest, IsNearTheTrueErrorAfterManyPasses) {
  const StudySize size = {.renders = 12, .passes = 48};
  const Scene scene = LoadScene(GetParam());
  const ErrorStudy study = StudyErrors(scene, HalvedReference(scene, size.side, 200, 10), size);
  RecordProperty("covered", study.Covered());
  EXPECT_GT(study.Ratios().back(), 0.8);
  EXPECT_LT(study.Ratios().back(), 1.25);
  // Of twelve renders of which nineteen in twenty are covered, two or more are left out by chance
  // in 12 %; three in 2 %.
  EXPECT_GE(study.Covered(), 10);
}

INSTANTIATE_TEST_SUITE_P(Scenes, ErrorEstimateAtStepsTest,
                         testing::Values("hard-shadow.pbrt", "bars.pbrt", "water-sun.pbrt"));

// A target that can be reached: the mean true error at the first estimate after a quarter of the
// passes.
double TargetOf(const ErrorStudy& study, const StudySize& size) {
  std::size_t look = 0;
  while (study.renders.front()[look].passes * 4 < size.passes)
    ++look;
  double square = 0;
  for (const std::vector<StudiedLook>& looks : study.renders)
    square += looks[look].truth / size.renders;
  return std::sqrt(square);
}

// Of the references here half the photons are enough: their noise is taken off the errors, and what
// is uncertain of it is 6 % of the squared error after all passes, where a render stops at less
// than half of its target.
//
// Intervals of images as small as those above are wide, so this one is larger. What stopping costs
// follows from the width of intervals that hold on scenes that no constant was chosen on: 2.5 to 3
// times the photons needed (docs/measurements.md).
TEST(StopOnErrorTest, EndsBelowTheTargetWithAtMostFourTimesThePhotonsNeeded) {
  // After so many there is an estimate: the target is the error there, and not that of a later one.
  constexpr int kPassesNeeded = 28;
  const StudySize size = {.side = 96, .renders = 6, .passes = 4 * kPassesNeeded};
  const Scene scene = LoadScene("glass-box.pbrt");
  const ErrorStudy study = StudyErrors(scene, HalvedReference(scene, size.side, 100, 10), size);
  const StopOutcome outcome = StopAt(study, TargetOf(study, size));
  RecordProperty("kept", outcome.kept);
  EXPECT_EQ(outcome.stopped, size.renders);
  EXPECT_EQ(outcome.kept, size.renders);
  RecordProperty("spent", std::to_string(outcome.mean_spent));
}

// Wide kernels: few pixels share no photons. And the first passes, which no guide of photons helped
// yet, have most of the noise of all, so that few passes say how much that is. Intervals are wider,
// and of 120 renders (24 of each of five orders of places on the film, between which chance
// decides) 110 stop within six times the photons needed, where those of glass-box stop within four.
// Of six, fewer than four do by chance in one of a hundred sets. All that stop keep the promise.
// What is needed is half of what it was without guides.
TEST(StopOnErrorTest, EndsBelowTheTargetInAPenumbraToo) {
  constexpr int kPassesNeeded = 25;
  const StudySize size = {.side = 96, .renders = 6, .passes = 6 * kPassesNeeded};
  const Scene scene = LoadScene("penumbra.pbrt");
  const ErrorStudy study = StudyErrors(scene, HalvedReference(scene, size.side, 100, 10), size);
  StudySize needed = size;
  needed.passes = 4 * kPassesNeeded;
  const StopOutcome outcome = StopAt(study, TargetOf(study, needed));
  RecordProperty("kept", outcome.kept);
  EXPECT_GE(outcome.stopped, 4);
  EXPECT_EQ(outcome.kept, outcome.stopped);
  RecordProperty("spent", std::to_string(outcome.mean_spent));
}

}  // namespace
}  // namespace lucerna
