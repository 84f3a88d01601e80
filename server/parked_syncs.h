// Sync calls that wait for work (long polls).
//
// Each call is answered once: with what there is for its worker, with an empty answer when its time
// is over, or by the caller of Break or Close. Time comes in as an argument.
//
// Threads: any. Answers are called without a lock.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "render/base/clock.h"
#include "render/base/mutex.h"
#include "render/base/status.h"
#include "server/scheduler.h"
#include "server/sync_answer.h"

namespace lucerna {

class ParkedSyncs {
 public:
  using Answer = std::function<void(StatusOr<SyncAnswer>)>;
  struct Call {
    std::string worker;
    Scheduler::Report report;
    SteadyTime until;
    Answer answer;
  };

  // The call's ticket; 0 after Close, and then the caller answers.
  [[nodiscard]] std::uint64_t Park(Call call);

  // The connection behind a call is gone. The call if it was waiting: the caller answers it. Absent
  // when it has been answered, or when AnswerReady is trying it and hands it to `on_broken`.
  [[nodiscard]] std::optional<Call> Break(std::uint64_t ticket);

  // What there is for a worker now; absent: it waits on.
  using TryAnswer = std::function<std::optional<StatusOr<SyncAnswer>>(
      const std::string& worker, const Scheduler::Report& report)>;
  // Tries every call that no other thread is trying, and answers those that have an answer or whose
  // time is over at `now`. `on_broken` answers calls that broke meanwhile.
  void AnswerReady(SteadyTime now, const TryAnswer& try_answer,
                   const std::function<void(const Call&)>& on_broken);

  // All calls that wait: the caller answers them. No more are taken.
  [[nodiscard]] std::vector<Call> Close();

 private:
  struct Parked {
    Call call;
    bool is_being_tried = false;  // by AnswerReady, which then decides what becomes of it
    bool is_broken = false;
  };

  Mutex mutex_;
  bool is_closed_ LUCERNA_GUARDED_BY(mutex_) = false;
  std::uint64_t next_ticket_ LUCERNA_GUARDED_BY(mutex_) = 1;
  std::map<std::uint64_t, Parked> parked_ LUCERNA_GUARDED_BY(mutex_);
};

}  // namespace lucerna
