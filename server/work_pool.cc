#include "server/work_pool.h"

#include <algorithm>
#include <utility>

namespace lucerna {

WorkPool::WorkPool(Options options) : options_(std::move(options)) {
  for (int t = 0; t < options_.threads; ++t)
    threads_.emplace_back([this] { Work(); });
}

WorkPool::~WorkPool() {
  Close();
  for (std::thread& thread : threads_)
    thread.join();
}

void WorkPool::Run(StillNeeded still_needed, Task task) {
  Status refusal;
  {
    const MutexLock lock(mutex_);
    if (is_closed_) {
      refusal = absl::UnavailableError("the coordinator is shutting down");
    } else if (waiting_.size() >= options_.max_waiting) {
      refusal = absl::ResourceExhaustedError(
          absl::StrCat("the coordinator is busy ", options_.work, " and ", waiting_.size(),
                       " more calls wait for it; try again later"));
    } else {
      waiting_.push_back({std::move(still_needed), std::move(task)});
      changed_.NotifyOne();
      return;
    }
  }
  task(refusal);
}

void WorkPool::Close() {
  std::deque<Waiting> refused;
  {
    const MutexLock lock(mutex_);
    is_closed_ = true;
    refused.swap(waiting_);
    changed_.NotifyAll();
  }
  for (const Waiting& waiting : refused)
    waiting.task(absl::UnavailableError("the coordinator is shutting down"));
}

void WorkPool::Work() {
  while (true) {
    Waiting next;
    {
      const MutexLock lock(mutex_);
      while (waiting_.empty() && !is_closed_)
        changed_.Wait(mutex_);
      if (waiting_.empty()) return;
      next = std::move(waiting_.front());
      waiting_.pop_front();
    }
    next.task(next.still_needed());
  }
}

int WorkPools::AllThreads() {
  return static_cast<int>(std::max(2U, std::thread::hardware_concurrency()));
}

void WorkPools::Close() {
  for (WorkPool* const pool : {&scenes, &uploads, &commits, &images, &changes})
    pool->Close();
}

}  // namespace lucerna
