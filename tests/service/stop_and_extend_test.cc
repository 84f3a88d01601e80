// A job is stopped with its image, goes on to a new end, and is stopped again, in any of its
// states.
#include <string>

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

}  // namespace
}  // namespace lucerna
