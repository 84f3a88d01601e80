// Workers that die at a commit, stand still, come and go in numbers, or return wrong results: the
// image is that of a run in which nothing failed, to the last bit.
//
// Real processes on loopback. What is waited for is what can be seen: a line of a log, a list.
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "gtest/gtest.h"
#include <grpcpp/grpcpp.h>
#include <signal.h>

#include "proto/lucerna/v1/admin.grpc.pb.h"
#include "tests/fault/coordinator_process.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace {

using std::chrono::milliseconds;

constexpr std::uint64_t kAllPhotons = kPasses * static_cast<std::uint64_t>(kPhotonsAPass);

std::vector<v1::Worker> WorkersOf(CoordinatorProcess& coordinator) {
  grpc::ClientContext context;
  v1::ListWorkersResponse response;
  const grpc::Status status = v1::AdminService::NewStub(coordinator.channel())
                                  ->ListWorkers(&context, v1::ListWorkersRequest(), &response);
  EXPECT_TRUE(status.ok()) << status.error_message();
  return {response.workers().begin(), response.workers().end()};
}

// Waits until `is_so` holds of the workers.
template <typename Condition>
bool WaitForWorkers(CoordinatorProcess& coordinator, const Condition& is_so) {
  const auto give_up_at = std::chrono::steady_clock::now() + kPatience;
  while (!is_so(WorkersOf(coordinator))) {
    if (std::chrono::steady_clock::now() > give_up_at) return false;
    std::this_thread::sleep_for(milliseconds(5));
  }
  return true;
}

void ExpectUnfaulted(CoordinatorProcess& coordinator, const std::string& job) {
  const v1::Job ended = coordinator.Wait(job);
  ASSERT_EQ(ended.state(), v1::JOB_STATE_SUCCEEDED) << ended.failure();
  EXPECT_EQ(ended.progress().tally().photons(), kAllPhotons) << "each photon once";
  EXPECT_EQ(coordinator.ImageDigest(job).Hex(),
            UnfaultedDigest(kScene, kPasses, kPhotonsAPass).Hex());
}

class KilledAtCommitTest : public testing::TestWithParam<const char*> {};

TEST_P(KilledAtCommitTest, AnotherWorkerBringsTheSameBits) {
  CoordinatorProcess coordinator({"--batch-photons", "100000"});
  const auto doomed = coordinator.StartFaultyWorker(GetParam());
  const std::string job = coordinator.Submit(kScene, kPasses, kPhotonsAPass);
  ASSERT_EQ(doomed->WaitForExit(kPatience), 128 + SIGKILL) << doomed->Errors();
  const auto replacement = coordinator.StartWorker();
  ExpectUnfaulted(coordinator, job);
}

INSTANTIATE_TEST_SUITE_P(Steps, KilledAtCommitTest,
                         testing::Values("commit.before:1", "commit.before:5", "commit.during:1",
                                         "commit.during:5", "commit.after:1", "commit.after:5"));

// Whole passes instead of batches of photons.
class KilledAtSliceTest : public testing::TestWithParam<const char*> {};

TEST_P(KilledAtSliceTest, AnotherWorkerBringsTheSameBits) {
  CoordinatorProcess coordinator;
  const auto doomed = coordinator.StartFaultyWorker(GetParam());
  const std::string job = coordinator.Submit(kScene, kPasses, kPhotonsAPass);
  ASSERT_EQ(doomed->WaitForExit(kPatience), 128 + SIGKILL) << doomed->Errors();
  const auto replacement = coordinator.StartWorker();
  ExpectUnfaulted(coordinator, job);
}

INSTANTIATE_TEST_SUITE_P(Steps, KilledAtSliceTest,
                         testing::Values("commit.before:3", "commit.during:3", "commit.after:3"));

// The first commit of this name, and all that follow, are not as they should be.
struct CommitFault {
  const char* name;
  const char* answer;  // part of the worker's log
};

class FaultyCommitTest : public testing::TestWithParam<CommitFault> {
 protected:
  void ExpectUnfaultedWith(const std::vector<std::string>& flags) {
    CoordinatorProcess coordinator(flags);
    const auto faulty = coordinator.StartFaultyWorker(GetParam().name);
    const std::string job = coordinator.Submit(kScene, kPasses, kPhotonsAPass);
    ASSERT_TRUE(faulty->WaitForText(GetParam().answer, kPatience)) << faulty->Errors();
    const auto sound = coordinator.StartWorker();
    ASSERT_TRUE(sound->WaitForText("joined", kPatience));
    // What has failed on all workers there were pauses the job.
    while (coordinator.Get(job).state() <= v1::JOB_STATE_RUNNING ||
           coordinator.Get(job).state() == v1::JOB_STATE_PAUSED) {
      if (coordinator.Get(job).state() == v1::JOB_STATE_PAUSED) {
        const Finished resumed = RunProgram(
            {kBin + "/lucerna", "resume", job, "--server", coordinator.address()}, kPatience);
        // It may have ended its pause meanwhile.
        EXPECT_LE(resumed.exit_code, 1) << resumed.errors;
      }
      std::this_thread::sleep_for(milliseconds(50));
    }
    ExpectUnfaulted(coordinator, job);
  }
};

TEST_P(FaultyCommitTest, OfABatchChangesNothing) {
  ExpectUnfaultedWith({"--batch-photons", "100000"});
}

TEST_P(FaultyCommitTest, OfASliceChangesNothing) {
  ExpectUnfaultedWith({});
}

INSTANTIATE_TEST_SUITE_P(
    Faults, FaultyCommitTest,
    testing::Values(CommitFault{"commit.twice", "joined"},
                    CommitFault{"commit.truncated", "malformed"},
                    CommitFault{"commit.short", "the stream ended after"},
                    CommitFault{"commit.forged", "of other work than its lease"}),
    [](const auto& fault) {
      return std::string(fault.param.name).substr(std::string("commit.").size());
    });

// Its lease runs out after ten seconds and goes to another; when it wakes up, what it has is late.
TEST(StoppedWorkerTest, IsReplacedWhileItStandsStillAndIsHarmlessAfterwards) {
  CoordinatorProcess coordinator({"--batch-photons", "100000"});
  const auto stopped = coordinator.StartWorker();
  const std::string job = coordinator.Submit(kScene, kPasses, kPhotonsAPass);
  ASSERT_TRUE(coordinator.WaitForPhotons(job, 1));
  ASSERT_TRUE(WaitForWorkers(coordinator, [](const std::vector<v1::Worker>& workers) {
    return workers.size() == 1 && workers[0].leases_held() > 0;
  }));
  stopped->Signal(SIGSTOP);
  const auto other = coordinator.StartWorker();
  // Until the lease of the stopped worker has ended, the other brings all but that.
  ASSERT_TRUE(WaitForWorkers(coordinator, [](const std::vector<v1::Worker>& workers) {
    for (const v1::Worker& worker : workers) {
      if (worker.leases_held() == 0 || worker.committed() == 0) return true;
    }
    return false;
  }));
  const v1::Job ended = coordinator.Wait(job);
  ASSERT_EQ(ended.state(), v1::JOB_STATE_SUCCEEDED) << ended.failure();
  stopped->Signal(SIGCONT);
  ExpectUnfaulted(coordinator, job);
  // It works again.
  const std::string next =
      coordinator.TrySubmit({.scene = kScene, .passes = 1, .request_id = "another"}).value();
  EXPECT_EQ(coordinator.Wait(next).state(), v1::JOB_STATE_SUCCEEDED);
}

TEST(ManyWorkersTest, OneThenEightThenTwoBringTheSameBits) {
  CoordinatorProcess coordinator({"--batch-photons", "20000"});
  std::vector<std::unique_ptr<ChildProcess>> workers;
  workers.push_back(coordinator.StartWorker());
  const std::string job = coordinator.Submit(kScene, kPasses, kPhotonsAPass);
  ASSERT_TRUE(coordinator.WaitForPhotons(job, 1));
  while (workers.size() < 8)
    workers.push_back(coordinator.StartWorker());
  ASSERT_TRUE(WaitForWorkers(coordinator,
                             [](const std::vector<v1::Worker>& all) { return all.size() == 8; }));
  while (workers.size() > 2) {
    workers.back()->Signal(SIGKILL);
    workers.pop_back();
  }
  ExpectUnfaulted(coordinator, job);
}

TEST(WorkersCommandTest, ListsDrainsAndReleasesWorkers) {
  CoordinatorProcess coordinator;
  const auto worker = coordinator.StartWorker();
  ASSERT_TRUE(WaitForWorkers(
      coordinator, [](const std::vector<v1::Worker>& workers) { return workers.size() == 1; }));
  const std::string id = WorkersOf(coordinator)[0].worker_id();
  const auto run = [&](std::vector<std::string> arguments) {
    std::vector<std::string> command = {kBin + "/lucerna", "workers"};
    command.insert(command.end(), arguments.begin(), arguments.end());
    command.insert(command.end(), {"--server", coordinator.address()});
    return RunProgram(command, kPatience);
  };
  const auto shows = [](const Finished& finished, const std::string& text) {
    return finished.exit_code == 0 && finished.output.find(text) != std::string::npos;
  };
  const Finished list = run({});
  EXPECT_TRUE(shows(list, id)) << list.output << list.errors;
  EXPECT_TRUE(shows(list, "active"));
  EXPECT_TRUE(shows(run({"--json"}), "\"state\": \"active\""));
  EXPECT_TRUE(shows(run({"drain", id}), "drained"));
  EXPECT_TRUE(shows(run({"quarantine", id, "--json"}), "\"reason\": \"by an operator\""));
  EXPECT_TRUE(shows(run({"release", id}), "active"));
  const Finished unknown = run({"release", "nobody"});
  EXPECT_EQ(unknown.exit_code, 1);
  EXPECT_NE(unknown.errors.find("there is no worker nobody"), std::string::npos) << unknown.errors;
  EXPECT_EQ(run({"release"}).exit_code, 2);
}

bool HasOneInQuarantine(const std::vector<v1::Worker>& workers) {
  int in_quarantine = 0;
  for (const v1::Worker& worker : workers)
    in_quarantine += worker.state() == v1::WORKER_STATE_QUARANTINED ? 1 : 0;
  return in_quarantine == 1;
}

// Found without an audit: the energy is not that of the scene's lights.
TEST(LiarTest, ThatReturnsZerosIsFoundAtOnce) {
  CoordinatorProcess coordinator({"--batch-photons", "20000", "--audit-share", "0"});
  const auto liar = coordinator.StartFaultyWorker("result.zeros");
  ASSERT_TRUE(liar->WaitForText("joined", kPatience));
  const auto honest = coordinator.StartWorker();
  ASSERT_TRUE(honest->WaitForText("joined", kPatience));
  const std::string job = coordinator.Submit(kScene, kPasses, kPhotonsAPass);
  ExpectUnfaulted(coordinator, job);
  EXPECT_TRUE(WaitForWorkers(coordinator, HasOneInQuarantine));
  EXPECT_NE(coordinator.process().Errors().find("is refused"), std::string::npos);
}

// One quantum in one hitpoint of each result: all counters are right. Of about 120 batches 40 are
// computed by the liar, and of every batch the chance to be audited is 0.3.
TEST(LiarTest, ThatChangesOneBitIsFoundByAuditsAndItsWorkIsTakenOut) {
  CoordinatorProcess coordinator({"--batch-photons", "20000", "--audit-share", "0.3"});
  const auto liar = coordinator.StartFaultyWorker("result.flipped");
  const std::string job = coordinator.Submit(kScene, kPasses, kPhotonsAPass);
  // While it is alone its work is believed.
  ASSERT_TRUE(coordinator.WaitForPhotons(job, 1));
  const auto first = coordinator.StartWorker();
  const auto second = coordinator.StartWorker();
  ExpectUnfaulted(coordinator, job);
  EXPECT_TRUE(WaitForWorkers(coordinator, HasOneInQuarantine));
  const v1::Job ended = coordinator.Get(job);
  EXPECT_GE(ended.events_size(), 1);
  EXPECT_TRUE(coordinator.process().WaitForText("its work is taken out", kPatience));
}

// As before, with checkpoints: none with a part of the liar is used.
TEST(LiarTest, IsTakenOutOfCheckpointsToo) {
  const TemporaryFolder folder;
  {
    CoordinatorProcess coordinator(
        {"--audit-share", "0.3", "--state", folder.path(), "--checkpoint-share", "1"});
    const auto liar = coordinator.StartFaultyWorker("result.flipped");
    const SmallJob small = {.scene = kScene, .passes = 60, .photons = 20'000};
    const std::string job = coordinator.TrySubmit(small).value();
    ASSERT_TRUE(coordinator.WaitForPhotons(job, 5 * 20'000));
    const auto first = coordinator.StartWorker();
    const auto second = coordinator.StartWorker();
    const v1::Job ended = coordinator.Wait(job);
    ASSERT_EQ(ended.state(), v1::JOB_STATE_SUCCEEDED) << ended.failure();
    CoordinatorProcess quiet;
    const auto worker = quiet.StartWorker();
    const std::string same = quiet.TrySubmit(small).value();
    ASSERT_EQ(quiet.Wait(same).state(), v1::JOB_STATE_SUCCEEDED);
    EXPECT_EQ(coordinator.ImageDigest(job).Hex(), quiet.ImageDigest(same).Hex());
    EXPECT_TRUE(WaitForWorkers(coordinator, HasOneInQuarantine));
  }
}

}  // namespace
}  // namespace lucerna
