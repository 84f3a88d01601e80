// A worker that is drained or in quarantine stays so when the coordinator is killed and started
// again, until it is released.
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "gtest/gtest.h"

#include "proto/lucerna/v1/admin.grpc.pb.h"
#include "tests/fault/coordinator_process.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace {

using Order = grpc::Status (v1::AdminService::Stub::*)(grpc::ClientContext*,
                                                       const v1::WorkerRequest&, v1::Worker*);

v1::Worker Send(const CoordinatorProcess& coordinator, Order order, const std::string& worker_id) {
  const auto admin = v1::AdminService::NewStub(coordinator.channel());
  grpc::ClientContext context;
  v1::WorkerRequest request;
  request.set_worker_id(worker_id);
  v1::Worker worker;
  const grpc::Status status = (admin.get()->*order)(&context, request, &worker);
  EXPECT_TRUE(status.ok()) << status.error_message();
  return worker;
}

// The only worker, once it is connected.
v1::Worker ConnectedWorker(const CoordinatorProcess& coordinator) {
  const auto admin = v1::AdminService::NewStub(coordinator.channel());
  const auto give_up_at = std::chrono::steady_clock::now() + kPatience;
  while (std::chrono::steady_clock::now() < give_up_at) {
    grpc::ClientContext context;
    v1::ListWorkersResponse list;
    EXPECT_TRUE(admin->ListWorkers(&context, {}, &list).ok());
    if (list.workers_size() == 1 && list.workers(0).is_connected()) return list.workers(0);
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  ADD_FAILURE() << "no worker has connected";
  return {};
}

struct Case {
  const char* name;
  Order order;
  v1::WorkerState state;
};

class WorkerStandingTest : public testing::TestWithParam<Case> {};

TEST_P(WorkerStandingTest, OutlivesTheCoordinator) {
  const TemporaryFolder folder;
  const std::vector<std::string> flags = {"--state", folder.At("state")};
  const std::string address = FreeAddress();
  auto coordinator = std::make_unique<CoordinatorProcess>(flags, address);
  const auto worker = coordinator->StartWorker();
  const std::string id = ConnectedWorker(*coordinator).worker_id();
  EXPECT_EQ(Send(*coordinator, GetParam().order, id).state(), GetParam().state);
  coordinator->process().Signal(SIGKILL);
  ASSERT_TRUE(coordinator->process().WaitForExit(kPatience));
  coordinator = std::make_unique<CoordinatorProcess>(flags, address);
  const v1::Worker again = ConnectedWorker(*coordinator);
  EXPECT_EQ(again.worker_id(), id);
  EXPECT_EQ(again.state(), GetParam().state);
  const std::string job = coordinator->Submit("glass-box.pbrt", 2, 10'000);
  Send(*coordinator, &v1::AdminService::Stub::ReleaseWorker, id);
  const v1::Job ended = coordinator->Wait(job);
  EXPECT_EQ(ended.state(), v1::JOB_STATE_SUCCEEDED) << ended.failure();
  EXPECT_EQ(coordinator->ImageDigest(job).Hex(),
            UnfaultedDigest("glass-box.pbrt", 2, 10'000).Hex());
  // Nor does what was released come back.
  coordinator->process().Signal(SIGKILL);
  ASSERT_TRUE(coordinator->process().WaitForExit(kPatience));
  coordinator = std::make_unique<CoordinatorProcess>(flags, address);
  EXPECT_EQ(ConnectedWorker(*coordinator).state(), v1::WORKER_STATE_ACTIVE);
}

INSTANTIATE_TEST_SUITE_P(
    Orders, WorkerStandingTest,
    testing::Values(Case{"Drain", &v1::AdminService::Stub::DrainWorker, v1::WORKER_STATE_DRAINED},
                    Case{"Quarantine", &v1::AdminService::Stub::QuarantineWorker,
                         v1::WORKER_STATE_QUARANTINED}),
    [](const testing::TestParamInfo<Case>& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace lucerna
