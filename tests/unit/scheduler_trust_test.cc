// What a worker may hand in, what is held against it, and which results are believed: only the
// holder of a lease delivers its batch, a connection that breaks is not a crash, a worker that only
// reports holds up nothing, and a wrong result does not get into the image. Time is an argument.
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "gtest/gtest.h"

#include "server/scheduler.h"
#include "tests/support/steady_time.h"

namespace lucerna {
namespace {

using Standing = Scheduler::Standing;

const PassKey kPass = {"job", 0};
const PassKey kNext = {"job", 1};

class SchedulerTrustTest : public testing::Test {
 protected:
  static SchedulerOptions Options() {
    SchedulerOptions options;
    options.fixed_batch = 100;
    options.audit_secret = "secret";
    return options;
  }
  static SchedulerOptions Audited() {
    SchedulerOptions options = Options();
    options.audit_share = 1;
    return options;
  }

  explicit SchedulerTrustTest(const SchedulerOptions& options = Options()) : scheduler_(options) {}

  std::string Join(const std::string& name, double now_s = 0, const std::string& identity = {}) {
    return scheduler_.AddWorker(name, At(now_s), identity).value();
  }
  std::optional<BatchLease> Ask(const std::string& worker, double now_s,
                                std::vector<std::string> held = {}) {
    Scheduler::Report report;
    report.held = std::move(held);
    report.wants_lease = true;
    EXPECT_TRUE(scheduler_.TakeReport(worker, report, At(now_s)).ok());
    const auto answer = scheduler_.AnswerFor(worker, report, At(now_s));
    EXPECT_TRUE(answer.ok());
    return answer.ok() ? answer->lease : std::nullopt;
  }
  // A heartbeat; false when the lease is revoked.
  bool Renew(const std::string& worker, const BatchLease& lease, double now_s) {
    Scheduler::Report report;
    report.held = {lease.id};
    EXPECT_TRUE(scheduler_.TakeReport(worker, report, At(now_s)).ok());
    return scheduler_.AnswerFor(worker, report, At(now_s))->revoked.empty();
  }
  void Fail(const std::string& worker, const BatchLease& lease, double now_s) {
    Scheduler::Report report;
    report.failures = {{lease.id, "out of memory"}};
    EXPECT_TRUE(scheduler_.TakeReport(worker, report, At(now_s)).ok());
  }
  StatusOr<Standing> StandingOf(const std::string& worker, const BatchLease& lease) {
    return scheduler_.StandingOf({worker, lease});
  }
  // Hands in a result, and merges it when it is to be. The status is that of TakeResult.
  StatusOr<Scheduler::Taken> Deliver(const std::string& worker, const BatchLease& lease,
                                     double now_s, const std::string& bytes = "right") {
    const auto taken = scheduler_.TakeResult({worker, lease}, Sha256(bytes), At(now_s));
    if (taken.ok() && taken->standing == Standing::kExpected && !taken->is_held) {
      scheduler_.Commit(lease.pass, lease.range, At(now_s));
    }
    return taken;
  }
  WorkerRecord RecordOf(const std::string& worker) { return *scheduler_.RecordOf(worker); }
  // The workers get a batch each in turn and deliver it after a second, `batches` in all: from then
  // on it is known how long one takes.
  void LearnTimes(const std::string& worker, int batches, double now_s) {
    for (int i = 0; i < batches; ++i)
      EXPECT_TRUE(Deliver(worker, Ask(worker, now_s + i).value(), now_s + i + 1).ok());
  }

  Scheduler scheduler_;
};

class SchedulerAuditTest : public SchedulerTrustTest {
 protected:
  SchedulerAuditTest() : SchedulerTrustTest(Audited()) {}
};

// Leases ----------------------------------------------------------------------------------------

TEST_F(SchedulerTrustTest, IdsOfRegistrationsAndLeasesCannotBeGuessed) {
  scheduler_.OpenPass(kPass, 200);
  const std::string worker = Join("w");
  const auto first = Ask(worker, 0);
  const auto second = Ask(worker, 0, {first->id});
  EXPECT_EQ(worker.size(), 32U);
  EXPECT_EQ(first->id.size(), 32U);
  EXPECT_NE(first->id.substr(0, 16), second->id.substr(0, 16));
  EXPECT_NE(first->id.substr(16), second->id.substr(16));
}

TEST_F(SchedulerTrustTest, OnlyTheHolderOfALeaseDeliversAndOnlyItsWork) {
  scheduler_.OpenPass(kPass, 200);
  scheduler_.OpenPass(kNext, 200);
  const std::string holder = Join("holder");
  const std::string other = Join("other");
  const BatchLease lease = Ask(holder, 0).value();
  EXPECT_EQ(StandingOf(holder, lease).value(), Standing::kExpected);
  EXPECT_TRUE(absl::IsPermissionDenied(StandingOf(other, lease).status()));
  EXPECT_TRUE(absl::IsFailedPrecondition(StandingOf("nobody", lease).status()));
  const auto refuses = [&](const std::function<void(BatchLease&)>& change) {
    BatchLease forged = lease;
    change(forged);
    return absl::IsFailedPrecondition(StandingOf(holder, forged).status()) &&
           absl::IsFailedPrecondition(Deliver(holder, forged, 0).status());
  };
  EXPECT_TRUE(refuses([](BatchLease& forged) { forged.id = "unknown"; }));
  EXPECT_TRUE(refuses([](BatchLease& forged) { forged.id.clear(); }));
  EXPECT_TRUE(refuses([](BatchLease& forged) { forged.range = {0, 99}; }));
  EXPECT_TRUE(refuses([](BatchLease& forged) { forged.range = {100, 200}; }));
  EXPECT_TRUE(refuses([](BatchLease& forged) { forged.kind = WorkKind::kPasses; }));
  EXPECT_TRUE(refuses([](BatchLease& forged) { forged.pass = kNext; }));
  EXPECT_EQ(RecordOf(holder).leases, LeaseCounts());
  EXPECT_TRUE(Deliver(holder, lease, 1).ok());
}

TEST_F(SchedulerTrustTest, ALeaseThatIsDeliveredOrOvertakenIsAnsweredPolitely) {
  scheduler_.OpenPass(kPass, 100);
  const std::string quick = Join("quick");
  const std::string slow = Join("slow");
  const BatchLease lost = Ask(slow, 0).value();
  scheduler_.LoseWorker(slow);
  const BatchLease again = Ask(quick, 1).value();
  ASSERT_EQ(again.range, lost.range);
  EXPECT_TRUE(Deliver(quick, again, 2).ok());
  EXPECT_EQ(StandingOf(quick, again).value(), Standing::kDuplicate);
  EXPECT_EQ(StandingOf(slow, lost).value(), Standing::kDuplicate);
  scheduler_.Close(kPass);
  EXPECT_EQ(StandingOf(quick, again).value(), Standing::kSuperseded);
  EXPECT_EQ(StandingOf(slow, lost).value(), Standing::kSuperseded);
}

// The work is done, and its bits are those of anyone.
TEST_F(SchedulerTrustTest, ALateResultCountsWhileItsBatchHasNoOther) {
  scheduler_.OpenPass(kPass, 100);
  const std::string late = Join("late");
  const BatchLease lease = Ask(late, 0).value();
  scheduler_.Expire(At(10));
  EXPECT_EQ(StandingOf(late, lease).value(), Standing::kExpected) << "nobody has it";
  BatchLease of_other_work = lease;
  of_other_work.range = {0, 50};
  EXPECT_TRUE(absl::IsFailedPrecondition(StandingOf(late, of_other_work).status()));
  const std::string other = Join("other", 11);
  ASSERT_TRUE(Ask(other, 11));
  EXPECT_EQ(StandingOf(late, lease).value(), Standing::kExpected) << "another has it";
  EXPECT_TRUE(Deliver(late, lease, 12).ok());
  EXPECT_FALSE(Ask(other, 13)) << "it is done";
}

TEST_F(SchedulerTrustTest, WhatWasGivenBackIsNotDelivered) {
  scheduler_.OpenPass(kPass, 200);
  const std::string worker = Join("w");
  const BatchLease failed = Ask(worker, 0).value();
  Fail(worker, failed, 1);
  EXPECT_TRUE(absl::IsFailedPrecondition(StandingOf(worker, failed).status()));
  const BatchLease dropped = Ask(worker, 2).value();
  ASSERT_TRUE(Ask(worker, 3)) << "mentions nothing";
  EXPECT_TRUE(absl::IsFailedPrecondition(StandingOf(worker, dropped).status()));
}

TEST_F(SchedulerTrustTest, ARefusedResultIsAFailureOfItsWorkerAlone) {
  scheduler_.OpenPass(kPass, 100);
  const std::string bad = Join("bad");
  const std::string good = Join("good");
  const BatchLease lease = Ask(bad, 0).value();
  scheduler_.RefuseResult({good, lease}, "not its lease");
  EXPECT_EQ(StandingOf(bad, lease).value(), Standing::kExpected);
  scheduler_.RefuseResult({bad, lease}, "garbage");
  EXPECT_TRUE(absl::IsFailedPrecondition(StandingOf(bad, lease).status()));
  EXPECT_EQ(RecordOf(bad).leases.failed, 1U);
  EXPECT_EQ(RecordOf(good).leases, LeaseCounts());
  EXPECT_EQ(Ask(good, 1).value().range, lease.range);
}

// Identity, losses and crashes --------------------------------------------------------------------

TEST_F(SchedulerTrustTest, AWorkerThatReconnectsIsTheSame) {
  scheduler_.OpenPass(kPass, 100);
  const std::string before = Join("host", 0, "identity");
  const BatchLease held = Ask(before, 0).value();
  const std::string after = Join("host", 1, "identity");
  EXPECT_NE(before, after);
  EXPECT_EQ(RecordOf(after).id, WorkerIdOf("identity"));
  EXPECT_NE(RecordOf(after).id, "identity") << "a list of workers gives nobody's identity away";
  EXPECT_EQ(scheduler_.Workers().size(), 1U);
  EXPECT_EQ(scheduler_.LiveWorkers(), 1);
  EXPECT_EQ(RecordOf(after).leases.lost, 1U);
  EXPECT_EQ(Ask(after, 1).value().range, held.range) << "what it held was dropped";
  EXPECT_TRUE(absl::IsFailedPrecondition(StandingOf(before, held).status()));
}

TEST_F(SchedulerTrustTest, ALinkThatFlapsPoisonsNothing) {
  scheduler_.OpenPass(kPass, 100);
  for (int i = 0; i < 50; ++i) {
    const std::string worker = Join("host", i, "identity");
    ASSERT_TRUE(Ask(worker, i));
    scheduler_.LoseWorker(worker);
  }
  scheduler_.Expire(At(60));
  EXPECT_TRUE(scheduler_.TakePoisoned().empty());
  const std::string back = Join("host", 60, "identity");
  EXPECT_EQ(RecordOf(back).leases, (LeaseCounts{.lost = 50}));
  EXPECT_EQ(RecordOf(back).state, WorkerState::kActive);
  EXPECT_TRUE(Ask(back, 60));
}

TEST_F(SchedulerTrustTest, AConnectionThatComesBackWithinTheRegistrationIsLostAndNoMore) {
  scheduler_.OpenPass(kPass, 100);
  const std::string worker = Join("w");
  ASSERT_TRUE(Ask(worker, 0));
  scheduler_.LoseWorker(worker);
  ASSERT_TRUE(Ask(worker, 5));
  EXPECT_EQ(RecordOf(worker).leases, (LeaseCounts{.lost = 1}));
}

TEST_F(SchedulerTrustTest, ABatchAtWhichThreeWorkersCrashedIsPoisoned) {
  scheduler_.OpenPass(kPass, 100);
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(scheduler_.TakePoisoned().empty());
    const std::string worker = Join(absl::StrCat("host", i), 40 * i);
    ASSERT_TRUE(Ask(worker, 40 * i));
    scheduler_.LoseWorker(worker);
    scheduler_.Expire(At(40 * i + 29));
    EXPECT_TRUE(scheduler_.TakePoisoned().empty()) << "it may come back";
    scheduler_.Expire(At(40 * i + 30));
  }
  const auto poisoned = scheduler_.TakePoisoned();
  ASSERT_EQ(poisoned.size(), 1U);
  EXPECT_NE(poisoned[0].message.find("photons 0 to 100 of pass 0 failed 3 times on 3 workers"),
            std::string::npos)
      << poisoned[0].message;
  EXPECT_NE(poisoned[0].message.find("host2"), std::string::npos);
}

// A container or a service that is started again has its name, and another identity.
TEST_F(SchedulerTrustTest, ANewProcessOfTheSameNameMeansThatTheOldOneCrashed) {
  scheduler_.OpenPass(kPass, 100);
  for (int i = 0; i < 3; ++i) {
    const std::string worker = Join("worker-0", i, absl::StrCat("identity ", i));
    EXPECT_TRUE(scheduler_.TakePoisoned().empty());
    ASSERT_TRUE(Ask(worker, i));
    scheduler_.LoseWorker(worker);
  }
  Join("worker-0", 3, "identity 3");
  EXPECT_EQ(scheduler_.TakePoisoned().size(), 1U);
}

TEST_F(SchedulerTrustTest, ACrashAtABatchThatAnotherHasIsNoPoisonYet) {
  scheduler_.OpenPass(kPass, 100);
  std::vector<std::string> crashed;
  for (int i = 0; i < 3; ++i) {
    crashed.push_back(Join(absl::StrCat("host", i), 0));
    ASSERT_TRUE(Ask(crashed.back(), 0));
    scheduler_.LoseWorker(crashed.back());
  }
  const std::string last = Join("last", 25);
  const BatchLease lease = Ask(last, 25).value();
  scheduler_.Expire(At(30));
  EXPECT_TRUE(scheduler_.TakePoisoned().empty()) << "the last may do it";
  Fail(last, lease, 31);
  EXPECT_EQ(scheduler_.TakePoisoned().size(), 1U);
}

TEST_F(SchedulerTrustTest, APoisonedBatchIsLentAgainWhenItIsReleased) {
  scheduler_.OpenPass(kPass, 100);
  const std::string lone = Join("lone");
  for (int i = 0; i < 3; ++i)
    Fail(lone, Ask(lone, i).value(), i);
  ASSERT_EQ(scheduler_.TakePoisoned().size(), 1U);
  EXPECT_FALSE(Ask(lone, 4));
  EXPECT_FALSE(scheduler_.TakeWaiting(At(4)));
  scheduler_.ReleasePoisoned("another job");
  EXPECT_FALSE(Ask(lone, 5));
  scheduler_.ReleasePoisoned("job");
  EXPECT_EQ(scheduler_.TakeWaiting(At(6)), lone);
  const auto lease = Ask(lone, 6);
  ASSERT_TRUE(lease);
  Fail(lone, *lease, 7);
  EXPECT_TRUE(scheduler_.TakePoisoned().empty()) << "counted from the beginning";
}

// Also of a batch that another worker still had when the job was paused.
TEST_F(SchedulerTrustTest, AJobThatGoesOnBeginsItsCountOfFailuresAnew) {
  scheduler_.OpenPass(kPass, 100);
  const std::string lone = Join("lone");
  for (int i = 0; i < 2; ++i)
    Fail(lone, Ask(lone, i).value(), i);
  scheduler_.SetHeld("job", true);
  EXPECT_FALSE(Ask(lone, 3));
  scheduler_.SetHeld("job", false);
  Fail(lone, Ask(lone, 4).value(), 4);
  EXPECT_TRUE(scheduler_.TakePoisoned().empty());
}

// The same passes with other radii: what was traced with the old ones must not count.
TEST_F(SchedulerTrustTest, ALateResultDoesNotCountWhenItsWorkWasOpenedAnew) {
  scheduler_.OpenPass(kPass, 100);
  const std::string late = Join("late");
  const BatchLease lease = Ask(late, 0).value();
  scheduler_.Expire(At(11));
  EXPECT_EQ(StandingOf(late, lease).value(), Standing::kExpected);
  scheduler_.Close(kPass);
  scheduler_.OpenPass(kPass, 100);
  EXPECT_EQ(StandingOf(late, lease).value(), Standing::kSuperseded);
}

TEST_F(SchedulerTrustTest, TheLastWorkerIsNotLeftOutAndItsBatchIsPoisoned) {
  scheduler_.OpenPass(kPass, 100);
  const std::string lone = Join("lone");
  for (int i = 0; i < 3; ++i)
    Fail(lone, Ask(lone, i).value(), i);
  EXPECT_EQ(RecordOf(lone).state, WorkerState::kActive);
  EXPECT_EQ(scheduler_.TakePoisoned().size(), 1U);
}

// Renewal -----------------------------------------------------------------------------------------

TEST_F(SchedulerTrustTest, ALeaseThatIsOnlyRenewedIsTakenBack) {
  scheduler_.OpenPass(kPass, 400);
  const std::string quick = Join("quick");
  LearnTimes(quick, 3, 0);
  const std::string hanging = Join("hanging", 3);
  const BatchLease lease = Ask(hanging, 3).value();
  double now = 3;
  while (now < 120 && Renew(hanging, lease, now)) {
    now += 3;
    Renew(quick, lease, now);  // is heard of too
    scheduler_.Expire(At(now));
  }
  // Batches take a second: 60 s, and until the next report.
  EXPECT_GE(now, 63);
  EXPECT_LE(now, 66);
  EXPECT_EQ(RecordOf(hanging).leases, (LeaseCounts{.stalled = 1}));
  EXPECT_EQ(Ask(quick, now).value().range, lease.range);
  EXPECT_EQ(StandingOf(hanging, lease).value(), Standing::kExpected) << "it may still come";
}

TEST_F(SchedulerTrustTest, TheFirstBatchesAreLentASecondTimeToo) {
  scheduler_.OpenPass(kPass, 100);
  const std::string hanging = Join("hanging");
  const BatchLease lease = Ask(hanging, 0).value();
  const std::string idle = Join("idle");
  EXPECT_FALSE(Ask(idle, 29)) << "it is not known how long a batch takes";
  EXPECT_EQ(Ask(idle, 31).value().range, lease.range);
}

TEST_F(SchedulerTrustTest, ABatchThatIsSlowForGoodReasonGetsMoreTimeEachTime) {
  SchedulerOptions options = Options();
  options.renew_unknown = std::chrono::seconds(100);
  Scheduler scheduler(options);
  scheduler.OpenPass(kPass, 100);
  const std::string slow = scheduler.AddWorker("slow", At(0)).value();
  double now = 0;
  for (const double limit : {100.0, 200.0, 400.0}) {
    Scheduler::Report report;
    report.wants_lease = true;
    ASSERT_TRUE(scheduler.TakeReport(slow, report, At(now)).ok());
    const auto lease = scheduler.AnswerFor(slow, report, At(now))->lease;
    ASSERT_TRUE(lease) << limit;
    const double began = now;
    report.wants_lease = false;
    report.held = {lease->id};
    while (scheduler.AnswerFor(slow, report, At(now))->revoked.empty()) {
      now += 5;
      ASSERT_LT(now, began + 1000);
      ASSERT_TRUE(scheduler.TakeReport(slow, report, At(now)).ok());
      scheduler.Expire(At(now));
    }
    EXPECT_GE(now - began, limit);
    EXPECT_LE(now - began, limit + 10);
  }
}

// Quarantine --------------------------------------------------------------------------------------

TEST_F(SchedulerTrustTest, AWorkerThatFailsOftenIsLentNothingUntilItIsReleased) {
  scheduler_.OpenPass(kPass, 100'000);
  const std::string bad = Join("bad", 0, "bad");
  const std::string good = Join("good");
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(RecordOf(bad).state, WorkerState::kActive);
    // Seven good ones between them: three of ten.
    LearnTimes(bad, i < 2 ? 3 : 0, 10 * i);
    Fail(bad, Ask(bad, 10 * i + 5).value(), 10 * i + 5);
    EXPECT_TRUE(Ask(good, 10 * i));
  }
  EXPECT_EQ(RecordOf(bad).state, WorkerState::kQuarantined);
  EXPECT_NE(RecordOf(bad).reason.find("out of memory"), std::string::npos);
  EXPECT_FALSE(Ask(bad, 40));
  EXPECT_FALSE(scheduler_.TakeWaiting(At(40))) << "it does not wait for what it cannot get";
  EXPECT_EQ(scheduler_.LiveWorkers(), 1);
  const std::string again = Join("bad", 41, "bad");
  EXPECT_FALSE(Ask(again, 41)) << "also after it has joined again";
  EXPECT_FALSE(scheduler_.Release("unknown"));
  EXPECT_TRUE(scheduler_.Release(WorkerIdOf("bad")));
  const auto lease = Ask(again, 42);
  ASSERT_TRUE(lease);
  EXPECT_EQ(scheduler_.LiveWorkers(), 2);
  Fail(again, *lease, 43);
  EXPECT_EQ(RecordOf(again).state, WorkerState::kActive) << "counted from the beginning";
}

TEST_F(SchedulerTrustTest, OldFailuresAreForgotten) {
  scheduler_.OpenPass(kPass, 100'000);
  const std::string worker = Join("w");
  Join("other");
  for (int i = 0; i < 5; ++i) {
    Fail(worker, Ask(worker, 10 * i).value(), 10 * i);
    LearnTimes(worker, 5, 10 * i + 1);
  }
  EXPECT_EQ(RecordOf(worker).state, WorkerState::kActive) << "two of ten";
}

TEST_F(SchedulerTrustTest, AWorkerThatIsDrainedFinishesWhatItHas) {
  scheduler_.OpenPass(kPass, 300);
  const std::string worker = Join("w", 0, "identity");
  const BatchLease lease = Ask(worker, 0).value();
  EXPECT_TRUE(scheduler_.Drain(WorkerIdOf("identity")));
  EXPECT_EQ(scheduler_.Workers()[0].held, 1U);
  EXPECT_TRUE(Renew(worker, lease, 1));
  EXPECT_FALSE(Ask(worker, 2, {lease.id}));
  EXPECT_TRUE(Deliver(worker, lease, 3).ok());
  EXPECT_EQ(scheduler_.Workers()[0].state, WorkerState::kDraining);
  EXPECT_EQ(scheduler_.Workers()[0].held, 0U);
  EXPECT_FALSE(Ask(worker, 4));
  EXPECT_TRUE(scheduler_.Release(WorkerIdOf("identity")));
  EXPECT_TRUE(Ask(worker, 5));
}

TEST_F(SchedulerTrustTest, WhatAWorkerInQuarantineHoldsGoesBack) {
  scheduler_.OpenPass(kPass, 100);
  const std::string worker = Join("w", 0, "identity");
  const BatchLease lease = Ask(worker, 0).value();
  EXPECT_TRUE(scheduler_.Quarantine(WorkerIdOf("identity"), "by hand"));
  EXPECT_TRUE(absl::IsFailedPrecondition(StandingOf(worker, lease).status()));
  EXPECT_EQ(Ask(Join("other"), 1).value().range, lease.range);
}

// Audits ------------------------------------------------------------------------------------------

TEST_F(SchedulerAuditTest, CountsWhenTwoWorkersReturnTheSame) {
  scheduler_.OpenPass(kPass, 100);
  const std::string first = Join("first");
  const std::string second = Join("second");
  const BatchLease lease = Ask(first, 0).value();
  const auto held = Deliver(first, lease, 1);
  ASSERT_TRUE(held.ok());
  EXPECT_TRUE(held->is_held);
  EXPECT_EQ(StandingOf(first, lease).value(), Standing::kDuplicate);
  EXPECT_FALSE(Ask(first, 2)) << "not to the same worker";
  EXPECT_FALSE(scheduler_.TakeWaiting(At(2)));
  const auto again = Ask(second, 3);
  ASSERT_TRUE(again);
  EXPECT_EQ(again->range, lease.range);
  const auto agreed = Deliver(second, *again, 4);
  ASSERT_TRUE(agreed.ok());
  EXPECT_FALSE(agreed->is_held);
  EXPECT_EQ(agreed->audit, AuditOutcome::kAgreed);
  EXPECT_TRUE(agreed->wrong.empty());
  EXPECT_FALSE(Ask(second, 5)) << "it is done";
}

TEST_F(SchedulerAuditTest, AWorkerThatWaitsIsChosenForTheSecondRun) {
  scheduler_.OpenPass(kPass, 100);
  const std::string first = Join("first");
  const std::string second = Join("second");
  const BatchLease lease = Ask(first, 0).value();
  EXPECT_FALSE(Ask(second, 0));
  ASSERT_TRUE(Deliver(first, lease, 0.5).ok());
  EXPECT_FALSE(Ask(first, 0.6)) << "waits too";
  EXPECT_EQ(scheduler_.TakeWaiting(At(0.7)), second);
}

TEST_F(SchedulerAuditTest, AThirdResultDecidesAndTheLiarIsLentNothing) {
  scheduler_.OpenPass(kPass, 500);
  const std::string liar = Join("liar", 0, "liar");
  const std::string honest = Join("honest");
  const std::string third = Join("third");
  const BatchLease lie = Ask(liar, 0).value();
  const BatchLease held = Ask(liar, 0, {lie.id}).value();
  ASSERT_TRUE(Deliver(liar, lie, 1, "wrong").ok());
  const auto disputed = Deliver(honest, Ask(honest, 2).value(), 3);
  ASSERT_TRUE(disputed.ok());
  EXPECT_TRUE(disputed->is_held);
  EXPECT_EQ(disputed->audit, AuditOutcome::kDisputed);
  EXPECT_TRUE(scheduler_.Disputes().empty()) << "a third worker is there";
  const auto decided = Deliver(third, Ask(third, 4).value(), 5);
  ASSERT_TRUE(decided.ok());
  EXPECT_FALSE(decided->is_held);
  EXPECT_EQ(decided->wrong, std::vector{WorkerIdOf("liar")});
  EXPECT_EQ(RecordOf(liar).state, WorkerState::kQuarantined);
  EXPECT_TRUE(RecordOf(liar).has_lied);
  EXPECT_TRUE(absl::IsFailedPrecondition(Deliver(liar, held, 6, "wrong").status()))
      << "what it holds is taken from it";
  EXPECT_FALSE(Ask(liar, 7));
  EXPECT_EQ(Ask(honest, 8).value().range, held.range);
}

// A lease that had ended before the lie was found.
TEST_F(SchedulerTrustTest, ALateResultOfAWorkerInQuarantineIsRefused) {
  scheduler_.OpenPass(kPass, 100);
  const std::string liar = Join("liar");
  const BatchLease lease = Ask(liar, 0).value();
  scheduler_.Expire(At(11));
  ASSERT_EQ(StandingOf(liar, lease).value(), Standing::kExpected);
  ASSERT_TRUE(scheduler_.Quarantine(RecordOf(liar).id, "it lies"));
  EXPECT_TRUE(absl::IsFailedPrecondition(Deliver(liar, lease, 12).status()));
}

// Of a job whose turn is over, more audits may wait than are looked at.
TEST_F(SchedulerAuditTest, AuditsOfAHeldJobDoNotHideThoseOfOthers) {
  scheduler_.OpenPass({"a", 0}, 2000);
  const std::string first = Join("first");
  const std::string second = Join("second");
  for (int i = 0; i < 20; ++i)
    ASSERT_TRUE(Deliver(first, Ask(first, 0).value(), 0)->is_held);
  scheduler_.SetHeld("a", true);
  scheduler_.OpenPass({"b", 0}, 100);
  const BatchLease lease = Ask(first, 1).value();
  ASSERT_EQ(lease.pass.job_id, "b");
  ASSERT_TRUE(Deliver(first, lease, 1)->is_held);
  const auto again = Ask(second, 2);
  ASSERT_TRUE(again);
  EXPECT_EQ(again->pass.job_id, "b");
}

TEST_F(SchedulerAuditTest, WithoutAThirdWorkerTheBatchWaitsAndSaysSo) {
  scheduler_.OpenPass(kPass, 100);
  const std::string first = Join("first");
  const std::string second = Join("second");
  ASSERT_TRUE(Deliver(first, Ask(first, 0).value(), 1, "one").ok());
  ASSERT_TRUE(Deliver(second, Ask(second, 1).value(), 2, "other").ok());
  EXPECT_FALSE(Ask(first, 100));
  EXPECT_FALSE(Ask(second, 100));
  ASSERT_EQ(scheduler_.Disputes().size(), 1U);
  EXPECT_NE(scheduler_.Disputes()["job"].find("photons 0 to 100 of pass 0"), std::string::npos);
  const std::string third = Join("third", 100);
  EXPECT_TRUE(scheduler_.Disputes().empty());
  const auto decided = Deliver(third, Ask(third, 100).value(), 101, "other");
  EXPECT_EQ(decided->wrong, std::vector{RecordOf(first).id});
}

TEST_F(SchedulerAuditTest, ALoneWorkerIsNotAudited) {
  scheduler_.OpenPass(kPass, 100);
  const std::string lone = Join("lone");
  const auto taken = Deliver(lone, Ask(lone, 0).value(), 1);
  ASSERT_TRUE(taken.ok());
  EXPECT_FALSE(taken->is_held);
  EXPECT_EQ(taken->audit, AuditOutcome::kNotAudited);
}

TEST_F(SchedulerAuditTest, AnAuditIsGivenUpWhenTheOtherWorkersHaveLeft) {
  scheduler_.OpenPass(kPass, 100);
  const std::string first = Join("first");
  const std::string second = Join("second");
  ASSERT_TRUE(Deliver(first, Ask(first, 0).value(), 1)->is_held);
  EXPECT_FALSE(Ask(first, 2));
  scheduler_.RemoveWorker(second);
  EXPECT_EQ(scheduler_.TakeWaiting(At(3)), first);
  const auto taken = Deliver(first, Ask(first, 3).value(), 4);
  ASSERT_TRUE(taken.ok());
  EXPECT_FALSE(taken->is_held);
  EXPECT_EQ(taken->audit, AuditOutcome::kNotAudited);
}

// One that is connected and never asks for work must not hold up the batch.
TEST_F(SchedulerAuditTest, AnAuditIsGivenUpWhenNobodyComesForIt) {
  scheduler_.OpenPass(kPass, 100);
  const std::string first = Join("first");
  Join("hanging");
  ASSERT_TRUE(Deliver(first, Ask(first, 0).value(), 1)->is_held);
  EXPECT_FALSE(Ask(first, 30.9));
  const auto again = Ask(first, 31.1);
  ASSERT_TRUE(again);
  EXPECT_FALSE(Deliver(first, *again, 32)->is_held);
}

TEST_F(SchedulerAuditTest, ResultsOfAWorkerInQuarantineSayNothing) {
  scheduler_.OpenPass(kPass, 100);
  const std::string bad = Join("bad", 0, "bad");
  const std::string good = Join("good");
  const BatchLease lease = Ask(bad, 0).value();
  ASSERT_TRUE(Deliver(bad, lease, 1, "wrong")->is_held);
  EXPECT_TRUE(scheduler_.Quarantine(WorkerIdOf("bad"), "by hand"));
  const auto again = Ask(good, 2);
  ASSERT_TRUE(again);
  const auto taken = Deliver(good, *again, 3);
  EXPECT_FALSE(taken->is_held) << "nobody is left to compare with";
}

TEST(AuditTest, TheShareOfBatchesThatAreAuditedIsThatOfTheOptions) {
  int audited = 0;
  constexpr int kBatches = 20'000;
  for (int i = 0; i < kBatches; ++i) {
    const auto first = static_cast<std::uint64_t>(i);
    const WorkRange range = {first, first + 1};
    audited += IsAudited("secret", 0.05, kPass, WorkKind::kPhotons, range) ? 1 : 0;
    EXPECT_FALSE(IsAudited("secret", 0, kPass, WorkKind::kPhotons, range));
    EXPECT_TRUE(IsAudited("secret", 1, kPass, WorkKind::kPhotons, range));
  }
  // Six standard deviations of a binomial: 6 · sqrt(20000 · 0.05 · 0.95) = 185.
  EXPECT_NEAR(audited, 0.05 * kBatches, 185);
  int same = 0;
  for (std::uint64_t i = 0; i < 1000; ++i) {
    same += IsAudited("secret", 0.5, kPass, WorkKind::kPhotons, {i, i + 1}) ==
                    IsAudited("another", 0.5, kPass, WorkKind::kPhotons, {i, i + 1})
                ? 1
                : 0;
  }
  // Of 1000 flips of a coin, six standard deviations.
  EXPECT_NEAR(same, 500, 95);
}

TEST(SchedulerLimitsTest, APeerHasSoManyRegistrationsAndOthersHaveTheirOwn) {
  SchedulerOptions options;
  options.max_registrations = 2;
  Scheduler scheduler(options);
  ASSERT_TRUE(scheduler.AddWorker("a", At(0), "one", "peer").ok());
  ASSERT_TRUE(scheduler.AddWorker("b", At(0), "two", "peer").ok());
  EXPECT_TRUE(absl::IsResourceExhausted(scheduler.AddWorker("c", At(0), "three", "peer").status()));
  EXPECT_TRUE(scheduler.AddWorker("c", At(0), "three", "other").ok());
  // A worker that comes back takes its own place.
  EXPECT_TRUE(scheduler.AddWorker("a", At(1), "one", "peer").ok());
  EXPECT_TRUE(absl::IsResourceExhausted(scheduler.AddWorker("d", At(1), "four", "peer").status()));
}

}  // namespace
}  // namespace lucerna
