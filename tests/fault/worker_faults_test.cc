// Workers may be killed, replaced, told to go, or be of the wrong build, and the coordinator may
// be absent: the image is the same to the last bit, or there is one clear message.
//
// Real processes on loopback.
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "gtest/gtest.h"
#include <grpcpp/grpcpp.h>
#include <signal.h>

#include "proto/lucerna/v1/work.grpc.pb.h"
#include "tests/fault/coordinator_process.h"

namespace lucerna {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

// For what must come before the lease of 10 s, renewed every few seconds, can end by itself.
constexpr seconds kBeforeLeasesEnd{5};

const std::vector<std::string> kSmallBatches = {"--batch-photons", "50000"};

class KilledWorkerTest : public testing::TestWithParam<int> {};

TEST_P(KilledWorkerTest, IsReplacedAndTheImageIsTheSame) {
  CoordinatorProcess coordinator(kSmallBatches);
  auto worker = coordinator.StartWorker();
  const std::string job = coordinator.Submit(kScene, kPasses, kPhotonsAPass);
  ASSERT_TRUE(coordinator.WaitForPhotons(
      job, static_cast<std::uint64_t>(GetParam() * kPhotonsAPass / 2 + 1)));
  worker->Signal(SIGKILL);
  ASSERT_EQ(worker->WaitForExit(kPatience), 128 + SIGKILL);
  const auto replacement = coordinator.StartWorker();
  const v1::Job ended = coordinator.Wait(job);
  ASSERT_EQ(ended.state(), v1::JOB_STATE_SUCCEEDED) << ended.failure();
  EXPECT_EQ(ended.progress().tally().photons(), static_cast<std::uint64_t>(kPasses * kPhotonsAPass))
      << "each photon once";
  EXPECT_EQ(coordinator.ImageDigest(job).Hex(),
            UnfaultedDigest(kScene, kPasses, kPhotonsAPass).Hex());
}

INSTANTIATE_TEST_SUITE_P(AtSeveralMoments, KilledWorkerTest, testing::Values(0, 3, 7));

TEST(WorkerFaultsTest, ABatchOfAKilledWorkerGoesBackAtOnceAndNotAfterTenSeconds) {
  CoordinatorProcess coordinator;
  auto worker = coordinator.StartWorker();
  const std::string job = coordinator.Submit(kScene, 2, 3'000'000);
  for (int i = 0; i < 12000 && coordinator.Get(job).state() < v1::JOB_STATE_RUNNING; ++i) {
    std::this_thread::sleep_for(milliseconds(5));
  }
  std::this_thread::sleep_for(milliseconds(200));
  ASSERT_EQ(coordinator.Get(job).progress().photons(), 0U) << "killed in its first batch";
  worker->Signal(SIGKILL);
  EXPECT_TRUE(coordinator.process().WaitForText("vanished", kBeforeLeasesEnd));
}

TEST(WorkerFaultsTest, AWorkerThatIsTerminatedLeavesBeforeItsLeaseEndsAndItsBatchIsDoneByAnother) {
  CoordinatorProcess coordinator;
  auto worker = coordinator.StartWorker();
  const std::string job = coordinator.Submit(kScene, kPasses, kPhotonsAPass);
  ASSERT_TRUE(coordinator.WaitForPhotons(job, 1));
  const auto begin = std::chrono::steady_clock::now();
  worker->Signal(SIGTERM);
  EXPECT_EQ(worker->WaitForExit(kPatience), 0) << worker->Errors();
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 2 * kBeforeLeasesEnd);
  EXPECT_TRUE(coordinator.process().WaitForText("left", kPatience));
  const auto other = coordinator.StartWorker();
  ASSERT_EQ(coordinator.Wait(job).state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(coordinator.ImageDigest(job).Hex(),
            UnfaultedDigest(kScene, kPasses, kPhotonsAPass).Hex());
}

TEST(WorkerFaultsTest, AnIdleWorkerLeavesSoon) {
  CoordinatorProcess coordinator;
  auto worker = coordinator.StartWorker();
  ASSERT_TRUE(worker->WaitForText("joined", kPatience));
  const auto begin = std::chrono::steady_clock::now();
  worker->Signal(SIGTERM);
  EXPECT_EQ(worker->WaitForExit(kPatience), 0);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 2 * kBeforeLeasesEnd);
}

TEST(WorkerFaultsTest, AnotherNumericProfileIsRefusedWithBothNames) {
  CoordinatorProcess coordinator;
  v1::RegisterRequest request;
  request.set_name("other build");
  request.set_numeric_profile("another build");
  v1::RegisterResponse response;
  grpc::ClientContext context;
  const grpc::Status status =
      v1::WorkerService::NewStub(coordinator.channel())->Register(&context, request, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_NE(status.error_message().find("another build"), std::string::npos);
  EXPECT_NE(status.error_message().find("embree"), std::string::npos) << status.error_message();
}

TEST(WorkerFaultsTest, AnAbsentCoordinatorIsOneClearMessage) {
  const Finished finished = RunProgram(
      {kBin + "/lucerna-worker", "--server", "127.0.0.1:1", "--connect-timeout", "1"}, kPatience);
  EXPECT_EQ(finished.exit_code, 3);
  EXPECT_NE(finished.errors.find("no coordinator answers at 127.0.0.1:1"), std::string::npos)
      << finished.errors;
  EXPECT_EQ(finished.output, "");
}

TEST(WorkerFaultsTest, AWorkerComesBackToACoordinatorThatWasStartedAnew) {
  auto coordinator = std::make_unique<CoordinatorProcess>();
  const std::string address = coordinator->address();
  auto worker = coordinator->StartWorker();
  ASSERT_TRUE(worker->WaitForText("joined", kPatience));
  coordinator->process().Signal(SIGKILL);
  ASSERT_TRUE(coordinator->process().WaitForExit(kPatience));
  ASSERT_TRUE(worker->WaitForText("lost the coordinator", kPatience)) << worker->Errors();
  ChildProcess anew({kBin + "/lucerna-server", "--listen", address});
  EXPECT_TRUE(anew.WaitForText("joined", kPatience)) << anew.Errors();
}

TEST(WorkerFaultsTest, AnUnencryptedListenerBeyondThisMachineMustBeAskedFor) {
  const Finished finished =
      RunProgram({kBin + "/lucerna-server", "--listen", "0.0.0.0:0"}, kPatience);
  EXPECT_EQ(finished.exit_code, 2);
  EXPECT_NE(finished.errors.find("--allow-insecure-network"), std::string::npos);
}

TEST(WorkerFaultsTest, ACommitWithoutALeaseIsRefusedAndChangesNothing) {
  CoordinatorProcess coordinator;
  const std::string job = coordinator.Submit(kScene, kPasses, kPhotonsAPass);
  for (int i = 0; i < 12000 && coordinator.Get(job).state() != v1::JOB_STATE_RUNNING; ++i) {
    std::this_thread::sleep_for(milliseconds(5));
  }
  const std::string garbage = "LAC1 and then nothing of sense";
  v1::CommitBatchRequest header;
  header.mutable_header()->set_job_id(job);
  header.mutable_header()->set_kind(v1::WORK_KIND_PHOTONS);
  header.mutable_header()->set_last(kPhotonsAPass);
  header.mutable_header()->set_digest(std::string(Sha256(garbage).Bytes()));
  header.mutable_header()->set_size_bytes(garbage.size());
  v1::CommitBatchRequest bytes;
  bytes.set_bytes(garbage);
  const auto stub = v1::WorkerService::NewStub(coordinator.channel());
  grpc::Status status;
  // Of a worker that never registered; the bytes are not even looked at.
  v1::CommitBatchResponse response;
  grpc::ClientContext context;
  const auto writer = stub->CommitBatch(&context, &response);
  writer->Write(header);
  writer->Write(bytes);
  writer->WritesDone();
  status = writer->Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION) << status.error_message();
  EXPECT_EQ(coordinator.Get(job).progress().photons(), 0U);
  EXPECT_TRUE(coordinator.Get(job).no_workers());

  const auto worker = coordinator.StartWorker();
  ASSERT_EQ(coordinator.Wait(job).state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(coordinator.ImageDigest(job).Hex(),
            UnfaultedDigest(kScene, kPasses, kPhotonsAPass).Hex());
}

}  // namespace
}  // namespace lucerna
