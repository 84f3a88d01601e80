// Every photon of a pass must be lent, come back when its worker fails, go to whoever can use it,
// and be given up only when several workers failed at it. Time is an argument here, so nothing
// waits.
#include "server/scheduler.h"

#include "gtest/gtest.h"

namespace lucerna {
namespace {

using std::chrono::seconds;

const PassKey kFirst = {"job", 0};
const PassKey kSecond = {"job", 1};

SteadyTime At(double s) {
  return SteadyTime(std::chrono::duration_cast<Duration>(std::chrono::duration<double>(s)));
}

SchedulerOptions Batches(std::uint64_t photons) {
  SchedulerOptions options;
  options.fixed_batch = photons;
  return options;
}

// What a worker gets that holds `held` and wants more.
std::optional<BatchLease> Ask(Scheduler& scheduler, const std::string& worker, double now_s,
                              std::vector<std::string> held = {}) {
  Scheduler::Report report;
  report.held = std::move(held);
  report.wants_lease = true;
  EXPECT_TRUE(scheduler.Hear(worker, report, At(now_s)).ok());
  auto answer = scheduler.Tell(worker, report, At(now_s));
  EXPECT_TRUE(answer.ok());
  return answer.ok() ? answer->lease : std::nullopt;
}

std::vector<std::string> Revoked(Scheduler& scheduler, const std::string& worker,
                                 std::vector<std::string> held, double now_s) {
  Scheduler::Report report;
  report.held = std::move(held);
  EXPECT_TRUE(scheduler.Hear(worker, report, At(now_s)).ok());
  return scheduler.Tell(worker, report, At(now_s))->revoked;
}

TEST(SchedulerTest, LendsAPassInOrderAndEachPhotonOnce) {
  Scheduler scheduler(Batches(40));
  scheduler.OpenPass(kFirst, 100);
  std::uint64_t next = 0;
  for (int i = 0; i < 3; ++i) {
    const auto worker = scheduler.AddWorker("w", At(0));
    const auto lease = Ask(scheduler, worker, 0);
    ASSERT_TRUE(lease);
    EXPECT_EQ(lease->range.first, next);
    next = lease->range.last;
  }
  EXPECT_EQ(next, 100U);
  EXPECT_FALSE(Ask(scheduler, scheduler.AddWorker("w", At(0)), 0));
}

TEST(SchedulerTest, CutsAPassByTheNumberOfWorkersButNotTooSmall) {
  Scheduler scheduler({});
  std::vector<std::string> workers;
  for (int i = 0; i < 4; ++i)
    workers.push_back(scheduler.AddWorker("w", At(0)));
  scheduler.OpenPass(kFirst, 1'000'001);
  EXPECT_EQ(Ask(scheduler, workers[0], 0)->range.size(), 250'001U);
  scheduler.ClosePass(kFirst);
  scheduler.OpenPass(kFirst, 5000);
  EXPECT_EQ(Ask(scheduler, workers[0], 0)->range.size(), 4096U);
  EXPECT_EQ(Ask(scheduler, workers[1], 0)->range.size(), 904U);
  scheduler.ClosePass(kFirst);
  scheduler.OpenPass(kFirst, 100);
  EXPECT_EQ(Ask(scheduler, workers[0], 0)->range.size(), 100U);
  scheduler.ClosePass(kFirst);
  scheduler.OpenPass(kFirst, std::uint64_t{1} << 40);
  EXPECT_EQ(Ask(scheduler, workers[0], 0)->range.size(), std::uint64_t{1} << 22);
}

TEST(SchedulerTest, GoesOnWithTheNextPassWhileTheFirstIsOut) {
  Scheduler scheduler(Batches(100));
  scheduler.OpenPass(kFirst, 100);
  scheduler.OpenPass(kSecond, 100);
  EXPECT_EQ(Ask(scheduler, scheduler.AddWorker("a", At(0)), 0)->pass, kFirst);
  EXPECT_EQ(Ask(scheduler, scheduler.AddWorker("b", At(0)), 0)->pass, kSecond);
}

TEST(SchedulerTest, LeavesTheLastBatchToAnIdleWorker) {
  Scheduler scheduler(Batches(50));
  const auto busy = scheduler.AddWorker("busy", At(0));
  const auto idle = scheduler.AddWorker("idle", At(0));
  scheduler.OpenPass(kFirst, 100);
  const auto held = Ask(scheduler, busy, 0);
  ASSERT_TRUE(held);
  EXPECT_FALSE(Ask(scheduler, busy, 0, {held->id}));
  EXPECT_TRUE(Ask(scheduler, idle, 0));
}

TEST(SchedulerTest, LendsAheadWhenThereIsEnoughForAll) {
  Scheduler scheduler(Batches(50));
  const auto busy = scheduler.AddWorker("busy", At(0));
  const auto idle = scheduler.AddWorker("idle", At(0));
  scheduler.OpenPass(kFirst, 150);
  const auto held = Ask(scheduler, busy, 0);
  EXPECT_TRUE(Ask(scheduler, busy, 0, {held->id}));
  EXPECT_TRUE(Ask(scheduler, idle, 0));
}

TEST(SchedulerTest, TakesBackALeaseThatRunsOutAndLendsTheSameRangeFirst) {
  Scheduler scheduler(Batches(50));
  const auto silent = scheduler.AddWorker("silent", At(0));
  const auto other = scheduler.AddWorker("other", At(0));
  scheduler.OpenPass(kFirst, 150);
  const auto lost = Ask(scheduler, silent, 0);
  EXPECT_EQ(Ask(scheduler, other, 9)->range, (PhotonRange{50, 100}));
  scheduler.Expire(At(9.9));
  EXPECT_TRUE(Revoked(scheduler, silent, {lost->id}, 9.9).empty()) << "renewed by the report";
  scheduler.Expire(At(19.8));
  EXPECT_TRUE(Revoked(scheduler, silent, {lost->id}, 19.85).empty());
  scheduler.Expire(At(29.9));
  EXPECT_EQ(Ask(scheduler, other, 29.9)->range, lost->range);
  EXPECT_EQ(Revoked(scheduler, silent, {lost->id}, 29.95), (std::vector{lost->id}));
}

TEST(SchedulerTest, GivesBackAtOnceWhatABrokenConnectionHeld) {
  Scheduler scheduler(Batches(100));
  const auto killed = scheduler.AddWorker("killed", At(0));
  const auto other = scheduler.AddWorker("other", At(0));
  scheduler.OpenPass(kFirst, 100);
  const auto lost = Ask(scheduler, killed, 0);
  EXPECT_EQ(scheduler.LiveWorkers(), 2);
  scheduler.LoseWorker(killed);
  EXPECT_EQ(scheduler.LiveWorkers(), 1);
  EXPECT_EQ(Ask(scheduler, other, 0.1)->range, lost->range);
}

TEST(SchedulerTest, ForgetsASilentWorkerAndTellsItSo) {
  Scheduler scheduler({});
  const auto worker = scheduler.AddWorker("w", At(0));
  scheduler.Expire(At(29));
  EXPECT_TRUE(scheduler.Hear(worker, {}, At(29)).ok());
  scheduler.Expire(At(58));
  EXPECT_EQ(scheduler.LiveWorkers(), 1);
  scheduler.Expire(At(59));
  EXPECT_TRUE(absl::IsNotFound(scheduler.Hear(worker, {}, At(59))));
  EXPECT_EQ(scheduler.LiveWorkers(), 0);
}

TEST(SchedulerTest, TakesBackWhatAWorkerThatAsksNoLongerMentions) {
  Scheduler scheduler(Batches(100));
  const auto worker = scheduler.AddWorker("w", At(0));
  scheduler.OpenPass(kFirst, 100);
  const auto dropped = Ask(scheduler, worker, 0);
  const auto again = Ask(scheduler, worker, 1);
  ASSERT_TRUE(again);
  EXPECT_EQ(again->range, dropped->range);
  EXPECT_NE(again->id, dropped->id);
}

TEST(SchedulerTest, AHeartbeatThatCrossesANewLeaseDoesNotTakeItBack) {
  Scheduler scheduler(Batches(100));
  const auto worker = scheduler.AddWorker("w", At(0));
  scheduler.OpenPass(kFirst, 100);
  const auto lease = Ask(scheduler, worker, 0);
  EXPECT_TRUE(Revoked(scheduler, worker, {}, 0.1).empty());
  EXPECT_TRUE(Revoked(scheduler, worker, {lease->id}, 0.2).empty());
}

TEST(SchedulerTest, RevokesWhatIsOfNoUseAnyMore) {
  Scheduler scheduler(Batches(100));
  const auto worker = scheduler.AddWorker("w", At(0));
  scheduler.OpenPass(kFirst, 100);
  scheduler.OpenPass(kSecond, 100);
  const auto first = Ask(scheduler, worker, 0);
  const auto second = Ask(scheduler, worker, 0, {first->id});
  ASSERT_TRUE(second);
  scheduler.Commit(kFirst, first->range, At(1));
  EXPECT_EQ(Revoked(scheduler, worker, {first->id, second->id}, 1), (std::vector{first->id}));
  scheduler.ClosePass(kSecond);
  EXPECT_EQ(Revoked(scheduler, worker, {second->id}, 1), (std::vector{second->id}));
}

TEST(SchedulerTest, DoesNotLendARangeThatALateAnswerHasBrought) {
  Scheduler scheduler(Batches(100));
  const auto late = scheduler.AddWorker("late", At(0));
  scheduler.OpenPass(kFirst, 100);
  const auto lease = Ask(scheduler, late, 0);
  scheduler.LoseWorker(late);
  scheduler.Commit(kFirst, lease->range, At(1));
  EXPECT_FALSE(Ask(scheduler, scheduler.AddWorker("other", At(1)), 1));
}

// Three batches of one second each, and a fourth that is out since `now_s` = 3.
struct Straggling {
  Scheduler scheduler{Batches(100)};
  std::string slow = scheduler.AddWorker("slow", At(0));
  std::string idle = scheduler.AddWorker("idle", At(0));
  std::optional<BatchLease> lease;

  Straggling() {
    scheduler.OpenPass(kFirst, 400);
    for (int i = 0; i < 3; ++i) {
      const auto quick = Ask(scheduler, idle, i);
      scheduler.Commit(kFirst, quick->range, At(i + 1));
    }
    lease = Ask(scheduler, slow, 3);
  }
};

TEST(SchedulerTest, LendsAStragglersBatchASecondTimeAndNotAThird) {
  Straggling s;
  EXPECT_FALSE(Ask(s.scheduler, s.idle, 5.9)) << "not yet three times the median";
  const auto doubled = Ask(s.scheduler, s.idle, 6.1);
  ASSERT_TRUE(doubled);
  EXPECT_EQ(doubled->range, s.lease->range);
  EXPECT_FALSE(Ask(s.scheduler, s.scheduler.AddWorker("third", At(7)), 7));
  s.scheduler.Commit(kFirst, doubled->range, At(8));
  EXPECT_EQ(Revoked(s.scheduler, s.slow, {s.lease->id}, 8), (std::vector{s.lease->id}));
}

TEST(SchedulerTest, DoesNotDoubleABatchWhileOthersArePending) {
  Straggling s;
  s.scheduler.OpenPass(kSecond, 100);
  EXPECT_EQ(Ask(s.scheduler, s.idle, 6.1)->pass, kSecond);
}

TEST(SchedulerTest, PoisonsABatchAtWhichThreeWorkersFailed) {
  Scheduler scheduler(Batches(100));
  scheduler.OpenPass(kFirst, 100);
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(scheduler.TakePoisoned().empty());
    const auto worker = scheduler.AddWorker(absl::StrCat("host", i), At(i));
    ASSERT_TRUE(Ask(scheduler, worker, i));
    scheduler.LoseWorker(worker);
  }
  const auto poisoned = scheduler.TakePoisoned();
  ASSERT_EQ(poisoned.size(), 1U);
  EXPECT_EQ(poisoned[0].pass, kFirst);
  EXPECT_NE(poisoned[0].message.find("host2"), std::string::npos) << poisoned[0].message;
}

TEST(SchedulerTest, PoisonsABatchThatALoneWorkerCannotDo) {
  Scheduler scheduler(Batches(100));
  scheduler.OpenPass(kFirst, 100);
  const auto worker = scheduler.AddWorker("lone", At(0));
  int tries = 0;
  for (; tries < 100 && scheduler.TakePoisoned().empty(); ++tries) {
    const auto lease = Ask(scheduler, worker, tries);
    ASSERT_TRUE(lease);
    Scheduler::Report report;
    report.failures = {{lease->id, "out of memory"}};
    ASSERT_TRUE(scheduler.Hear(worker, report, At(tries)).ok());
  }
  EXPECT_EQ(tries, 6);
}

TEST(SchedulerTest, AGoodbyeIsNoFailure) {
  Scheduler scheduler(Batches(100));
  scheduler.OpenPass(kFirst, 100);
  for (int i = 0; i < 10; ++i) {
    const auto worker = scheduler.AddWorker("w", At(i));
    ASSERT_TRUE(Ask(scheduler, worker, i));
    scheduler.RemoveWorker(worker);
  }
  EXPECT_TRUE(scheduler.TakePoisoned().empty());
}

}  // namespace
}  // namespace lucerna
