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
#include "render/transport/photon_guide.h"
#include "render/wire/channel.h"

namespace lucerna {

// What all work of a job shares.
struct JobToTrace {
  SceneManifest scene;
  RenderSettings settings;
  SceneNeeds needs;
  std::vector<std::shared_ptr<const PhotonGuide>> guides;  // those that it had at that time
};

// Work that was lent to this worker (see work.proto).
struct LentWork {
  std::string lease_id;
  std::string job_id;
  v1::WorkKind kind = v1::WORK_KIND_UNSPECIFIED;
  std::uint64_t pass = 0;
  std::uint64_t first = 0, last = 0;  // photons or passes
  Digest block;                       // of photons
  Digest radii;
  std::uint64_t photons_per_pass = 0;
  float caustic_radius = 1;
  std::uint64_t guide = 0;          // of JobToTrace::guides the last of the first so many; 0: none
  std::optional<Digest> eye_paths;  // of passes; absent: one for each pixel
};

class Connection {
 public:
  // The ways to one coordinator. They connect by themselves, and serve one Connection after
  // another.
  struct Channels {
    explicit Channels(const Endpoint& endpoint);
    // Heartbeats must not wait behind the bytes of a commit.
    std::shared_ptr<grpc::Channel> messages, bulk;
  };
  explicit Connection(const Channels& channels);

  // Whether the coordinator could be reached within `wait`.
  [[nodiscard]] bool WaitUntilConnected(Duration wait);

  // Errors of all calls: what work.proto says, and UNAVAILABLE, DEADLINE_EXCEEDED or CANCELLED
  // when the coordinator is gone or the call was broken off.
  [[nodiscard]] StatusOr<v1::RegisterResponse> Register(const v1::RegisterRequest& request);
  [[nodiscard]] StatusOr<v1::SyncResponse> Sync(const v1::SyncRequest& request, Duration wait);
  [[nodiscard]] StatusOr<v1::JobDescription> DescribeJob(const std::string& job_id,
                                                         bool guides_only = false);
  // Errors: also DATA_LOSS when the bytes do not have that digest.
  [[nodiscard]] StatusOr<std::string> Fetch(const Digest& digest, std::uint64_t max_bytes);
  [[nodiscard]] StatusOr<v1::CommitOutcome> Commit(v1::CommitBatchRequest::Header header,
                                                   std::string_view bytes);
  [[nodiscard]] Status Goodbye(const std::string& worker_id);

  // Breaks off the calls that are under way, and refuses new ones but Goodbye.
  void BreakOff();

 private:
  class Call;

  const std::shared_ptr<grpc::Channel> channel_;
  const std::unique_ptr<v1::WorkerService::Stub> stub_, bulk_stub_;
  Mutex mutex_;
  bool is_broken_off_ LUCERNA_GUARDED_BY(mutex_) = false;
  std::set<grpc::ClientContext*> calls_ LUCERNA_GUARDED_BY(mutex_);
};

// Errors: INVALID_ARGUMENT for a lease, or a job, that no coordinator of ours would give.
[[nodiscard]] StatusOr<LentWork> ReadLease(const v1::Lease& message);
[[nodiscard]] StatusOr<JobToTrace> ReadJob(const v1::JobDescription& message);
// Sets the guides alone, from a description of that job.
[[nodiscard]] Status ReadGuides(const v1::JobDescription& message, JobToTrace& job);

}  // namespace lucerna
