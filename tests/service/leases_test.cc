// Batches that are lent come back, once, whatever becomes of their workers; and what waits is
// answered when the coordinator ends.
#include <string>
#include <thread>

#include "gtest/gtest.h"

#include "tests/service/service_under_test.h"

namespace lucerna {
namespace {

class LeasesTest : public testing::Test {
 protected:
  LeasesTest() : client_(service_), scene_(client_.Upload(SmallScene())) {
    job_ = client_.Submit(RequestFor(scene_, "job", 10)).message.job_id();
  }

  v1::CommitOutcome Outcome(IdleHandsWorker& worker, const v1::Lease& lease) {
    const auto committed = worker.Commit(lease);
    EXPECT_TRUE(committed.ok()) << committed.status.error_message();
    return committed.message.outcome();
  }

  // The photons of the first pass. While its eye paths are being traced, workers are lent the next
  // one.
  std::optional<v1::Lease> TakeFirstPass(IdleHandsWorker& worker) {
    std::optional<v1::Lease> lease = worker.TakeLease();
    while (lease && lease->pass() > 0)
      lease = worker.TakeLease();
    return lease;
  }

  ServiceUnderTest service_;
  TestClient client_;
  v1::SceneManifest scene_;
  std::string job_;
};

TEST_F(LeasesTest, ALeaseThatRanOutGoesToAnotherAndTheFirstToCommitCounts) {
  IdleHandsWorker slow(service_);
  const std::optional<v1::Lease> lease = TakeFirstPass(slow);
  ASSERT_TRUE(lease);
  service_.clock().Move(std::chrono::seconds(11));
  IdleHandsWorker other(service_);
  // The next pass is open too, and is what there is until the tick that ends the lease.
  std::optional<v1::Lease> again = other.TakeLease();
  for (int i = 0; i < 1000 && again && again->pass() != lease->pass(); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    again = other.TakeLease();
  }
  ASSERT_TRUE(again);
  ASSERT_EQ(again->pass(), lease->pass());
  EXPECT_EQ(again->first(), lease->first());
  EXPECT_NE(again->lease_id(), lease->lease_id());
  // Answered at once when it is revoked.
  const auto revoked = slow.Sync(false, std::chrono::seconds(5), {lease->lease_id()});
  ASSERT_EQ(revoked.message.revoked_lease_ids_size(), 1);
  EXPECT_EQ(revoked.message.revoked_lease_ids(0), lease->lease_id());

  EXPECT_EQ(Outcome(slow, *lease), v1::COMMIT_OUTCOME_ACCEPTED) << "late, but first";
  EXPECT_NE(Outcome(other, *again), v1::COMMIT_OUTCOME_ACCEPTED);
  EXPECT_EQ(client_.Get(job_).message.progress().photons(), 1000U);
}

TEST_F(LeasesTest, BatchesOfAConnectionThatBreaksGoBackWithoutAnyTimePassing) {
  IdleHandsWorker lost(service_);
  const std::optional<v1::Lease> lease = TakeFirstPass(lost);
  ASSERT_TRUE(lease);
  IdleHandsWorker other(service_);
  std::optional<v1::Lease> found;
  for (int i = 0; i < 20 && !found; ++i) {
    grpc::ClientContext context;
    std::thread heartbeat([&] {
      const auto answer = lost.Sync(false, std::chrono::seconds(5), {lease->lease_id()}, &context);
      EXPECT_EQ(answer.code(), grpc::StatusCode::CANCELLED);
    });
    // Long enough for the call to arrive, else it is made again.
    std::this_thread::sleep_for(std::chrono::milliseconds(50 * (i + 1)));
    context.TryCancel();
    heartbeat.join();
    for (int tries = 0; tries < 100 && !found; ++tries) {
      const auto answer = other.Sync(true, Duration::zero());
      if (answer.message.has_lease() && answer.message.lease().pass() == lease->pass()) {
        found = answer.message.lease();
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
  ASSERT_TRUE(found);
  EXPECT_EQ(Outcome(other, *found), v1::COMMIT_OUTCOME_ACCEPTED);
}

TEST_F(LeasesTest, ACommitCountsOnceAndNotAtAllWhenItsJobHasEnded) {
  IdleHandsWorker worker(service_);
  const std::optional<v1::Lease> lease = TakeFirstPass(worker);
  ASSERT_TRUE(lease);
  EXPECT_EQ(Outcome(worker, *lease), v1::COMMIT_OUTCOME_ACCEPTED);
  const v1::CommitOutcome second = Outcome(worker, *lease);
  EXPECT_TRUE(second == v1::COMMIT_OUTCOME_DUPLICATE || second == v1::COMMIT_OUTCOME_SUPERSEDED);
  const std::optional<v1::Lease> next = worker.TakeLease();
  ASSERT_TRUE(next);
  EXPECT_TRUE(client_.Cancel(job_).ok());
  EXPECT_EQ(Outcome(worker, *next), v1::COMMIT_OUTCOME_SUPERSEDED);
  EXPECT_EQ(client_.Get(job_).message.progress().photons(), 1000U);
}

TEST_F(LeasesTest, ABatchThatIsGivenUpAgainAndAgainPausesItsJobAndNotTheNextOne) {
  IdleHandsWorker worker(service_);
  for (int i = 0; i < 1000 && client_.Get(job_).message.state() != v1::JOB_STATE_PAUSED; ++i) {
    const auto answer = worker.Sync(true, Duration::zero());
    ASSERT_TRUE(answer.ok());
    if (answer.message.has_lease()) {
      ASSERT_TRUE(worker.GiveUp(answer.message.lease(), "on purpose").ok());
    }
  }
  const v1::Job paused = client_.Get(job_).message;
  EXPECT_EQ(paused.state(), v1::JOB_STATE_PAUSED);
  EXPECT_EQ(paused.pause_cause(), v1::PAUSE_CAUSE_FAILED_BATCH);
  EXPECT_NE(paused.condition().find("on purpose"), std::string::npos) << paused.condition();
  const std::string next = client_.Submit(RequestFor(scene_, "next", 2)).message.job_id();
  {
    const WorkerThread diligent(service_);
    EXPECT_TRUE(client_.WaitFor(next, {v1::JOB_STATE_SUCCEEDED}).ok());
  }
  // The batch is lent again, and what failed before the pause does not count any more.
  EXPECT_TRUE(client_.Resume(job_).ok());
  ASSERT_TRUE(worker.GiveUp(worker.TakeLease().value(), "once more").ok());
  EXPECT_NE(client_.Get(job_).message.state(), v1::JOB_STATE_PAUSED);
  const WorkerThread diligent(service_);
  EXPECT_TRUE(client_.WaitFor(job_, {v1::JOB_STATE_SUCCEEDED}).ok());
}

TEST_F(LeasesTest, AParkedSyncIsAnsweredWithWorkAsSoonAsThereIsSome) {
  EXPECT_TRUE(client_.Cancel(job_).ok());
  IdleHandsWorker worker(service_);
  std::thread parked([&] {
    // Its time is never over, because the clock stands still.
    for (int i = 0; i < 100; ++i) {
      const auto answer = worker.Sync(true, std::chrono::seconds(5));
      ASSERT_TRUE(answer.ok()) << answer.status.error_message();
      if (answer.message.has_lease()) return;
    }
    ADD_FAILURE() << "no lease came";
  });
  const std::string next = client_.Submit(RequestFor(scene_, "next", 2)).message.job_id();
  parked.join();
}

TEST_F(LeasesTest, AWatcherHearsOfAJobAtRestEveryFiveSeconds) {
  ASSERT_TRUE(client_.WaitFor(job_, {v1::JOB_STATE_RUNNING}).ok());
  int messages = 0;
  const auto watched = client_.Watch(job_, [&](const v1::Job&) {
    service_.clock().Move(std::chrono::seconds(5));
    return ++messages < 4;
  });
  EXPECT_EQ(watched.code(), grpc::StatusCode::CANCELLED);
  EXPECT_GE(messages, 4);
}

TEST_F(LeasesTest, EverythingThatWaitsIsAnsweredWhenTheCoordinatorEnds) {
  ASSERT_TRUE(client_.WaitFor(job_, {v1::JOB_STATE_RUNNING}).ok());
  IdleHandsWorker worker(service_);
  const std::optional<v1::Lease> lease = worker.TakeLease();
  ASSERT_TRUE(lease);
  std::atomic<bool> watches = false;
  std::thread watcher([&] {
    TestClient client(service_);
    const auto watched = client.Watch(job_, [&](const v1::Job&) {
      watches = true;
      return true;
    });
    EXPECT_NE(watched.code(), grpc::StatusCode::DEADLINE_EXCEEDED);
  });
  std::thread parked([&] {
    const auto answer = worker.Sync(false, std::chrono::seconds(5), {lease->lease_id()});
    EXPECT_NE(answer.code(), grpc::StatusCode::DEADLINE_EXCEEDED);
  });
  while (!watches)
    std::this_thread::yield();
  service_.ShutDown();
  watcher.join();
  parked.join();
}

}  // namespace
}  // namespace lucerna
