// Registrations of workers, what they report, and their standing: part of server/scheduler.h.
#include <algorithm>
#include <utility>

#include "render/base/escape.h"
#include "server/scheduler.h"

namespace lucerna {
namespace {

// A lease may become at most 2^10 times as old as at first.
constexpr int kMostDoublings = 10;

Status UnknownWorker(const std::string& worker) {
  return absl::NotFoundError(absl::StrCat("the coordinator does not know worker ",
                                          Escaped(worker.substr(0, 8)), "; register again"));
}

}  // namespace

// Reports and answers
// ---------------------------------------------------------------------------------------------

StatusOr<std::string> Scheduler::AddWorker(std::string_view name, SteadyTime now,
                                           std::string_view identity, std::string_view peer,
                                           int threads) {
  const MutexLock lock(mutex_);
  std::string id = options_.new_id();
  const std::string record = WorkerIdOf(identity.empty() ? RandomId() : std::string(identity));
  const auto earlier = registrations_.find(record);
  const bool takes_place =
      earlier != registrations_.end() && workers_.at(earlier->second).peer == peer;
  const auto of_peer = peers_.find(std::string(peer));
  if (!takes_place && of_peer != peers_.end() && of_peer->second >= options_.max_registrations) {
    return absl::ResourceExhaustedError(absl::StrCat(
        "you have ", of_peer->second, " workers here already; those that have gone are forgotten ",
        Seconds(options_.worker_silence), " s after they were last heard of"));
  }
  if (earlier != registrations_.end()) {
    const auto found = workers_.find(earlier->second);
    TakeBackAll(found->second, Ending::kInterrupted);
    ResolveInterrupted(found->second, /*has_crashed=*/false);
    Forget(found, now);
  }
  records_.Join(record, name, now);
  // A new process in the place of one that was not heard of: that one has crashed.
  const auto [first, last] = missing_.equal_range(std::string(name));
  std::vector<std::string> replaced;
  for (auto missing = first; missing != last; ++missing)
    replaced.push_back(missing->second);
  for (const std::string& missing : replaced)
    ResolveInterrupted(workers_.at(missing), /*has_crashed=*/true);
  Worker& worker = workers_[id];
  worker.record = record;
  worker.peer = peer;
  worker.threads = std::max(1, threads);
  ++peers_[worker.peer];
  worker.heard_at = now;
  worker.may_be_lent = records_.Find(record)->may_be_lent();
  Count(id, worker);
  registrations_[record] = id;
  worker_deadlines_.emplace(now + options_.worker_silence, id);
  return id;
}

void Scheduler::Forget(std::map<std::string, Worker>::iterator worker, SteadyTime now) {
  Uncount(worker->second);
  registrations_.erase(worker->second.record);
  const auto of_peer = peers_.find(worker->second.peer);
  if (--of_peer->second == 0) peers_.erase(of_peer);
  records_.Leave(worker->second.record, now);
  affected_.insert(worker->first);
  workers_.erase(worker);
}

Status Scheduler::TakeReport(const std::string& worker_id, const Report& report, SteadyTime now) {
  const MutexLock lock(mutex_);
  const auto found = workers_.find(worker_id);
  if (found == workers_.end()) return UnknownWorker(worker_id);
  Worker& worker = found->second;
  worker.heard_at = now;
  SetConnected(worker_id, worker, true);
  ResolveInterrupted(worker, /*has_crashed=*/false);
  for (const auto& [lease_id, reason] : report.failures) {
    if (!worker.leases.contains(lease_id)) continue;
    NoteLoss(
        worker.record,
        absl::StrCat("failed at ", NameOfLease(lease_id), ": ",
                     reason.empty() ? "no reason given"
                                    : Escaped(std::string_view(reason).substr(0, kMostReason))));
    TakeBack(lease_id, Ending::kFailed, reason.empty() ? "failed" : reason);
  }
  const std::set<std::string> held(report.held.begin(), report.held.end());
  const std::vector<std::string> leases(worker.leases.begin(), worker.leases.end());
  for (const std::string& lease_id : leases) {
    if (held.contains(lease_id)) {
      Lease& lease = leases_.at(lease_id);
      const SteadyTime last = lease.lent_at + LongestAge(lease);
      lease.is_too_old = last <= now + options_.lease_time;
      lease.expires_at = std::max(lease.expires_at, std::min(now + options_.lease_time, last));
    } else if (report.wants_lease) {
      // Not a failure: the worker dropped it on purpose, or never got the answer that lent it.
      TakeBack(lease_id, Ending::kGivenBack);
    }
  }
  return absl::OkStatus();
}

Duration Scheduler::LongestAge(const Lease& lease) const {
  Duration age = options_.renew_unknown;
  if (const std::optional<double> usual = UsualTime(lease.kind)) {
    const double usual_s = std::min(*usual * static_cast<double>(lease.range.size()), 1e5);
    age = std::max(options_.renew_at_least,
                   std::chrono::duration_cast<Duration>(
                       std::chrono::duration<double>(options_.renew_until * usual_s)));
  }
  const Work& work = open_.at(lease.pass);
  const auto losses = work.losses.find(lease.range);
  const int stalls = losses == work.losses.end() ? 0 : losses->second.stalls;
  return age * (1 << std::min(stalls, kMostDoublings));
}

StatusOr<Scheduler::Answer> Scheduler::AnswerFor(const std::string& worker_id, const Report& report,
                                                 SteadyTime now) {
  const MutexLock lock(mutex_);
  const auto found = workers_.find(worker_id);
  if (found == workers_.end()) return UnknownWorker(worker_id);
  Worker& worker = found->second;
  Answer answer;
  for (const std::string& lease_id : report.held) {
    if (!worker.leases.contains(lease_id)) answer.revoked.push_back(lease_id);
  }
  if (report.wants_lease && worker.may_be_lent) {
    answer.lease = Lend(worker_id, now);
    if (!answer.lease) answer.lease = LendTwice(worker_id, now);
    if (answer.lease) {
      SetPlace(worker_id, worker, 0);
    } else if (worker.place == 0) {
      SetPlace(worker_id, worker, next_place_++);
    }
  }
  return answer;
}

void Scheduler::WaitAgain(const std::string& worker_id) {
  const MutexLock lock(mutex_);
  const auto found = workers_.find(worker_id);
  if (found == workers_.end() || found->second.place != 0 || !found->second.may_be_lent) return;
  SetPlace(worker_id, found->second, next_place_++);
}

std::optional<std::string> Scheduler::TakeWaiting(SteadyTime now) {
  const MutexLock lock(mutex_);
  const auto idle = idle_queue_.begin();
  const auto busy = busy_queue_.begin();
  const bool may_be_idle = idle != idle_queue_.end() && (shares_.Next() || FindStraggler(now));
  const bool may_be_busy = busy != busy_queue_.end() &&
                           !(may_be_idle && idle->first < busy->first) && HasBatchesToSpare(now);
  if (!may_be_idle && !may_be_busy) {
    if (waiting_audits_.empty()) return std::nullopt;
    int looked_at = 0;
    for (const auto& [place, waiting] : idle_queue_) {
      if (++looked_at > kMostLookedAt) break;
      if (!FindAudit(waiting, now)) continue;
      std::string id = waiting;
      SetPlace(id, workers_.at(id), 0);
      return id;
    }
    return std::nullopt;
  }
  std::string id = may_be_busy ? busy->second : idle->second;
  SetPlace(id, workers_.at(id), 0);
  return id;
}

std::vector<std::string> Scheduler::TakeAffected() {
  const MutexLock lock(mutex_);
  std::vector<std::string> affected(affected_.begin(), affected_.end());
  affected_.clear();
  return affected;
}

void Scheduler::LoseWorker(const std::string& worker_id) {
  const MutexLock lock(mutex_);
  const auto found = workers_.find(worker_id);
  if (found == workers_.end()) return;
  NoteLoss(found->second.record,
           absl::StrCat("vanished: its connection broke; leases that it held and that go back: ",
                        found->second.leases.size()));
  SetConnected(worker_id, found->second, false);
  TakeBackAll(found->second, Ending::kInterrupted);
}

void Scheduler::NoteLoss(const std::string& record, std::string reason) {
  if (losses_.size() >= kMostLosses) return;
  const WorkerRecord* const worker = records_.Find(record);
  losses_.push_back({record, worker == nullptr ? "" : worker->name, std::move(reason)});
}

std::vector<Scheduler::Loss> Scheduler::TakeLosses() {
  const MutexLock lock(mutex_);
  return std::exchange(losses_, {});
}

void Scheduler::RemoveWorker(const std::string& worker_id) {
  const MutexLock lock(mutex_);
  const auto found = workers_.find(worker_id);
  if (found == workers_.end()) return;
  TakeBackAll(found->second, Ending::kGivenBack);
  ResolveInterrupted(found->second, /*has_crashed=*/false);
  Forget(found, found->second.heard_at);
}

void Scheduler::ResolveInterrupted(Worker& worker, bool has_crashed) {
  if (worker.interrupted.empty()) return;
  const WorkerRecord* const record = records_.Find(worker.record);
  const auto [first, last] = missing_.equal_range(record->name);
  for (auto missing = first; missing != last; ++missing) {
    if (missing->second != registrations_.at(worker.record)) continue;
    missing_.erase(missing);
    break;
  }
  for (const auto& [key, range] : std::exchange(worker.interrupted, {})) {
    records_.Count(worker.record,
                   has_crashed ? WorkerRecords::End::kCrashed : WorkerRecords::End::kLost);
    if (has_crashed) CountFailure(key, range, worker.record, "it crashed or was cut off");
  }
}

// Workers
// ---------------------------------------------------------------------------------------------

Scheduler::Load Scheduler::LoadAt(SteadyTime now) const {
  const MutexLock lock(mutex_);
  Load load;
  load.live_workers = live_workers_;
  load.idle_workers = idle_workers_;
  load.leases = leases_.size();
  for (const auto& [id, lease] : leases_)
    load.oldest_lease = std::max(load.oldest_lease, now - lease.lent_at);
  load.lent = next_lease_ - 1;
  load.lent_again = load.lent - lent_anew_;
  return load;
}

std::optional<WorkerRecord> Scheduler::RecordOf(const std::string& worker) const {
  const MutexLock lock(mutex_);
  const auto found = workers_.find(worker);
  if (found == workers_.end()) return std::nullopt;
  return *records_.Find(found->second.record);
}

std::vector<WorkerRecord> Scheduler::Workers() const {
  const MutexLock lock(mutex_);
  std::vector<WorkerRecord> all = records_.All();
  for (WorkerRecord& record : all) {
    const auto registration = registrations_.find(record.id);
    if (registration == registrations_.end()) continue;
    const Worker& worker = workers_.at(registration->second);
    record.is_connected = worker.is_connected;
    record.heard_at = worker.heard_at;
    record.held = worker.leases.size();
  }
  return all;
}

void Scheduler::UpdateStanding(const std::string& record) {
  const auto registration = registrations_.find(record);
  if (registration == registrations_.end()) return;
  Worker& worker = workers_.at(registration->second);
  Uncount(worker);
  worker.may_be_lent = records_.Find(record)->may_be_lent();
  if (!worker.may_be_lent) worker.place = 0;
  Count(registration->second, worker);
  // Its call may wait for what it cannot get any more, or can get again.
  affected_.insert(registration->second);
}

bool Scheduler::QuarantineLocked(const std::string& id, std::string_view reason, bool has_lied) {
  if (!records_.Quarantine(id, reason, has_lied)) return false;
  UpdateStanding(id);
  if (const auto registration = registrations_.find(id); registration != registrations_.end()) {
    Worker& worker = workers_.at(registration->second);
    TakeBackAll(worker, Ending::kGivenBack);
    // Its late results are refused too.
    for (PastLease& past : worker.past) {
      if (past.ending == Ending::kInterrupted || past.ending == Ending::kStalled) {
        past.ending = Ending::kGivenBack;
      }
    }
  }
  // What it returned for audits that are not decided says nothing.
  for (auto& [key, work] : open_) {
    std::vector<WorkRange> without_result;
    for (auto& [range, audit] : work.audits) {
      audit.Remove(id);
      if (audit.results().empty()) without_result.push_back(range);
    }
    for (const WorkRange& range : without_result) {
      work.audits.erase(range);
      const bool was_waiting = waiting_audits_.erase({key, range}) > 0;
      if (was_waiting) Return(key, work, range);
      EnterNewest(work, range);
    }
  }
  return true;
}

bool Scheduler::Quarantine(const std::string& id, std::string_view reason) {
  const MutexLock lock(mutex_);
  return QuarantineLocked(id, reason, /*has_lied=*/false);
}

bool Scheduler::Drain(const std::string& id) {
  const MutexLock lock(mutex_);
  if (!records_.Drain(id)) return false;
  UpdateStanding(id);
  return true;
}

bool Scheduler::Release(const std::string& id) {
  const MutexLock lock(mutex_);
  if (!records_.Release(id)) return false;
  UpdateStanding(id);
  return true;
}

std::vector<WorkerStanding> Scheduler::TakeChangedStandings() {
  const MutexLock lock(mutex_);
  return records_.TakeChanged();
}

void Scheduler::NoteChangedStanding(const std::string& id) {
  const MutexLock lock(mutex_);
  records_.NoteChanged(id);
}

void Scheduler::RestoreStanding(const WorkerStanding& standing, SteadyTime now) {
  const MutexLock lock(mutex_);
  records_.Restore(standing, now);
}

template <typename Records>
bool Scheduler::HasOthersThan(const Records& records) const {
  std::uint64_t among = 0;
  for (const std::string& record : records) {
    const auto registration = registrations_.find(record);
    if (registration != registrations_.end() && workers_.at(registration->second).is_live()) {
      ++among;
    }
  }
  return live_workers_ > among;
}

// A bad worker among others is left out; the last one goes on, and its batches are poisoned if it
// cannot do them.
void Scheduler::QuarantineIfUnreliable(const std::string& record, std::string_view failure) {
  const WorkerRecord* const known = records_.Find(record);
  if (known == nullptr || known->state == WorkerState::kQuarantined ||
      !records_.IsUnreliable(record) || !HasOthersThan(std::array{record})) {
    return;
  }
  const std::string reason = absl::StrCat(
      kBadOfRecent, " of its last ", kRecentLeases,
      " leases failed or stalled, the last one: ", std::string(failure.substr(0, kMostReason)));
  records_.Quarantine(record, reason);
  NoteLoss(record, absl::StrCat("is put in quarantine: ", Escaped(reason)));
  UpdateStanding(record);
}

}  // namespace lucerna
