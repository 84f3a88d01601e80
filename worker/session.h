// How does a worker find its coordinator, and find it again?
//
// Connects with patience, registers, works until the coordinator is gone, and begins anew; what
// was held is dropped, because a coordinator that comes back lends it again.
#pragma once

#include <memory>
#include <string>

#include "render/base/clock.h"
#include "render/base/mutex.h"
#include "render/base/status.h"
#include "render/wire/channel.h"
#include "worker/connection.h"
#include "worker/lease_runner.h"
#include "worker/scene_cache.h"

namespace lucerna {

class Session {
 public:
  struct Options {
    Endpoint server;
    int threads = 0;             // 0: all
    Duration connect_timeout{};  // how long an absent coordinator is waited for
    std::string name;
    std::string numeric_profile;
    // Random: what tells this worker from others through all its connections.
    std::string identity;
  };

  Session(Options options, const Clock& clock);

  // Works until Stop (then OK), or until there is no sense in going on.
  // Errors: UNAVAILABLE when no coordinator answered for connect_timeout, FAILED_PRECONDITION
  // when it refused this worker.
  [[nodiscard]] Status Run();

  [[nodiscard]] const WorkCounts& counts() const { return counts_; }

  // Ends Run within a second or so, after a goodbye. Threads: any.
  void Stop();

 private:
  // A connection on which this worker is registered, or why there is none.
  StatusOr<v1::RegisterResponse> Join();
  bool is_stopped() const;
  void Pause(Duration time);

  const Options options_;
  const Clock& clock_;
  const Connection::Channels channels_;
  SceneCache cache_;
  WorkCounts counts_;

  mutable Mutex mutex_;
  Condition changed_;
  bool is_stopped_ LUCERNA_GUARDED_BY(mutex_) = false;
  std::string worker_id_ LUCERNA_GUARDED_BY(mutex_);  // of the runner
  std::shared_ptr<Connection> connection_ LUCERNA_GUARDED_BY(mutex_);
  std::shared_ptr<LeaseRunner> runner_ LUCERNA_GUARDED_BY(mutex_);
};

}  // namespace lucerna
