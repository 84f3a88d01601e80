// What a user reads about a job must follow from the job alone, and an ETA must come from whichever
// limit stops it first.
#include <cmath>

#include "gtest/gtest.h"

#include "client/convergence.h"
#include "client/progress_view.h"
#include "render/wire/messages.h"
#include "tests/support/converging_job.h"

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
  job.mutable_settings()->set_passes(16);
  job.mutable_settings()->set_photons_per_pass(1'000'000);
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
}

TEST(ProgressViewTest, ARunningJobShowsItsShareRateAndTimeLeft) {
  EXPECT_EQ(ProgressLine(Running()),
            "[#####---------------]  25 %  pass 3/16  4.00 M photons  1.00 M/s  4.00 s"
            "  ETA 12.0 s");
}

TEST(ProgressViewTest, TheLimitThatStopsFirstDecides) {
  v1::Job job = Running();
  job.mutable_settings()->set_time_s(8);
  EXPECT_DOUBLE_EQ(*ShareDone(job), 0.5);
  EXPECT_EQ(*TimeLeft(job), seconds(4));
  job.mutable_settings()->set_time_s(800);
  EXPECT_DOUBLE_EQ(*ShareDone(job), 0.25);
  EXPECT_EQ(*TimeLeft(job), seconds(12));
  job.mutable_settings()->set_passes(0);
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
  job.mutable_settings()->set_photons(7'100'000);
  EXPECT_DOUBLE_EQ(*ShareDone(job), 0.5) << "the eighth pass reaches them";
  EXPECT_EQ(*TimeLeft(job), seconds(4));
  job.mutable_settings()->set_photons(100'000'000);
  EXPECT_DOUBLE_EQ(*ShareDone(job), 0.25) << "passes end it first";
  job.mutable_settings()->set_passes(0);
  EXPECT_DOUBLE_EQ(*ShareDone(job), 0.04);
}

TEST(ProgressViewTest, AnErrorTargetIsALimitToo) {
  v1::Job job = ConvergingJob(10);
  job.set_state(v1::JOB_STATE_RUNNING);
  const double high = job.convergence(9).relative().high();
  job.mutable_settings()->set_time_s(0);
  // Half the error takes eight times as long.
  job.mutable_settings()->set_error(std::sqrt(high) / 2);
  EXPECT_NEAR(*ShareDone(job), 1.0 / 8, 1e-5);
  EXPECT_EQ(*TimeLeft(job), *TimeToTarget(job));
  job.mutable_settings()->set_time_s(2 * Seconds(FromProto(job.progress().running())));
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
  job.mutable_settings()->set_error(0.03);
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

}  // namespace
}  // namespace lucerna
