// How does a worker speak with its coordinator?
//
// The calls of WorkerService in values, with deadlines. Every call can be broken off from another
// thread, so that a worker that must end does not wait for the network.
//
// Threads: any, several calls at once.
#pragma once

#include <cstdint>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <grpcpp/grpcpp.h>

#include "proto/lucerna/v1/work.grpc.pb.h"
#include "render/analysis/needs.h"
#include "render/base/clock.h"
#include "render/base/digest.h"
#include "render/base/mutex.h"
#include "render/base/status.h"
#include "render/scene/render_settings.h"
#include "render/scene/scene_files.h"

namespace lucerna {

// A batch that was lent to this worker.
struct LentBatch {
  std::string lease_id;
  std::string job_id;
  SceneManifest scene;
  RenderSettings settings;
  SceneNeeds needs;
  std::uint64_t pass = 0;
  std::uint64_t first_photon = 0, last_photon = 0;
  Digest block;
  Digest radii;
};

class Connection {
 public:
  // Does not connect yet.
  explicit Connection(const std::string& address);

  // Whether the coordinator could be reached within `wait`.
  [[nodiscard]] bool WaitUntilConnected(Duration wait);

  // Errors of all calls: what work.proto says, and UNAVAILABLE, DEADLINE_EXCEEDED or CANCELLED
  // when the coordinator is gone or the call was broken off.
  [[nodiscard]] StatusOr<v1::RegisterResponse> Register(const v1::RegisterRequest& request);
  [[nodiscard]] StatusOr<v1::SyncResponse> Sync(const v1::SyncRequest& request, Duration wait);
  [[nodiscard]] StatusOr<v1::JobDescription> DescribeJob(const std::string& job_id);
  // Errors: also DATA_LOSS when the bytes do not have that digest.
  [[nodiscard]] StatusOr<std::string> Fetch(const Digest& digest, std::uint64_t max_bytes);
  [[nodiscard]] StatusOr<v1::CommitOutcome> Commit(v1::CommitBatchRequest::Header header,
                                                   const std::string& bytes);
  [[nodiscard]] Status Goodbye(const std::string& worker_id);

  // Breaks off the calls that are under way, and refuses new ones but Goodbye.
  void BreakOff();

 private:
  class Call;

  const std::shared_ptr<grpc::Channel> channel_;
  const std::unique_ptr<v1::WorkerService::Stub> stub_;
  Mutex mutex_;
  bool is_broken_off_ LUCERNA_GUARDED_BY(mutex_) = false;
  std::set<grpc::ClientContext*> calls_ LUCERNA_GUARDED_BY(mutex_);
};

// Errors: INVALID_ARGUMENT for a lease that no coordinator of ours would lend.
[[nodiscard]] StatusOr<LentBatch> ReadLease(const v1::Lease& message);

}  // namespace lucerna
