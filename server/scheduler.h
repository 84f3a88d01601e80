// Who traces which photons next?
//
// The state of workers, open passes and leases. Pure decisions: no
// clock (moments come in as arguments), no network, no bytes.
//
// Open work is a pass, cut into batches of photons, or a round, cut into slices of passes
// (estimate/rounds.h), in order as workers ask for them. How large a batch is does not show in the
// image, so it follows the number of workers. A batch that comes back without its result (the lease
// ran out, the worker left or gave it up) keeps its range and goes out first.
// When nothing is left to hand out and a lease is much older than a batch usually takes, the
// batch is lent a second time; whoever commits first wins.
//
// Batch: pending -> leased -> committed; back to pending; poisoned, and with it the job, when
// poison_workers different workers, or poison_losses leases in all, failed at it.
//
// Workers that found nothing to do wait in a queue, in which an idle worker and one that fetches
// ahead are served first come, first served. Counts of workers, the queue, the passes that have
// something to lend, and leases by age and by expiry are kept up to date with every change, so that
// a call takes a time that grows with the logarithm of the number of workers.
//
// Threads: any; every call is one short step under one lock.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <queue>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "render/base/clock.h"
#include "render/base/mutex.h"
#include "render/base/status.h"
#include "server/batch.h"
#include "server/fair_share.h"

namespace lucerna {

struct SchedulerOptions {
  // In front of every worker's name: a worker of an earlier coordinator is not known here.
  std::string instance = "w";
  Duration lease_time = std::chrono::seconds(10);  // renewed by every Sync
  // A worker that is silent for so long is forgotten.
  Duration worker_silence = std::chrono::seconds(30);
  std::uint64_t min_batch = 4096;  // [photons]
  std::uint64_t max_batch = std::uint64_t{1} << 22;
  std::uint64_t fixed_batch = 0;  // all batches of this size; 0: as above
  std::uint64_t max_slice = 16;   // [passes]
  // Slices are cut so that open rounds have so many for every worker.
  std::uint64_t slices_per_worker = 2;
  // A lease this many times older than the median batch may be doubled.
  int speculate_after = 3;
  Duration speculate_at_least = std::chrono::seconds(1);
  std::size_t poison_workers = 3;
  int poison_losses = 6;
};

struct BatchLease {
  std::string id;
  PassKey pass;
  WorkRange range;
  WorkKind kind = WorkKind::kPhotons;
};

class Scheduler {
 public:
  explicit Scheduler(SchedulerOptions options) : options_(std::move(options)) {}

  // A new worker's id.
  [[nodiscard]] std::string AddWorker(std::string_view name, SteadyTime now);

  // What a worker says of itself.
  struct Report {
    std::vector<std::string> held;                              // lease ids
    std::vector<std::pair<std::string, std::string>> failures;  // lease id, reason
    bool wants_lease = false;
  };
  // Takes a report: renews what is held, takes back what failed and, when the worker wants a
  // lease, all it no longer mentions. Errors: NOT_FOUND for an unknown worker.
  [[nodiscard]] Status TakeReport(const std::string& worker, const Report& report, SteadyTime now);

  struct Answer {
    std::optional<BatchLease> lease;
    std::vector<std::string> revoked;  // of `held`: of no use any more
    [[nodiscard]] bool empty() const { return !lease && revoked.empty(); }
  };
  // What there is to tell the worker now. A worker that wants a lease and gets none waits for one
  // from then on. Errors: NOT_FOUND for an unknown worker.
  [[nodiscard]] StatusOr<Answer> AnswerFor(const std::string& worker, const Report& report,
                                           SteadyTime now);

  // Of the workers that can be lent something now, the one that has waited longest; it ceases to
  // wait, and the caller asks AnswerFor for its lease. Absent when no worker that waits can be lent
  // anything.
  [[nodiscard]] std::optional<std::string> TakeWaiting(SteadyTime now);
  // The worker could not be told of the lease that AnswerFor gave it, and waits on.
  void WaitAgain(const std::string& worker);
  // Workers of which leases have ended since the last call, in whatever way, or which are not known
  // any more: what AnswerFor says to them has changed.
  [[nodiscard]] std::vector<std::string> TakeAffected();

  // The worker's connection broke: its batches go back at once. It may return.
  void LoseWorker(const std::string& worker);
  // The worker leaves in order: its batches go back, and that is no failure.
  void RemoveWorker(const std::string& worker);

  // Opens a pass to be traced by batches of photons. Requires that the key is not open.
  void OpenPass(const PassKey& key, std::uint64_t photons);
  // Opens the passes `passes` of a round, which begins with key.pass, to be traced by slices.
  // Slices that would not end before `due`, if there is one, are as short as can be.
  void OpenRound(const PassKey& key, WorkRange passes, std::optional<SteadyTime> due);
  // Changes which passes of an open round are lent; those that have been lent stay.
  void SetRoundEnd(const PassKey& key, std::uint64_t last, std::optional<SteadyTime> due);
  // No more batches of it; its leases are revoked.
  void Close(const PassKey& key);
  // Whether a batch of this range is lent, or has been lent and come back.
  [[nodiscard]] bool Expects(const PassKey& key, WorkKind kind, WorkRange range) const;
  // The batch has been merged, by whomever.
  void Commit(const PassKey& key, WorkRange range, SteadyTime now);

  // Sharing of workers among jobs (server/fair_share.h) ------------------------------------------

  void SetClaim(const std::string& job_id, FairShare::Claim claim);
  // A held job is lent nothing, also not a second time; what is lent may come back. When it goes
  // on, failures of its batches are forgotten.
  void SetHeld(const std::string& job_id, bool is_held);
  // A result of so many photons or passes came back, and took so long, as the worker says.
  void CountWork(const std::string& job_id, WorkKind kind, std::uint64_t size, Duration worker_cpu);
  // The job has no open work, and will have none.
  void ForgetJob(const std::string& job_id);

  // Takes back what has run out and forgets workers that are silent.
  void Expire(SteadyTime now);

  struct Poisoned {
    PassKey pass;
    std::string message;  // for the user
  };
  // Batches found poisoned since the last call.
  [[nodiscard]] std::vector<Poisoned> TakePoisoned();

  // Workers that are connected.
  [[nodiscard]] int LiveWorkers() const;
  // The worker's name for people; empty when unknown.
  [[nodiscard]] std::string NameOf(const std::string& worker) const;

 private:
  struct Worker {
    std::string name;
    SteadyTime heard_at;
    bool is_connected = true;
    std::set<std::string> leases;
    std::uint64_t place = 0;  // in the queue for leases; 0: does not wait
  };
  struct Lease {
    std::string worker;
    PassKey pass;
    WorkRange range;
    WorkKind kind = WorkKind::kPhotons;
    SteadyTime lent_at;
    SteadyTime expires_at;
  };
  struct Losses {
    std::set<std::string> workers;
    int leases = 0;
  };
  // An open pass or round.
  struct Work {
    WorkKind kind = WorkKind::kPhotons;
    WorkRange rest;           // not handed out yet
    std::uint64_t total = 0;  // photons or passes
    std::optional<SteadyTime> due;
    std::set<WorkRange> returned;                     // go out first
    std::map<WorkRange, std::set<std::string>> lent;  // -> lease ids
    std::map<WorkRange, Losses> losses;

    [[nodiscard]] bool HasBatches() const { return rest.size() > 0 || !returned.empty(); }
  };
  struct Straggler {
    PassKey pass;
    WorkRange range;
    auto operator<=>(const Straggler&) const = default;
  };
  // A moment, and the id of the lease or worker to look at then. What has moved on to a later
  // moment since is put in again, and what has ended is dropped.
  using Deadline = std::pair<SteadyTime, std::string>;
  using Deadlines = std::priority_queue<Deadline, std::vector<Deadline>, std::greater<>>;

  // Every change to a worker's connection, leases or place goes between these two.
  void Uncount(const Worker& worker) LUCERNA_REQUIRES(mutex_);
  void Count(const std::string& id, const Worker& worker) LUCERNA_REQUIRES(mutex_);
  void SetConnected(const std::string& id, Worker& worker, bool is_connected)
      LUCERNA_REQUIRES(mutex_);
  void SetPlace(const std::string& id, Worker& worker, std::uint64_t place)
      LUCERNA_REQUIRES(mutex_);
  // To be called when `rest` or `returned` of open work have changed.
  void UpdateLendable(const PassKey& key, const Work& work) LUCERNA_REQUIRES(mutex_);
  void EraseLendable(const PassKey& key) LUCERNA_REQUIRES(mutex_);
  void AddWork(const PassKey& key, Work work) LUCERNA_REQUIRES(mutex_);

  // Of the next batch. Requires work.rest.size() > 0.
  std::uint64_t BatchSize(const Work& work, SteadyTime now) const LUCERNA_REQUIRES(mutex_);
  std::uint64_t SliceSize(const Work& work, SteadyTime now) const LUCERNA_REQUIRES(mutex_);
  // Whether there are more batches to hand out than idle workers.
  bool HasBatchesToSpare(SteadyTime now) const LUCERNA_REQUIRES(mutex_);
  std::optional<BatchLease> Lend(const std::string& worker_id, SteadyTime now)
      LUCERNA_REQUIRES(mutex_);
  // What may be lent a second time.
  std::optional<Straggler> FindStraggler(SteadyTime now) const LUCERNA_REQUIRES(mutex_);
  std::optional<BatchLease> LendTwice(const std::string& worker_id, SteadyTime now)
      LUCERNA_REQUIRES(mutex_);
  BatchLease Enter(const std::string& worker_id, const PassKey& key, WorkRange range,
                   SteadyTime now) LUCERNA_REQUIRES(mutex_);
  // Ends a lease and makes its batch pending unless another holds it. A non-empty `failure` says
  // how the worker failed at it.
  void TakeBack(const std::string& lease_id, std::string_view failure) LUCERNA_REQUIRES(mutex_);
  void TakeBackAll(Worker& worker, std::string_view failure) LUCERNA_REQUIRES(mutex_);
  void EraseLease(const std::string& lease_id) LUCERNA_REQUIRES(mutex_);
  // Enters a lease among those that are the only ones of their range, or takes it out.
  void AddSole(const std::string& lease_id) LUCERNA_REQUIRES(mutex_);
  void EraseSole(const std::string& lease_id, const Lease& lease) LUCERNA_REQUIRES(mutex_);
  // How long a photon or a pass of a lease usually takes [s].
  std::optional<double> UsualTime(WorkKind kind) const LUCERNA_REQUIRES(mutex_) {
    return usual_times_[static_cast<std::size_t>(kind)];
  }

  const SchedulerOptions options_;
  mutable Mutex mutex_;
  std::map<std::string, Worker> workers_ LUCERNA_GUARDED_BY(mutex_);
  std::map<PassKey, Work> open_ LUCERNA_GUARDED_BY(mutex_);
  std::map<std::string, Lease> leases_ LUCERNA_GUARDED_BY(mutex_);
  // [kinds] of the last commits, how long a photon or a pass of the lease took [s], and the median.
  std::array<std::deque<double>, 2> times_ LUCERNA_GUARDED_BY(mutex_);
  std::array<std::optional<double>, 2> usual_times_ LUCERNA_GUARDED_BY(mutex_);
  std::vector<Poisoned> poisoned_ LUCERNA_GUARDED_BY(mutex_);
  std::uint64_t next_worker_ LUCERNA_GUARDED_BY(mutex_) = 1;
  std::uint64_t next_lease_ LUCERNA_GUARDED_BY(mutex_) = 1;
  std::uint64_t next_place_ LUCERNA_GUARDED_BY(mutex_) = 1;

  // What follows from the above.
  std::uint64_t live_workers_ LUCERNA_GUARDED_BY(mutex_) = 0;  // connected
  std::uint64_t idle_workers_ LUCERNA_GUARDED_BY(mutex_) = 0;  // of those, without a lease
  // Workers that wait, by place: without a lease, and with one.
  std::map<std::uint64_t, std::string> idle_queue_ LUCERNA_GUARDED_BY(mutex_);
  std::map<std::uint64_t, std::string> busy_queue_ LUCERNA_GUARDED_BY(mutex_);
  std::set<std::string> affected_ LUCERNA_GUARDED_BY(mutex_);
  std::set<PassKey> lendable_ LUCERNA_GUARDED_BY(mutex_);  // where HasBatches()
  FairShare shares_ LUCERNA_GUARDED_BY(mutex_);
  std::uint64_t round_passes_ LUCERNA_GUARDED_BY(mutex_) = 0;  // `total` of all open rounds
  // Leases that are the only ones of their range, oldest first, by kind and size of the range.
  std::map<std::pair<WorkKind, std::uint64_t>, std::set<Deadline>> sole_leases_
      LUCERNA_GUARDED_BY(mutex_);
  Deadlines lease_deadlines_ LUCERNA_GUARDED_BY(mutex_);
  Deadlines worker_deadlines_ LUCERNA_GUARDED_BY(mutex_);
};

}  // namespace lucerna
