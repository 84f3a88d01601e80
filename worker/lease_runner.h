// What does a worker do between its registration and its goodbye?
//
// Three stages work on three batches at once, so that the network never idles the cores: fetch
// (ask for a lease, get what it names), compute (trace and gather), commit (encode and send). A
// fourth thread keeps one heartbeat call open, by which the coordinator notices at once when the
// worker is gone and tells which leases are of no use any more.
#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "proto/lucerna/v1/work.pb.h"
#include "render/base/clock.h"
#include "render/base/mutex.h"
#include "render/base/status.h"
#include "worker/connection.h"
#include "worker/hand_over.h"
#include "worker/scene_cache.h"
#include "worker/work_counts.h"

namespace lucerna {

class LeaseRunner {
 public:
  // Connection, cache and counts outlive the runner.
  LeaseRunner(Connection& connection, SceneCache& cache, WorkCounts& counts, std::string worker_id,
              Duration sync_every)
      : connection_(connection),
        cache_(cache),
        counts_(counts),
        worker_id_(std::move(worker_id)),
        sync_every_(sync_every) {}

  // Works until Stop, or until the coordinator is gone or does not know this worker any more;
  // returns why. All that was held is dropped. Once only.
  [[nodiscard]] Status Run();

  // Ends Run soon: running batches are given up. Threads: any.
  void Stop(Status why);

 private:
  // A lease that this worker has, from its arrival to its end.
  struct Held {
    LentWork work;
    std::atomic<bool> is_revoked = false;
  };
  struct Fetched {
    std::shared_ptr<Held> held;
    std::shared_ptr<const JobToTrace> job;
    std::shared_ptr<BatchTracer> tracer;
    std::shared_ptr<const HitpointBlock> block;  // of photons
    std::shared_ptr<const RadiusColumn> radii;
    std::shared_ptr<const EyePathCounts> eye_paths;
  };
  struct Computed {
    std::shared_ptr<Held> held;
    std::string bytes;  // of the result
    Duration cpu{};
  };

  void FetchStage();
  void ComputeStage();
  void CommitStage();
  void Heartbeat();
  StatusOr<Fetched> Fetch(const std::shared_ptr<Held>& held);
  // Of a job that is described with at least so many guides.
  StatusOr<std::shared_ptr<const JobToTrace>> JobOf(const std::string& job_id,
                                                    std::uint64_t guides);
  // The encoded result of a lease.
  StatusOr<std::string> Compute(const Fetched& fetched);
  StatusOr<v1::CommitOutcome> Commit(const Computed& computed);
  // What is to be said of the leases held.
  v1::SyncRequest Report(bool wants_lease);
  void Revoke(const v1::SyncResponse& response);
  // Ends a lease; a non-OK `status` tells the coordinator that it was not worked off, and why.
  void Release(const Held& held, const Status& status);
  // Whether the status means that there is no coordinator (that knows us) any more; then it stops
  // the runner.
  bool StopIfGone(const Status& status);

  Connection& connection_;
  SceneCache& cache_;
  WorkCounts& counts_;
  const std::string worker_id_;
  const Duration sync_every_;

  // Of the fetch stage alone: the job that the last lease was of.
  std::deque<std::pair<std::string, std::shared_ptr<const JobToTrace>>> jobs_;  // newest first

  HandOver<Fetched> fetched_;
  HandOver<Computed> computed_;

  Mutex mutex_;
  bool is_stopped_ LUCERNA_GUARDED_BY(mutex_) = false;
  Status why_stopped_ LUCERNA_GUARDED_BY(mutex_);
  std::map<std::string, std::shared_ptr<Held>> held_ LUCERNA_GUARDED_BY(mutex_);
  std::vector<std::pair<std::string, std::string>> failures_ LUCERNA_GUARDED_BY(mutex_);
};

}  // namespace lucerna
