// A job that is cancelled, whatever it was about to do, makes room for the next one.
#include <string>
#include <thread>
#include <vector>

#include "gtest/gtest.h"

#include "tests/service/service_under_test.h"

namespace lucerna {
namespace {

TEST(CancelTest, AJobThatWaitsForWorkersEndsAndTheNextOneRuns) {
  ServiceUnderTest service;
  TestClient client(service);
  const v1::SceneManifest scene = client.Upload(SmallScene());
  const std::string first = client.Submit(RequestFor(scene, "first", 2)).message.job_id();
  ASSERT_TRUE(client.WaitFor(first, {v1::JOB_STATE_RUNNING}).ok());
  EXPECT_EQ(client.Cancel(first).message.state(), v1::JOB_STATE_CANCELLED);
  const WorkerThread worker(service);
  const std::string second = client.Submit(RequestFor(scene, "second", 2)).message.job_id();
  EXPECT_EQ(client.WaitFor(second, {v1::JOB_STATE_SUCCEEDED}).message.progress().passes(), 2);
}

// A cancel that arrived between the moment in which the handler searched for the job's runner and
// the one in which the job got it left the job's thread waiting for ever.
TEST(CancelTest, ClientsThatSubmitAndCancelLeaveTheCoordinatorAtWork) {
  ServiceUnderTest service;
  const v1::SceneManifest scene = TestClient(service).Upload(SmallScene());
  std::vector<std::thread> clients;
  for (int c = 0; c < 2; ++c) {
    clients.emplace_back([&service, &scene, c] {
      TestClient client(service);
      for (int i = 0; i < 1000; ++i) {
        const auto job = client.Submit(RequestFor(scene, absl::StrCat(c, " ", i), 2));
        ASSERT_TRUE(job.ok()) << job.status.error_message();
        std::this_thread::sleep_for(std::chrono::microseconds(i % 97));
        const auto cancelled = client.Cancel(job.message.job_id());
        ASSERT_TRUE(cancelled.ok()) << cancelled.status.error_message();
        EXPECT_EQ(cancelled.message.state(), v1::JOB_STATE_CANCELLED);
      }
    });
  }
  for (std::thread& thread : clients)
    thread.join();
  TestClient client(service);
  const WorkerThread worker(service);
  const std::string last = client.Submit(RequestFor(scene, "last", 2)).message.job_id();
  EXPECT_EQ(client.WaitFor(last, {v1::JOB_STATE_SUCCEEDED}).message.progress().passes(), 2);
}

}  // namespace
}  // namespace lucerna
