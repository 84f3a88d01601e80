// Counts hold where jobs are as long as they may be: 1e12 photons a pass, passes by the million,
// more than 2^53 of anything. (A pixel's own photons are a statistic, of 16 significant bits a
// slice.)
#include <cmath>
#include <cstdint>
#include <vector>

#include "gtest/gtest.h"

#include "render/estimate/accumulation.h"
#include "render/estimate/evidence.h"
#include "render/estimate/radius_controller.h"
#include "render/report/progress_view.h"
#include "server/pass_merger.h"
#include "server/scheduler.h"
#include "tests/support/job_settings.h"

namespace lucerna {
namespace {

constexpr std::uint64_t kTrillion = 1'000'000'000'000;
constexpr std::uint64_t kBeyondDouble = (std::uint64_t{1} << 53) + 1;

Accumulation OfOneHitpoint(std::uint32_t count, std::uint64_t photons) {
  Accumulation accumulation;
  accumulation.hitpoints = {0};
  accumulation.counts = {count};
  for (auto& channel : accumulation.flux)
    channel = {1};
  accumulation.evidence.assign(kCommonColumns, {1});
  accumulation.tally.photons = photons;
  accumulation.tally.rays = 3 * photons;
  accumulation.tally.deposits = 2 * photons;
  accumulation.tally.pairs = photons;
  return accumulation;
}

TEST(ExtremeCountsTest, ATallyCountsBeyondWhatADoubleHolds) {
  BatchTally tally;
  tally.photons = kBeyondDouble - 1;
  BatchTally more;
  more.photons = 1;
  more.rays = kBeyondDouble;
  tally += more;
  EXPECT_EQ(tally.photons, kBeyondDouble);
  EXPECT_EQ(tally.rays, kBeyondDouble);
}

// A pass of 1e12 photons in the batches of the scheduler: every photon is lent once, merged once
// and counted.
TEST(ExtremeCountsTest, APassOfATrillionPhotonsIsLentAndMergedWhole) {
  SchedulerOptions options;
  options.fixed_batch = kTrillion / 1000 + 1;
  Scheduler scheduler(options);
  PassMerger merger;
  const PassKey key = {"job", 0};
  merger.Open(key, 1, kTrillion, kCommonColumns);
  const SteadyTime now{};
  const std::string worker = scheduler.AddWorker("w", now).value();
  scheduler.OpenPass(key, kTrillion);
  Scheduler::Report report;
  report.wants_lease = true;
  std::uint64_t lent = 0;
  while (true) {
    ASSERT_TRUE(scheduler.TakeReport(worker, report, now).ok());
    const auto answer = scheduler.AnswerFor(worker, report, now);
    ASSERT_TRUE(answer.ok());
    if (!answer->lease) break;
    const WorkRange range = answer->lease->range;
    EXPECT_EQ(range.first, lent);
    lent = range.last;
    ASSERT_TRUE(merger.Merge(key, range, OfOneHitpoint(UINT32_MAX, range.size())).ok());
    scheduler.Commit(key, range, now);
  }
  EXPECT_EQ(lent, kTrillion);
  ASSERT_TRUE(merger.IsComplete(key));
  const PassSums sums = merger.Take(key);
  EXPECT_EQ(sums.tally().photons, kTrillion);
  EXPECT_EQ(sums.tally().rays, 3 * kTrillion);
  // More than a hitpoint's 32 bits of one batch.
  EXPECT_EQ(sums.counts()[0], std::int64_t{UINT32_MAX} * 1000);
}

// N and r go on after N has passed 2^24, and after passes by the million. In float both stand
// still there.
TEST(ExtremeCountsTest, RadiiShrinkAfterAnyNumberOfPasses) {
  RenderSettings settings;
  settings.alpha = 2.0 / 3;
  settings.radius_controller = RadiusControllerKind::kPpm;
  const auto ppm = MakeRadiusController(settings, 1);
  const PixelRadius late = {1, 0x1p30};
  const PixelRadius next = ppm->Next(late, {1, 1, {}}, {0, 1}, {});
  EXPECT_EQ(next.photons, 0x1p30 + settings.alpha);
  EXPECT_NEAR((1 - next.radius) * 0x1p30, (1 - settings.alpha) / 2, 1e-5);

  settings.radius_controller = RadiusControllerKind::kPppm;
  const auto pppm = MakeRadiusController(settings, 1);
  PixelRadius radius = {1, 0};
  constexpr std::uint64_t kPasses = 4'000'000;
  for (std::uint64_t pass = 0; pass < kPasses; ++pass)
    radius = pppm->Next(radius, {1, radius.radius, {}}, {pass, pass + 1}, {});
  // The product of (i + α)/(i + 1) from 1 to n is Γ(n + 1 + α) / (Γ(1 + α) Γ(n + 2)).
  const double n = kPasses;
  const double expected = std::exp(0.5 * (std::lgamma(n + 1 + settings.alpha) -
                                          std::lgamma(1 + settings.alpha) - std::lgamma(n + 2)));
  EXPECT_NEAR(radius.radius / expected, 1, 1e-6);
}

TEST(ExtremeCountsTest, ProgressOfTheLongestJobIsAShare) {
  v1::Job job;
  job.set_state(v1::JOB_STATE_RUNNING);
  SetSetting(job, &RenderSettings::photons_per_pass, static_cast<std::int64_t>(kTrillion));
  SetSetting(job, &RenderSettings::passes, 9'000'000);
  job.mutable_progress()->set_photons(4'500'000 * kTrillion);
  EXPECT_NEAR(ShareDone(job).value(), 0.5, 1e-12);
  SetSetting(job, &RenderSettings::passes, INT64_MAX);
  EXPECT_LT(ShareDone(job).value(), 1e-9);
}

}  // namespace
}  // namespace lucerna
