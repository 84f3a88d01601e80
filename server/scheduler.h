// Who traces which photons next?
//
// The state of workers, open passes and leases. Pure decisions: no
// clock (moments come in as arguments), no network, no bytes.
//
// A pass is cut into batches in photon order as workers ask for them. How large a batch is does
// not show in the image, so it follows the number of workers. A batch that comes back without its
// photons (the lease ran out, the worker left or gave it up) keeps its range and goes out first.
// When nothing is left to hand out and a lease is much older than a batch usually takes, the
// batch is lent a second time; whoever commits first wins.
//
// Batch: pending -> leased -> committed; back to pending; poisoned, and with it the job, when
// poison_workers different workers, or poison_losses leases in all, failed at it.
//
// Threads: any; every call is one short step under one lock.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "render/base/clock.h"
#include "render/base/mutex.h"
#include "render/base/status.h"
#include "server/batch.h"

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
  // A lease this many times older than the median batch may be doubled.
  int speculate_after = 3;
  Duration speculate_at_least = std::chrono::seconds(1);
  std::size_t poison_workers = 3;
  int poison_losses = 6;
};

struct BatchLease {
  std::string id;
  PassKey pass;
  PhotonRange range;
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
  [[nodiscard]] Status Hear(const std::string& worker, const Report& report, SteadyTime now);

  struct Answer {
    std::optional<BatchLease> lease;
    std::vector<std::string> revoked;  // of `held`: of no use any more
    [[nodiscard]] bool empty() const { return !lease && revoked.empty(); }
  };
  // What there is to tell the worker now. Errors: NOT_FOUND for an unknown worker.
  [[nodiscard]] StatusOr<Answer> Tell(const std::string& worker, const Report& report,
                                      SteadyTime now);

  // The worker's connection broke: its batches go back at once. It may return.
  void LoseWorker(const std::string& worker);
  // The worker leaves in order: its batches go back, and that is no failure.
  void RemoveWorker(const std::string& worker);

  // Requires that the pass is not open.
  void OpenPass(const PassKey& key, std::uint64_t photons);
  // No more batches of it; its leases are revoked.
  void ClosePass(const PassKey& key);
  // The batch has been merged, by whomever.
  void Commit(const PassKey& key, PhotonRange range, SteadyTime now);

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
  };
  struct Lease {
    std::string worker;
    PassKey pass;
    PhotonRange range;
    SteadyTime lent_at;
    SteadyTime expires_at;
  };
  struct Losses {
    std::set<std::string> workers;
    int leases = 0;
  };
  struct Pass {
    std::uint64_t photons = 0;
    std::uint64_t next_photon = 0;                      // not handed out yet from here on
    std::set<PhotonRange> returned;                     // go out first
    std::map<PhotonRange, std::set<std::string>> lent;  // -> lease ids
    std::map<PhotonRange, Losses> losses;
  };

  std::uint64_t BatchSize(const Pass& pass) const LUCERNA_REQUIRES(mutex_);
  std::uint64_t PendingBatches() const LUCERNA_REQUIRES(mutex_);
  std::optional<BatchLease> Lend(const std::string& worker_id, SteadyTime now)
      LUCERNA_REQUIRES(mutex_);
  std::optional<BatchLease> LendTwice(const std::string& worker_id, SteadyTime now)
      LUCERNA_REQUIRES(mutex_);
  BatchLease Enter(const std::string& worker_id, const PassKey& key, PhotonRange range,
                   SteadyTime now) LUCERNA_REQUIRES(mutex_);
  // Ends a lease and makes its batch pending unless another holds it. A non-empty `failure` says
  // how the worker failed at it.
  void TakeBack(const std::string& lease_id, std::string_view failure) LUCERNA_REQUIRES(mutex_);
  void TakeBackAll(Worker& worker, std::string_view failure) LUCERNA_REQUIRES(mutex_);
  void EraseLease(const std::string& lease_id) LUCERNA_REQUIRES(mutex_);
  std::optional<Duration> MedianBatchTime() const LUCERNA_REQUIRES(mutex_);

  const SchedulerOptions options_;
  mutable Mutex mutex_;
  std::map<std::string, Worker> workers_ LUCERNA_GUARDED_BY(mutex_);
  std::map<PassKey, Pass> passes_ LUCERNA_GUARDED_BY(mutex_);
  std::map<std::string, Lease> leases_ LUCERNA_GUARDED_BY(mutex_);
  std::deque<Duration> batch_times_ LUCERNA_GUARDED_BY(mutex_);  // of the last commits
  std::vector<Poisoned> poisoned_ LUCERNA_GUARDED_BY(mutex_);
  std::uint64_t next_worker_ LUCERNA_GUARDED_BY(mutex_) = 1;
  std::uint64_t next_lease_ LUCERNA_GUARDED_BY(mutex_) = 1;
};

}  // namespace lucerna
