// The error estimate of a render is true: near the true error, its intervals hold the truth at all
// looks in at least nineteen renders of twenty, and stopping on it keeps the promise as often.
#include <algorithm>
#include <cmath>
#include <vector>

#include "gtest/gtest.h"

#include "tests/support/error_study.h"
#include "tests/support/local_render.h"

namespace lucerna {
namespace {

class ErrorEstimateTest : public testing::TestWithParam<const char*> {};

TEST_P(ErrorEstimateTest, IsTrueAndItsIntervalsHoldTheTruthAtAllLooks) {
  const StudySize size;
  const Scene scene = LoadScene(GetParam());
  const ErrorStudy study = StudyErrors(scene, StudyReference(scene, size.side), size);
  RecordProperty("covered", study.Covered());
  EXPECT_GE(study.Covered(), size.renders * 95 / 100);
  for (const double ratio : study.Ratios()) {
    EXPECT_GT(ratio, 0.8);
    EXPECT_LT(ratio, 1.25);
  }
}

INSTANTIATE_TEST_SUITE_P(Scenes, ErrorEstimateTest,
                         testing::Values("penumbra.pbrt", "caustic.pbrt", "glass-box.pbrt",
                                         "water-sun.pbrt"));

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
  // Of twelve renders of which nineteen in twenty are covered, two or more are left out by chance in
  // 12 %; three in 2 %.
  EXPECT_GE(study.Covered(), 10);
}

INSTANTIATE_TEST_SUITE_P(Scenes, ErrorEstimateAtStepsTest,
                         testing::Values("hard-shadow.pbrt", "bars.pbrt", "water-sun.pbrt"));

// A target that can be reached: the mean true error at the first look after a third of the passes.
double TargetOf(const ErrorStudy& study, const StudySize& size) {
  std::size_t look = 0;
  while (study.renders.front()[look].passes * 3 < size.passes)
    ++look;
  double square = 0;
  for (const std::vector<StudiedLook>& looks : study.renders)
    square += looks[look].truth / size.renders;
  return std::sqrt(square);
}

// Intervals of images as small as those above are wide, so this one is larger.
TEST(StopOnErrorTest, EndsBelowTheTargetAndSpendsAtMostTwiceThePhotonsNeeded) {
  const StudySize size = {.side = 96, .renders = 40, .passes = 28};
  const Scene scene = LoadScene("glass-box.pbrt");
  const ErrorStudy study = StudyErrors(scene, StudyReference(scene, size.side), size);
  const StopOutcome outcome = StopAt(study, TargetOf(study, size));
  RecordProperty("kept", outcome.kept);
  EXPECT_EQ(outcome.stopped, size.renders);
  EXPECT_GE(outcome.kept, size.renders * 95 / 100);
  EXPECT_GE(outcome.within_two, size.renders * 95 / 100);
}

// Wide kernels: few pixels share no photons, and single renders may spend more.
TEST(StopOnErrorTest, SpendsAtMostTwiceThePhotonsNeededOnAverageInAPenumbra) {
  const StudySize size = {.side = 128, .renders = 20, .passes = 28};
  const Scene scene = LoadScene("penumbra.pbrt");
  const ErrorStudy study = StudyErrors(scene, StudyReference(scene, size.side), size);
  const StopOutcome outcome = StopAt(study, TargetOf(study, size));
  RecordProperty("kept", outcome.kept);
  EXPECT_EQ(outcome.stopped, size.renders);
  EXPECT_GE(outcome.kept, size.renders * 95 / 100);
  EXPECT_LT(outcome.mean_spent, 2);
}

}  // namespace
}  // namespace lucerna
