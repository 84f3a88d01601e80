// When is a call over that moves no bytes?
//
// A transfer may take hours on a slow line, so it has no deadline; but each piece of it, 1 MiB at
// most, must pass within a time that 10 kB/s keep. The guard cancels a call whose pieces have
// stopped, or that nobody waits for any more, though its thread is blocked in the call.
#pragma once

#include <functional>
#include <thread>

#include <grpcpp/grpcpp.h>

#include "render/base/clock.h"
#include "render/base/mutex.h"

namespace lucerna {

// 1 MiB at 10 kB/s, and a minute for the other side to do its part.
inline constexpr std::chrono::seconds kLongestSilence{165};
// A deadline for calls that a guard watches, or that may take what they take while the other side
// lives: pings end them when it does not.
inline constexpr std::chrono::hours kNoDeadline{24 * 30};

class StallGuard {
 public:
  // Watches the call of `context` from now on. `gives_up`, if there is one, is called about ten
  // times a second, from another thread, and ends the call by returning true.
  StallGuard(grpc::ClientContext& context, Duration longest_silence,
             std::function<bool()> gives_up = {});
  // Ends the watch.
  ~StallGuard();
  StallGuard(const StallGuard&) = delete;
  StallGuard& operator=(const StallGuard&) = delete;

  // A piece has passed.
  void Progress();

 private:
  void Watch();

  grpc::ClientContext& context_;
  const Duration longest_silence_;
  const std::function<bool()> gives_up_;
  Mutex mutex_;
  Condition changed_;
  SteadyTime moved_at_ LUCERNA_GUARDED_BY(mutex_);
  bool is_over_ LUCERNA_GUARDED_BY(mutex_) = false;
  std::thread thread_;  // last: it uses all of the above
};

}  // namespace lucerna
