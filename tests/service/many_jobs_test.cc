// Several jobs at once share the workers, are paused, resumed and prioritised, and none blocks
// another.
#include <map>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "gtest/gtest.h"

#include "render/math/rng.h"
#include "render/wire/messages.h"
#include "tests/service/service_under_test.h"

namespace lucerna {
namespace {

class ManyJobsTest : public testing::Test {
 protected:
  ManyJobsTest()
      : service_({.jobs_at_once = 2}), client_(service_), scene_(client_.Upload(SmallScene())) {}

  std::string Submit(const std::string& request_id, std::int64_t passes, int priority = 0) {
    v1::SubmitRequest request = RequestFor(scene_, request_id, passes);
    request.set_priority(priority);
    const auto job = client_.Submit(request);
    EXPECT_TRUE(job.ok()) << job.status.error_message();
    return job.message.job_id();
  }
  v1::JobState StateOf(const std::string& job) { return client_.Get(job).message.state(); }
  std::int64_t PassesOf(const std::string& job) {
    return client_.Get(job).message.progress().passes();
  }
  // A watcher hears of progress only when time passes.
  void WaitForPasses(const std::string& job, std::int64_t passes) {
    for (int i = 0; i < 10'000 && PassesOf(job) < passes; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    EXPECT_GE(PassesOf(job), passes);
  }

  ServiceUnderTest service_;
  TestClient client_;
  v1::SceneManifest scene_;
};

TEST_F(ManyJobsTest, TwoRunAtOnceAndAreLentInTurns) {
  const std::string a = Submit("a", kEndless);
  const std::string b = Submit("b", kEndless);
  const std::string c = Submit("c", 2);
  ASSERT_TRUE(client_.WaitFor(a, {v1::JOB_STATE_RUNNING}).ok());
  ASSERT_TRUE(client_.WaitFor(b, {v1::JOB_STATE_RUNNING}).ok());
  EXPECT_EQ(StateOf(c), v1::JOB_STATE_QUEUED);
  IdleHandsWorker worker(service_);
  std::map<std::string, int> leases;
  for (int i = 0; i < 200; ++i) {
    const auto lease = worker.TakeLease();
    ASSERT_TRUE(lease);
    ++leases[lease->job_id()];
    ASSERT_TRUE(worker.Commit(*lease).ok());
  }
  // Each has nothing to lend now and then, while its rounds are taken in.
  EXPECT_GT(leases[a], 50);
  EXPECT_GT(leases[b], 50);
  EXPECT_TRUE(client_.Cancel(a).ok());
  const WorkerThread diligent(service_);
  EXPECT_TRUE(client_.WaitFor(c, {v1::JOB_STATE_SUCCEEDED}).ok());
  EXPECT_EQ(StateOf(b), v1::JOB_STATE_RUNNING);
}

TEST_F(ManyJobsTest, HigherPriorityRunsFirstAlsoWhenItComesLast) {
  const WorkerThread worker(service_);
  const std::string low = Submit("low", kEndless, -1);
  const std::string high = Submit("high", kEndless, 3);
  ASSERT_TRUE(client_.WaitFor(low, {v1::JOB_STATE_RUNNING}).ok());
  ASSERT_TRUE(client_.WaitFor(high, {v1::JOB_STATE_RUNNING}).ok());
  const std::string middle = Submit("middle", kEndless, 1);
  ASSERT_TRUE(client_.WaitFor(middle, {v1::JOB_STATE_RUNNING}).ok());
  ASSERT_TRUE(client_.WaitFor(low, {v1::JOB_STATE_QUEUED}).ok());
  EXPECT_EQ(client_.SetPriority(low, 2).message.priority(), 2);
  ASSERT_TRUE(client_.WaitFor(low, {v1::JOB_STATE_RUNNING}).ok());
  ASSERT_TRUE(client_.WaitFor(middle, {v1::JOB_STATE_QUEUED}).ok());
  EXPECT_EQ(StateOf(high), v1::JOB_STATE_RUNNING);
  EXPECT_EQ(client_.SetPriority(low, 101).code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(client_.SetPriority("unknown", 1).code(), grpc::StatusCode::NOT_FOUND);
  v1::SubmitRequest request = RequestFor(scene_, "too high", 2);
  request.set_priority(-101);
  EXPECT_EQ(client_.Submit(request).code(), grpc::StatusCode::INVALID_ARGUMENT);
}

TEST_F(ManyJobsTest, APausedJobIsLentNothingKeepsWhatComesBackAndGoesOnToItsEnd) {
  const std::string job = Submit("job", 12);
  IdleHandsWorker worker(service_);
  // The first image, then a lease that is out while the job is paused.
  while (PassesOf(job) < 2)
    ASSERT_TRUE(worker.Commit(worker.TakeLease().value()).ok());
  const v1::Lease lease = worker.TakeLease().value();
  const v1::Job paused = client_.Pause(job).message;
  EXPECT_EQ(paused.state(), v1::JOB_STATE_PAUSED);
  EXPECT_EQ(paused.pause_cause(), v1::PAUSE_CAUSE_USER);
  EXPECT_EQ(paused.condition(), "paused by its user");
  const std::uint64_t photons = paused.progress().photons();
  // Others have its place and its workers.
  const std::string other = Submit("other", 3);
  const std::string third = Submit("third", 3);
  {
    const WorkerThread diligent(service_);
    EXPECT_TRUE(client_.WaitFor(other, {v1::JOB_STATE_SUCCEEDED}).ok());
    EXPECT_TRUE(client_.WaitFor(third, {v1::JOB_STATE_SUCCEEDED}).ok());
  }
  EXPECT_EQ(client_.Get(job).message.progress().photons(), photons) << "nothing of it was lent";
  const auto idle = worker.Sync(true, Duration::zero(), {lease.lease_id()});
  EXPECT_FALSE(idle.message.has_lease());
  EXPECT_EQ(idle.message.revoked_lease_ids_size(), 0);
  EXPECT_EQ(worker.Commit(lease).message.outcome(), v1::COMMIT_OUTCOME_ACCEPTED);
  EXPECT_TRUE(client_.Image(job).ok()) << "so far";
  EXPECT_GT(client_.Get(job).message.progress().photons(), photons);
  EXPECT_EQ(client_.Resume(job).message.state(), v1::JOB_STATE_QUEUED);
  const WorkerThread diligent(service_);
  const v1::Job ended = client_.WaitFor(job, {v1::JOB_STATE_SUCCEEDED}).message;
  EXPECT_EQ(ended.progress().passes(), 12);
  EXPECT_EQ(ended.progress().photons(), 12'000U)
      << "each once, also the " << photons << " from before the pause";
  EXPECT_EQ(client_.Pause(job).code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(client_.Resume(job).code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(client_.Pause("unknown").code(), grpc::StatusCode::NOT_FOUND);
}

TEST_F(ManyJobsTest, APausedJobIsStoppedWithItsImageOrCancelled) {
  const WorkerThread worker(service_);
  const std::string stopped = Submit("stopped", kEndless);
  const std::string cancelled = Submit("cancelled", kEndless);
  for (const std::string& job : {stopped, cancelled}) {
    WaitForPasses(job, 2);
    ASSERT_EQ(client_.Pause(job).message.state(), v1::JOB_STATE_PAUSED);
  }
  EXPECT_TRUE(client_.Stop(stopped).ok());
  EXPECT_EQ(client_.WaitFor(stopped, {v1::JOB_STATE_SUCCEEDED}).message.stop_reason(),
            v1::STOP_REASON_USER);
  EXPECT_TRUE(client_.Image(stopped).ok());
  EXPECT_EQ(client_.Cancel(cancelled).message.state(), v1::JOB_STATE_CANCELLED);
  const std::string next = Submit("next", 2);
  EXPECT_TRUE(client_.WaitFor(next, {v1::JOB_STATE_SUCCEEDED}).ok());
}

// A job that needs no photons ends although jobs that wait for workers have all places.
TEST_F(ManyJobsTest, JobsWithoutWorkersBlockNobodyAndTheirTimeStandsStill) {
  const std::string a = Submit("a", kEndless);
  const std::string b = Submit("b", kEndless);
  ASSERT_TRUE(client_.WaitFor(a, {v1::JOB_STATE_RUNNING}).ok());
  const v1::Job alone = client_.WaitFor(b, {v1::JOB_STATE_RUNNING}).message;
  EXPECT_TRUE(alone.no_workers());
  TestScene dark = SmallScene();
  std::string& text = dark.files.at("scene.pbrt");
  text.erase(text.find("LightSource"), text.find("Material") - text.find("LightSource"));
  const v1::SceneManifest scene = client_.Upload(dark);
  // The coordinator traces the eye paths of a first pass itself.
  const auto without_photons = client_.Submit(RequestFor(scene, "dark", 1));
  ASSERT_TRUE(without_photons.ok()) << without_photons.status.error_message();
  const std::string job = without_photons.message.job_id();
  EXPECT_EQ(StateOf(job), v1::JOB_STATE_QUEUED);
  service_.clock().Move(std::chrono::seconds(6));
  EXPECT_TRUE(client_.WaitFor(job, {v1::JOB_STATE_SUCCEEDED}).ok());
  EXPECT_EQ(client_.Get(a).message.progress().running().seconds(), 0);
  const WorkerThread worker(service_);
  WaitForPasses(a, 2);
  WaitForPasses(b, 2);
}

TEST_F(ManyJobsTest, ListsAreFiltered) {
  const std::string a = Submit("a", kEndless);
  const std::string b = Submit("b", kEndless);
  ASSERT_TRUE(client_.Pause(b).ok());
  v1::ListJobsRequest request;
  EXPECT_EQ(client_.List(request).message.jobs_size(), 2);
  request.add_states(v1::JOB_STATE_PAUSED);
  const v1::ListJobsResponse paused = client_.List(request).message;
  ASSERT_EQ(paused.jobs_size(), 1);
  EXPECT_EQ(paused.jobs(0).job_id(), b);
  request.set_name_contains("no such name");
  EXPECT_EQ(client_.List(request).message.jobs_size(), 0);
  request.add_states(static_cast<v1::JobState>(99));
  EXPECT_EQ(client_.List(request).code(), grpc::StatusCode::INVALID_ARGUMENT);
}

TEST_F(ManyJobsTest, OneRequestThirtyTimesAtOnceIsOneJob) {
  std::vector<std::thread> clients;
  std::vector<std::string> jobs(30);
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    clients.emplace_back([&, i] {
      TestClient client(service_);
      const auto job = client.Submit(RequestFor(scene_, "the same", 2));
      EXPECT_TRUE(job.ok()) << job.status.error_message();
      jobs[i] = job.message.job_id();
    });
  }
  for (std::thread& thread : clients)
    thread.join();
  EXPECT_EQ(std::set<std::string>(jobs.begin(), jobs.end()).size(), 1U);
  EXPECT_EQ(client_.List().message.jobs_size(), 1);
}

// What an ended job that keeps its photons holds, where there is room for many.
std::uint64_t HeldByAJob() {
  ServiceUnderTest service;
  TestClient client(service);
  const v1::SceneManifest scene = client.Upload(SmallScene());
  const WorkerThread worker(service);
  const std::string job = client.Submit(RequestFor(scene, "only", 2)).message.job_id();
  EXPECT_TRUE(client.WaitFor(job, {v1::JOB_STATE_SUCCEEDED}).ok());
  return service.coordinator().budget().HeldFor(MemoryUse::kJobs);
}

TEST(MemoryOfJobsTest, AJobThatDoesNotFitBesideOthersWaitsAndBlocksNobody) {
  // Room for one job of this size and a smaller one, and not for two.
  ServiceUnderTest service({.jobs_at_once = 2, .max_memory_bytes = HeldByAJob() * 7 / 4});
  TestClient client(service);
  const v1::SceneManifest scene = client.Upload(SmallScene());
  const std::string first = client.Submit(RequestFor(scene, "first", kEndless)).message.job_id();
  ASSERT_TRUE(client.WaitFor(first, {v1::JOB_STATE_RUNNING}).ok());
  const std::string second = client.Submit(RequestFor(scene, "second", 2)).message.job_id();
  std::string condition;
  for (int i = 0; i < 10'000 && condition.empty(); ++i) {
    condition = client.Get(second).message.condition();
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_EQ(condition, "waits for memory that other jobs hold");
  EXPECT_EQ(client.Get(second).message.state(), v1::JOB_STATE_PREPARING);
  // It has left its place to a smaller one.
  v1::SubmitRequest small = RequestFor(scene, "small", 2);
  RenderOverrides overrides;
  overrides.passes = 2;
  overrides.photons_per_pass = 1000;
  overrides.radius_controller = RadiusControllerKind::kPppm;
  overrides.width = 2;
  overrides.height = 2;
  *small.mutable_overrides() = ToProto(overrides);
  const auto third = client.Submit(small);
  ASSERT_TRUE(third.ok()) << third.status.error_message();
  ASSERT_TRUE(client.WaitFor(third.message.job_id(), {v1::JOB_STATE_RUNNING}).ok());
  EXPECT_TRUE(client.Cancel(first).ok());
  EXPECT_TRUE(client.Cancel(third.message.job_id()).ok());
  const WorkerThread worker(service);
  const v1::Job ended = client.WaitFor(second, {v1::JOB_STATE_SUCCEEDED}).message;
  EXPECT_EQ(ended.condition(), "");
}

TEST(MemoryOfJobsTest, WhatWillNeverFitIsRefusedAndEndedJobsLetGoOfTheirPhotons) {
  // Room for one job and its scene, and not for two.
  const std::uint64_t room = HeldByAJob() * 7 / 4;
  ServiceUnderTest service({.max_memory_bytes = room});
  TestClient client(service);
  EXPECT_EQ(client.UploadBytes(std::string(2 * room, 'x')).error_code(),
            grpc::StatusCode::RESOURCE_EXHAUSTED);
  const v1::SceneManifest scene = client.Upload(SmallScene());
  const WorkerThread worker(service);
  std::string first;
  for (const char* request : {"first", "second"}) {
    const std::string job = client.Submit(RequestFor(scene, request, 2)).message.job_id();
    EXPECT_TRUE(client.WaitFor(job, {v1::JOB_STATE_SUCCEEDED}).ok());
    if (first.empty()) first = job;
  }
  EXPECT_EQ(client.Extend(first, 4).code(), grpc::StatusCode::FAILED_PRECONDITION)
      << "the second needed its memory";
  EXPECT_TRUE(client.Image(first).ok());
  EXPECT_LE(service.coordinator().budget().held(), room);
}

TEST_F(ManyJobsTest, RoundsThatAreOpenCountAsMemoryAndAJobGoesOnWithoutRoomForMany) {
  MemoryBudget& budget = service_.coordinator().budget();
  const std::string job = Submit("a", kEndless);
  ASSERT_TRUE(client_.WaitFor(job, {v1::JOB_STATE_RUNNING}).ok());
  const std::uint64_t alone = budget.HeldFor(MemoryUse::kJobs);
  auto worker = std::make_unique<WorkerThread>(service_);
  WaitForPasses(job, 2000);
  worker.reset();
  // Nothing comes any more: as many rounds are open as may be.
  for (int i = 0; i < 10'000 && budget.HeldFor(MemoryUse::kJobs) == alone; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_GE(budget.HeldFor(MemoryUse::kJobs), alone + kSmallScenePixels * 48);

  // Room for a result on its way in, and not for one more round.
  const auto rest = budget.Claim(MemoryUse::kUploads, budget.max_bytes() - budget.held() - 2900);
  ASSERT_TRUE(rest.ok()) << rest.status();
  worker = std::make_unique<WorkerThread>(service_);
  WaitForPasses(job, 4000);
  EXPECT_TRUE(client_.Cancel(job).ok());
  for (int i = 0; i < 10'000 && budget.HeldFor(MemoryUse::kJobs) > 0; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_EQ(budget.HeldFor(MemoryUse::kJobs), 0U);
}

// Whatever comes to them, jobs that are left to themselves in the end come to their ends, with each
// photon counted once.
TEST_F(ManyJobsTest, StormsOfRequestsLeaveJobsThatEnd) {
  const WorkerThread worker(service_);
  const WorkerThread other_worker(service_);
  constexpr std::int64_t kPasses = 40;
  std::vector<std::string> jobs;
  for (int i = 0; i < 4; ++i)
    jobs.push_back(Submit(absl::StrCat("job ", i), kPasses));
  std::vector<std::thread> storms;
  for (std::uint64_t s = 0; s < 3; ++s) {
    storms.emplace_back([&, s] {
      TestClient client(service_);
      KeyedRng rng(CombineKeys(s, 1));
      for (int i = 0; i < 300; ++i) {
        const std::string& job = jobs[rng.Bits() % jobs.size()];
        switch (rng.Bits() % 6) {
          case 0:
          case 1:
            (void)client.Pause(job);
            break;
          case 2:
          case 3:
            (void)client.Resume(job);
            break;
          case 4:
            (void)client.SetPriority(job, static_cast<int>(rng.Bits() % 5));
            break;
          default:
            (void)client.Extend(job, kPasses);
        }
      }
    });
  }
  for (std::thread& thread : storms)
    thread.join();
  for (const std::string& job : jobs) {
    (void)client_.Resume(job);
    const v1::Job ended = client_.WaitFor(job, {v1::JOB_STATE_SUCCEEDED}).message;
    EXPECT_EQ(ended.progress().passes(), kPasses);
    EXPECT_EQ(ended.progress().photons(), static_cast<std::uint64_t>(kPasses * 1000));
  }
}

}  // namespace
}  // namespace lucerna
