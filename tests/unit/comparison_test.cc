// A comparison decides which settings are better, so on curves whose truth is known it must say the
// truth: on exact power laws every interpolated error, ratio and slope is exact.
#include "client/compare/comparison.h"

#include <cmath>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace lucerna {
namespace {

using testing::HasSubstr;
using testing::Not;

// error = scale · photons^exponent at a steady million photons a second, on two cores that are busy
// for four fifths of the wall time.
ComparedRun PowerLaw(std::size_t setting, double scale, double exponent, double noise = 0) {
  ComparedRun run = {.setting = setting, .seed = 0, .points = {}};
  for (double seconds = 0.13; seconds < 12; seconds *= 1.17) {
    const double photons = 1e6 * seconds;
    run.points.push_back({.seconds = seconds,
                          .wall_s = seconds / 0.8,
                          .photons = photons,
                          .rel_mse = scale * std::pow(photons, exponent) + noise,
                          .reference_noise = noise,
                          .untrimmed = 3 * scale * std::pow(photons, exponent) + 2 * noise,
                          .untrimmed_reference_noise = 2 * noise});
  }
  return run;
}

const std::vector<double> kTimes = {1, 2, 5, 10};
const std::vector<SettingToCompare> kTwo = {{"a", std::nullopt}, {"b", TheorySlopes{-1, 0}}};

TEST(ComparisonTest, APowerLawIsMetExactlyBetweenItsPoints) {
  const std::vector<ComparedRun> runs = {PowerLaw(0, 3, -2.0 / 3), PowerLaw(1, 8, -1)};
  const Comparison comparison = CompareRuns(kTwo, runs, kTimes);
  ASSERT_EQ(comparison.settings.size(), 2U);
  for (std::size_t i = 0; i < kTimes.size(); ++i) {
    const double photons = 1e6 * kTimes[i];
    const double a = 3 * std::pow(photons, -2.0 / 3);
    const double b = 8 / photons;
    const auto& cell_a = comparison.settings[0].cells[i];
    const auto& cell_b = comparison.settings[1].cells[i];
    ASSERT_TRUE(cell_a && cell_b) << kTimes[i];
    EXPECT_NEAR(cell_a->rel_mse.value / a, 1, 1e-12);
    EXPECT_NEAR(cell_b->rel_mse.value / b, 1, 1e-12);
    EXPECT_NEAR(cell_a->untrimmed.value / a, 3, 1e-11);
    EXPECT_NEAR(cell_b->untrimmed.value / b, 3, 1e-11);
    EXPECT_NEAR(cell_a->ratio.value, 1, 1e-12);
    EXPECT_NEAR(cell_b->ratio.value / (b / a), 1, 1e-12);
    EXPECT_NEAR(cell_a->wall_s, kTimes[i] / 0.8, 1e-9);
    EXPECT_NEAR(cell_a->photons / photons, 1, 1e-12);
    EXPECT_FALSE(cell_a->rel_mse.standard_error) << "one run tells no spread";
  }
  EXPECT_NEAR(comparison.settings[0].slope_photons->value, -2.0 / 3, 1e-12);
  EXPECT_NEAR(comparison.settings[1].slope_photons->value, -1, 1e-12);
  EXPECT_NEAR(comparison.settings[1].slope_seconds->value, -1, 1e-12);
}

TEST(ComparisonTest, SlopesAgainstPhotonsAndTimeAreToldApart) {
  // Photons come at a rate that falls: photons = 1e6 · seconds^0.5.
  ComparedRun run = PowerLaw(0, 1, -1);
  for (ErrorPoint& point : run.points) {
    point.photons = 1e6 * std::sqrt(point.seconds);
    point.rel_mse = 1 / point.photons;
  }
  const Comparison comparison = CompareRuns({{"a", std::nullopt}}, {&run, 1}, kTimes);
  EXPECT_NEAR(comparison.settings[0].slope_photons->value, -1, 1e-12);
  EXPECT_NEAR(comparison.settings[0].slope_seconds->value, -0.5, 1e-12);
}

TEST(ComparisonTest, OnlyTheAskedTimesCountForTheSlope) {
  // Steep before 0.5 s, flat after.
  ComparedRun run = PowerLaw(0, 1, -1);
  for (ErrorPoint& point : run.points)
    point.rel_mse = 1 / std::pow(std::min(point.seconds, 0.5), 3);
  const Comparison comparison = CompareRuns({{"a", std::nullopt}}, {&run, 1}, kTimes);
  EXPECT_NEAR(comparison.settings[0].slope_seconds->value, 0, 1e-12);
}

TEST(ComparisonTest, TheReferencesNoiseIsTakenOff) {
  // At 10 s a true error of 1e-6 stands under a noise of 5e-6.
  const std::vector<ComparedRun> runs = {PowerLaw(0, 10, -1, 5e-6)};
  const Comparison comparison = CompareRuns({{"a", std::nullopt}}, runs, kTimes);
  const ComparedSetting& a = comparison.settings[0];
  EXPECT_NEAR(a.cells[0]->rel_mse.value, 1e-5, 1e-15);
  EXPECT_NEAR(a.cells[3]->rel_mse.value, 1e-6, 1e-15);
  EXPECT_FALSE(a.cells[0]->is_mostly_reference);
  EXPECT_TRUE(a.cells[3]->is_mostly_reference);
  EXPECT_NEAR(a.slope_photons->value, -1, 1e-9);
}

TEST(ComparisonTest, WhereNoErrorIsLeftThereIsNoFigure) {
  ComparedRun run = PowerLaw(0, 10, -1, 5e-6);
  for (ErrorPoint& point : run.points) {
    if (point.seconds > 4) point.rel_mse = 4.9e-6;
  }
  const Comparison comparison = CompareRuns({{"a", std::nullopt}}, {&run, 1}, kTimes);
  EXPECT_TRUE(comparison.settings[0].cells[1]);
  EXPECT_FALSE(comparison.settings[0].cells[3]);
}

TEST(ComparisonTest, MeansAndStandardErrorsWorkedByHand) {
  // Errors 1, 2, 3 and twice as much: mean 2, standard error 1/√3; the ratio has none.
  std::vector<ComparedRun> runs;
  for (const double scale : {1.0, 2.0, 3.0}) {
    runs.push_back(PowerLaw(0, scale, -1));
    runs.push_back(PowerLaw(1, 2 * scale, -1));
  }
  const Comparison comparison = CompareRuns(kTwo, runs, {1});
  const ComparedCell& a = *comparison.settings[0].cells[0];
  EXPECT_NEAR(a.rel_mse.value, 2e-6, 1e-15);
  EXPECT_NEAR(a.rel_mse.standard_error.value(), 1e-6 / std::sqrt(3), 1e-15);
  const ComparedCell& b = *comparison.settings[1].cells[0];
  EXPECT_NEAR(b.ratio.value, 2, 1e-12);
  EXPECT_NEAR(b.ratio.standard_error.value(), 0, 1e-12) << "repetitions go in pairs";
}

TEST(ComparisonTest, ACurveIsProlongedALittleAndNoMore) {
  const ComparedRun run = PowerLaw(0, 1, -1);
  const double end = run.points.back().seconds;
  const auto beyond = PointAt(run.points, 1.2 * end);
  ASSERT_TRUE(beyond);
  EXPECT_NEAR(beyond->rel_mse * 1.2e6 * end, 1, 1e-9);
  EXPECT_FALSE(PointAt(run.points, 1.3 * end));
  EXPECT_FALSE(PointAt(run.points, 0.05));
  EXPECT_FALSE(PointAt({}, 1));
  EXPECT_FALSE(PointAt({run.points.data(), 1}, run.points[0].seconds)) << "no line through a point";
}

TEST(ComparisonTest, OneRunThatFellShortLeavesTheCellEmpty) {
  std::vector<ComparedRun> runs = {PowerLaw(0, 1, -1), PowerLaw(0, 1, -1)};
  std::erase_if(runs[1].points, [](const ErrorPoint& point) { return point.seconds > 3; });
  const Comparison comparison = CompareRuns({{"a", std::nullopt}}, runs, kTimes);
  EXPECT_TRUE(comparison.settings[0].cells[1]);
  EXPECT_FALSE(comparison.settings[0].cells[3]);
}

TEST(ComparisonTest, AnExponentNeedsASpan) {
  EXPECT_FALSE(FittedExponent({}));
  const std::vector<PowerLawPoint> close = {{1, 2}, {1.4, 1}};
  EXPECT_FALSE(FittedExponent(close));
  const std::vector<PowerLawPoint> black = {{1, 2}, {4, 0}};
  EXPECT_FALSE(FittedExponent(black));
}

TEST(ComparisonTest, TheoryIsThatOfTheController) {
  RenderSettings settings;
  settings.radius_controller = RadiusControllerKind::kPpm;
  EXPECT_NEAR(TheoryOf(settings)->noise, -2.0 / 3, 1e-12);
  EXPECT_NEAR(TheoryOf(settings)->squared_bias, -2.0 / 3, 1e-12);
  settings.alpha = 0.9;
  EXPECT_NEAR(TheoryOf(settings)->noise, -0.9, 1e-12);
  EXPECT_NEAR(TheoryOf(settings)->squared_bias, -0.2, 1e-12);
  settings.radius_controller = RadiusControllerKind::kFrequency;
  EXPECT_EQ(TheoryOf(settings)->noise, -1) << "a radius that stands still";
  settings.radius_controller = RadiusControllerKind::kCppm;
  EXPECT_FALSE(TheoryOf(settings));
}

TEST(ComparisonTest, TheTableSaysWhatWasComparedAndHow) {
  const std::vector<ComparedRun> runs = {PowerLaw(0, 1, -1), PowerLaw(1, 2, -1)};
  const Comparison comparison = CompareRuns(kTwo, runs, {1, 100});
  ComparisonSubject subject = {.scene = "box.pbrt",
                               .reference = "ref.exr",
                               .reference_noise = std::nullopt,
                               .cores = 2,
                               .repetitions = 1,
                               .first_seed = 5,
                               .left_out = "",
                               .flags = {"", "--alpha 0.5 | x"}};
  const std::string table = ComparisonTable(comparison, subject);
  EXPECT_THAT(table, HasSubstr("# box.pbrt\n"));
  EXPECT_THAT(table, HasSubstr("does not state its own noise"));
  EXPECT_THAT(table, HasSubstr("over 2 cores"));
  EXPECT_THAT(table, HasSubstr("| 1 | a | 1.00e-06 | 3.00e-06 | 1.00 | 1.25 | 1e+06 |\n"));
  EXPECT_THAT(table, HasSubstr("| 1 | b | 2.00e-06 | 6.00e-06 | 2.00 | 1.25 | 1e+06 |\n"));
  EXPECT_THAT(table, HasSubstr("| 100 | a | — | — | — | — | — |\n"));
  EXPECT_THAT(table, HasSubstr("| b | `--alpha 0.5 \\| x` |"));
  EXPECT_THAT(table, HasSubstr("| -1.00 / 0.00 |\n"));
  subject.reference_noise = 1.25e-5;
  EXPECT_THAT(ComparisonTable(comparison, subject), HasSubstr("1.25e-05"));
  EXPECT_THAT(ComparisonTable(comparison, subject), Not(HasSubstr("does not tell")));
}

}  // namespace
}  // namespace lucerna
