// A std::mutex that clang can reason about.
//
// The annotations let `-Wthread-safety` refuse code that touches a guarded field without its
// lock. The mutex underneath is std::mutex, because ThreadSanitizer understands that one even
// when the libraries around us were built without it.
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>

#if defined(__clang__)
#define LUCERNA_THREAD_ATTRIBUTE(x) __attribute__((x))
#else
#define LUCERNA_THREAD_ATTRIBUTE(x)
#endif
#define LUCERNA_GUARDED_BY(x) LUCERNA_THREAD_ATTRIBUTE(guarded_by(x))
#define LUCERNA_REQUIRES(...) LUCERNA_THREAD_ATTRIBUTE(requires_capability(__VA_ARGS__))
#define LUCERNA_EXCLUDES(...) LUCERNA_THREAD_ATTRIBUTE(locks_excluded(__VA_ARGS__))

namespace lucerna {

class LUCERNA_THREAD_ATTRIBUTE(capability("mutex")) Mutex {
 public:
  void Lock() LUCERNA_THREAD_ATTRIBUTE(acquire_capability()) { mutex_.lock(); }
  void Unlock() LUCERNA_THREAD_ATTRIBUTE(release_capability()) { mutex_.unlock(); }

 private:
  friend class Condition;
  std::mutex mutex_;
};

class LUCERNA_THREAD_ATTRIBUTE(scoped_lockable) MutexLock {
 public:
  explicit MutexLock(Mutex& mutex) LUCERNA_THREAD_ATTRIBUTE(acquire_capability(mutex))
      : mutex_(mutex) {
    mutex_.Lock();
  }
  ~MutexLock() LUCERNA_THREAD_ATTRIBUTE(release_capability()) { mutex_.Unlock(); }
  MutexLock(const MutexLock&) = delete;
  MutexLock& operator=(const MutexLock&) = delete;

 private:
  Mutex& mutex_;
};

// Wakes threads that wait for a change under a Mutex. Wakes may be spurious: wait in a loop.
class Condition {
 public:
  void Wait(Mutex& mutex) LUCERNA_REQUIRES(mutex) {
    std::unique_lock<std::mutex> lock(mutex.mutex_, std::adopt_lock);
    condition_.wait(lock);
    lock.release();
  }
  // Returns after a notification or after `timeout`, whichever is first.
  void WaitFor(Mutex& mutex, std::chrono::nanoseconds timeout) LUCERNA_REQUIRES(mutex) {
    std::unique_lock<std::mutex> lock(mutex.mutex_, std::adopt_lock);
    condition_.wait_for(lock, timeout);
    lock.release();
  }
  void NotifyOne() { condition_.notify_one(); }
  void NotifyAll() { condition_.notify_all(); }

 private:
  std::condition_variable condition_;
};

}  // namespace lucerna
