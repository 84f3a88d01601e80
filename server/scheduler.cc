#include "server/scheduler.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "absl/strings/str_join.h"

#include "render/base/escape.h"
#include "render/estimate/slice_sums.h"

namespace lucerna {
namespace {

constexpr std::size_t kTimesKept = 31;
// With fewer commits than this the usual time of one is unknown.
constexpr std::size_t kTimesNeeded = 3;
// A slice shall be there when so much of the time that a job has left is over, by the time from
// lending to merging of the worker's last slice, or of most workers. With a quarter, slices of the
// last minute of a large farm were so short that they filled its link.
constexpr double kShareOfTimeLeft = 0.8;
// Of a registration, so many of its last leases are known.
constexpr std::size_t kMostPast = 64;

// What a batch is called for people.
std::string NameOf(const PassKey& key, WorkKind kind, WorkRange range) {
  const std::string numbers = absl::StrCat(range.first, " to ", range.last);
  return kind == WorkKind::kPasses ? absl::StrCat("passes ", numbers)
                                   : absl::StrCat("photons ", numbers, " of pass ", key.pass);
}

std::uint64_t CeilDivide(std::uint64_t a, std::uint64_t b) {
  return a / b + (a % b != 0 ? 1 : 0);
}

// Absent while there are too few of them.
std::optional<double> MedianOf(const std::deque<double>& known) {
  if (known.size() < kTimesNeeded) return std::nullopt;
  std::vector<double> times(known.begin(), known.end());
  const auto middle = times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2);
  std::nth_element(times.begin(), middle, times.end());
  return *middle;
}

}  // namespace

// Bookkeeping
// ---------------------------------------------------------------------------------------------

void Scheduler::Uncount(const Worker& worker) {
  if (worker.is_live()) {
    --live_workers_;
    if (worker.leases.empty()) --idle_workers_;
  }
  if (worker.place > 0) (worker.leases.empty() ? idle_queue_ : busy_queue_).erase(worker.place);
}

void Scheduler::Count(const std::string& id, const Worker& worker) {
  if (worker.is_live()) {
    ++live_workers_;
    if (worker.leases.empty()) ++idle_workers_;
  }
  if (worker.place > 0) (worker.leases.empty() ? idle_queue_ : busy_queue_)[worker.place] = id;
}

void Scheduler::SetConnected(const std::string& id, Worker& worker, bool is_connected) {
  if (worker.is_connected == is_connected) return;
  Uncount(worker);
  worker.is_connected = is_connected;
  Count(id, worker);
}

void Scheduler::SetPlace(const std::string& id, Worker& worker, std::uint64_t place) {
  if (worker.place == place) return;
  Uncount(worker);
  worker.place = place;
  Count(id, worker);
}

void Scheduler::UpdateLendable(const PassKey& key, const Work& work) {
  if (work.HasBatches()) {
    lendable_.insert(key);
    shares_.SetLendable(key.job_id, true);
  } else {
    EraseLendable(key);
  }
}

void Scheduler::EraseLendable(const PassKey& key) {
  lendable_.erase(key);
  const auto next = lendable_.lower_bound({key.job_id, 0});
  if (next == lendable_.end() || next->job_id != key.job_id) {
    shares_.SetLendable(key.job_id, false);
  }
}

// Work
// ---------------------------------------------------------------------------------------------

void Scheduler::AddWork(const PassKey& key, Work work) {
  if (work.kind == WorkKind::kPasses) round_passes_ += work.total;
  work.opening = next_opening_++;
  const auto [added, is_new] = open_.emplace(key, std::move(work));
  LUCERNA_CHECK(is_new);
  UpdateLendable(key, added->second);
}

void Scheduler::OpenPass(const PassKey& key, std::uint64_t photons) {
  const MutexLock lock(mutex_);
  Work work;
  work.rest = {0, photons};
  work.total = photons;
  AddWork(key, std::move(work));
}

void Scheduler::OpenRound(const PassKey& key, WorkRange passes, std::optional<SteadyTime> due) {
  const MutexLock lock(mutex_);
  Work work;
  work.kind = WorkKind::kPasses;
  work.rest = passes;
  work.total = passes.size();
  work.due = due;
  AddWork(key, std::move(work));
}

void Scheduler::SetRoundEnd(const PassKey& key, std::uint64_t last, std::optional<SteadyTime> due) {
  const MutexLock lock(mutex_);
  const auto found = open_.find(key);
  if (found == open_.end() || found->second.kind != WorkKind::kPasses) return;
  found->second.rest.last = std::max(found->second.rest.first, last);
  found->second.due = due;
  UpdateLendable(key, found->second);
}

void Scheduler::Close(const PassKey& key) {
  const MutexLock lock(mutex_);
  const auto found = open_.find(key);
  if (found == open_.end()) return;
  Work& work = found->second;
  while (!work.lent.empty()) {
    const WorkRange range = work.lent.begin()->first;
    Settle(key, work, range);
  }
  for (const auto& [range, audit] : work.audits)
    waiting_audits_.erase({key, range});
  if (work.kind == WorkKind::kPasses) round_passes_ -= work.total;
  open_.erase(found);
  EraseLendable(key);
}

void Scheduler::SetClaim(const std::string& job_id, FairShare::Claim claim) {
  const MutexLock lock(mutex_);
  shares_.SetClaim(job_id, std::move(claim));
}

void Scheduler::SetHeld(const std::string& job_id, bool is_held) {
  const MutexLock lock(mutex_);
  shares_.SetHeld(job_id, is_held);
  if (!is_held) LendPoisonedAgain(job_id);
}

void Scheduler::CountWork(const std::string& worker, const std::string& job_id, WorkKind kind,
                          std::uint64_t size, Duration worker_cpu) {
  const MutexLock lock(mutex_);
  shares_.CountWork(job_id, kind, size, worker_cpu);
  const auto found = workers_.find(worker);
  if (found == workers_.end() || kind != WorkKind::kPasses || size == 0) return;
  found->second.pace.tracing =
      std::max(0.0, Seconds(worker_cpu)) / found->second.threads / static_cast<double>(size);
}

void Scheduler::ForgetJob(const std::string& job_id) {
  const MutexLock lock(mutex_);
  const auto work = open_.lower_bound({job_id, 0});
  if (work == open_.end() || work->first.job_id != job_id) shares_.Forget(job_id);
}

void Scheduler::Settle(const PassKey& key, Work& work, WorkRange range) {
  if (const auto lent = work.lent.find(range); lent != work.lent.end()) {
    EraseNewest(work, range);
    const std::vector<std::string> ids(lent->second.begin(), lent->second.end());
    for (const std::string& id : ids)
      EraseLease(id, Ending::kOvertaken);
    work.lent.erase(lent);
  }
  work.returned.erase(range);
  work.poisoned.erase(range);
  work.losses.erase(range);
  work.audits.erase(range);
  work.not_audited.erase(range);
  waiting_audits_.erase({key, range});
}

void Scheduler::Return(const PassKey& key, Work& work, WorkRange range) {
  if (work.audits.contains(range)) {
    waiting_audits_.insert({key, range});
  } else {
    work.returned.insert(range);
    PoisonIfDue(key, work, range);
  }
  UpdateLendable(key, work);
}

// Results
// ---------------------------------------------------------------------------------------------

StatusOr<Scheduler::Standing> Scheduler::StandingLocked(const BatchClaim& claim) const {
  const auto worker = workers_.find(claim.worker);
  if (worker == workers_.end()) {
    return absl::FailedPreconditionError(
        "the coordinator does not know the worker of this result; register again");
  }
  const auto is_work_of = [&](const PassKey& pass, WorkKind kind, WorkRange range) {
    return claim.lease.pass == pass && claim.lease.kind == kind && claim.lease.range == range;
  };
  const Status other_work =
      absl::FailedPreconditionError("the result is of other work than its lease");
  if (const auto lease = leases_.find(claim.lease.id); lease != leases_.end()) {
    if (lease->second.worker != claim.worker) {
      return absl::PermissionDeniedError("the lease is of another worker");
    }
    if (!is_work_of(lease->second.pass, lease->second.kind, lease->second.range)) {
      return other_work;
    }
    return Standing::kExpected;
  }
  const std::deque<PastLease>& past = worker->second.past;
  const auto ended =
      std::ranges::find(past, claim.lease.id, [](const PastLease& item) { return item.lease.id; });
  if (ended == past.end()) {
    return absl::FailedPreconditionError("the worker has no such lease");
  }
  if (!is_work_of(ended->lease.pass, ended->lease.kind, ended->lease.range)) return other_work;
  const auto open = open_.find(claim.lease.pass);
  // The same passes may have been opened again with other radii, by a job that began again.
  if (open == open_.end() || open->second.kind != claim.lease.kind ||
      open->second.opening != ended->opening) {
    return Standing::kSuperseded;
  }
  switch (ended->ending) {
    case Ending::kDelivered:
    case Ending::kOvertaken:
      return Standing::kDuplicate;
    case Ending::kGivenBack:
    case Ending::kFailed:
      return absl::FailedPreconditionError("the lease was given back");
    case Ending::kInterrupted:
    case Ending::kStalled:
      break;
  }
  const Work& work = open->second;
  const WorkRange range = claim.lease.range;
  if (const auto audit = work.audits.find(range); audit != work.audits.end()) {
    return audit->second.HasResultOf(worker->second.record) ? Standing::kDuplicate
                                                            : Standing::kExpected;
  }
  const bool is_pending =
      work.lent.contains(range) || work.returned.contains(range) || work.poisoned.contains(range);
  return is_pending ? Standing::kExpected : Standing::kDuplicate;
}

StatusOr<Scheduler::Standing> Scheduler::StandingOf(const BatchClaim& claim) const {
  const MutexLock lock(mutex_);
  return StandingLocked(claim);
}

StatusOr<Scheduler::Taken> Scheduler::TakeResult(const BatchClaim& claim, const Digest& result,
                                                 SteadyTime now) {
  const MutexLock lock(mutex_);
  Taken taken;
  LUCERNA_ASSIGN_OR_RETURN(taken.standing, StandingLocked(claim));
  if (taken.standing != Standing::kExpected) return taken;
  const auto& [lease_id, key, range, kind] = claim.lease;
  const std::string record = workers_.at(claim.worker).record;
  Work& work = open_.at(key);
  records_.Count(record, WorkerRecords::End::kCommitted);
  if (const auto lease = leases_.find(lease_id); lease != leases_.end())
    lease->second.has_result = true;
  auto audit = work.audits.find(range);
  if (audit == work.audits.end()) {
    if (!IsAudited(options_.audit_secret, options_.audit_share, key, kind, range)) return taken;
    if (work.not_audited.contains(range) || !HasOthersThan(std::array{record})) {
      taken.audit = AuditOutcome::kNotAudited;
      return taken;
    }
    if (work.lent.contains(range)) EraseNewest(work, range);
    audit = work.audits.emplace(range, Audit(now)).first;
  }
  const bool was_disputed = audit->second.is_disputed();
  if (audit->second.Add(record, result)) {
    taken.audit = AuditOutcome::kAgreed;
    taken.wrong = audit->second.Wrong();
    for (const std::string& wrong : taken.wrong) {
      QuarantineLocked(wrong, "a result of it differs from what two other workers returned",
                       /*has_lied=*/true);
    }
    return taken;
  }
  taken.is_held = true;
  if (audit->second.is_disputed() && !was_disputed) taken.audit = AuditOutcome::kDisputed;
  work.returned.erase(range);
  work.poisoned.erase(range);
  if (const auto lease = leases_.find(lease_id); lease != leases_.end()) {
    NoteTime(lease->second, now);
    EraseLease(lease_id, Ending::kDelivered);
    const auto lent = work.lent.find(range);
    lent->second.erase(lease_id);
    if (lent->second.empty()) work.lent.erase(lent);
  }
  if (!work.lent.contains(range)) waiting_audits_.insert({key, range});
  UpdateLendable(key, work);
  return taken;
}

void Scheduler::RefuseResult(const BatchClaim& claim, std::string_view reason) {
  const MutexLock lock(mutex_);
  const StatusOr<Standing> standing = StandingLocked(claim);
  if (!standing.ok() || *standing != Standing::kExpected) return;
  const std::string failure =
      absl::StrCat("its result was refused: ", std::string(reason.substr(0, kMostReason)));
  if (leases_.contains(claim.lease.id)) {
    TakeBack(claim.lease.id, Ending::kFailed, failure);
    return;
  }
  Worker& worker = workers_.at(claim.worker);
  std::ranges::find(worker.past, claim.lease.id, [](const PastLease& item) {
    return item.lease.id;
  })->ending = Ending::kFailed;
  const std::string record = worker.record;
  records_.Count(record, WorkerRecords::End::kFailed);
  CountFailure(claim.lease.pass, claim.lease.range, record, failure);
  QuarantineIfUnreliable(record, failure);
}

void Scheduler::NoteTime(const Lease& lease, SteadyTime now) {
  const auto of_kind = static_cast<std::size_t>(lease.kind);
  const double time = Seconds(now - lease.lent_at) / static_cast<double>(lease.range.size());
  if (lease.kind == WorkKind::kPasses) workers_.at(lease.worker).pace.until_merged = time;
  times_[of_kind].push_back(time);
  if (times_[of_kind].size() > kTimesKept) times_[of_kind].pop_front();
  usual_times_[of_kind] = MedianOf(times_[of_kind]);
}

void Scheduler::Commit(const PassKey& key, WorkRange range, SteadyTime now) {
  const MutexLock lock(mutex_);
  const auto found = open_.find(key);
  if (found == open_.end()) return;
  Work& work = found->second;
  const auto lent = work.lent.find(range);
  if (lent != work.lent.end()) {
    // The newest: a lease that had to be doubled says nothing of how long a batch takes.
    const auto newest = std::ranges::max_element(
        lent->second, {}, [&](const std::string& id) { return leases_.at(id).lent_at; });
    NoteTime(leases_.at(*newest), now);
  }
  Settle(key, work, range);
  UpdateLendable(key, work);
}

void Scheduler::Expire(SteadyTime now) {
  const MutexLock lock(mutex_);
  while (!lease_deadlines_.empty() && lease_deadlines_.top().first <= now) {
    const std::string id = lease_deadlines_.top().second;
    lease_deadlines_.pop();
    const auto lease = leases_.find(id);
    if (lease == leases_.end()) continue;
    if (lease->second.expires_at > now) {
      lease_deadlines_.emplace(lease->second.expires_at, id);
    } else if (lease->second.is_too_old) {
      NoteLoss(workers_.at(lease->second.worker).record,
               absl::StrCat("stalled at ", NameOfLease(id), ": it did not end within ",
                            Seconds(LongestAge(lease->second)), " s"));
      TakeBack(id, Ending::kStalled, "it was renewed and did not end");
    } else {
      NoteLoss(workers_.at(lease->second.worker).record,
               absl::StrCat("was not heard of for ", Seconds(options_.lease_time),
                            " s: ", NameOfLease(id), " goes back"));
      TakeBack(id, Ending::kInterrupted);
    }
  }
  while (!worker_deadlines_.empty() && worker_deadlines_.top().first <= now) {
    const std::string id = worker_deadlines_.top().second;
    worker_deadlines_.pop();
    const auto worker = workers_.find(id);
    if (worker == workers_.end()) continue;
    if (const SteadyTime until = worker->second.heard_at + options_.worker_silence; until > now) {
      worker_deadlines_.emplace(until, id);
      continue;
    }
    TakeBackAll(worker->second, Ending::kInterrupted);
    NoteLoss(worker->second.record,
             absl::StrCat("is given up: it crashed or was cut off, and did not come back within ",
                          Seconds(options_.worker_silence),
                          " s; leases that count as crashed: ", worker->second.interrupted.size()));
    ResolveInterrupted(worker->second, /*has_crashed=*/true);
    Forget(worker, worker->second.heard_at);
  }
}

std::vector<Scheduler::Poisoned> Scheduler::TakePoisoned() {
  const MutexLock lock(mutex_);
  return std::exchange(poisoned_, {});
}

void Scheduler::ReleasePoisoned(const std::string& job_id) {
  const MutexLock lock(mutex_);
  LendPoisonedAgain(job_id);
}

void Scheduler::LendPoisonedAgain(const std::string& job_id) {
  for (auto open = open_.lower_bound({job_id, 0});
       open != open_.end() && open->first.job_id == job_id; ++open) {
    Work& work = open->second;
    for (const WorkRange& range : std::exchange(work.poisoned, {}))
      work.returned.insert(range);
    // Failures are forgotten; how long leases may last, which follows from stalls, is kept.
    for (auto& [range, losses] : work.losses) {
      Losses anew;
      anew.stalls = losses.stalls;
      losses = std::move(anew);
    }
    UpdateLendable(open->first, work);
  }
}

std::map<std::string, std::string> Scheduler::Disputes() const {
  const MutexLock lock(mutex_);
  std::map<std::string, std::string> disputes;
  for (const auto& [key, range] : waiting_audits_) {
    const Audit& audit = open_.at(key).audits.at(range);
    if (!audit.is_disputed() || disputes.contains(key.job_id)) continue;
    std::vector<std::string> workers;
    for (const auto& [worker, result] : audit.results())
      workers.push_back(worker);
    if (HasOthersThan(workers)) continue;
    disputes[key.job_id] =
        absl::StrCat("waits for another worker: workers ", absl::StrJoin(workers, ", "),
                     " returned different results of ", NameOf(key, open_.at(key).kind, range),
                     ", and one more must say which is right");
  }
  return disputes;
}

int Scheduler::LiveWorkers() const {
  const MutexLock lock(mutex_);
  return static_cast<int>(live_workers_);
}

// Leases
// ---------------------------------------------------------------------------------------------

std::uint64_t Scheduler::BatchSize(const Work& work, const Pace& pace, SteadyTime now) const {
  if (work.kind == WorkKind::kPasses) return SliceSize(work, pace, now);
  if (options_.fixed_batch > 0) return std::min(options_.fixed_batch, work.rest.size());
  const std::uint64_t ways = std::clamp<std::uint64_t>(live_workers_, 1, options_.max_split_ways);
  const std::uint64_t share = CeilDivide(work.total, ways);
  return std::min(std::clamp(share, options_.min_batch, options_.max_batch), work.rest.size());
}

// Long slices cost the coordinator and the network least; but every worker shall have one and find
// a second one waiting, and what is not done when time is up is lost.
std::uint64_t Scheduler::SliceSize(const Work& work, const Pace& pace, SteadyTime now) const {
  std::uint64_t size = std::min(
      {round_passes_ / (options_.slices_per_worker * std::max<std::uint64_t>(live_workers_, 1)),
       options_.max_slice, work.rest.size()});
  // Their sums are twice as large, and a worker holds some while it traces others.
  if (HasFeatures({work.rest.first, work.rest.first + 1})) size = 1;
  if (pace.tracing && *pace.tracing * static_cast<double>(size) > Seconds(options_.longest_slice)) {
    size = static_cast<std::uint64_t>(Seconds(options_.longest_slice) / *pace.tracing);
  }
  if (work.due) {
    const std::optional<double> time =
        pace.until_merged ? pace.until_merged : UsualTime(WorkKind::kPasses);
    const double left = Seconds(*work.due - now);
    if (!time || left <= 0) {
      size = 1;
    } else if (const double passes = kShareOfTimeLeft * left / *time;
               passes < static_cast<double>(size)) {
      size = static_cast<std::uint64_t>(passes);
    }
  }
  size = std::bit_floor(std::max<std::uint64_t>(size, 1));
  while (work.rest.first % size != 0)
    size /= 2;
  return size;
}

// A job has a few dozen rounds open at most, whatever the number of workers.
bool Scheduler::HasBatchesToSpare(SteadyTime now) const {
  std::uint64_t batches = 0;
  for (const PassKey& key : lendable_) {
    if (shares_.IsHeld(key.job_id)) continue;
    const Work& work = open_.at(key);
    batches += work.returned.size();
    if (work.rest.size() > 0) batches += CeilDivide(work.rest.size(), BatchSize(work, Pace(), now));
    if (batches > idle_workers_) return true;
  }
  return false;
}

std::optional<BatchLease> Scheduler::Lend(const std::string& worker_id, SteadyTime now) {
  if (const std::optional<WaitingAudit> audit = FindAudit(worker_id, now)) {
    waiting_audits_.erase({audit->pass, audit->range});
    if (audit->is_given_up) {
      Work& work = open_.at(audit->pass);
      work.audits.erase(audit->range);
      work.not_audited.insert(audit->range);
    }
    return Enter(worker_id, audit->pass, audit->range, now);
  }
  const std::optional<std::string> job_id = shares_.Next();
  if (!job_id) return std::nullopt;
  // A worker that is busy fetches ahead only what the idle ones leave over; else one worker would
  // take a whole last pass and the others would stand by.
  const Worker& worker = workers_.at(worker_id);
  if (!worker.leases.empty() && !HasBatchesToSpare(now)) return std::nullopt;
  const PassKey key = *lendable_.lower_bound({*job_id, 0});
  Work& work = open_.at(key);
  WorkRange range;
  if (!work.returned.empty()) {
    // One that this worker has not failed at, if there is one.
    const std::map<WorkRange, Losses>& losses = work.losses;
    const std::string& record = worker.record;
    const auto is_new_to_worker = [&](const WorkRange& returned) {
      const auto found = losses.find(returned);
      return found == losses.end() || !found->second.workers.contains(record);
    };
    auto choice = std::find_if(work.returned.begin(), work.returned.end(), is_new_to_worker);
    if (choice == work.returned.end()) choice = work.returned.begin();
    range = *choice;
    work.returned.erase(choice);
  } else {
    range = {work.rest.first, work.rest.first + BatchSize(work, worker.pace, now)};
    work.rest.first = range.last;
    ++lent_anew_;
  }
  UpdateLendable(key, work);
  return Enter(worker_id, key, range, now);
}

std::optional<Scheduler::WaitingAudit> Scheduler::FindAudit(const std::string& worker_id,
                                                            SteadyTime now) const {
  const std::string& record = workers_.at(worker_id).record;
  int looked_at = 0;
  for (const auto& [key, range] : waiting_audits_) {
    if (shares_.IsHeld(key.job_id)) continue;
    if (++looked_at > kMostLookedAt) break;
    const Audit& audit = open_.at(key).audits.at(range);
    const bool is_given_up =
        !audit.is_disputed() && (now - audit.began_at() >= options_.audit_patience ||
                                 !HasOthersThan(std::array{audit.results().begin()->first}));
    if (is_given_up || !audit.HasResultOf(record)) return WaitingAudit{key, range, is_given_up};
  }
  return std::nullopt;
}

std::optional<Scheduler::Straggler> Scheduler::FindStraggler(SteadyTime now) const {
  std::optional<Straggler> first;
  for (const auto& [kind_and_size, leases] : newest_leases_) {
    const auto& [kind, size] = kind_and_size;
    const std::optional<double> usual = UsualTime(kind);
    const double patience =
        usual ? std::max(*usual * static_cast<double>(size) * options_.speculate_after,
                         Seconds(options_.speculate_at_least))
              : Seconds(options_.speculate_unknown);
    auto newest = leases.begin();
    while (newest != leases.end() && shares_.IsHeld(leases_.at(std::get<2>(*newest)).pass.job_id))
      ++newest;
    if (newest == leases.end()) continue;
    const auto& [lent_at, number, id] = *newest;
    if (Seconds(now - lent_at) < patience) continue;
    const Lease& lease = leases_.at(id);
    if (const Straggler found = {lease.pass, lease.range}; !first || found < *first) first = found;
  }
  return first;
}

std::optional<BatchLease> Scheduler::LendTwice(const std::string& worker_id, SteadyTime now) {
  // Only an idle worker: it holds none of the batches.
  if (!workers_.at(worker_id).leases.empty()) return std::nullopt;
  const std::optional<Straggler> straggler = FindStraggler(now);
  if (!straggler) return std::nullopt;
  return Enter(worker_id, straggler->pass, straggler->range, now);
}

BatchLease Scheduler::Enter(const std::string& worker_id, const PassKey& key, WorkRange range,
                            SteadyTime now) {
  const std::string id = options_.new_id();
  Work& work = open_.at(key);
  shares_.CountLent(key.job_id, work.kind, range.size());
  Lease lease;
  lease.worker = worker_id;
  lease.pass = key;
  lease.range = range;
  lease.kind = work.kind;
  lease.lent_at = now;
  lease.expires_at = now + options_.lease_time;
  lease.number = next_lease_++;
  leases_[id] = std::move(lease);
  lease_deadlines_.emplace(now + options_.lease_time, id);
  Worker& worker = workers_.at(worker_id);
  Uncount(worker);
  worker.leases.insert(id);
  Count(worker_id, worker);
  EraseNewest(work, range);
  work.lent[range].insert(id);
  EnterNewest(work, range);
  return {id, key, range, work.kind};
}

const std::string* Scheduler::NewestOf(const Work& work, WorkRange range) const {
  const auto lent = work.lent.find(range);
  if (lent == work.lent.end() || lent->second.size() >= options_.max_holders ||
      work.audits.contains(range)) {
    return nullptr;
  }
  const std::string* newest = nullptr;
  std::uint64_t number = 0;
  for (const std::string& id : lent->second) {
    if (const std::uint64_t of_lease = leases_.at(id).number; of_lease > number) {
      number = of_lease;
      newest = &id;
    }
  }
  return newest;
}

void Scheduler::EnterNewest(const Work& work, WorkRange range) {
  const std::string* const id = NewestOf(work, range);
  if (id == nullptr) return;
  const Lease& lease = leases_.at(*id);
  newest_leases_[{lease.kind, range.size()}].emplace(lease.lent_at, lease.number, *id);
}

void Scheduler::EraseNewest(const Work& work, WorkRange range) {
  const std::string* const id = NewestOf(work, range);
  if (id == nullptr) return;
  const Lease& lease = leases_.at(*id);
  const auto found = newest_leases_.find({lease.kind, range.size()});
  found->second.erase({lease.lent_at, lease.number, *id});
  if (found->second.empty()) newest_leases_.erase(found);
}

void Scheduler::EraseLease(const std::string& lease_id, Ending ending) {
  const auto lease = leases_.find(lease_id);
  const auto found = workers_.find(lease->second.worker);
  LUCERNA_CHECK(found != workers_.end());
  Worker& worker = found->second;
  Uncount(worker);
  worker.leases.erase(lease_id);
  Count(found->first, worker);
  const Lease& ended = lease->second;
  worker.past.push_back(
      {{lease_id, ended.pass, ended.range, ended.kind}, ending, open_.at(ended.pass).opening});
  if (worker.past.size() > kMostPast) worker.past.pop_front();
  affected_.insert(found->first);
  if (traced_.contains(ended.pass.job_id) && ended_.size() < kMostLosses) {
    const WorkerRecord* const record = records_.Find(worker.record);
    ended_.push_back({.job_id = ended.pass.job_id,
                      .record = worker.record,
                      .name = record == nullptr ? "" : record->name,
                      .work = NameOf(ended.pass, ended.kind, ended.range),
                      .ending = EndingText(ended.has_result ? Ending::kDelivered : ending),
                      .lent_at = ended.lent_at});
  }
  leases_.erase(lease);
}

std::string Scheduler::NameOfLease(const std::string& lease_id) const {
  const Lease& lease = leases_.at(lease_id);
  return absl::StrCat(NameOf(lease.pass, lease.kind, lease.range), " of job ", lease.pass.job_id);
}

const char* Scheduler::EndingText(Ending ending) {
  switch (ending) {
    case Ending::kDelivered:
      return "delivered";
    case Ending::kOvertaken:
      return "overtaken";
    case Ending::kGivenBack:
      return "given back";
    case Ending::kFailed:
      return "failed";
    case Ending::kInterrupted:
      return "interrupted";
    case Ending::kStalled:
      return "stalled";
  }
  return "";
}

void Scheduler::SetTraced(const std::string& job_id, bool is_traced) {
  const MutexLock lock(mutex_);
  if (is_traced) {
    traced_.insert(job_id);
  } else {
    traced_.erase(job_id);
  }
}

std::vector<Scheduler::EndedLease> Scheduler::TakeEnded() {
  const MutexLock lock(mutex_);
  return std::exchange(ended_, {});
}

void Scheduler::TakeBack(const std::string& lease_id, Ending ending, std::string_view failure) {
  const Lease lease = leases_.at(lease_id);
  Work& work = open_.at(lease.pass);
  const std::string record = workers_.at(lease.worker).record;
  EraseNewest(work, lease.range);
  EraseLease(lease_id, ending);
  const auto lent = work.lent.find(lease.range);
  lent->second.erase(lease_id);
  const bool is_held = !lent->second.empty();
  if (is_held) {
    EnterNewest(work, lease.range);
  } else {
    work.lent.erase(lent);
    Return(lease.pass, work, lease.range);
  }
  switch (ending) {
    case Ending::kFailed:
      records_.Count(record, WorkerRecords::End::kFailed);
      CountFailure(lease.pass, lease.range, record, failure);
      break;
    case Ending::kStalled:
      records_.Count(record, WorkerRecords::End::kStalled);
      ++work.losses[lease.range].stalls;
      break;
    case Ending::kInterrupted: {
      Worker& worker = workers_.at(lease.worker);
      if (worker.interrupted.empty()) {
        missing_.emplace(records_.Find(record)->name, lease.worker);
      }
      if (worker.interrupted.size() < kMostPast) {
        worker.interrupted.emplace_back(lease.pass, lease.range);
      }
      break;
    }
    case Ending::kDelivered:
    case Ending::kOvertaken:
    case Ending::kGivenBack:
      break;
  }
  if (ending == Ending::kFailed || ending == Ending::kStalled) {
    QuarantineIfUnreliable(record, failure);
  }
}

void Scheduler::TakeBackAll(Worker& worker, Ending ending) {
  const std::vector<std::string> ids(worker.leases.begin(), worker.leases.end());
  for (const std::string& id : ids)
    TakeBack(id, ending);
}

// Poison
// ---------------------------------------------------------------------------------------------

void Scheduler::CountFailure(const PassKey& key, WorkRange range, const std::string& record,
                             std::string_view failure) {
  const auto open = open_.find(key);
  if (open == open_.end()) return;
  Work& work = open->second;
  // Of one that has its result by now nothing need be known.
  if (!work.lent.contains(range) && !work.returned.contains(range) &&
      !work.poisoned.contains(range) && !work.audits.contains(range) &&
      !work.losses.contains(range)) {
    return;
  }
  Losses& losses = work.losses[range];
  losses.workers.insert(record);
  ++losses.failures;
  const WorkerRecord* const worker = records_.Find(record);
  losses.last = absl::StrCat(worker == nullptr ? record : Escaped(worker->name), ": ",
                             Escaped(failure.substr(0, kMostReason)));
  losses.is_poisoned =
      losses.is_poisoned || losses.workers.size() >= options_.poison_workers ||
      (losses.failures >= options_.poison_failures && !HasOthersThan(losses.workers));
  PoisonIfDue(key, work, range);
}

void Scheduler::PoisonIfDue(const PassKey& key, Work& work, WorkRange range) {
  const auto losses = work.losses.find(range);
  // While somebody has it, it may still come.
  if (losses == work.losses.end() || !losses->second.is_poisoned ||
      !work.returned.contains(range)) {
    return;
  }
  work.returned.erase(range);
  if (work.kind == WorkKind::kPasses && range.size() > 1 && !work.audits.contains(range)) {
    // Long slices are lost where workers come and go, whatever is in them. Each half is poisoned by
    // one more failure, so that a bad pass is found and the others are not lost with it.
    Losses of_half = losses->second;
    of_half.is_poisoned = false;
    of_half.failures = std::min(of_half.failures, options_.poison_failures - 1);
    while (!of_half.workers.empty() && of_half.workers.size() >= options_.poison_workers)
      of_half.workers.erase(of_half.workers.begin());
    const std::uint64_t middle = range.first + range.size() / 2;
    work.losses.erase(range);
    for (const WorkRange& half : {WorkRange{range.first, middle}, WorkRange{middle, range.last}}) {
      work.losses[half] = of_half;
      work.returned.insert(half);
    }
    UpdateLendable(key, work);
    return;
  }
  work.poisoned.insert(range);
  UpdateLendable(key, work);
  poisoned_.push_back(
      {key, absl::StrCat(NameOf(key, work.kind, range), " failed ", losses->second.failures,
                         " times on ", losses->second.workers.size(), " workers, last on ",
                         losses->second.last)});
}

}  // namespace lucerna
