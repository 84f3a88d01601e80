// Threads for work that an RPC thread must not do itself.
//
// gRPC's own threads answer every call, heartbeats among them, so they only hand work over: reading
// scenes, checking and merging accumulations, encoding images, writing changes of jobs to the disk.
// A pool has a fixed number of threads and a bounded queue. A task is refused when the queue is
// full, and is not begun when nobody needs its result any more.
//
// Threads: any. A task may not wait for another one of the same pool.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <new>
#include <string>
#include <thread>
#include <vector>

#include "render/base/mutex.h"
#include "render/base/status.h"

namespace lucerna {

// Whether the result of some work is still needed: OK, or the reason why not (CANCELLED,
// DEADLINE_EXCEEDED). Long work checks again between its steps.
using StillNeeded = std::function<Status()>;

// What `work`, a function without arguments, returns, or RESOURCE_EXHAUSTED when memory runs out in
// it: then the call fails and not the process.
template <typename Work>
[[nodiscard]] auto WithinMemory(const Work& work) -> decltype(work()) {
  try {
    return work();
  } catch (const std::bad_alloc&) {
    return absl::ResourceExhaustedError("the coordinator ran out of memory; try again later");
  }
}

class WorkPool {
 public:
  struct Options {
    std::string work;  // for messages: "reading scenes"
    int threads = 1;
    std::size_t max_waiting = 64;
  };
  explicit WorkPool(Options options);
  // Close, and waits for the tasks that have begun.
  ~WorkPool();
  WorkPool(const WorkPool&) = delete;
  WorkPool& operator=(const WorkPool&) = delete;

  // Called exactly once: with OK in a thread of the pool, to do the work, or with the reason why
  // the work is not to be done, in any thread.
  using Task = std::function<void(const Status& may_begin)>;
  // Reasons: RESOURCE_EXHAUSTED when the queue is full, UNAVAILABLE when the pool is closed, else
  // what `still_needed` says when it is the task's turn.
  void Run(StillNeeded still_needed, Task task);

  // Refuses the tasks that have not begun and all later ones.
  void Close();

  [[nodiscard]] int threads() const { return options_.threads; }
  [[nodiscard]] std::size_t max_waiting() const { return options_.max_waiting; }

 private:
  struct Waiting {
    StillNeeded still_needed;
    Task task;
  };
  void Work();

  const Options options_;
  Mutex mutex_;
  Condition changed_;
  bool is_closed_ LUCERNA_GUARDED_BY(mutex_) = false;
  std::deque<Waiting> waiting_ LUCERNA_GUARDED_BY(mutex_);
  std::vector<std::thread> threads_;  // last, so that all they use is there
};

// The pools of a coordinator, one for each kind of work, so that no kind waits for another.
struct WorkPools {
  WorkPool scenes{{.work = "reading scenes", .threads = 2, .max_waiting = 32}};
  WorkPool uploads{{.work = "checking uploads", .threads = 2, .max_waiting = 256}};
  // As many threads as the machine has: workers wait for room here.
  WorkPool commits{{.work = "merging batches", .threads = AllThreads(), .max_waiting = 1024}};
  WorkPool images{{.work = "encoding images", .threads = 2, .max_waiting = 64}};
  // These wait for the disk, so many at once; together they wait for one sync (state_store.h).
  WorkPool changes{{.work = "changing jobs", .threads = 16, .max_waiting = 1024}};

  void Close();

 private:
  static int AllThreads();
};

}  // namespace lucerna
