// Jobs that share workers, are paused, resumed, given other priorities and new ends, also while
// their coordinator is killed, bring the bits that each brings alone.
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "gtest/gtest.h"
#include <grpcpp/grpcpp.h>
#include <signal.h>

#include "proto/lucerna/v1/jobs.grpc.pb.h"
#include "render/math/rng.h"
#include "render/scene/render_settings.h"
#include "render/wire/messages.h"
#include "tests/fault/coordinator_process.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace {

SmallJob JobNamed(const std::string& request_id, int passes) {
  return {.passes = passes, .photons = 20'000, .request_id = request_id};
}

const std::vector<int> kPassesOfJobs = {24, 40, 31};

// Alone on a coordinator, one after the other.
const std::vector<std::string>& QuietDigests() {
  static const std::vector<std::string> digests = [] {
    CoordinatorProcess coordinator({"--jobs-at-once", "1"});
    const auto worker = coordinator.StartWorker();
    std::vector<std::string> found;
    for (const int passes : kPassesOfJobs) {
      const std::string job = coordinator.TrySubmit(JobNamed(absl::StrCat(passes), passes)).value();
      EXPECT_EQ(coordinator.Wait(job).state(), v1::JOB_STATE_SUCCEEDED);
      found.push_back(coordinator.ImageDigest(job).Hex());
    }
    return found;
  }();
  return digests;
}

std::vector<std::string> SubmitAll(CoordinatorProcess& coordinator) {
  std::vector<std::string> jobs;
  for (const int passes : kPassesOfJobs)
    jobs.push_back(coordinator.TrySubmit(JobNamed(absl::StrCat(passes), passes)).value());
  return jobs;
}

void ExpectQuietEnds(CoordinatorProcess& coordinator, const std::vector<std::string>& jobs) {
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    const v1::Job ended = coordinator.Wait(jobs[i]);
    ASSERT_EQ(ended.state(), v1::JOB_STATE_SUCCEEDED) << ended.failure();
    EXPECT_EQ(ended.progress().passes(), kPassesOfJobs[i]);
    EXPECT_EQ(ended.progress().photons(), static_cast<std::uint64_t>(kPassesOfJobs[i]) * 20'000);
    EXPECT_EQ(coordinator.ImageDigest(jobs[i]).Hex(), QuietDigests()[i]);
  }
}

// Makes one call on a job's service; the errors are those of the calls.
template <typename Request>
grpc::Status Call(CoordinatorProcess& coordinator, const Request& request,
                  grpc::Status (v1::JobService::Stub::*method)(grpc::ClientContext*, const Request&,
                                                               v1::Job*)) {
  const auto stub = v1::JobService::NewStub(coordinator.channel());
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + kPatience);
  v1::Job job;
  return ((*stub).*method)(&context, request, &job);
}

grpc::Status Pause(CoordinatorProcess& coordinator, const std::string& job) {
  v1::PauseJobRequest request;
  request.set_job_id(job);
  return Call(coordinator, request, &v1::JobService::Stub::Pause);
}

grpc::Status Resume(CoordinatorProcess& coordinator, const std::string& job) {
  v1::ResumeJobRequest request;
  request.set_job_id(job);
  return Call(coordinator, request, &v1::JobService::Stub::Resume);
}

grpc::Status SetPriority(CoordinatorProcess& coordinator, const std::string& job, int priority) {
  v1::SetJobPriorityRequest request;
  request.set_job_id(job);
  request.set_priority(priority);
  return Call(coordinator, request, &v1::JobService::Stub::SetPriority);
}

grpc::Status Extend(CoordinatorProcess& coordinator, const std::string& job, int passes) {
  v1::ExtendJobRequest request;
  request.set_job_id(job);
  RenderOverrides until;
  until.passes = passes;
  *request.mutable_until() = ToProto(until);
  return Call(coordinator, request, &v1::JobService::Stub::Extend);
}

void WaitFor(CoordinatorProcess& coordinator, const std::string& job,
             const std::function<bool(const v1::Job&)>& is_there) {
  for (int i = 0; i < 6000; ++i) {
    if (is_there(coordinator.Get(job))) return;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  ADD_FAILURE() << coordinator.Get(job).ShortDebugString();
}

TEST(ManyJobsFaultTest, JobsThatRunAtOnceHaveTheBitsOfEachAlone) {
  CoordinatorProcess coordinator({"--jobs-at-once", "3"});
  const auto worker = coordinator.StartWorker();
  const auto other_worker = coordinator.StartWorker();
  ExpectQuietEnds(coordinator, SubmitAll(coordinator));
}

TEST(ManyJobsFaultTest, StormsOfPauseResumePriorityAndExtendEndInTheQuietBits) {
  CoordinatorProcess coordinator({"--jobs-at-once", "2"});
  const auto worker = coordinator.StartWorker();
  const auto other_worker = coordinator.StartWorker();
  const std::vector<std::string> jobs = SubmitAll(coordinator);
  KeyedRng rng(CombineKeys(16, 6));
  for (int i = 0; i < 400; ++i) {
    const std::size_t which = rng.Bits() % jobs.size();
    const std::string& job = jobs[which];
    switch (rng.Bits() % 5) {
      case 0:
        (void)Pause(coordinator, job);
        break;
      case 1:
      case 2:
        (void)Resume(coordinator, job);
        break;
      case 3:
        (void)SetPriority(coordinator, job, static_cast<int>(rng.Bits() % 5));
        break;
      default:
        (void)Extend(coordinator, job, kPassesOfJobs[which]);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(rng.Bits() % 8));
  }
  for (const std::string& job : jobs)
    (void)Resume(coordinator, job);
  ExpectQuietEnds(coordinator, jobs);
}

TEST(ManyJobsFaultTest, AJobThatIsPausedStaysSoAfterACrashAndGoesOnWithTheQuietBits) {
  const TemporaryFolder folder;
  const std::string address = FreeAddress();
  const std::vector<std::string> flags = {"--state", folder.path(), "--checkpoint-share", "1"};
  auto coordinator = std::make_unique<CoordinatorProcess>(flags, address);
  const auto worker = coordinator->StartWorker();
  const std::vector<std::string> jobs = SubmitAll(*coordinator);
  WaitFor(*coordinator, jobs[1], [](const v1::Job& job) { return job.progress().passes() >= 3; });
  ASSERT_TRUE(Pause(*coordinator, jobs[1]).ok());
  ASSERT_TRUE(SetPriority(*coordinator, jobs[2], 7).ok());
  ASSERT_EQ(coordinator->Get(jobs[1]).state(), v1::JOB_STATE_PAUSED);
  coordinator->process().Signal(SIGKILL);
  ASSERT_TRUE(coordinator->process().WaitForExit(kPatience));
  coordinator = std::make_unique<CoordinatorProcess>(flags, address);
  const v1::Job paused = coordinator->Get(jobs[1]);
  EXPECT_EQ(paused.state(), v1::JOB_STATE_PAUSED);
  EXPECT_EQ(paused.condition(), "paused by its user");
  EXPECT_EQ(coordinator->Get(jobs[2]).priority(), 7);
  // The others end while it is paused.
  EXPECT_EQ(coordinator->Wait(jobs[0]).state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(coordinator->Wait(jobs[2]).state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(coordinator->Get(jobs[1]).state(), v1::JOB_STATE_PAUSED);
  ASSERT_TRUE(Resume(*coordinator, jobs[1]).ok());
  ExpectQuietEnds(*coordinator, jobs);
}

// A coordinator that keeps everything in a folder, and one worker; both can be replaced.
class RestartTest : public testing::Test {
 protected:
  void Start() { coordinator_ = std::make_unique<CoordinatorProcess>(flags_, address_); }
  void End(int signal) {
    coordinator_->process().Signal(signal);
    ASSERT_TRUE(coordinator_->process().WaitForExit(kPatience));
  }

  const TemporaryFolder folder_;
  const std::string address_ = FreeAddress();
  const std::vector<std::string> flags_ = {"--state", folder_.path(), "--checkpoint-share", "1"};
  std::unique_ptr<CoordinatorProcess> coordinator_;
};

TEST_F(RestartTest, ANewEndOfAPausedJobSurvivesACrash) {
  Start();
  const auto worker = coordinator_->StartWorker();
  const std::string job = coordinator_->TrySubmit(JobNamed("one", 1'000'000)).value();
  WaitFor(*coordinator_, job, [](const v1::Job& now) { return now.progress().passes() >= 3; });
  ASSERT_TRUE(Pause(*coordinator_, job).ok());
  // Else the quiet run would have fewer passes.
  ASSERT_LT(coordinator_->Get(job).progress().passes(), kPassesOfJobs[1]);
  ASSERT_TRUE(Extend(*coordinator_, job, kPassesOfJobs[1]).ok());
  End(SIGKILL);
  Start();
  ASSERT_TRUE(Resume(*coordinator_, job).ok());
  const v1::Job ended = coordinator_->Wait(job);
  ASSERT_EQ(ended.state(), v1::JOB_STATE_SUCCEEDED) << ended.failure();
  EXPECT_EQ(ended.progress().passes(), kPassesOfJobs[1]);
  EXPECT_EQ(coordinator_->ImageDigest(job).Hex(), QuietDigests()[1]);
}

TEST_F(RestartTest, AnEndedJobGoesOnAfterACrashWhenItIsExtended) {
  Start();
  const auto worker = coordinator_->StartWorker();
  const std::string job = coordinator_->TrySubmit(JobNamed("one", kPassesOfJobs[0])).value();
  ASSERT_EQ(coordinator_->Wait(job).state(), v1::JOB_STATE_SUCCEEDED);
  End(SIGKILL);
  Start();
  ASSERT_TRUE(Extend(*coordinator_, job, kPassesOfJobs[1]).ok());
  const v1::Job ended = coordinator_->Wait(job);
  ASSERT_EQ(ended.state(), v1::JOB_STATE_SUCCEEDED) << ended.failure();
  EXPECT_EQ(ended.progress().passes(), kPassesOfJobs[1]);
  EXPECT_EQ(ended.progress().photons(), static_cast<std::uint64_t>(kPassesOfJobs[1]) * 20'000);
  EXPECT_EQ(coordinator_->ImageDigest(job).Hex(), QuietDigests()[1]);
}

double RunningSeconds(const v1::Job& job) {
  return static_cast<double>(job.progress().running().seconds()) +
         1e-9 * static_cast<double>(job.progress().running().nanos());
}

TEST_F(RestartTest, TimeBeforeARestartCountsAndTimeWithoutAWorkerDoesNot) {
  constexpr double kTimeLimit = 4;
  Start();
  std::string job;
  {
    const auto worker = coordinator_->StartWorker();
    job = coordinator_->TrySubmit({.photons = 20'000, .time_s = kTimeLimit}).value();
    WaitFor(*coordinator_, job, [](const v1::Job& now) { return RunningSeconds(now) >= 1; });
    ASSERT_EQ(coordinator_->Get(job).state(), v1::JOB_STATE_RUNNING);
    End(SIGKILL);
  }
  Start();
  // The newest checkpoint, one of which follows each round, is read a moment after the start.
  WaitFor(*coordinator_, job, [](const v1::Job& now) { return now.progress().passes() > 0; });
  const v1::Job after = coordinator_->Get(job);
  EXPECT_GT(RunningSeconds(after), 0.1);
  // Longer than the limit: a clock that went on would end the job.
  std::this_thread::sleep_for(std::chrono::seconds(6));
  const v1::Job waiting = coordinator_->Get(job);
  EXPECT_LT(waiting.state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(RunningSeconds(waiting), RunningSeconds(after));
  const auto worker = coordinator_->StartWorker();
  const v1::Job ended = coordinator_->Wait(job);
  ASSERT_EQ(ended.state(), v1::JOB_STATE_SUCCEEDED) << ended.failure();
  EXPECT_GE(RunningSeconds(ended), kTimeLimit);
  EXPECT_GT(ended.progress().passes(), after.progress().passes());
}

// The seconds in which it waits for commits are not time of the job.
TEST_F(RestartTest, AnOrderlyEndOfTheCoordinatorDoesNotEndAJobByItsTime) {
  Start();
  const auto worker = coordinator_->StartWorker();
  const std::string job = coordinator_->TrySubmit({.photons = 20'000, .time_s = 4}).value();
  WaitFor(*coordinator_, job, [](const v1::Job& now) { return RunningSeconds(now) >= 1; });
  End(SIGTERM);
  Start();
  EXPECT_LT(coordinator_->Get(job).state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(coordinator_->Wait(job).state(), v1::JOB_STATE_SUCCEEDED);
}

}  // namespace
}  // namespace lucerna
