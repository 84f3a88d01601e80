// How does one stage of the pipeline hand a batch to the next?
//
// A HandOver has room for one value. The giver waits until the room is free, the taker until
// there is something, and both give up when it is closed.
//
// Threads: any.
#pragma once

#include <optional>
#include <utility>

#include "render/base/mutex.h"

namespace lucerna {

template <typename Value>
class HandOver {
 public:
  // False when it is closed; then the value is gone.
  bool Give(Value value) {
    const MutexLock lock(mutex_);
    while (value_ && !is_closed_)
      changed_.Wait(mutex_);
    if (is_closed_) return false;
    value_ = std::move(value);
    changed_.NotifyAll();
    return true;
  }

  // Absent when it is closed.
  std::optional<Value> Take() {
    const MutexLock lock(mutex_);
    while (!value_ && !is_closed_)
      changed_.Wait(mutex_);
    if (is_closed_) return std::nullopt;
    changed_.NotifyAll();
    return std::exchange(value_, std::nullopt);
  }

  // Waits until there is room. False when it is closed.
  bool WaitForRoom() {
    const MutexLock lock(mutex_);
    while (value_ && !is_closed_)
      changed_.Wait(mutex_);
    return !is_closed_;
  }

  void Close() {
    const MutexLock lock(mutex_);
    is_closed_ = true;
    changed_.NotifyAll();
  }

 private:
  Mutex mutex_;
  Condition changed_;
  bool is_closed_ LUCERNA_GUARDED_BY(mutex_) = false;
  std::optional<Value> value_ LUCERNA_GUARDED_BY(mutex_);
};

}  // namespace lucerna
