// Any two requests at once, in any state of a job: each gets an answer that its contract allows,
// and the coordinator goes on to the next job.
#include <algorithm>
#include <array>
#include <string>
#include <thread>

#include "gtest/gtest.h"

#include "render/math/rng.h"
#include "tests/service/service_under_test.h"

namespace lucerna {
namespace {

enum class Request : std::uint8_t { kSubmitAgain, kCancel, kStop, kExtend, kWatch, kImage };
constexpr std::array<Request, 6> kRequests = {Request::kSubmitAgain, Request::kCancel,
                                              Request::kStop,        Request::kExtend,
                                              Request::kWatch,       Request::kImage};

enum class State : std::uint8_t {
  kJustSubmitted,
  kWaiting,
  kRunning,
  kSucceeded,
  kWaitingToGoOn,
  kCancelled,
};

class PairsTest : public testing::TestWithParam<State> {
 protected:
  PairsTest() : client_(service_), scene_(client_.Upload(SmallScene())), worker_(service_) {}

  static bool NeedsBusyCoordinator(State state) {
    return state == State::kWaiting || state == State::kWaitingToGoOn;
  }

  std::string SubmitNew(const std::string& request_id, std::int64_t passes) {
    const auto job = client_.Submit(RequestFor(scene_, request_id, passes));
    EXPECT_TRUE(job.ok()) << job.status.error_message();
    return job.message.job_id();
  }

  // A job in the state, and one that runs before it if that is what the state needs.
  std::string JobIn(State state, const std::string& request_id, std::string& before) {
    const bool is_short = state == State::kSucceeded || state == State::kWaitingToGoOn;
    std::string job;
    if (is_short) {
      job = SubmitNew(request_id, 2);
      EXPECT_TRUE(client_.WaitFor(job, {v1::JOB_STATE_SUCCEEDED}).ok());
    }
    if (NeedsBusyCoordinator(state)) {
      before = SubmitNew(request_id + " before", kEndless);
      EXPECT_TRUE(client_.WaitFor(before, {v1::JOB_STATE_RUNNING}).ok());
    }
    if (state == State::kWaitingToGoOn) {
      EXPECT_TRUE(client_.Extend(job, kEndless).ok());
    }
    if (is_short) return job;
    job = SubmitNew(request_id, kEndless);
    if (state == State::kRunning) {
      EXPECT_TRUE(client_.WaitFor(job, {v1::JOB_STATE_RUNNING}).ok());
    }
    if (state == State::kCancelled) {
      EXPECT_TRUE(client_.Cancel(job).ok());
    }
    return job;
  }

  void Make(Request request, const std::string& job, const std::string& request_id,
            TestClient& client, std::atomic<bool>& was_cancelled) {
    grpc::Status status;
    switch (request) {
      case Request::kSubmitAgain: {
        const auto again = client.Submit(RequestFor(scene_, request_id, 3));
        status = again.status;
        EXPECT_EQ(again.message.job_id(), job) << "the same request";
        break;
      }
      case Request::kCancel: {
        const auto cancelled = client.Cancel(job);
        status = cancelled.status;
        EXPECT_TRUE(cancelled.message.state() >= v1::JOB_STATE_SUCCEEDED);
        if (cancelled.message.state() == v1::JOB_STATE_CANCELLED) was_cancelled = true;
        break;
      }
      case Request::kStop:
        status = client.Stop(job).status;
        break;
      case Request::kExtend:
        status = client.Extend(job, kEndless).status;
        break;
      case Request::kWatch: {
        int messages = 0;
        const auto watched = client.Watch(job, [&](const v1::Job&) { return ++messages < 2; });
        EXPECT_TRUE(watched.ok() || watched.code() == grpc::StatusCode::CANCELLED)
            << watched.status.error_message();
        return;
      }
      case Request::kImage:
        status = client.Image(job).status;
        break;
    }
    EXPECT_TRUE(status.ok() || status.error_code() == grpc::StatusCode::FAILED_PRECONDITION)
        << static_cast<int>(request) << ": " << status.error_message();
  }

  ServiceUnderTest service_;
  TestClient client_;
  v1::SceneManifest scene_;
  WorkerThread worker_;
};

TEST_P(PairsTest, AreAnsweredAndTheNextJobRuns) {
  TestClient first(service_);
  TestClient second(service_);
  int pair = 0;
  for (const Request one : kRequests) {
    for (const Request other : kRequests) {
      KeyedRng rng(CombineKeys(static_cast<std::uint64_t>(GetParam()), pair));
      const std::string request_id = absl::StrCat("pair ", pair++);
      SCOPED_TRACE(request_id);
      std::string before;
      const std::string job = JobIn(GetParam(), request_id, before);
      std::atomic<bool> was_cancelled = false;
      const auto later = [&rng] { return std::chrono::microseconds(rng.Bits() % 1500); };
      const auto pause_of_one = later();
      const auto pause_of_other = later();
      // A watch of a job at rest hears of nothing new until it ends.
      std::atomic<int> answered = 0;
      std::thread thread([&] {
        std::this_thread::sleep_for(pause_of_one);
        Make(one, job, request_id, first, was_cancelled);
        ++answered;
      });
      std::thread other_thread([&] {
        std::this_thread::sleep_for(pause_of_other);
        Make(other, job, request_id, second, was_cancelled);
        ++answered;
      });
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
      if (!before.empty()) {
        EXPECT_TRUE(client_.Cancel(before).ok());
      }
      const v1::Job ended = client_.Cancel(job).message;
      // Ends the watches too. More than once: an extension may come after a cancel that found the
      // job succeeded, and a watch of a job that runs hears of nothing new while time stands still.
      while (answered < 2) {
        EXPECT_TRUE(client_.Cancel(job).ok());
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
      thread.join();
      other_thread.join();
      EXPECT_GE(ended.state(), v1::JOB_STATE_SUCCEEDED);
      const v1::JobState state = client_.Get(job).message.state();
      if (was_cancelled) {
        EXPECT_EQ(state, v1::JOB_STATE_CANCELLED);
      }
      // The extension may have been the last of all.
      EXPECT_TRUE(client_.Cancel(job).ok());
    }
  }
  const std::string last = SubmitNew("last", 2);
  EXPECT_EQ(client_.WaitFor(last, {v1::JOB_STATE_SUCCEEDED}).message.progress().passes(), 2);
}

INSTANTIATE_TEST_SUITE_P(InEveryState, PairsTest,
                         testing::Values(State::kJustSubmitted, State::kWaiting, State::kRunning,
                                         State::kSucceeded, State::kWaitingToGoOn,
                                         State::kCancelled));

}  // namespace
}  // namespace lucerna
