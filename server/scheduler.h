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
// batch is lent a second time, and a third when that one is late too; whoever commits first wins.
//
// Batch: pending -> leased -> committed; back to pending; poisoned when poison_workers different
// workers failed or crashed at it, or all that there are, poison_failures times. A slice of several
// passes is cut into halves first, each of which one more failure poisons. A poisoned batch
// is lent no more until ReleasePoisoned.
//
// A result counts only with the lease of the very worker and range (StandingOf). A lease that ended
// because nothing was heard of its worker, or because it took too long, is as good as one that has
// not ended until another result of its range has come.
//
// A lease is renewed by reports until it is much older than a batch usually takes: a worker that
// only reports holds up nothing. Leases taken back because a worker was not heard of are counted
// once it is known how that ended: as lost connections when it comes back, else as crashes.
//
// Some batches are audited (server/audit.h): after the first result they are lent to another
// worker. Workers whose results were wrong, and such as fail often, are lent nothing
// (worker_records.h).
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
#include <tuple>
#include <utility>
#include <vector>

#include "render/base/clock.h"
#include "render/base/digest.h"
#include "render/base/mutex.h"
#include "render/base/random_id.h"
#include "render/base/status.h"
#include "server/audit.h"
#include "server/batch.h"
#include "server/fair_share.h"
#include "server/worker_records.h"

namespace lucerna {

struct SchedulerOptions {
  // Ids of registrations and leases: whoever knows them may use them.
  std::function<std::string()> new_id = RandomId;
  Duration lease_time = std::chrono::seconds(10);  // renewed by every Sync
  // A worker that is silent for so long is forgotten.
  Duration worker_silence = std::chrono::seconds(30);
  std::uint64_t min_batch = 4096;  // [photons]
  std::uint64_t max_batch = std::uint64_t{1} << 22;
  // A pass is split among so many workers at most: what every one of them is sent and sends takes
  // longer than the photons that one more would take over.
  std::uint64_t max_split_ways = 6;
  std::uint64_t fixed_batch = 0;  // all batches of this size; 0: as above
  std::uint64_t max_slice = 16;   // [passes]
  // By the time in which the worker traces a pass: what is lost with it, and the sums of halves
  // that it holds, stay few where passes take long. (Not by the time until they are merged: where
  // the link is full slices must be long.)
  Duration longest_slice = std::chrono::seconds(30);
  // Slices are cut so that open rounds have so many for every worker.
  std::uint64_t slices_per_worker = 2;
  // A lease this many times older than the median batch may be doubled.
  int speculate_after = 3;
  Duration speculate_at_least = std::chrono::seconds(1);
  Duration speculate_unknown = std::chrono::seconds(30);  // while no median is known
  std::size_t max_holders = 3;                            // of one batch at a time
  // A lease this many times older than the median batch is not renewed, but it is for
  // renew_at_least, and while no median is known for renew_unknown. Each time that a batch is taken
  // back so, its next lease may become twice as old: a batch that is slow for good reason ends too.
  int renew_until = 20;
  Duration renew_at_least = std::chrono::seconds(60);
  Duration renew_unknown = std::chrono::minutes(10);
  std::size_t poison_workers = 3;
  int poison_failures = 3;  // when no other worker is left to try
  // Of batches, which share is computed by two workers; and what only this process knows.
  double audit_share = 0;
  std::string audit_secret;
  // Of one peer, or it could fill the memory within worker_silence. A farm behind one address, or
  // with one token, has one for each worker.
  std::size_t max_registrations = 16384;
  // An audit for which no other worker has come for so long is given up.
  Duration audit_patience = std::chrono::seconds(30);
};

struct BatchLease {
  std::string id;
  PassKey pass;
  WorkRange range;
  WorkKind kind = WorkKind::kPhotons;
};

// Of which work a worker says that it hands in the result.
struct BatchClaim {
  std::string worker;
  BatchLease lease;
};

class Scheduler {
 public:
  explicit Scheduler(SchedulerOptions options) : options_(std::move(options)) {}

  // The id of a new registration. `identity` is what the worker keeps through all its
  // registrations; what an earlier one held goes back, because it was dropped. Empty: a new one.
  // `peer` is whose limits the registration counts for; the worker traces with so many threads.
  // Errors: RESOURCE_EXHAUSTED when the peer has max_registrations; then nothing has changed.
  [[nodiscard]] StatusOr<std::string> AddWorker(std::string_view name, SteadyTime now,
                                                std::string_view identity = {},
                                                std::string_view peer = {}, int threads = 1);

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

  enum class Standing : std::uint8_t { kExpected, kDuplicate, kSuperseded };
  // Whether a result may count. kDuplicate: another result of the batch has, or this one;
  // kSuperseded: the pass or round has ended.
  // Errors: PERMISSION_DENIED for the lease of another worker, FAILED_PRECONDITION for an unknown
  // worker, an unknown lease, one that the worker gave back, and work other than the lease's.
  [[nodiscard]] StatusOr<Standing> StandingOf(const BatchClaim& claim) const;

  struct Taken {
    Standing standing = Standing::kExpected;
    // The batch is audited and another worker's result is needed: this one is not merged.
    bool is_held = false;
    AuditOutcome audit = AuditOutcome::kNone;
    std::vector<std::string> wrong;  // worker records: their results differ from what two returned
  };
  // Takes the digest of a result that is as it should be. It is to be merged when it is expected
  // and not held; then Commit follows. Errors: as StandingOf.
  [[nodiscard]] StatusOr<Taken> TakeResult(const BatchClaim& claim, const Digest& result,
                                           SteadyTime now);
  // The result of a claim is not what it should be: as if the worker had reported a failure.
  void RefuseResult(const BatchClaim& claim, std::string_view reason);
  // The batch has been merged, by whomever.
  void Commit(const PassKey& key, WorkRange range, SteadyTime now);

  // Sharing of workers among jobs (server/fair_share.h) ------------------------------------------

  void SetClaim(const std::string& job_id, FairShare::Claim claim);
  // A held job is lent nothing, also not a second time; what is lent may come back. When it goes
  // on, failures of its batches are forgotten.
  void SetHeld(const std::string& job_id, bool is_held);
  // A result of so many photons or passes came back, and took so much processor time, as the worker
  // says.
  void CountWork(const std::string& worker, const std::string& job_id, WorkKind kind,
                 std::uint64_t size, Duration worker_cpu);
  // The job has no open work, and will have none.
  void ForgetJob(const std::string& job_id);

  // Takes back what has run out and forgets workers that are silent.
  void Expire(SteadyTime now);

  // What went wrong with a worker, for the log.
  struct Loss {
    std::string record;  // its id
    std::string name;
    std::string reason;  // a sentence whose subject is the worker
  };
  // Since the last call, in their order; of more than a thousand the first.
  [[nodiscard]] std::vector<Loss> TakeLosses();

  // Leases of such a job are kept for TakeEnded when they end.
  void SetTraced(const std::string& job_id, bool is_traced);
  struct EndedLease {
    std::string job_id;
    std::string record;  // the worker's id
    std::string name;
    std::string work;    // "passes 0 to 4"
    std::string ending;  // "delivered"
    SteadyTime lent_at;
  };
  // Since the last call, of jobs that are traced.
  [[nodiscard]] std::vector<EndedLease> TakeEnded();

  struct Poisoned {
    PassKey pass;
    std::string message;  // for the user
  };
  // Batches found poisoned since the last call.
  [[nodiscard]] std::vector<Poisoned> TakePoisoned();
  // The poisoned batches of a job may be lent again, and what was counted against them is not.
  void ReleasePoisoned(const std::string& job_id);
  // Batches of which two workers returned different results and no third is there to decide: the
  // first of each job, for the user.
  [[nodiscard]] std::map<std::string, std::string> Disputes() const;

  // Workers that are connected and may be lent work.
  [[nodiscard]] int LiveWorkers() const;
  struct Load {
    std::uint64_t live_workers = 0;
    std::uint64_t idle_workers = 0;  // of those, that hold no lease
    std::uint64_t leases = 0;
    Duration oldest_lease{};  // how long ago it was lent
    // Leases, since the process began, and those of work that had been lent before: it came back,
    // or its worker is late, or the result is audited.
    std::uint64_t lent = 0, lent_again = 0;
  };
  [[nodiscard]] Load LoadAt(SteadyTime now) const;
  // What is known of the worker of a registration; absent when unknown.
  [[nodiscard]] std::optional<WorkerRecord> RecordOf(const std::string& worker) const;

  // Workers by the ids of their records.

  [[nodiscard]] std::vector<WorkerRecord> Workers() const;
  // Lends it nothing more; what it holds goes back. False when there is no such worker.
  bool Quarantine(const std::string& id, std::string_view reason);
  // Lends it nothing more; what it holds it may finish. False when there is no such worker.
  bool Drain(const std::string& id);
  // Lends to it again. False when there is no such worker.
  bool Release(const std::string& id);
  // As the functions of WorkerRecords.
  [[nodiscard]] std::vector<WorkerStanding> TakeChangedStandings();
  void NoteChangedStanding(const std::string& id);
  void RestoreStanding(const WorkerStanding& standing, SteadyTime now);

 private:
  // So many audits are looked at for one worker. A worker is passed over only by audits that it has
  // a part in, and each has a few.
  static constexpr int kMostLookedAt = 8;
  static constexpr std::size_t kMostReason = 200;  // of what workers say, for messages
  // Losses, and leases that ended, between two calls that take them.
  static constexpr std::size_t kMostLosses = 1000;

  // How a lease ended.
  enum class Ending : std::uint8_t {
    kDelivered,    // by its result
    kOvertaken,    // by another result, or the end of its pass or round
    kGivenBack,    // the worker dropped it, or left, or must not deliver it
    kFailed,       // the worker reported so, or its result was refused
    kInterrupted,  // nothing was heard of the worker
    kStalled,      // renewed for too long
  };
  struct PastLease {
    BatchLease lease;
    Ending ending = Ending::kDelivered;
    std::uint64_t opening = 0;  // of its work
  };
  // How long a pass of a worker's last slice took [s].
  struct Pace {
    std::optional<double> until_merged;  // since it was lent
    // Processor time over its threads, as it says: less than it takes where it has fewer
    // processors.
    std::optional<double> tracing;
  };
  // A registration.
  struct Worker {
    std::string record;  // its id
    std::string peer;
    SteadyTime heard_at;
    bool is_connected = true;
    bool may_be_lent = true;
    std::set<std::string> leases;
    std::uint64_t place = 0;  // in the queue for leases; 0: does not wait
    int threads = 1;
    Pace pace;
    // What it held when it was last heard of.
    std::vector<std::pair<PassKey, WorkRange>> interrupted;
    std::deque<PastLease> past;  // the newest
    [[nodiscard]] bool is_live() const { return is_connected && may_be_lent; }
  };
  struct Lease {
    std::string worker;
    PassKey pass;
    WorkRange range;
    WorkKind kind = WorkKind::kPhotons;
    SteadyTime lent_at;
    SteadyTime expires_at;
    std::uint64_t number = 0;  // leases are numbered as they are lent
    bool is_too_old = false;   // to be renewed
    bool has_result = false;   // that was taken
  };
  struct Losses {
    std::set<std::string> workers;  // records of those that failed or crashed
    int failures = 0;               // and how often
    int stalls = 0;
    std::string last;  // what happened last, for the user
    bool is_poisoned = false;
  };
  // An open pass or round.
  struct Work {
    WorkKind kind = WorkKind::kPhotons;
    std::uint64_t opening = 0;  // which one it is: the same passes may be opened again
    WorkRange rest;             // not handed out yet
    std::uint64_t total = 0;    // photons or passes
    std::optional<SteadyTime> due;
    std::set<WorkRange> returned;                     // go out first
    std::map<WorkRange, std::set<std::string>> lent;  // -> lease ids
    std::map<WorkRange, Losses> losses;
    std::set<WorkRange> poisoned;       // of what has come back
    std::map<WorkRange, Audit> audits;  // that have begun
    std::set<WorkRange> not_audited;    // although they were to be: no other worker came

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
  // Of a lease, for what must not depend on its id.
  using Age = std::tuple<SteadyTime, std::uint64_t, std::string>;

  // Every change to a worker's connection, standing, leases or place goes between these two.
  void Uncount(const Worker& worker) LUCERNA_REQUIRES(mutex_);
  void Count(const std::string& id, const Worker& worker) LUCERNA_REQUIRES(mutex_);
  void SetConnected(const std::string& id, Worker& worker, bool is_connected)
      LUCERNA_REQUIRES(mutex_);
  void SetPlace(const std::string& id, Worker& worker, std::uint64_t place)
      LUCERNA_REQUIRES(mutex_);
  // To be called when `rest` or `returned` of open work have changed.
  void UpdateLendable(const PassKey& key, const Work& work) LUCERNA_REQUIRES(mutex_);
  void EraseLendable(const PassKey& key) LUCERNA_REQUIRES(mutex_);
  void LendPoisonedAgain(const std::string& job_id) LUCERNA_REQUIRES(mutex_);
  void AddWork(const PassKey& key, Work work) LUCERNA_REQUIRES(mutex_);

  // Of the next batch. Requires work.rest.size() > 0.
  // `pace`: of the worker that it is for, or of none.
  std::uint64_t BatchSize(const Work& work, const Pace& pace, SteadyTime now) const
      LUCERNA_REQUIRES(mutex_);
  std::uint64_t SliceSize(const Work& work, const Pace& pace, SteadyTime now) const
      LUCERNA_REQUIRES(mutex_);
  // Whether there are more batches to hand out than idle workers.
  bool HasBatchesToSpare(SteadyTime now) const LUCERNA_REQUIRES(mutex_);
  std::optional<BatchLease> Lend(const std::string& worker_id, SteadyTime now)
      LUCERNA_REQUIRES(mutex_);
  // The batch of an audit that the worker may be lent. One that no other worker will come for is
  // to be given up (`is_given_up`) and lent as any other.
  struct WaitingAudit {
    PassKey pass;
    WorkRange range;
    bool is_given_up = false;
  };
  std::optional<WaitingAudit> FindAudit(const std::string& worker_id, SteadyTime now) const
      LUCERNA_REQUIRES(mutex_);
  // Whether a worker may be lent work beside those of `records`.
  template <typename Records>
  bool HasOthersThan(const Records& records) const LUCERNA_REQUIRES(mutex_);
  // What may be lent a second time.
  std::optional<Straggler> FindStraggler(SteadyTime now) const LUCERNA_REQUIRES(mutex_);
  std::optional<BatchLease> LendTwice(const std::string& worker_id, SteadyTime now)
      LUCERNA_REQUIRES(mutex_);
  BatchLease Enter(const std::string& worker_id, const PassKey& key, WorkRange range,
                   SteadyTime now) LUCERNA_REQUIRES(mutex_);
  // Ends a lease and makes its batch pending unless another holds it. `failure` says how the worker
  // failed at it, if it did.
  void TakeBack(const std::string& lease_id, Ending ending, std::string_view failure = {})
      LUCERNA_REQUIRES(mutex_);
  void TakeBackAll(Worker& worker, Ending ending) LUCERNA_REQUIRES(mutex_);
  void EraseLease(const std::string& lease_id, Ending ending) LUCERNA_REQUIRES(mutex_);
  static const char* EndingText(Ending ending);
  // A range that nobody holds any more waits to be lent again.
  void Return(const PassKey& key, Work& work, WorkRange range) LUCERNA_REQUIRES(mutex_);
  // The range has a result, or its pass or round has ended: it waits for nothing.
  void Settle(const PassKey& key, Work& work, WorkRange range) LUCERNA_REQUIRES(mutex_);
  // A worker failed or crashed at a batch.
  void CountFailure(const PassKey& key, WorkRange range, const std::string& record,
                    std::string_view failure) LUCERNA_REQUIRES(mutex_);
  // Lends a batch no more, if it is poisoned and has come back.
  void PoisonIfDue(const PassKey& key, Work& work, WorkRange range) LUCERNA_REQUIRES(mutex_);
  // It is known now how the worker that was not heard of fared.
  void ResolveInterrupted(Worker& worker, bool has_crashed) LUCERNA_REQUIRES(mutex_);
  void QuarantineIfUnreliable(const std::string& record, std::string_view failure)
      LUCERNA_REQUIRES(mutex_);
  void NoteLoss(const std::string& record, std::string reason) LUCERNA_REQUIRES(mutex_);
  // "pass 3 of job x" of a lease that there is.
  std::string NameOfLease(const std::string& lease_id) const LUCERNA_REQUIRES(mutex_);
  bool QuarantineLocked(const std::string& id, std::string_view reason, bool has_lied)
      LUCERNA_REQUIRES(mutex_);
  // What follows for its registration from the state of a worker's record.
  void UpdateStanding(const std::string& record) LUCERNA_REQUIRES(mutex_);
  void Forget(std::map<std::string, Worker>::iterator worker, SteadyTime now)
      LUCERNA_REQUIRES(mutex_);
  StatusOr<Standing> StandingLocked(const BatchClaim& claim) const LUCERNA_REQUIRES(mutex_);
  void NoteTime(const Lease& lease, SteadyTime now) LUCERNA_REQUIRES(mutex_);
  // How old a lease may become by being renewed.
  Duration LongestAge(const Lease& lease) const LUCERNA_REQUIRES(mutex_);
  // Enters the newest lease of a range among those that another may join, or takes it out.
  void EnterNewest(const Work& work, WorkRange range) LUCERNA_REQUIRES(mutex_);
  void EraseNewest(const Work& work, WorkRange range) LUCERNA_REQUIRES(mutex_);
  const std::string* NewestOf(const Work& work, WorkRange range) const LUCERNA_REQUIRES(mutex_);
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
  std::vector<Loss> losses_ LUCERNA_GUARDED_BY(mutex_);
  std::set<std::string> traced_ LUCERNA_GUARDED_BY(mutex_);  // jobs
  std::vector<EndedLease> ended_ LUCERNA_GUARDED_BY(mutex_);
  WorkerRecords records_ LUCERNA_GUARDED_BY(mutex_);
  std::uint64_t next_lease_ LUCERNA_GUARDED_BY(mutex_) = 1;
  std::uint64_t next_opening_ LUCERNA_GUARDED_BY(mutex_) = 1;
  std::uint64_t next_place_ LUCERNA_GUARDED_BY(mutex_) = 1;
  std::uint64_t lent_anew_ LUCERNA_GUARDED_BY(mutex_) = 0;  // leases of work never lent before

  // What follows from the above.
  std::uint64_t live_workers_ LUCERNA_GUARDED_BY(mutex_) = 0;  // connected, may be lent work
  std::uint64_t idle_workers_ LUCERNA_GUARDED_BY(mutex_) = 0;  // of those, without a lease
  // Workers that wait, by place: without a lease, and with one.
  std::map<std::uint64_t, std::string> idle_queue_ LUCERNA_GUARDED_BY(mutex_);
  std::map<std::uint64_t, std::string> busy_queue_ LUCERNA_GUARDED_BY(mutex_);
  std::set<std::string> affected_ LUCERNA_GUARDED_BY(mutex_);
  std::set<PassKey> lendable_ LUCERNA_GUARDED_BY(mutex_);  // where HasBatches()
  FairShare shares_ LUCERNA_GUARDED_BY(mutex_);
  std::uint64_t round_passes_ LUCERNA_GUARDED_BY(mutex_) = 0;  // `total` of all open rounds
  // The newest lease of each range that another worker may join, oldest first, by kind and size of
  // the range.
  std::map<std::pair<WorkKind, std::uint64_t>, std::set<Age>> newest_leases_
      LUCERNA_GUARDED_BY(mutex_);
  std::map<std::string, std::string> registrations_ LUCERNA_GUARDED_BY(mutex_);  // by record
  std::map<std::string, std::size_t> peers_ LUCERNA_GUARDED_BY(mutex_);  // registrations of each
  // Registrations that were not heard of while they held leases, by name.
  std::multimap<std::string, std::string> missing_ LUCERNA_GUARDED_BY(mutex_);
  // Batches of audits that nobody holds.
  std::set<std::pair<PassKey, WorkRange>> waiting_audits_ LUCERNA_GUARDED_BY(mutex_);
  Deadlines lease_deadlines_ LUCERNA_GUARDED_BY(mutex_);
  Deadlines worker_deadlines_ LUCERNA_GUARDED_BY(mutex_);
};

}  // namespace lucerna
