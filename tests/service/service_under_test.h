// How does a test talk to all services of a coordinator in one process?
//
// The real services and Coordinator behind a real gRPC server on loopback. Time stands still unless
// the test moves it; ticks come all the same, from a thread of the server's own, so that whatever
// does not depend on time happens at once.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <grpcpp/grpcpp.h>

#include "proto/lucerna/v1/assets.grpc.pb.h"
#include "proto/lucerna/v1/images.grpc.pb.h"
#include "proto/lucerna/v1/jobs.grpc.pb.h"
#include "proto/lucerna/v1/work.grpc.pb.h"
#include "render/base/clock.h"
#include "server/admin_service.h"
#include "server/asset_service.h"
#include "server/coordinator.h"
#include "server/image_service.h"
#include "server/job_service.h"
#include "server/work_pool.h"
#include "server/worker_service.h"

namespace lucerna {

class MovableClock final : public Clock {
 public:
  [[nodiscard]] SteadyTime Steady() const override { return SteadyTime(Duration(now_ns_)); }
  [[nodiscard]] WallTime Wall() const override { return WallTime(Duration(now_ns_)); }
  void Move(Duration by) { now_ns_ += by.count(); }

 private:
  std::atomic<std::int64_t> now_ns_ = std::int64_t{1'000'000'000'000'000'000};
};

// The answer to a call. Every call has a deadline of half a minute of real time, which only ends
// what hangs.
template <typename Message>
struct Answer {
  grpc::Status status;
  Message message;
  [[nodiscard]] bool ok() const { return status.ok(); }
  [[nodiscard]] grpc::StatusCode code() const { return status.error_code(); }
};

inline constexpr std::chrono::seconds kCallLimit{120};
// More passes than any test waits for.
inline constexpr std::int64_t kEndless = 1'000'000'000;

struct TestScene {
  std::map<std::string, std::string> files;  // by logical path
  std::string main_path = "scene.pbrt";
};
// Two quads and a point light in kSmallScenePixels pixels: a job with photons.
inline constexpr std::size_t kSmallScenePixels = 64;
[[nodiscard]] TestScene SmallScene();
// Makes a tally that of so many photons of SmallScene, which all escaped.
void SetEscaped(BatchTally& tally, std::uint64_t photons);

struct ServiceChoices {
  double audit_share = 0;  // of the batches, which are computed by two workers
  std::size_t jobs_at_once = 1;
  std::uint64_t max_memory_bytes = 0;
  std::size_t max_watches = Coordinator::Options().max_watches;
};

class ServiceUnderTest {
 public:
  static constexpr const char* kNumericProfile = "the profile of these tests";

  explicit ServiceUnderTest(const ServiceChoices& choices = {});
  ~ServiceUnderTest();
  ServiceUnderTest(const ServiceUnderTest&) = delete;
  ServiceUnderTest& operator=(const ServiceUnderTest&) = delete;

  MovableClock& clock() { return clock_; }
  Coordinator& coordinator() { return *coordinator_; }
  WorkPools& pools() { return pools_; }
  // A connection of its own to the server.
  [[nodiscard]] std::shared_ptr<grpc::Channel> NewChannel() const;

  // Ends the coordinator in order, as its program does. Calls that are open end. Once.
  void ShutDown();

 private:
  MovableClock clock_;
  std::unique_ptr<Coordinator> coordinator_;
  WorkPools pools_;
  std::unique_ptr<AssetService> assets_;
  std::unique_ptr<JobService> jobs_;
  std::unique_ptr<ImageService> images_;
  std::unique_ptr<WorkerService> workers_;
  std::unique_ptr<AdminService> admin_;
  std::unique_ptr<grpc::Server> server_;
  int port_ = 0;
  std::atomic<bool> is_shut_down_ = false;
  std::thread ticks_;
};

// A user with a connection of their own. Threads: one at a time.
class TestClient {
 public:
  explicit TestClient(const ServiceUnderTest& service);

  // Uploads the scene's files and names them.
  v1::SceneManifest Upload(const TestScene& scene);
  grpc::Status UploadBytes(const std::string& bytes);

  Answer<v1::SubmitResponse> Submit(const v1::SubmitRequest& request);
  Answer<v1::Job> Get(const std::string& job_id);
  Answer<v1::Job> Cancel(const std::string& job_id);
  Answer<v1::Job> Stop(const std::string& job_id);
  Answer<v1::Job> Extend(const std::string& job_id, std::int64_t passes);
  Answer<v1::Job> Pause(const std::string& job_id);
  Answer<v1::Job> Resume(const std::string& job_id);
  Answer<v1::Job> SetPriority(const std::string& job_id, int priority);
  Answer<v1::ListJobsResponse> List(const v1::ListJobsRequest& request = {});
  // The job as the last message of a watch has it. `at_each` may return false to leave.
  Answer<v1::Job> Watch(
      const std::string& job_id,
      const std::function<bool(const v1::Job&)>& at_each = [](const v1::Job&) { return true; });
  // The job as soon as it is in one of `states`.
  Answer<v1::Job> WaitFor(const std::string& job_id, const std::vector<v1::JobState>& states);
  // EXR bytes.
  Answer<std::string> Image(const std::string& job_id);

 private:
  std::unique_ptr<v1::AssetService::Stub> assets_;
  std::unique_ptr<v1::JobService::Stub> jobs_;
  std::unique_ptr<v1::ImageService::Stub> images_;
};

// A request for a job of a scene that is uploaded; no workers' time to speak of.
[[nodiscard]] v1::SubmitRequest RequestFor(const v1::SceneManifest& scene,
                                           const std::string& request_id, std::int64_t passes);

// A worker that traces nothing: its results say that all photons escaped. Its slices are of jobs of
// SmallScene with RequestFor.
// Threads: one at a time.
class IdleHandsWorker {
 public:
  // Without an identity it is a new worker.
  explicit IdleHandsWorker(const ServiceUnderTest& service, const std::string& identity = {});

  [[nodiscard]] const std::string& id() const { return id_; }
  Answer<v1::SyncResponse> Sync(bool wants_lease, Duration wait, std::vector<std::string> held = {},
                                grpc::ClientContext* context = nullptr);
  Answer<v1::CommitBatchResponse> Commit(const v1::Lease& lease) {
    return CommitBytes(lease, ResultOf(lease));
  }
  // The bytes that Commit sends.
  std::string ResultOf(const v1::Lease& lease);
  Answer<v1::CommitBatchResponse> CommitBytes(const v1::Lease& lease, const std::string& bytes);
  // Hands a lease back as a failure.
  grpc::Status GiveUp(const v1::Lease& lease, const std::string& reason);
  Answer<v1::JobDescription> DescribeJob(const std::string& job_id);
  // The bytes of a blob.
  Answer<std::string> Fetch(const std::string& digest);
  // Asks until there is a lease; absent after many answers without one. Keeps `held`.
  std::optional<v1::Lease> TakeLease(const std::vector<std::string>& held = {});

 private:
  std::unique_ptr<v1::WorkerService::Stub> stub_;
  std::string id_;
};

// Such a worker in a thread of its own, which commits whatever it is lent.
class WorkerThread {
 public:
  explicit WorkerThread(const ServiceUnderTest& service);
  ~WorkerThread();

 private:
  IdleHandsWorker worker_;
  std::atomic<bool> is_stopped_ = false;
  std::thread thread_;
};

}  // namespace lucerna
