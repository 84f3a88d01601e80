// A job only moves forward, an ended one never changes, and its rate is that of the last seconds.
#include "server/job.h"

#include <cmath>

#include "gtest/gtest.h"

#include "render/estimate/rounds.h"
#include "tests/support/steady_time.h"

namespace lucerna {
namespace {

TEST(JobCountersTest, NamesTheFirstDroppedPhotonsWhateverTheOrderOfBatches) {
  JobCounters forward;
  JobCounters backward;
  for (std::uint64_t pass = 0; pass < 4; ++pass)
    forward.NameDropped({{pass, 10 - pass}, {pass, 20}, {pass, 30}});
  for (std::uint64_t pass = 4; pass-- > 0;)
    backward.NameDropped({{pass, 10 - pass}, {pass, 20}, {pass, 30}});
  const std::vector<PhotonKey> first = {{0, 10}, {0, 20}, {0, 30}, {1, 9},
                                        {1, 20}, {1, 30}, {2, 8},  {2, 20}};
  EXPECT_EQ(forward.dropped_photons, first);
  EXPECT_EQ(backward.dropped_photons, first);
}

// Every pass has its own entry until there are too many; none is lost, and the sums stay.
TEST(PassRecordTest, KeepsEveryPassAndJoinsNeighboursWhenThereAreMany) {
  PassRecord record;
  constexpr std::int64_t kMost = PassRecord::kMostTallies;
  const auto add = [&](std::int64_t passes) {
    for (std::int64_t i = 0; i < passes; ++i) {
      BatchTally tally;
      tally.photons = 10;
      tally.energy.emitted = tally.energy.escaped = 7;
      record.Add(tally);
    }
  };
  const auto expect = [&](std::int64_t passes, std::int64_t each) {
    std::int64_t next = 0;
    for (const PassTally& part : record.tallies()) {
      EXPECT_EQ(part.first_pass, next);
      next += part.passes;
      if (next < passes) {
        EXPECT_EQ(part.passes, each);
      }
      EXPECT_EQ(part.tally.photons, 10U * static_cast<std::uint64_t>(part.passes));
      EXPECT_EQ(part.tally.energy.escaped, 7 * part.passes);
    }
    EXPECT_EQ(next, passes);
  };
  add(kMost);
  EXPECT_EQ(record.tallies().size(), PassRecord::kMostTallies);
  expect(kMost, 1);
  add(1);
  EXPECT_EQ(record.tallies().size(), PassRecord::kMostTallies / 2 + 1);
  expect(kMost + 1, 2);
  add(4 * kMost + 2);
  expect(5 * kMost + 3, 8);
}

// Rounds are taken in as a whole, so a record holds at least as many passes an entry as asked for.
TEST(PassRecordTest, TakesInRoundsOfSeveralPasses) {
  PassRecord record;
  std::uint64_t next = 0;
  while (next < 20'000) {
    const PassRange round = RoundOf(next);
    BatchTally tally;
    tally.photons = 10 * round.size();
    record.Add(tally, static_cast<std::int64_t>(round.size()));
    next = round.last;
  }
  EXPECT_LE(record.tallies().size(), PassRecord::kMostTallies);
  EXPECT_GE(record.tallies().size(), PassRecord::kMostTallies / 4);
  std::int64_t passes = 0;
  for (const PassTally& part : record.tallies()) {
    EXPECT_EQ(part.first_pass, passes);
    EXPECT_EQ(part.tally.photons, 10U * static_cast<std::uint64_t>(part.passes));
    passes += part.passes;
  }
  EXPECT_EQ(passes, static_cast<std::int64_t>(next));
}

// A worker may say any time of a batch: a job's time stands still at its end and never wraps.
TEST(SaturatingSumTest, StaysAtItsEnd) {
  const Duration most = SaturatingSum(Duration::max(), Duration::max());
  EXPECT_GT(most, std::chrono::hours(24 * 365 * 70));
  EXPECT_EQ(SaturatingSum(most, std::chrono::nanoseconds(1)), most);
  EXPECT_GT(most + most, most) << "a few of them can be added up";
  EXPECT_EQ(SaturatingSum(std::chrono::seconds(2), std::chrono::seconds(3)),
            std::chrono::seconds(5));
}

TEST(JobLifeTest, RunsToItsEnd) {
  JobLife life(At(10));
  EXPECT_FALSE(life.Run(At(11))) << "not prepared yet";
  EXPECT_FALSE(life.Succeed(StopReason::kPasses, At(11)));
  ASSERT_TRUE(life.Prepare());
  EXPECT_FALSE(life.Prepare());
  EXPECT_EQ(life.Running(At(12)), Duration::zero());
  ASSERT_TRUE(life.Run(At(12)));
  EXPECT_EQ(life.Running(At(15)), std::chrono::seconds(3));
  ASSERT_TRUE(life.Succeed(StopReason::kTime, At(17)));
  EXPECT_EQ(life.state(), JobState::kSucceeded);
  EXPECT_EQ(life.stop_reason(), StopReason::kTime);
  EXPECT_EQ(life.Running(At(100)), std::chrono::seconds(5)) << "stands still";
}

TEST(JobLifeTest, ItsTimeIsThatInWhichItRunsAndAWorkerIsThere) {
  JobLife life(At(0));
  life.SetHasWorkers(false, At(1));
  ASSERT_TRUE(life.Prepare());
  ASSERT_TRUE(life.Run(At(2)));
  EXPECT_EQ(life.Running(At(9)), Duration::zero());
  EXPECT_FALSE(life.WhenItHasRun(std::chrono::seconds(5)));
  life.SetHasWorkers(true, At(10));
  life.SetHasWorkers(true, At(11));
  EXPECT_EQ(life.WhenItHasRun(std::chrono::seconds(5)), At(15));
  ASSERT_TRUE(life.Pause(At(12)));
  EXPECT_FALSE(life.Pause(At(13)));
  EXPECT_FALSE(life.WhenItHasRun(std::chrono::seconds(5)));
  EXPECT_EQ(life.Running(At(20)), std::chrono::seconds(2));
  ASSERT_TRUE(life.Resume());
  EXPECT_FALSE(life.Resume());
  EXPECT_EQ(life.state(), JobState::kQueued);
  ASSERT_TRUE(life.Prepare());
  ASSERT_TRUE(life.Run(At(30)));
  EXPECT_EQ(life.WhenItHasRun(std::chrono::seconds(5)), At(33));
  ASSERT_TRUE(life.GiveUpTurn(At(31)));
  EXPECT_FALSE(life.GiveUpTurn(At(31)));
  EXPECT_EQ(life.Running(At(40)), std::chrono::seconds(3));
  ASSERT_TRUE(life.Succeed(StopReason::kUser, At(41))) << "it was done when it gave up its turn";
  EXPECT_FALSE(life.Pause(At(42)));
}

TEST(JobLifeTest, CanBeCancelledOrFailAnywhereBeforeTheEndAndNeverAfter) {
  for (int steps = 0; steps < 4; ++steps) {
    JobLife cancelled(At(0));
    JobLife failed(At(0));
    for (JobLife* life : {&cancelled, &failed}) {
      ASSERT_TRUE(steps < 1 || life->Prepare());
      ASSERT_TRUE(steps < 2 || life->Run(At(1)));
      ASSERT_TRUE(steps < 3 || life->Succeed(StopReason::kPasses, At(2)));
    }
    EXPECT_EQ(cancelled.Cancel(At(3)), steps < 3);
    EXPECT_EQ(failed.Fail("why", At(3)), steps < 3);
    EXPECT_TRUE(cancelled.has_ended());
    EXPECT_FALSE(cancelled.Fail("late", At(4)));
    EXPECT_FALSE(cancelled.Prepare());
    EXPECT_FALSE(failed.Cancel(At(4)));
    EXPECT_EQ(failed.failure(), steps < 3 ? "why" : "");
  }
}

TEST(SlidingRateTest, ForgetsWhatIsOlderThanTheWindow) {
  SlidingRate rate(std::chrono::seconds(5));
  for (int s = 1; s <= 10; ++s)
    rate.Add(700, At(s));
  for (int s = 11; s <= 20; ++s)
    rate.Add(100, At(s));
  EXPECT_NEAR(rate.PerSecond(At(0), At(20)), 100, 1e-9);
}

TEST(SlidingRateTest, KnowsTheRateOfRareArrivals) {
  SlidingRate rate(std::chrono::seconds(5));
  for (int s = 40; s <= 400; s += 40)
    rate.Add(800, At(s));
  // The same before an arrival as after it, but for the arrival.
  EXPECT_NEAR(rate.PerSecond(At(0), At(400)), 20, 1e-9);
  EXPECT_NEAR(rate.PerSecond(At(0), At(439)), 800 * 4 / 199.0, 1e-9);
  rate.Add(800, At(440));
  rate.Add(800, At(441));
  EXPECT_NEAR(rate.PerSecond(At(0), At(441)), 800 * 4 / 121.0, 1e-9);
}

// A thousand workers that began together, and need 40 seconds for a pass.
TEST(SlidingRateTest, KnowsTheRateOfManyThatArriveTogether) {
  SlidingRate rate(std::chrono::seconds(5));
  for (int s = 40; s <= 400; s += 40)
    for (int worker = 0; worker < 1000; ++worker)
      rate.Add(800, At(s + 0.0005 * worker));
  EXPECT_NEAR(rate.PerSecond(At(0), At(401)) / 20000, 1, 0.01);
  EXPECT_NEAR(rate.PerSecond(At(0), At(420)) / 20000, 160.0 / 180, 0.01);
}

TEST(SlidingRateTest, FallsWhenNothingArrivesAnyMore) {
  SlidingRate rate(std::chrono::seconds(5));
  for (int s = 1; s <= 10; ++s)
    rate.Add(100, At(s));
  EXPECT_NEAR(rate.PerSecond(At(0), At(46)), 10, 1e-9);  // those at 7, 8, 9 and 10, since 6
}

TEST(SlidingRateTest, CountsNoTimeInWhichNothingRan) {
  SlidingRate rate(std::chrono::seconds(5));
  for (int s = 1; s <= 10; ++s)
    rate.Add(100, At(s));
  // It stood still from 10 to 1000, so that what ran 12 seconds began at 990.
  rate.Add(100, At(1001));
  EXPECT_NEAR(rate.PerSecond(At(990), At(1002)), 400 / 12.0, 1e-9);
}

TEST(SlidingRateTest, DividesByTheTimeThereWas) {
  SlidingRate rate(std::chrono::seconds(5));
  rate.Add(100, At(1));
  EXPECT_NEAR(rate.PerSecond(At(0), At(2)), 50, 1e-9);
  EXPECT_EQ(rate.PerSecond(At(2), At(2)), 0) << "no time at all";
}

}  // namespace
}  // namespace lucerna
