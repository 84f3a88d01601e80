// The exponent that a report states must be that of the samples, and a predicted time the one at
// which the law reaches the target.
#include <cmath>

#include "gtest/gtest.h"

#include "render/report/convergence.h"
#include "render/wire/messages.h"
#include "tests/support/converging_job.h"
#include "tests/support/job_settings.h"

namespace lucerna {
namespace {

TEST(PowerLawTest, AnExactLawGivesItsExponent) {
  std::vector<ChartPoint> points;
  for (const double x : {1e-3, 0.5, 7.0, 2e4, 1e9})
    points.push_back({x, 3 * std::pow(x, -2.0 / 3)});
  const auto law = FitPowerLaw(points);
  ASSERT_TRUE(law.has_value());
  EXPECT_NEAR(law->exponent, -2.0 / 3, 1e-12);
  EXPECT_NEAR(law->factor, 3, 1e-10);
  EXPECT_NEAR(law->At(100), 3 * std::pow(100, -2.0 / 3), 1e-10);
}

TEST(PowerLawTest, LeastSquaresLiesBetween) {
  // In logarithms to base e: (0, 0), (1, 1), (2, 0); the best line is level, at a third.
  const auto law = FitPowerLaw({{1, 1}, {std::exp(1), std::exp(1)}, {std::exp(2), 1}});
  ASSERT_TRUE(law.has_value());
  EXPECT_NEAR(law->exponent, 0, 1e-12);
  EXPECT_NEAR(law->factor, std::exp(1.0 / 3), 1e-12);
}

TEST(PowerLawTest, TooFewPointsOrNoSpreadGiveNone) {
  EXPECT_FALSE(FitPowerLaw(std::vector<ChartPoint>{}).has_value());
  EXPECT_FALSE(FitPowerLaw({{1, 1}, {2, 2}}).has_value());
  EXPECT_FALSE(FitPowerLaw({{1, 1}, {2, 2}, {0, 5}}).has_value()) << "no logarithm";
  EXPECT_FALSE(FitPowerLaw({{1, 1}, {2, 2}, {3, -5}, {4, std::nan("")}}).has_value());
  EXPECT_FALSE(FitPowerLaw({{5, 1}, {5, 2}, {5, 3}}).has_value());
}

TEST(ConvergenceTest, ErrorsAreRootsAndPartsAddUpSquared) {
  const RelativeError error = *NewestError(ConvergingJob(1));
  EXPECT_DOUBLE_EQ(error.value, std::sqrt(0.049));
  EXPECT_DOUBLE_EQ(error.noise * error.noise + error.bias * error.bias, 0.049);
  EXPECT_DOUBLE_EQ(error.low, std::sqrt(0.8 * 0.049));
  EXPECT_DOUBLE_EQ(*error.truth, std::sqrt(0.049));
  EXPECT_FALSE(NewestError(ConvergingJob(0)).has_value());
  v1::ErrorSample below_zero;
  below_zero.mutable_relative()->set_noise(-1e-9);
  EXPECT_EQ(ErrorOf(below_zero).value, 0);
  EXPECT_FALSE(ErrorOf(below_zero).truth.has_value());
}

TEST(ConvergenceTest, TheLaterHalfIsFitted) {
  v1::Job job = ConvergingJob(24);
  // Photons are whole numbers, 1e-6 of them at most.
  EXPECT_NEAR(FitOfSquaredError(job, ErrorAgainst::kPhotons)->exponent, -2.0 / 3, 1e-5);
  EXPECT_NEAR(FitOfSquaredError(job, ErrorAgainst::kTime)->exponent, -2.0 / 3, 1e-5);
  // Whatever the first half was like.
  for (int i = 0; i < 12; ++i)
    job.mutable_convergence(i)->mutable_relative()->set_noise(5);
  EXPECT_NEAR(FitOfSquaredError(job, ErrorAgainst::kTime)->exponent, -2.0 / 3, 1e-5);
  job.mutable_convergence(12)->mutable_relative()->set_noise(5);
  EXPECT_LT(FitOfSquaredError(job, ErrorAgainst::kTime)->exponent, -0.7);
  EXPECT_EQ(FirstFitted(ConvergingJob(4)), 1) << "three at least";
  EXPECT_FALSE(FitOfSquaredError(ConvergingJob(2), ErrorAgainst::kTime).has_value());
}

TEST(ConvergenceTest, TheTargetIsReachedWhenTheUpperEndIsThere) {
  v1::Job job = ConvergingJob(10);
  const double high = job.convergence(9).relative().high();
  const double now_s = Seconds(FromProto(job.progress().running()));
  // Half the error is a quarter of its square: 4^(3/2) = 8 times the time, of which one has passed.
  SetSetting(job, &RenderSettings::error, std::sqrt(high) / 2);
  EXPECT_NEAR(Seconds(*TimeToTarget(job)), 7 * now_s, 1e-4 * now_s);
  // What has passed since the sample is not waited for again.
  *job.mutable_progress()->mutable_running() =
      ToProto(FromProto(job.progress().running()) + std::chrono::seconds(2));
  EXPECT_NEAR(Seconds(*TimeToTarget(job)), 7 * now_s - 2, 1e-4 * now_s);
  SetSetting(job, &RenderSettings::error, std::sqrt(high) * 1.0001);
  EXPECT_EQ(*TimeToTarget(job), Duration::zero());
}

TEST(ConvergenceTest, WithoutATargetOrAFallThereIsNoTime) {
  v1::Job job = ConvergingJob(10);
  SetSetting(job, &RenderSettings::error, 0);
  EXPECT_FALSE(TimeToTarget(job).has_value());
  SetSetting(job, &RenderSettings::error, 0.01);
  for (v1::ErrorSample& sample : *job.mutable_convergence())
    sample.mutable_relative()->set_high(1);
  EXPECT_FALSE(TimeToTarget(job).has_value()) << "level";
  EXPECT_FALSE(TimeToTarget(ConvergingJob(2)).has_value()) << "too few";
  EXPECT_FALSE(TimeToTarget(ConvergingJob(0)).has_value());
  // One that hardly falls gives a long time, not an overflowed one.
  job = ConvergingJob(10);
  SetSetting(job, &RenderSettings::error, 1e-12);
  EXPECT_GT(*TimeToTarget(job), std::chrono::hours(24 * 365));
}

TEST(ConvergenceTest, PercentagesHaveThreeDigits) {
  EXPECT_EQ(ShortPercent(0.0183), "1.83 %");
  EXPECT_EQ(ShortPercent(0.02), "2.00 %");
  EXPECT_EQ(ShortPercent(0.1234), "12.3 %");
  EXPECT_EQ(ShortPercent(3.456), "346 %");
  EXPECT_EQ(ShortPercent(0.000512), "0.0512 %");
  EXPECT_EQ(ShortPercent(0), "0 %");
  EXPECT_EQ(ShortPercent(std::nan("")), "unknown");
}

// A running job whose newest sample may miss `share` of the image.
v1::Job MissingJob(double share) {
  v1::Job job = ConvergingJob(10);
  v1::ErrorSample& newest = *job.mutable_convergence(9);
  newest.set_missing_relative(share);
  newest.mutable_relative()->set_high(newest.relative().high() + share);
  v1::LightFinding& weak = *job.add_lights();
  weak.set_name("light 1 (a point light at (0, 0, 1))");
  weak.set_photons_sent(50'000);
  weak.set_in_view_other(20'000);
  v1::LightFinding& hidden = *job.add_lights();
  hidden.set_name("light 2 (a disk)");
  hidden.set_photons_sent(12'000);
  hidden.set_missing_share(0.4);
  return job;
}

TEST(MissingLightSentenceTest, NamesTheLight) {
  EXPECT_EQ(
      MissingLightSentence(MissingJob(0.1)),
      "light 2 (a disk): no photon of 12000 has reached the view, light worth up to 40.0 % of "
      "the image may be missing");
  EXPECT_EQ(MissingLightSentence(MissingJob(1e-9)), "") << "too little to matter";
  EXPECT_EQ(MissingLightSentence(v1::Job()), "");
}

TEST(MissingLightSentenceTest, TellsFewFromNoneAndOneWayFromAnother) {
  v1::Job job = MissingJob(0.1);
  job.mutable_lights(1)->set_in_view_other(3);
  EXPECT_NE(MissingLightSentence(job).find("only 3 of 12000 photons have reached the view,"),
            std::string::npos)
      << MissingLightSentence(job);
  job.mutable_lights(1)->set_in_view_other(5000);
  EXPECT_NE(MissingLightSentence(job).find(
                "no photon of 12000 has reached the view through smooth surfaces alone"),
            std::string::npos)
      << MissingLightSentence(job);
  job.mutable_lights(1)->set_in_view_other(2);
  job.mutable_lights(1)->set_in_view_caustic(5000);
  EXPECT_NE(
      MissingLightSentence(job).find("only 2 of 12000 photons have reached the view by other ways"),
      std::string::npos)
      << MissingLightSentence(job);
}

TEST(FoundNothingTest, ABlackImageHasNoError) {
  v1::Job job = ConvergingJob(10);
  EXPECT_FALSE(FoundNothing(job));
  v1::ErrorSample& newest = *job.mutable_convergence(9);
  newest.clear_relative();
  newest.mutable_relative()->set_high(HUGE_VAL);
  newest.set_nothing_found(true);
  EXPECT_TRUE(FoundNothing(job));
  EXPECT_FALSE(NewestError(job).has_value());
  EXPECT_FALSE(FindFarTarget(job).has_value());
}

// Squared errors fall as time^(-2/3): a tenth of the error takes a thousand times as long.
TEST(FarTargetTest, IsSaidBeyondAHundredTimesTheTime) {
  v1::Job job = ConvergingJob(12);
  const double high = std::sqrt(job.convergence(11).relative().high());
  // 4.5³ = 91 times the time.
  SetSetting(job, &RenderSettings::error, high / 4.5);
  EXPECT_FALSE(FindFarTarget(job).has_value());
  SetSetting(job, &RenderSettings::error, high / 10);
  const auto far = FindFarTarget(job);
  ASSERT_TRUE(far.has_value());
  const double so_far_s = Seconds(FromProto(job.convergence(11).running()));
  EXPECT_NEAR(Seconds(*far->left) / so_far_s, 999, 2);
  EXPECT_NE(far->sentence.find("needs 1000 times the time so far"), std::string::npos)
      << far->sentence;
  EXPECT_NE(far->sentence.find("more workers"), std::string::npos) << "noise prevails";
  SetSetting(job, &RenderSettings::error, high * 1.01);
  EXPECT_FALSE(FindFarTarget(job).has_value()) << "reached";
  SetSetting(job, &RenderSettings::error, 0);
  EXPECT_FALSE(FindFarTarget(job).has_value()) << "no target";
  job = ConvergingJob(5);
  SetSetting(job, &RenderSettings::error, 1e-6);
  EXPECT_FALSE(FindFarTarget(job).has_value()) << "no trend yet";
}

TEST(FarTargetTest, BiasThatStandsStillIsNotInSight) {
  v1::Job job = ConvergingJob(24);
  for (v1::ErrorSample& sample : *job.mutable_convergence()) {
    v1::SquaredError& relative = *sample.mutable_relative();
    relative.set_bias(0.01);
    relative.set_high(1.3 * (relative.noise() + relative.bias()));
  }
  SetSetting(job, &RenderSettings::error, 0.035);
  const auto far = FindFarTarget(job);
  ASSERT_TRUE(far.has_value());
  EXPECT_FALSE(far->left.has_value());
  EXPECT_NE(far->sentence.find("the bias stands still at 10.0 %"), std::string::npos)
      << far->sentence;
  EXPECT_NE(far->sentence.find("--initial-radius"), std::string::npos);
  // Bias below the target does not keep the job from it.
  SetSetting(job, &RenderSettings::error, 0.11);
  EXPECT_FALSE(FindFarTarget(job).has_value());
}

TEST(FarTargetTest, LightThatWasNotFoundAsksForPhotons) {
  v1::Job job = ConvergingJob(12);
  for (v1::ErrorSample& sample : *job.mutable_convergence()) {
    sample.mutable_relative()->set_high(0.9);
    sample.set_missing_relative(0.8);
  }
  const auto far = FindFarTarget(job);
  ASSERT_TRUE(far.has_value());
  EXPECT_NE(far->sentence.find("not in sight"), std::string::npos) << far->sentence;
  EXPECT_NE(far->sentence.find("more photons would help"), std::string::npos);
}

}  // namespace
}  // namespace lucerna
