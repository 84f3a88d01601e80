// Sync calls that wait for work (long polls).
//
// Each call is answered once: with what there is for its worker, with an empty answer when its time
// is over, or by the caller of Break or Close. Time comes in as an argument.
//
// A call is tried when there is news for its worker and when its time is over, so that a change
// costs no more than the calls that it concerns.
//
// Threads: any. Answers are called without a lock.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
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
  // when it has been answered, or when it is being tried and will be handed to `on_broken`.
  [[nodiscard]] std::optional<Call> Break(std::uint64_t ticket);

  // What there is for a worker now; absent: it waits on.
  using TryAnswer = std::function<std::optional<StatusOr<SyncAnswer>>(
      const std::string& worker, const Scheduler::Report& report)>;
  // Answers a call that broke while it was tried.
  using OnBroken = std::function<void(const Call&)>;

  // Tries the calls of these workers, and answers those that have an answer or whose time is over
  // at `now`. A call that another thread is trying is tried again by that thread.
  void AnswerWorkers(const std::vector<std::string>& workers, SteadyTime now,
                     const TryAnswer& try_answer, const OnBroken& on_broken);
  // The same for the calls whose time is over at `now`.
  void AnswerOverdue(SteadyTime now, const TryAnswer& try_answer, const OnBroken& on_broken);
  // The same for all calls.
  void AnswerReady(SteadyTime now, const TryAnswer& try_answer, const OnBroken& on_broken);

  // All calls that wait: the caller answers them. No more are taken.
  [[nodiscard]] std::vector<Call> Close();

 private:
  struct Parked {
    Call call;
    bool is_being_tried = false;  // by AnswerOne, which then decides what becomes of it
    bool shall_be_tried_again = false;
    bool is_broken = false;
  };

  void AnswerOne(std::uint64_t ticket, SteadyTime now, const TryAnswer& try_answer,
                 const OnBroken& on_broken);
  void AnswerAll(const std::vector<std::uint64_t>& tickets, SteadyTime now,
                 const TryAnswer& try_answer, const OnBroken& on_broken);
  // Takes a call out. Requires that it is there.
  Parked Remove(std::uint64_t ticket) LUCERNA_REQUIRES(mutex_);

  Mutex mutex_;
  bool is_closed_ LUCERNA_GUARDED_BY(mutex_) = false;
  std::uint64_t next_ticket_ LUCERNA_GUARDED_BY(mutex_) = 1;
  std::map<std::uint64_t, Parked> parked_ LUCERNA_GUARDED_BY(mutex_);
  std::map<std::string, std::set<std::uint64_t>> of_workers_ LUCERNA_GUARDED_BY(mutex_);
  std::set<std::pair<SteadyTime, std::uint64_t>> by_end_ LUCERNA_GUARDED_BY(mutex_);
};

}  // namespace lucerna
