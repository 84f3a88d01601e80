// Whatever the pools for heavy work do, calls that need none of it are answered: heartbeats above
// all, because a worker that gets no answer gives its work up.
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "gtest/gtest.h"

#include "tests/service/service_under_test.h"

namespace lucerna {
namespace {

// Occupies all threads of a pool until it is released.
class Occupation {
 public:
  explicit Occupation(WorkPool& pool, int threads) {
    for (int t = 0; t < threads; ++t) {
      pool.Run([] { return absl::OkStatus(); },
               [this](const Status&) {
                 const MutexLock lock(mutex_);
                 ++occupied_;
                 changed_.NotifyAll();
                 while (!is_released_)
                   changed_.Wait(mutex_);
                 --occupied_;
                 changed_.NotifyAll();
               });
    }
    const MutexLock lock(mutex_);
    while (occupied_ < threads)
      changed_.Wait(mutex_);
  }
  ~Occupation() { Release(); }
  void Release() {
    const MutexLock lock(mutex_);
    is_released_ = true;
    changed_.NotifyAll();
    while (occupied_ > 0)
      changed_.Wait(mutex_);
  }

 private:
  Mutex mutex_;
  Condition changed_;
  int occupied_ = 0;
  bool is_released_ = false;
};

TEST(BusyPoolsTest, HeartbeatsAndStatesAreAnsweredWhileAllPoolsAreBusy) {
  ServiceUnderTest service;
  TestClient client(service);
  const v1::SceneManifest scene = client.Upload(SmallScene());
  IdleHandsWorker worker(service);
  const std::string running = client.Submit(RequestFor(scene, "running", 2)).message.job_id();
  const std::optional<v1::Lease> lease = worker.TakeLease();
  ASSERT_TRUE(lease);

  WorkPools& pools = service.pools();
  std::vector<std::unique_ptr<Occupation>> occupations;
  for (WorkPool* const pool :
       {&pools.scenes, &pools.uploads, &pools.commits, &pools.images, &pools.changes})
    occupations.push_back(std::make_unique<Occupation>(*pool, pool->threads()));
  // More calls than gRPC has threads wait for the pools.
  std::vector<std::thread> callers;
  for (int c = 0; c < 16; ++c) {
    callers.emplace_back([&, c] {
      TestClient caller(service);
      const auto job = caller.Submit(RequestFor(scene, absl::StrCat("waits ", c), 1));
      EXPECT_TRUE(job.ok()) << job.status.error_message();
      EXPECT_TRUE(caller.Cancel(job.message.job_id()).ok());
      EXPECT_TRUE(caller.UploadBytes(absl::StrCat("bytes of ", c)).ok());
    });
    callers.emplace_back([&] { EXPECT_TRUE(TestClient(service).Pause(running).ok()); });
  }
  for (int i = 0; i < 20; ++i) {
    EXPECT_TRUE(worker.Sync(false, Duration::zero(), {lease->lease_id()}).ok());
    EXPECT_EQ(client.Get(running).message.state(), v1::JOB_STATE_RUNNING);
  }
  occupations.clear();
  for (std::thread& caller : callers)
    caller.join();
  EXPECT_EQ(client.Get(running).message.state(), v1::JOB_STATE_PAUSED);
}

TEST(BusyPoolsTest, ASubmitWhoseCallerHasLeftIsNotRead) {
  ServiceUnderTest service;
  TestClient client(service);
  const v1::SceneManifest scene = client.Upload(SmallScene());
  WorkPool& pool = service.pools().scenes;
  Occupation occupation(pool, pool.threads());
  // Waits in the queue until its deadline has passed.
  const auto stub = v1::JobService::NewStub(service.NewChannel());
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::milliseconds(100));
  v1::SubmitResponse response;
  EXPECT_EQ(stub->Submit(&context, RequestFor(scene, "late", 2), &response).error_code(),
            grpc::StatusCode::DEADLINE_EXCEEDED);
  // gRPC cancels the call in the server some time later.
  std::this_thread::sleep_for(std::chrono::milliseconds(1500));
  occupation.Release();
  // Read after the first, by the same threads.
  const auto next = client.Submit(RequestFor(scene, "next", 2));
  ASSERT_TRUE(next.ok());
  EXPECT_NE(next.message.job_id().find("-1-"), std::string::npos)
      << next.message.job_id() << " is not the first job of this coordinator";
}

TEST(BusyPoolsTest, AFullPoolSaysSo) {
  ServiceUnderTest service;
  TestClient client(service);
  const v1::SceneManifest scene = client.Upload(SmallScene());
  WorkPool& pool = service.pools().scenes;
  Occupation occupation(pool, pool.threads());
  std::atomic<std::size_t> began = 0;
  for (std::size_t i = 0; i < pool.max_waiting(); ++i)
    pool.Run([] { return absl::OkStatus(); }, [&began](const Status&) { ++began; });
  EXPECT_EQ(client.Submit(RequestFor(scene, "one too many", 2)).code(),
            grpc::StatusCode::RESOURCE_EXHAUSTED);
  occupation.Release();
  while (began < pool.max_waiting())
    std::this_thread::yield();
  EXPECT_TRUE(client.Submit(RequestFor(scene, "one too many", 2)).ok());
}

}  // namespace
}  // namespace lucerna
