// What a user reads about a job must follow from the job alone, and an ETA must come from whichever
// limit stops it first.
#include <cmath>

#include "gtest/gtest.h"

#include "render/report/convergence.h"
#include "render/report/progress_view.h"
#include "render/wire/messages.h"
#include "tests/support/converging_job.h"
#include "tests/support/job_settings.h"

namespace lucerna {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

// 16 passes of a million photons; a quarter is done, after 4 s, at 1 M photons/s.
v1::Job Running() {
  v1::Job job;
  job.set_job_id("j1");
  job.set_name("pool.pbrt");
  job.set_state(v1::JOB_STATE_RUNNING);
  SetSetting(job, &RenderSettings::passes, 16);
  SetSetting(job, &RenderSettings::photons_per_pass, 1'000'000);
  job.mutable_progress()->set_passes(3);
  job.mutable_progress()->set_photons(4'000'000);
  job.mutable_progress()->set_photons_per_second(1'000'000);
  *job.mutable_progress()->mutable_running() = ToProto(Duration(seconds(4)));
  return job;
}

TEST(ProgressViewTest, CountsAreShort) {
  EXPECT_EQ(ShortCount(0), "0");
  EXPECT_EQ(ShortCount(999), "999");
  EXPECT_EQ(ShortCount(999.7), "1.00 k");
  EXPECT_EQ(ShortCount(2050), "2.05 k");
  EXPECT_EQ(ShortCount(13'940'000), "13.9 M");
  EXPECT_EQ(ShortCount(999'600'000), "1.00 G");
  EXPECT_EQ(ShortCount(5e15), "5000 T");
}

TEST(ProgressViewTest, TimesAreShort) {
  EXPECT_EQ(ShortTime(milliseconds(350)), "0.35 s");
  EXPECT_EQ(ShortTime(milliseconds(12540)), "12.5 s");
  EXPECT_EQ(ShortTime(milliseconds(59990)), "1:00");
  EXPECT_EQ(ShortTime(seconds(245)), "4:05");
  EXPECT_EQ(ShortTime(seconds(3723)), "1:02:03");
  EXPECT_EQ(ShortTime(seconds(172'799)), "47:59:59");
  EXPECT_EQ(ShortTime(seconds(302'400)), "3.5 days");
}

TEST(ProgressViewTest, ARunningJobShowsItsShareRateAndTimeLeft) {
  EXPECT_EQ(ProgressLine(Running()),
            "[#####---------------]  25 %  pass 3/16  4.00 M photons  1.00 M/s  4.00 s"
            "  ETA 12.0 s");
}

TEST(ProgressViewTest, ALineOfTheTableTellsProgressOwnerAndTimeLeft) {
  v1::Job job = Running();
  EXPECT_EQ(
      TableLine(job),
      "j1                                RUNNING     25 %      3     4.00 M    4.00 s    12.0 s  "
      "-            pool.pbrt");
  EXPECT_EQ(
      TableHead(),
      "JOB                               STATE       DONE PASSES    PHOTONS      TIME       ETA  "
      "OWNER        NAME");
  job.set_owner("anna");
  job.set_state(v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(
      TableLine(job),
      "j1                                SUCCEEDED  100 %      3     4.00 M    4.00 s         -  "
      "anna         pool.pbrt");
}

TEST(ProgressViewTest, TheLimitThatStopsFirstDecides) {
  v1::Job job = Running();
  SetSetting(job, &RenderSettings::time_s, 8);
  EXPECT_DOUBLE_EQ(*ShareDone(job), 0.5);
  EXPECT_EQ(*TimeLeft(job), seconds(4));
  SetSetting(job, &RenderSettings::time_s, 800);
  EXPECT_DOUBLE_EQ(*ShareDone(job), 0.25);
  EXPECT_EQ(*TimeLeft(job), seconds(12));
  SetSetting(job, &RenderSettings::passes, 0);
  EXPECT_DOUBLE_EQ(*ShareDone(job), 0.005);
  EXPECT_EQ(*TimeLeft(job), seconds(796));
}

TEST(ProgressViewTest, NoRateNoEta) {
  v1::Job job = Running();
  job.mutable_progress()->set_photons_per_second(0);
  EXPECT_FALSE(TimeLeft(job).has_value());
  EXPECT_EQ(ProgressLine(job).find("ETA"), std::string::npos);
  // A rate that all but stands still gives a long time, not an overflowed one.
  job.mutable_progress()->set_photons_per_second(1e-9);
  EXPECT_GT(*TimeLeft(job), std::chrono::hours(24 * 365));
}

TEST(ProgressViewTest, AShareNeverPassesOne) {
  v1::Job job = Running();
  job.mutable_progress()->set_photons(17'000'000);
  EXPECT_DOUBLE_EQ(*ShareDone(job), 1);
  EXPECT_EQ(*TimeLeft(job), seconds(0));
}

TEST(ProgressViewTest, SaysWhyNothingMoves) {
  v1::Job job = Running();
  job.set_no_workers(true);
  EXPECT_NE(ProgressLine(job).find("no worker is connected"), std::string::npos);
  job.set_state(v1::JOB_STATE_QUEUED);
  EXPECT_EQ(ProgressLine(job), "queued");
}

TEST(ProgressViewTest, ASummaryNamesTheEnd) {
  v1::Job job = Running();
  job.set_state(v1::JOB_STATE_SUCCEEDED);
  job.set_stop_reason(v1::STOP_REASON_TIME);
  EXPECT_EQ(SummaryLine(job), "3 passes, 4.00 M photons in 4.00 s, stopped by its time limit");
  job.set_stop_reason(v1::STOP_REASON_PASSES);
  EXPECT_EQ(SummaryLine(job), "3 passes, 4.00 M photons in 4.00 s, all passes done");
  job.mutable_progress()->set_passes(1);
  EXPECT_EQ(SummaryLine(job), "1 pass, 4.00 M photons in 4.00 s, all passes done");
  job.set_state(v1::JOB_STATE_FAILED);
  job.set_failure("a batch failed on three workers");
  EXPECT_NE(SummaryLine(job).find("failed: a batch failed on three workers"), std::string::npos);
}

TEST(ProgressViewTest, PhotonsAreALimitAtTheEndOfTheirPass) {
  v1::Job job = Running();
  SetSetting(job, &RenderSettings::photons, 7'100'000);
  EXPECT_DOUBLE_EQ(*ShareDone(job), 0.5) << "the eighth pass reaches them";
  EXPECT_EQ(*TimeLeft(job), seconds(4));
  SetSetting(job, &RenderSettings::photons, 100'000'000);
  EXPECT_DOUBLE_EQ(*ShareDone(job), 0.25) << "passes end it first";
  SetSetting(job, &RenderSettings::passes, 0);
  EXPECT_DOUBLE_EQ(*ShareDone(job), 0.04);
}

TEST(ProgressViewTest, AnErrorTargetIsALimitToo) {
  v1::Job job = ConvergingJob(10);
  job.set_state(v1::JOB_STATE_RUNNING);
  const double high = job.convergence(9).relative().high();
  SetSetting(job, &RenderSettings::time_s, 0);
  // Half the error takes eight times as long.
  SetSetting(job, &RenderSettings::error, std::sqrt(high) / 2);
  EXPECT_NEAR(*ShareDone(job), 1.0 / 8, 1e-5);
  EXPECT_EQ(*TimeLeft(job), *TimeToTarget(job));
  SetSetting(job, &RenderSettings::time_s, 2 * Seconds(FromProto(job.progress().running())));
  EXPECT_NEAR(*ShareDone(job), 1.0 / 2, 1e-5) << "time ends it first";
}

TEST(ProgressViewTest, TheErrorIsSaidWithItsIntervalAndTarget) {
  v1::Job job = ConvergingJob();
  EXPECT_EQ(ErrorLine(job),
            "error about 2.96 % (95 %: 2.65 % to 3.38 %)  untrimmed 3.28 %  target 3.50 %");
  EXPECT_NE(SummaryLine(job).find(
                ", its error target reached, error about 2.96 % (95 %: 2.65 % to 3.38 %), "
                "untrimmed 3.28 %; the target leaves out the worst 65 pixels"),
            std::string::npos)
      << SummaryLine(job);
  EXPECT_EQ(SummaryLine(job).find("denoised"), std::string::npos);
  v1::DenoisedError& denoised =
      *job.mutable_convergence(job.convergence_size() - 1)->mutable_denoised();
  denoised.mutable_relative()->set_noise(0.0001);
  denoised.mutable_relative()->set_low(0.000081);
  denoised.mutable_relative()->set_high(0.000144);
  denoised.set_relative_untrimmed(0.000121);
  EXPECT_NE(SummaryLine(job).find("; denoised, 1.00 % (95 %: 0.900 % to 1.20 %), untrimmed 1.10 %"),
            std::string::npos)
      << SummaryLine(job);
  SetSetting(job, &RenderSettings::error, 0.03);
  EXPECT_NE(ErrorLine(job).find("  target 3.00 % in about 1:"), std::string::npos)
      << ErrorLine(job);
  EXPECT_EQ(ErrorLine(Running()), "");
}

TEST(ProgressPrinterTest, PlainLinesComeAtMostEveryTwoSecondsAndAtEveryNewState) {
  ProgressPrinter printer;
  v1::Job job = Running();
  job.set_state(v1::JOB_STATE_PREPARING);
  SteadyTime now{};
  EXPECT_EQ(printer.Update(job, now), "reading the scene\n");
  EXPECT_EQ(printer.Update(job, now + seconds(9)), "") << "nothing new";
  job.set_state(v1::JOB_STATE_RUNNING);
  now += milliseconds(10);
  EXPECT_EQ(printer.Update(job, now), ProgressLine(job) + "\n");
  job.mutable_progress()->set_photons(5'000'000);
  EXPECT_EQ(printer.Update(job, now + milliseconds(1999)), "");
  EXPECT_EQ(printer.Update(job, now + milliseconds(2000)), ProgressLine(job) + "\n");
}

// Never "0 %".
TEST(ErrorLineTest, ABlackImageIsNothingFound) {
  v1::Job job = ConvergingJob(8);
  v1::ErrorSample& newest = *job.mutable_convergence(7);
  newest.clear_relative();
  newest.mutable_relative()->set_high(HUGE_VAL);
  newest.set_nothing_found(true);
  EXPECT_EQ(ErrorLine(job), "nothing found yet: no light has reached the view");
  EXPECT_NE(SummaryLine(job).find("no light was found: the image is black"), std::string::npos)
      << SummaryLine(job);
  v1::LightFinding& light = *job.add_lights();
  light.set_name("light 1 (a point light at (0, 0, 1))");
  light.set_photons_sent(99);
  light.set_missing_share(HUGE_VAL);
  EXPECT_EQ(ErrorNotes(job),
            std::vector<std::string>(
                {"light 1 (a point light at (0, 0, 1)): no photon of 99 has reached the view"}));
}

TEST(ErrorLineTest, ATargetOutOfSightIsSaid) {
  v1::Job job = ConvergingJob(24);
  job.set_state(v1::JOB_STATE_RUNNING);
  for (v1::ErrorSample& sample : *job.mutable_convergence()) {
    sample.mutable_relative()->set_bias(0.04);
    sample.mutable_relative()->set_high(0.1);
  }
  SetSetting(job, &RenderSettings::time_s, 0);
  EXPECT_TRUE(ErrorLine(job).ends_with("target 3.50 % not in sight")) << ErrorLine(job);
  EXPECT_TRUE(ProgressLine(job).ends_with("ETA not in sight")) << ProgressLine(job);
  ASSERT_EQ(ErrorNotes(job).size(), 1U);
  ProgressPrinter printer;
  const std::string first = printer.Update(job, SteadyTime());
  EXPECT_NE(first.find(ErrorNotes(job)[0]), std::string::npos) << first;
  job.mutable_progress()->set_photons(job.progress().photons() * 2);
  const std::string second = printer.Update(job, SteadyTime() + seconds(10));
  EXPECT_EQ(second.find("not in sight:"), std::string::npos) << "said once: " << second;
}

}  // namespace
}  // namespace lucerna
