// A job is stopped with its image, goes on to a new end, and is stopped again, in any of its
// states.
#include <algorithm>
#include <chrono>
#include <string>
#include <thread>

#include "gtest/gtest.h"

#include "render/wire/messages.h"
#include "tests/service/service_under_test.h"

namespace lucerna {
namespace {

TEST(StopAndExtendTest, AJobThatRunsForEverIsStoppedAndGoesOn) {
  ServiceUnderTest service;
  TestClient client(service);
  const v1::SceneManifest scene = client.Upload(SmallScene());
  const WorkerThread worker(service);
  const std::string job = client.Submit(RequestFor(scene, "long", 1'000'000)).message.job_id();
  ASSERT_TRUE(client.WaitFor(job, {v1::JOB_STATE_RUNNING}).ok());
  EXPECT_TRUE(client.Stop(job).ok());
  const v1::Job stopped = client.WaitFor(job, {v1::JOB_STATE_SUCCEEDED}).message;
  EXPECT_EQ(stopped.stop_reason(), v1::STOP_REASON_USER);
  EXPECT_GE(stopped.progress().passes(), 1);
  EXPECT_TRUE(client.Image(job).ok());

  const std::int64_t more = stopped.progress().passes() + 3;
  EXPECT_EQ(client.Extend(job, more).message.stop_reason(), v1::STOP_REASON_UNSPECIFIED);
  const v1::Job extended = client.WaitFor(job, {v1::JOB_STATE_SUCCEEDED}).message;
  EXPECT_EQ(extended.stop_reason(), v1::STOP_REASON_PASSES);
  EXPECT_EQ(extended.progress().passes(), more);
}

// The stop was forgotten when the job began to go on, and it then waited for workers.
TEST(StopAndExtendTest, AStopOfAJobThatWaitsToGoOnIsNotForgotten) {
  ServiceUnderTest service;
  TestClient client(service);
  const v1::SceneManifest scene = client.Upload(SmallScene());
  std::string first;
  {
    const WorkerThread worker(service);
    first = client.Submit(RequestFor(scene, "first", 2)).message.job_id();
    ASSERT_TRUE(client.WaitFor(first, {v1::JOB_STATE_SUCCEEDED}).ok());
  }
  const std::string second = client.Submit(RequestFor(scene, "second", 2)).message.job_id();
  ASSERT_TRUE(client.WaitFor(second, {v1::JOB_STATE_RUNNING}).ok());
  EXPECT_EQ(client.Extend(first, 100).message.state(), v1::JOB_STATE_QUEUED);
  EXPECT_TRUE(client.Stop(first).ok());
  EXPECT_TRUE(client.Cancel(second).ok());
  const v1::Job stopped = client.WaitFor(first, {v1::JOB_STATE_SUCCEEDED}).message;
  EXPECT_EQ(stopped.stop_reason(), v1::STOP_REASON_USER);
  EXPECT_EQ(stopped.progress().passes(), 2);
}

TEST(StopAndExtendTest, AJobThatHasNotBegunIsCancelledInstead) {
  ServiceUnderTest service;
  TestClient client(service);
  const v1::SceneManifest scene = client.Upload(SmallScene());
  const std::string first = client.Submit(RequestFor(scene, "first", 2)).message.job_id();
  const std::string second = client.Submit(RequestFor(scene, "second", 2)).message.job_id();
  EXPECT_EQ(client.Stop(second).code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(SettingsOf(client.Extend(second, 3).message).passes, 3);
  EXPECT_EQ(client.Image(second).code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(client.Cancel(second).message.state(), v1::JOB_STATE_CANCELLED);
  EXPECT_EQ(client.Extend(second, 4).code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(client.Stop(second).message.state(), v1::JOB_STATE_CANCELLED);
  EXPECT_EQ(client.Cancel("unknown").code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(client.Stop("unknown").code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(client.Extend("unknown", 1).code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(client.Watch("unknown").status.error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(client.Image("unknown").code(), grpc::StatusCode::NOT_FOUND);
}

v1::SubmitRequest ForSeconds(const v1::SceneManifest& scene, double time_s) {
  v1::SubmitRequest request = RequestFor(scene, "timed", 1);
  RenderOverrides overrides;
  overrides.time_s = time_s;
  overrides.photons_per_pass = 1000;
  overrides.radius_controller = RadiusControllerKind::kPppm;
  *request.mutable_overrides() = ToProto(overrides);
  return request;
}

bool SaysThatFirstPassIsLate(const v1::Job& job) {
  return std::ranges::any_of(job.warnings(), [](const std::string& warning) {
    return warning.find("the 5 s were over before the first pass was whole") != std::string::npos;
  });
}

// What is out when time is up is taken back; the image is that of the passes that are whole.
TEST(StopAndExtendTest, TimeThatIsUpTakesLeasesBackAndKeepsWholePasses) {
  ServiceUnderTest service;
  TestClient client(service);
  const v1::SceneManifest scene = client.Upload(SmallScene());
  IdleHandsWorker worker(service);
  const std::string job = client.Submit(ForSeconds(scene, 5)).message.job_id();
  const auto first = worker.TakeLease();
  ASSERT_TRUE(first);
  ASSERT_TRUE(worker.Commit(*first).ok());
  const auto second = worker.TakeLease();
  ASSERT_TRUE(second);
  service.clock().Move(std::chrono::seconds(5));
  const v1::Job ended = client.WaitFor(job, {v1::JOB_STATE_SUCCEEDED}).message;
  EXPECT_EQ(ended.stop_reason(), v1::STOP_REASON_TIME);
  EXPECT_EQ(ended.progress().passes(), 1);
  EXPECT_EQ(ended.progress().photons(), 1000U);
  EXPECT_FALSE(SaysThatFirstPassIsLate(ended));
  const auto answer = worker.Sync(false, Duration::zero(), {second->lease_id()});
  ASSERT_EQ(answer.message.revoked_lease_ids_size(), 1);
  EXPECT_EQ(answer.message.revoked_lease_ids(0), second->lease_id());
  EXPECT_EQ(worker.Commit(*second).message.outcome(), v1::COMMIT_OUTCOME_SUPERSEDED);
}

// An image has at least one pass: it is finished, nothing else is lent, and the job says so.
TEST(StopAndExtendTest, TimeThatIsUpBeforeTheFirstPassWaitsForThatAlone) {
  ServiceUnderTest service;
  TestClient client(service);
  const v1::SceneManifest scene = client.Upload(SmallScene());
  IdleHandsWorker worker(service);
  const std::string job = client.Submit(ForSeconds(scene, 5)).message.job_id();
  const auto first = worker.TakeLease();
  ASSERT_TRUE(first);
  EXPECT_EQ(client.Get(job).message.warnings_size(), 0);
  service.clock().Move(std::chrono::seconds(5));
  v1::Job warned = client.Get(job).message;
  for (int i = 0; i < 20'000 && !SaysThatFirstPassIsLate(warned); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    warned = client.Get(job).message;
  }
  ASSERT_TRUE(SaysThatFirstPassIsLate(warned));
  EXPECT_EQ(warned.state(), v1::JOB_STATE_RUNNING);
  IdleHandsWorker other(service, "other");
  EXPECT_FALSE(other.Sync(true, Duration::zero()).message.has_lease()) << "of a later pass";
  EXPECT_EQ(
      worker.Sync(false, Duration::zero(), {first->lease_id()}).message.revoked_lease_ids_size(),
      0);
  ASSERT_TRUE(worker.Commit(*first).ok());
  const v1::Job ended = client.WaitFor(job, {v1::JOB_STATE_SUCCEEDED}).message;
  EXPECT_EQ(ended.stop_reason(), v1::STOP_REASON_TIME);
  EXPECT_EQ(ended.progress().passes(), 1);
  EXPECT_TRUE(SaysThatFirstPassIsLate(ended));
}

}  // namespace
}  // namespace lucerna
