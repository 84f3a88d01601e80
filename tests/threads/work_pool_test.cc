// Every task is called once, in a thread of the pool or with the reason why not.
#include "server/work_pool.h"

#include <atomic>
#include <optional>
#include <thread>
#include <vector>

#include "gtest/gtest.h"

namespace lucerna {
namespace {

Status Needed() {
  return absl::OkStatus();
}

// Occupies a thread of a pool for as long as it lives.
class Occupied {
 public:
  explicit Occupied(WorkPool& pool) {
    pool.Run(Needed, [this](const Status& may_begin) {
      EXPECT_TRUE(may_begin.ok());
      const MutexLock lock(mutex_);
      has_begun_ = true;
      changed_.NotifyAll();
      while (!may_end_)
        changed_.Wait(mutex_);
      has_ended_ = true;
      changed_.NotifyAll();
    });
    const MutexLock lock(mutex_);
    while (!has_begun_)
      changed_.Wait(mutex_);
  }
  ~Occupied() {
    const MutexLock lock(mutex_);
    may_end_ = true;
    changed_.NotifyAll();
    while (!has_ended_)
      changed_.Wait(mutex_);
  }

 private:
  Mutex mutex_;
  Condition changed_;
  bool has_begun_ = false, may_end_ = false, has_ended_ = false;
};

// What a task was called with, once. Keeps the code alone: copies of a Status share a count that
// the packaged library lowers where ThreadSanitizer does not see it.
class Called {
 public:
  WorkPool::Task Task() {
    return [this](const Status& may_begin) {
      const MutexLock lock(mutex_);
      EXPECT_FALSE(code_.has_value()) << "called twice";
      code_ = may_begin.code();
      changed_.NotifyAll();
    };
  }
  absl::StatusCode Wait() {
    const MutexLock lock(mutex_);
    while (!code_)
      changed_.Wait(mutex_);
    return *code_;
  }

 private:
  Mutex mutex_;
  Condition changed_;
  std::optional<absl::StatusCode> code_;
};

TEST(WorkPoolTest, RefusesATaskWhenTheQueueIsFullAndTakesOneWhenThereIsRoom) {
  WorkPool pool({.work = "testing", .threads = 1, .max_waiting = 1});
  Called waiting;
  Called refused;
  {
    const Occupied occupied(pool);
    pool.Run(Needed, waiting.Task());
    pool.Run(Needed, refused.Task());
    EXPECT_EQ(refused.Wait(), absl::StatusCode::kResourceExhausted);
  }
  EXPECT_EQ(waiting.Wait(), absl::StatusCode::kOk);
  Called later;
  pool.Run(Needed, later.Task());
  EXPECT_EQ(later.Wait(), absl::StatusCode::kOk);
}

TEST(WorkPoolTest, DoesNotBeginWhatNobodyNeedsAnyMore) {
  WorkPool pool({.work = "testing", .threads = 1, .max_waiting = 2});
  std::atomic<bool> is_needed = true;
  Called task;
  {
    const Occupied occupied(pool);
    pool.Run(
        [&]() -> Status {
          return is_needed ? absl::OkStatus() : absl::CancelledError("the caller left");
        },
        task.Task());
    is_needed = false;
  }
  EXPECT_EQ(task.Wait(), absl::StatusCode::kCancelled);
}

TEST(WorkPoolTest, RefusesWhatWaitsWhenItIsClosed) {
  WorkPool pool({.work = "testing", .threads = 1, .max_waiting = 2});
  Called waiting;
  Called late;
  const Occupied occupied(pool);
  pool.Run(Needed, waiting.Task());
  pool.Close();
  EXPECT_EQ(waiting.Wait(), absl::StatusCode::kUnavailable);
  pool.Run(Needed, late.Task());
  EXPECT_EQ(late.Wait(), absl::StatusCode::kUnavailable);
}

TEST(WorkPoolTest, CallsEveryTaskOnceWhoeverClosesIt) {
  for (int round = 0; round < 20; ++round) {
    constexpr std::size_t kTasks = 200;
    std::vector<std::atomic<int>> calls(4 * kTasks);
    {
      WorkPool pool({.work = "testing", .threads = 3, .max_waiting = 50});
      std::vector<std::thread> callers;
      for (std::size_t c = 0; c < 4; ++c) {
        callers.emplace_back([&, c] {
          for (std::size_t i = 0; i < kTasks; ++i) {
            pool.Run(Needed, [&count = calls[c * kTasks + i]](const Status&) { ++count; });
            if (c == 3 && i == kTasks / 2) pool.Close();
          }
        });
      }
      for (std::thread& caller : callers)
        caller.join();
    }
    for (const std::atomic<int>& count : calls)
      EXPECT_EQ(count, 1);
  }
}

}  // namespace
}  // namespace lucerna
