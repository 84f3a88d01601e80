// Every photon of a pass must be lent, come back when its worker fails, go to whoever can use it,
// and be given up only when several workers failed at it. Time is an argument here, so nothing
// waits.
#include "server/scheduler.h"

#include <algorithm>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "gtest/gtest.h"

#include "render/estimate/rounds.h"
#include "tests/support/steady_time.h"

namespace lucerna {
namespace {

using std::chrono::seconds;

const PassKey kFirst = {"job", 0};
const PassKey kSecond = {"job", 1};

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
  EXPECT_TRUE(scheduler.TakeReport(worker, report, At(now_s)).ok());
  auto answer = scheduler.AnswerFor(worker, report, At(now_s));
  EXPECT_TRUE(answer.ok());
  return answer.ok() ? answer->lease : std::nullopt;
}

std::vector<std::string> Revoked(Scheduler& scheduler, const std::string& worker,
                                 std::vector<std::string> held, double now_s) {
  Scheduler::Report report;
  report.held = std::move(held);
  EXPECT_TRUE(scheduler.TakeReport(worker, report, At(now_s)).ok());
  return scheduler.AnswerFor(worker, report, At(now_s))->revoked;
}

void Fail(Scheduler& scheduler, const std::string& worker, const BatchLease& lease, double now_s) {
  Scheduler::Report report;
  report.failures = {{lease.id, "out of memory"}};
  EXPECT_TRUE(scheduler.TakeReport(worker, report, At(now_s)).ok());
}

TEST(SchedulerTest, LendsAPassInOrderAndEachPhotonOnce) {
  Scheduler scheduler(Batches(40));
  scheduler.OpenPass(kFirst, 100);
  std::uint64_t next = 0;
  for (int i = 0; i < 3; ++i) {
    const auto worker = scheduler.AddWorker("w", At(0)).value();
    const auto lease = Ask(scheduler, worker, 0);
    ASSERT_TRUE(lease);
    EXPECT_EQ(lease->range.first, next);
    next = lease->range.last;
  }
  EXPECT_EQ(next, 100U);
  EXPECT_FALSE(Ask(scheduler, scheduler.AddWorker("w", At(0)).value(), 0));
}

// A lease whose job has gone cannot be handed over. The worker's call is still open, so the worker
// must be served when there is other work, without asking again.
TEST(SchedulerTest, AWorkerThatCouldNotBeToldOfItsLeaseWaitsOn) {
  Scheduler scheduler(Batches(100));
  scheduler.OpenPass(kFirst, 100);
  const auto worker = scheduler.AddWorker("w", At(0)).value();
  ASSERT_TRUE(Ask(scheduler, worker, 0));
  EXPECT_FALSE(scheduler.TakeWaiting(At(0)));
  scheduler.WaitAgain(worker);
  scheduler.Close(kFirst);
  EXPECT_FALSE(scheduler.TakeWaiting(At(0))) << "there is nothing to lend";
  scheduler.OpenPass(kSecond, 100);
  EXPECT_EQ(scheduler.TakeWaiting(At(0)), worker);
}

TEST(SchedulerTest, CutsAPassByTheNumberOfWorkersButNotTooSmall) {
  Scheduler scheduler({});
  std::vector<std::string> workers;
  for (int i = 0; i < 4; ++i)
    workers.push_back(scheduler.AddWorker("w", At(0)).value());
  scheduler.OpenPass(kFirst, 1'000'001);
  EXPECT_EQ(Ask(scheduler, workers[0], 0)->range.size(), 250'001U);
  scheduler.Close(kFirst);
  scheduler.OpenPass(kFirst, 5000);
  EXPECT_EQ(Ask(scheduler, workers[0], 0)->range.size(), 4096U);
  EXPECT_EQ(Ask(scheduler, workers[1], 0)->range.size(), 904U);
  scheduler.Close(kFirst);
  scheduler.OpenPass(kFirst, 100);
  EXPECT_EQ(Ask(scheduler, workers[0], 0)->range.size(), 100U);
  scheduler.Close(kFirst);
  scheduler.OpenPass(kFirst, std::uint64_t{1} << 40);
  EXPECT_EQ(Ask(scheduler, workers[0], 0)->range.size(), std::uint64_t{1} << 22);
}

TEST(SchedulerTest, GoesOnWithTheNextPassWhileTheFirstIsOut) {
  Scheduler scheduler(Batches(100));
  scheduler.OpenPass(kFirst, 100);
  scheduler.OpenPass(kSecond, 100);
  EXPECT_EQ(Ask(scheduler, scheduler.AddWorker("a", At(0)).value(), 0)->pass, kFirst);
  EXPECT_EQ(Ask(scheduler, scheduler.AddWorker("b", At(0)).value(), 0)->pass, kSecond);
}

TEST(SchedulerTest, LeavesTheLastBatchToAnIdleWorker) {
  Scheduler scheduler(Batches(50));
  const auto busy = scheduler.AddWorker("busy", At(0)).value();
  const auto idle = scheduler.AddWorker("idle", At(0)).value();
  scheduler.OpenPass(kFirst, 100);
  const auto held = Ask(scheduler, busy, 0);
  ASSERT_TRUE(held);
  EXPECT_FALSE(Ask(scheduler, busy, 0, {held->id}));
  EXPECT_TRUE(Ask(scheduler, idle, 0));
}

TEST(SchedulerTest, LendsAheadWhenThereIsEnoughForAll) {
  Scheduler scheduler(Batches(50));
  const auto busy = scheduler.AddWorker("busy", At(0)).value();
  const auto idle = scheduler.AddWorker("idle", At(0)).value();
  scheduler.OpenPass(kFirst, 150);
  const auto held = Ask(scheduler, busy, 0);
  EXPECT_TRUE(Ask(scheduler, busy, 0, {held->id}));
  EXPECT_TRUE(Ask(scheduler, idle, 0));
}

TEST(SchedulerTest, TakesBackALeaseThatRunsOutAndLendsTheSameRangeFirst) {
  Scheduler scheduler(Batches(50));
  const auto silent = scheduler.AddWorker("silent", At(0)).value();
  const auto other = scheduler.AddWorker("other", At(0)).value();
  scheduler.OpenPass(kFirst, 150);
  const auto lost = Ask(scheduler, silent, 0);
  EXPECT_EQ(Ask(scheduler, other, 9)->range, (WorkRange{50, 100}));
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
  const auto killed = scheduler.AddWorker("killed", At(0)).value();
  const auto other = scheduler.AddWorker("other", At(0)).value();
  scheduler.OpenPass(kFirst, 100);
  const auto lost = Ask(scheduler, killed, 0);
  EXPECT_EQ(scheduler.LiveWorkers(), 2);
  scheduler.LoseWorker(killed);
  EXPECT_EQ(scheduler.LiveWorkers(), 1);
  EXPECT_EQ(Ask(scheduler, other, 0.1)->range, lost->range);
}

TEST(SchedulerTest, ForgetsASilentWorkerAndTellsItSo) {
  Scheduler scheduler({});
  const auto worker = scheduler.AddWorker("w", At(0)).value();
  scheduler.Expire(At(29));
  EXPECT_TRUE(scheduler.TakeReport(worker, {}, At(29)).ok());
  scheduler.Expire(At(58));
  EXPECT_EQ(scheduler.LiveWorkers(), 1);
  scheduler.Expire(At(59));
  EXPECT_TRUE(absl::IsNotFound(scheduler.TakeReport(worker, {}, At(59))));
  EXPECT_EQ(scheduler.LiveWorkers(), 0);
}

TEST(SchedulerTest, TakesBackWhatAWorkerThatAsksNoLongerMentions) {
  Scheduler scheduler(Batches(100));
  const auto worker = scheduler.AddWorker("w", At(0)).value();
  scheduler.OpenPass(kFirst, 100);
  const auto dropped = Ask(scheduler, worker, 0);
  const auto again = Ask(scheduler, worker, 1);
  ASSERT_TRUE(again);
  EXPECT_EQ(again->range, dropped->range);
  EXPECT_NE(again->id, dropped->id);
}

TEST(SchedulerTest, AHeartbeatThatCrossesANewLeaseDoesNotTakeItBack) {
  Scheduler scheduler(Batches(100));
  const auto worker = scheduler.AddWorker("w", At(0)).value();
  scheduler.OpenPass(kFirst, 100);
  const auto lease = Ask(scheduler, worker, 0);
  EXPECT_TRUE(Revoked(scheduler, worker, {}, 0.1).empty());
  EXPECT_TRUE(Revoked(scheduler, worker, {lease->id}, 0.2).empty());
}

TEST(SchedulerTest, RevokesWhatIsOfNoUseAnyMore) {
  Scheduler scheduler(Batches(100));
  const auto worker = scheduler.AddWorker("w", At(0)).value();
  scheduler.OpenPass(kFirst, 100);
  scheduler.OpenPass(kSecond, 100);
  const auto first = Ask(scheduler, worker, 0);
  const auto second = Ask(scheduler, worker, 0, {first->id});
  ASSERT_TRUE(second);
  scheduler.Commit(kFirst, first->range, At(1));
  EXPECT_EQ(Revoked(scheduler, worker, {first->id, second->id}, 1), (std::vector{first->id}));
  scheduler.Close(kSecond);
  EXPECT_EQ(Revoked(scheduler, worker, {second->id}, 1), (std::vector{second->id}));
}

TEST(SchedulerTest, DoesNotLendARangeThatALateAnswerHasBrought) {
  Scheduler scheduler(Batches(100));
  const auto late = scheduler.AddWorker("late", At(0)).value();
  scheduler.OpenPass(kFirst, 100);
  const auto lease = Ask(scheduler, late, 0);
  scheduler.LoseWorker(late);
  scheduler.Commit(kFirst, lease->range, At(1));
  EXPECT_FALSE(Ask(scheduler, scheduler.AddWorker("other", At(1)).value(), 1));
}

// Three batches of one second each, and a fourth that is out since `now_s` = 3.
struct Straggling {
  Scheduler scheduler{Batches(100)};
  std::string slow = scheduler.AddWorker("slow", At(0)).value();
  std::string idle = scheduler.AddWorker("idle", At(0)).value();
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

TEST(SchedulerTest, LendsAStragglersBatchASecondTimeAndAThirdAndNotAFourth) {
  Straggling s;
  EXPECT_FALSE(Ask(s.scheduler, s.idle, 5.9)) << "not yet three times the median";
  const auto doubled = Ask(s.scheduler, s.idle, 6.1);
  ASSERT_TRUE(doubled);
  EXPECT_EQ(doubled->range, s.lease->range);
  const auto third_worker = s.scheduler.AddWorker("third", At(9)).value();
  EXPECT_FALSE(Ask(s.scheduler, third_worker, 9)) << "the second has not had its time";
  const auto third = Ask(s.scheduler, third_worker, 9.2);
  ASSERT_TRUE(third);
  EXPECT_EQ(third->range, s.lease->range);
  EXPECT_FALSE(Ask(s.scheduler, s.scheduler.AddWorker("fourth", At(20)).value(), 20));
  s.scheduler.Commit(kFirst, doubled->range, At(21));
  EXPECT_EQ(Revoked(s.scheduler, s.slow, {s.lease->id}, 21), (std::vector{s.lease->id}));
  EXPECT_EQ(Revoked(s.scheduler, third_worker, {third->id}, 21), (std::vector{third->id}));
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
    const auto worker = scheduler.AddWorker(absl::StrCat("host", i), At(i)).value();
    Fail(scheduler, worker, Ask(scheduler, worker, i).value(), i);
  }
  const auto poisoned = scheduler.TakePoisoned();
  ASSERT_EQ(poisoned.size(), 1U);
  EXPECT_EQ(poisoned[0].pass, kFirst);
  EXPECT_NE(poisoned[0].message.find("host2"), std::string::npos) << poisoned[0].message;
}

TEST(SchedulerTest, PoisonsABatchThatALoneWorkerCannotDo) {
  Scheduler scheduler(Batches(100));
  scheduler.OpenPass(kFirst, 100);
  const auto worker = scheduler.AddWorker("lone", At(0)).value();
  int tries = 0;
  for (; tries < 100 && scheduler.TakePoisoned().empty(); ++tries) {
    Fail(scheduler, worker, Ask(scheduler, worker, tries).value(), tries);
  }
  EXPECT_EQ(tries, 3);
}

TEST(SchedulerTest, SaysWhyAWorkerLostWhatItHeld) {
  Scheduler scheduler(Batches(100));
  scheduler.OpenPass(kFirst, 400);
  const auto failing = scheduler.AddWorker("failing", At(0)).value();
  Fail(scheduler, failing, Ask(scheduler, failing, 0).value(), 0);
  const auto broken = scheduler.AddWorker("broken", At(0)).value();
  ASSERT_TRUE(Ask(scheduler, broken, 0));
  scheduler.LoseWorker(broken);
  const auto silent = scheduler.AddWorker("silent", At(1)).value();
  ASSERT_TRUE(Ask(scheduler, silent, 1));
  scheduler.Expire(At(12));
  scheduler.RemoveWorker(failing);
  scheduler.Expire(At(40));
  const auto losses = scheduler.TakeLosses();
  const auto reasons_of = [&](const std::string& name) {
    std::vector<std::string> reasons;
    for (const Scheduler::Loss& loss : losses) {
      if (loss.name == name) reasons.push_back(loss.reason);
    }
    return reasons;
  };
  EXPECT_EQ(
      reasons_of("failing"),
      (std::vector<std::string>{"failed at photons 0 to 100 of pass 0 of job job: out of memory"}))
      << "leaving in order is no loss";
  EXPECT_EQ(reasons_of("broken"),
            (std::vector<std::string>{
                "vanished: its connection broke; leases that it held and that go back: 1",
                "is given up: it crashed or was cut off, and did not come back within 30 s; leases "
                "that count as crashed: 1"}));
  EXPECT_EQ(reasons_of("silent"),
            (std::vector<std::string>{
                "was not heard of for 10 s: photons 0 to 100 of pass 0 of job job goes back",
                "is given up: it crashed or was cut off, and did not come back within 30 s; leases "
                "that count as crashed: 1"}));
  EXPECT_TRUE(scheduler.TakeLosses().empty());
}

TEST(SchedulerTest, SaysHowLeasesOfTracedJobsEnded) {
  Scheduler scheduler(Batches(100));
  const auto lose_one = [&](const PassKey& pass) {
    scheduler.OpenPass(pass, 100);
    const auto worker = scheduler.AddWorker("host", At(1)).value();
    ASSERT_TRUE(Ask(scheduler, worker, 1));
    scheduler.LoseWorker(worker);
    scheduler.Close(pass);
  };
  lose_one(kFirst);
  EXPECT_TRUE(scheduler.TakeEnded().empty()) << "of a job that is not traced";
  scheduler.SetTraced("job", true);
  lose_one(kFirst);
  auto ended = scheduler.TakeEnded();
  ASSERT_EQ(ended.size(), 1U);
  EXPECT_EQ(ended[0].job_id, "job");
  EXPECT_EQ(ended[0].name, "host");
  EXPECT_EQ(ended[0].work, "photons 0 to 100 of pass 0");
  EXPECT_EQ(ended[0].ending, "interrupted");
  EXPECT_EQ(ended[0].lent_at, At(1));

  scheduler.OpenPass(kSecond, 100);
  const auto worker = scheduler.AddWorker("other", At(2)).value();
  const auto lease = Ask(scheduler, worker, 2);
  ASSERT_TRUE(lease);
  ASSERT_TRUE(scheduler.TakeResult({worker, *lease}, Digest(), At(3)).ok());
  EXPECT_TRUE(scheduler.TakeEnded().empty()) << "it ends when its result is merged";
  scheduler.Commit(kSecond, lease->range, At(3));
  ended = scheduler.TakeEnded();
  ASSERT_EQ(ended.size(), 1U);
  EXPECT_EQ(ended[0].ending, "delivered");
  scheduler.SetTraced("job", false);
  lose_one(kFirst);
  EXPECT_TRUE(scheduler.TakeEnded().empty());
}

TEST(SchedulerTest, AGoodbyeIsNoFailure) {
  Scheduler scheduler(Batches(100));
  scheduler.OpenPass(kFirst, 100);
  for (int i = 0; i < 10; ++i) {
    const auto worker = scheduler.AddWorker("w", At(i)).value();
    ASSERT_TRUE(Ask(scheduler, worker, i));
    scheduler.RemoveWorker(worker);
  }
  EXPECT_TRUE(scheduler.TakePoisoned().empty());
}

// Rounds: slices of passes instead of batches of photons.
// ---------------------------------------------------------------------------------------------

const PassKey kRound64 = {"job", 64};  // of 8 passes
const PassKey kRound72 = {"job", 72};

// Takes slices as `worker` and hands each in after `seconds_a_pass`, from `now_s` on, until there
// are none.
std::vector<WorkRange> TakeAll(Scheduler& scheduler, const std::string& worker,
                               double seconds_a_pass = 1, double now_s = 0) {
  std::vector<WorkRange> slices;
  while (const auto lease = Ask(scheduler, worker, now_s)) {
    slices.push_back(lease->range);
    now_s += seconds_a_pass * static_cast<double>(lease->range.size());
    scheduler.Commit(lease->pass, lease->range, At(now_s));
  }
  return slices;
}

void ExpectSlices(const std::vector<WorkRange>& slices, std::uint64_t first, std::uint64_t last) {
  for (const WorkRange& slice : slices) {
    EXPECT_EQ(slice.first, first) << "in order and without a gap";
    EXPECT_TRUE(IsSlice({slice.first, slice.last})) << slice.first << " " << slice.last;
    first = slice.last;
  }
  EXPECT_EQ(first, last);
}

TEST(SchedulerRoundTest, LendsEachPassOnceInSlicesOfTheRound) {
  for (std::uint64_t first = 0; first < 700; first = RoundOf(first).last) {
    for (const int workers : {1, 3, 100}) {
      const PassRange round = RoundOf(first);
      Scheduler scheduler({});
      std::vector<std::string> all;
      for (int i = 0; i < workers; ++i)
        all.push_back(scheduler.AddWorker("w", At(0)).value());
      const PassKey key = {"job", round.first};
      scheduler.OpenRound(key, {round.first, round.last}, {});
      const auto lease = Ask(scheduler, all[0], 0);
      ASSERT_TRUE(lease);
      EXPECT_EQ(lease->kind, WorkKind::kPasses);
      EXPECT_EQ(lease->pass, key);
      scheduler.Commit(key, lease->range, At(1));
      std::vector<WorkRange> slices = TakeAll(scheduler, all[0]);
      slices.insert(slices.begin(), lease->range);
      ExpectSlices(slices, round.first, round.last);
    }
  }
}

// A job may end within a round: slices end there too, and are aligned all the same.
TEST(SchedulerRoundTest, LendsPartOfARoundInSlices) {
  for (std::uint64_t last = 65; last <= 72; ++last) {
    Scheduler scheduler({});
    const auto worker = scheduler.AddWorker("w", At(0)).value();
    scheduler.OpenRound(kRound64, {64, last}, {});
    ExpectSlices(TakeAll(scheduler, worker), 64, last);
  }
}

// Every further worker would be sent all hitpoints.
TEST(SchedulerTest, SplitsAPassAmongAFewWorkersAtMost) {
  SchedulerOptions options;
  options.max_split_ways = 4;
  options.min_batch = 10;
  Scheduler scheduler(options);
  std::vector<std::string> workers;
  for (int i = 0; i < 10; ++i)
    workers.push_back(scheduler.AddWorker("w", At(0)).value());
  scheduler.OpenPass({"job", 0}, 1000);
  int lent = 0;
  for (const std::string& worker : workers) {
    const auto lease = Ask(scheduler, worker, 0);
    if (!lease) continue;
    ++lent;
    EXPECT_EQ(lease->range.size(), 250U);
  }
  EXPECT_EQ(lent, 4);
}

// One worker finds a second slice while it works on its first; many share the passes that are open,
// two slices each, down to single passes.
TEST(SchedulerRoundTest, SlicesAreShorterTheMoreWorkersThereAre) {
  const PassKey key = {"job", 512};  // of 64 passes
  const auto first_slice = [&](int workers) {
    Scheduler scheduler({});
    std::string worker;
    for (int i = 0; i < workers; ++i)
      worker = scheduler.AddWorker("w", At(0)).value();
    scheduler.OpenRound(key, {512, 576}, {});
    return Ask(scheduler, worker, 0)->range.size();
  };
  EXPECT_EQ(first_slice(1), SchedulerOptions().max_slice);
  EXPECT_EQ(first_slice(2), 16U);
  EXPECT_EQ(first_slice(3), 8U);  // 64 / 6, rounded down to a power of two
  EXPECT_EQ(first_slice(4), 8U);
  EXPECT_EQ(first_slice(16), 2U);
  EXPECT_EQ(first_slice(33), 1U);
  EXPECT_EQ(first_slice(1000), 1U);
}

// Each pass of them brings the looks of surfaces too.
TEST(SchedulerRoundTest, SlicesOfTheFirstPassesAreOfOnePass) {
  for (const std::uint64_t first : {14U, 16U}) {
    Scheduler scheduler({});
    const auto worker = scheduler.AddWorker("w", At(0)).value();
    const PassRange round = RoundOf(first);
    scheduler.OpenRound({"job", round.first}, {round.first, round.last}, {});
    EXPECT_EQ(Ask(scheduler, worker, 0)->range.size(), first < 16 ? 1U : round.size() / 2);
  }
}

// A worker traces 30 s for one at most, if its passes take less than that, however long they wait
// for others and for the network.
TEST(SchedulerRoundTest, SlicesAreShorterTheLongerPassesTake) {
  const PassKey key = {"job", 512};  // of 64 passes
  const auto second_slice = [&](double pass_s, double waiting_s = 0) {
    constexpr int kThreads = 4;
    Scheduler scheduler({});
    const auto worker = scheduler.AddWorker("w", At(0), {}, {}, kThreads).value();
    scheduler.OpenRound(key, {512, 576}, {});
    const auto lease = Ask(scheduler, worker, 0);
    EXPECT_EQ(lease->range.size(), 16U) << "nothing is known of how long a pass takes";
    const double tracing = pass_s * static_cast<double>(lease->range.size());
    const double took = tracing + waiting_s;
    // Heard of now and then.
    for (double now = 5; now < took; now += 5)
      EXPECT_TRUE(Revoked(scheduler, worker, {lease->id}, now).empty());
    scheduler.Commit(key, lease->range, At(took));
    scheduler.CountWork(
        worker, key.job_id, WorkKind::kPasses, lease->range.size(),
        std::chrono::duration_cast<Duration>(std::chrono::duration<double>(kThreads * tracing)));
    return Ask(scheduler, worker, took)->range.size();
  };
  EXPECT_EQ(second_slice(1), 16U);
  EXPECT_EQ(second_slice(1, 100), 16U);
  EXPECT_EQ(second_slice(3.7), 8U);
  EXPECT_EQ(second_slice(10), 2U);
  EXPECT_EQ(second_slice(40), 1U);
}

TEST(SchedulerRoundTest, AllRoundsThatAreOpenAreShared) {
  Scheduler scheduler({});
  const auto worker = scheduler.AddWorker("w", At(0)).value();
  scheduler.OpenRound(kRound64, {64, 72}, {});
  scheduler.OpenRound(kRound72, {72, 80}, {});
  // 16 passes for one worker, of which a round has 8.
  EXPECT_EQ(Ask(scheduler, worker, 0)->range, (WorkRange{64, 72}));
}

TEST(SchedulerRoundTest, AWorkerThatHasLeftHasNoShare) {
  Scheduler scheduler({});
  const auto worker = scheduler.AddWorker("w", At(0)).value();
  const auto lost = scheduler.AddWorker("lost", At(0)).value();
  scheduler.LoseWorker(lost);
  scheduler.OpenRound(kRound64, {64, 72}, {});
  EXPECT_EQ(Ask(scheduler, worker, 0)->range.size(), 4U);
}

// What is not done when time is up is lost. Until it is known how long a pass takes, slices are as
// short as can be; then none takes more than four fifths of the time that is left.
TEST(SchedulerRoundTest, SlicesAreShortWhenTimeRunsOut) {
  const PassKey key = {"job", 512};
  Scheduler scheduler({});
  const auto worker = scheduler.AddWorker("w", At(0)).value();
  scheduler.OpenRound(key, {512, 576}, At(100));
  double now = 0;
  std::vector<std::uint64_t> sizes;
  std::uint64_t next = 512;
  while (const auto lease = Ask(scheduler, worker, now)) {
    EXPECT_EQ(lease->range.first, next);
    EXPECT_TRUE(IsSlice({lease->range.first, lease->range.last}));
    next = lease->range.last;
    sizes.push_back(lease->range.size());
    // A second a pass.
    if (sizes.size() > 1 && now < 99) {
      EXPECT_LE(static_cast<double>(sizes.back()), std::max(1.0, 0.8 * (100 - now))) << now;
    }
    now += static_cast<double>(lease->range.size());
    scheduler.Commit(key, lease->range, At(now));
  }
  EXPECT_EQ(next, 576U);
  EXPECT_EQ(sizes.front(), 1U) << "nothing is known of how long a pass takes";
  EXPECT_EQ(*std::ranges::max_element(sizes), 16U);
  // With more time left, near the end, and after it.
  scheduler.OpenRound({"job", 704}, {704, 768}, At(now + 20));
  EXPECT_EQ(Ask(scheduler, worker, now)->range.size(), 16U);
  scheduler.Close({"job", 704});
  scheduler.OpenRound({"job", 576}, {576, 640}, At(now + 2.4));
  EXPECT_EQ(Ask(scheduler, worker, now)->range.size(), 1U);
  scheduler.Close({"job", 576});
  scheduler.OpenRound({"job", 640}, {640, 704}, At(now - 1));
  EXPECT_EQ(Ask(scheduler, worker, now)->range.size(), 1U);
}

// By the pace of the worker that it is for: a slow one takes less than a quick one.
TEST(SchedulerRoundTest, SlicesNearTheEndFollowTheWorkersOwnPace) {
  const PassKey key = {"job", 512};
  Scheduler scheduler({});
  const auto quick = scheduler.AddWorker("quick", At(0)).value();
  const auto slow = scheduler.AddWorker("slow", At(0)).value();
  scheduler.OpenRound(key, {512, 576}, At(100));
  const auto of_quick = Ask(scheduler, quick, 0);
  const auto of_slow = Ask(scheduler, slow, 0);
  ASSERT_TRUE(of_quick && of_slow);
  scheduler.Commit(key, of_quick->range, At(1));
  scheduler.Commit(key, of_slow->range, At(8));
  // A pass takes the one 1 s and the other 8 s. Of the 8 s that may be used the first would take
  // all, but begins at a multiple of two.
  EXPECT_EQ(Ask(scheduler, quick, 90)->range, (WorkRange{514, 516}));
  EXPECT_EQ(Ask(scheduler, slow, 90)->range, (WorkRange{516, 517}));
}

TEST(SchedulerRoundTest, TimesOfPhotonsSayNothingOfPasses) {
  Scheduler scheduler(Batches(100));
  const auto worker = scheduler.AddWorker("w", At(0)).value();
  scheduler.OpenPass(kFirst, 400);
  for (int i = 0; i < 4; ++i)
    scheduler.Commit(kFirst, Ask(scheduler, worker, i)->range, At(i + 1));
  scheduler.Close(kFirst);
  scheduler.OpenRound({"job", 512}, {512, 576}, At(1e6));
  EXPECT_EQ(Ask(scheduler, worker, 4)->range.size(), 1U);
}

// A slice goes out again as it was: another part of the round would overlap it when it comes back
// after all.
TEST(SchedulerRoundTest, SlicesThatComeBackGoOutFirstAndUnchanged) {
  const PassKey key = {"job", 512};
  Scheduler scheduler({});
  const auto lost = scheduler.AddWorker("lost", At(0)).value();
  scheduler.OpenRound(key, {512, 576}, {});
  const auto lease = Ask(scheduler, lost, 0);
  ASSERT_EQ(lease->range, (WorkRange{512, 528}));
  std::vector<std::string> others;
  for (int i = 0; i < 50; ++i)
    others.push_back(scheduler.AddWorker("other", At(0)).value());
  EXPECT_EQ(Ask(scheduler, others[0], 0)->range, (WorkRange{528, 529}));
  scheduler.LoseWorker(lost);
  const auto again = Ask(scheduler, others[1], 1);
  ASSERT_TRUE(again);
  EXPECT_EQ(again->range, lease->range);
  EXPECT_NE(again->id, lease->id);
  EXPECT_EQ(Ask(scheduler, others[2], 1)->range, (WorkRange{529, 530}));
}

// After slices of one pass comes no slice of four before the next multiple of four.
TEST(SchedulerRoundTest, SlicesStayAlignedWhenWorkersComeAndGo) {
  const PassKey key = {"job", 512};
  Scheduler scheduler({});
  const auto worker = scheduler.AddWorker("w", At(0)).value();
  scheduler.OpenRound(key, {512, 576}, {});
  std::vector<WorkRange> slices;
  std::vector<std::string> others;
  for (int step = 0; const auto lease = Ask(scheduler, worker, step); ++step) {
    slices.push_back(lease->range);
    scheduler.Commit(key, lease->range, At(step));
    // 1, 41 and 11 workers in turn.
    while (others.size() < (step % 3 == 0 ? 40U : 0U))
      others.push_back(scheduler.AddWorker("other", At(step)).value());
    while (others.size() > (step % 3 == 1 ? 10U : 0U) && step % 3 != 0) {
      scheduler.RemoveWorker(others.back());
      others.pop_back();
    }
  }
  ExpectSlices(slices, 512, 576);
  std::set<std::uint64_t> sizes;
  for (const WorkRange& slice : slices)
    sizes.insert(slice.size());
  EXPECT_GE(sizes.size(), 3U);
}

TEST(SchedulerRoundTest, ASliceThatALateAnswerHasBroughtIsNotLentAgain) {
  Scheduler scheduler({});
  const auto late = scheduler.AddWorker("late", At(0)).value();
  scheduler.OpenRound(kRound64, {64, 65}, {});
  const auto lease = Ask(scheduler, late, 0);
  scheduler.LoseWorker(late);
  scheduler.Commit(kRound64, lease->range, At(1));
  EXPECT_FALSE(Ask(scheduler, scheduler.AddWorker("other", At(1)).value(), 1));
}

TEST(SchedulerRoundTest, ARoundEndsEarlierAndLater) {
  Scheduler scheduler({});
  std::vector<std::string> workers;
  for (int i = 0; i < 8; ++i)
    workers.push_back(scheduler.AddWorker("w", At(0)).value());
  scheduler.OpenRound(kRound64, {64, 72}, {});
  const auto first = Ask(scheduler, workers[0], 0);
  ASSERT_EQ(first->range, (WorkRange{64, 65}));
  // Earlier than what has been lent: that stays, and no more is lent.
  scheduler.SetRoundEnd(kRound64, 64, {});
  EXPECT_FALSE(Ask(scheduler, workers[1], 0));
  EXPECT_TRUE(Revoked(scheduler, workers[0], {first->id}, 0).empty());
  // Later: goes on where it stopped.
  scheduler.SetRoundEnd(kRound64, 67, {});
  EXPECT_EQ(Ask(scheduler, workers[1], 0)->range, (WorkRange{65, 66}));
  EXPECT_EQ(Ask(scheduler, workers[2], 0)->range, (WorkRange{66, 67}));
  EXPECT_FALSE(Ask(scheduler, workers[3], 0));
  scheduler.SetRoundEnd(kRound64, 72, {});
  EXPECT_EQ(Ask(scheduler, workers[3], 0)->range, (WorkRange{67, 68}));
  // Of what is not open, and of passes that are split, there is no end to change.
  scheduler.SetRoundEnd(kRound72, 73, {});
  scheduler.OpenPass(kFirst, 5000);
  scheduler.SetRoundEnd(kFirst, 1, {});
  EXPECT_EQ(Ask(scheduler, workers[4], 0)->range, (WorkRange{0, 4096}));
}

TEST(SchedulerRoundTest, ANewTimeLimitMakesSlicesShorter) {
  Scheduler scheduler({});
  const auto worker = scheduler.AddWorker("w", At(0)).value();
  scheduler.OpenRound(kRound64, {64, 72}, {});
  scheduler.SetRoundEnd(kRound64, 72, At(10));
  EXPECT_EQ(Ask(scheduler, worker, 0)->range.size(), 1U);
}

TEST(SchedulerRoundTest, AClosedRoundRevokesItsSlices) {
  Scheduler scheduler({});
  const auto worker = scheduler.AddWorker("w", At(0)).value();
  scheduler.OpenRound(kRound64, {64, 72}, {});
  const auto lease = Ask(scheduler, worker, 0);
  scheduler.Close(kRound64);
  EXPECT_EQ(Revoked(scheduler, worker, {lease->id}, 1), (std::vector{lease->id}));
  EXPECT_FALSE(Ask(scheduler, worker, 1));
}

// Slices of eight passes take eight times as long as those of one: a straggler is measured by the
// passes it has.
TEST(SchedulerRoundTest, ALongSliceIsNoStraggler) {
  constexpr double kPass = 3;  // usual time [s]
  constexpr double kBegin = 3 * kPass;
  Scheduler scheduler({});
  const auto quick = scheduler.AddWorker("quick", At(0)).value();
  for (std::uint64_t first = 0; first < 3; ++first) {
    const PassKey key = {"job", first};
    scheduler.OpenRound(key, {first, first + 1}, {});
    const double now = kPass * static_cast<double>(first);
    scheduler.Commit(key, Ask(scheduler, quick, now)->range, At(now + kPass));
    scheduler.Close(key);
  }
  scheduler.OpenRound(kRound64, {64, 72}, {});
  scheduler.OpenRound(kRound72, {72, 80}, {});
  const auto slow = scheduler.AddWorker("slow", At(kBegin)).value();
  scheduler.RemoveWorker(quick);
  ASSERT_EQ(Ask(scheduler, slow, kBegin)->range, (WorkRange{64, 72}));
  const auto idle = scheduler.AddWorker("idle", At(kBegin)).value();
  while (const auto lease = Ask(scheduler, idle, kBegin))
    scheduler.Commit(lease->pass, lease->range,
                     At(kBegin + kPass * static_cast<double>(lease->range.size())));
  EXPECT_FALSE(Ask(scheduler, idle, kBegin + 3 * kPass + 1))
      << "three times the usual time of one pass";
  EXPECT_FALSE(Ask(scheduler, idle, kBegin + 3 * 8 * kPass - 1));
  const auto doubled = Ask(scheduler, idle, kBegin + 3 * 8 * kPass + 1);
  ASSERT_TRUE(doubled);
  EXPECT_EQ(doubled->range, (WorkRange{64, 72}));
}

TEST(SchedulerRoundTest, ASliceAtWhichThreeWorkersFailedNamesItsPasses) {
  Scheduler scheduler({});
  scheduler.OpenRound(kRound64, {64, 66}, {});
  for (int i = 0; i < 3; ++i) {
    const auto worker = scheduler.AddWorker("w", At(i)).value();
    Fail(scheduler, worker, Ask(scheduler, worker, i).value(), i);
  }
  const auto poisoned = scheduler.TakePoisoned();
  ASSERT_EQ(poisoned.size(), 1U);
  EXPECT_EQ(poisoned[0].pass, kRound64);
  EXPECT_TRUE(poisoned[0].message.starts_with("passes 64 to ")) << poisoned[0].message;
}

// A slice that fails is cut down to the pass that is bad; all others are traced.
TEST(SchedulerRoundTest, OnlyTheBadPassOfASliceIsPoisoned) {
  Scheduler scheduler({});
  scheduler.OpenRound(kRound64, {64, 72}, {});
  constexpr std::uint64_t kBad = 66;
  std::uint64_t done = 0;
  int failures = 0;
  for (int i = 0; i < 30; ++i) {
    const auto worker = scheduler.AddWorker(absl::StrCat("host", i), At(i)).value();
    const auto lease = Ask(scheduler, worker, i);
    if (!lease) break;
    if (lease->range.first <= kBad && kBad < lease->range.last) {
      Fail(scheduler, worker, *lease, i);
      ++failures;
    } else {
      scheduler.Commit(lease->pass, lease->range, At(i));
      done += lease->range.size();
    }
    scheduler.RemoveWorker(worker);
  }
  EXPECT_EQ(done, 7U);
  // Three at a slice of four passes, then one at two passes and one at the bad one.
  EXPECT_EQ(failures, 5);
  const auto poisoned = scheduler.TakePoisoned();
  ASSERT_EQ(poisoned.size(), 1U);
  EXPECT_TRUE(poisoned[0].message.starts_with("passes 66 to 67 ")) << poisoned[0].message;
}

}  // namespace
}  // namespace lucerna
