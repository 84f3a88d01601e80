#include "server/scheduler.h"

#include <algorithm>
#include <bit>
#include <utility>

namespace lucerna {
namespace {

constexpr std::size_t kTimesKept = 31;
// With fewer commits than this the usual time of one is unknown.
constexpr std::size_t kTimesNeeded = 3;
// A slice shall take no more of the time that a job has left.
constexpr double kShareOfTimeLeft = 0.25;

Status UnknownWorker(const std::string& worker) {
  return absl::NotFoundError(
      absl::StrCat("the coordinator does not know worker ", worker, "; register again"));
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
  if (worker.is_connected) {
    --live_workers_;
    if (worker.leases.empty()) --idle_workers_;
  }
  if (worker.place > 0) (worker.leases.empty() ? idle_queue_ : busy_queue_).erase(worker.place);
}

void Scheduler::Count(const std::string& id, const Worker& worker) {
  if (worker.is_connected) {
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

// Reports and answers
// ---------------------------------------------------------------------------------------------

std::string Scheduler::AddWorker(std::string_view name, SteadyTime now) {
  const MutexLock lock(mutex_);
  std::string id = absl::StrCat(options_.instance, "-", next_worker_++);
  Worker& worker = workers_[id];
  worker.name = name;
  worker.heard_at = now;
  Count(id, worker);
  worker_deadlines_.emplace(now + options_.worker_silence, id);
  return id;
}

Status Scheduler::TakeReport(const std::string& worker_id, const Report& report, SteadyTime now) {
  const MutexLock lock(mutex_);
  const auto found = workers_.find(worker_id);
  if (found == workers_.end()) return UnknownWorker(worker_id);
  Worker& worker = found->second;
  worker.heard_at = now;
  SetConnected(worker_id, worker, true);
  for (const auto& [lease_id, reason] : report.failures) {
    if (worker.leases.contains(lease_id)) TakeBack(lease_id, reason.empty() ? "failed" : reason);
  }
  const std::set<std::string> held(report.held.begin(), report.held.end());
  const std::vector<std::string> leases(worker.leases.begin(), worker.leases.end());
  for (const std::string& lease_id : leases) {
    if (held.contains(lease_id)) {
      leases_.at(lease_id).expires_at = now + options_.lease_time;
    } else if (report.wants_lease) {
      // Not a failure: the worker dropped it on purpose, or never got the answer that lent it.
      TakeBack(lease_id, "");
    }
  }
  return absl::OkStatus();
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
  if (report.wants_lease) {
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
  if (found == workers_.end() || found->second.place != 0) return;
  SetPlace(worker_id, found->second, next_place_++);
}

std::optional<std::string> Scheduler::TakeWaiting(SteadyTime now) {
  const MutexLock lock(mutex_);
  const auto idle = idle_queue_.begin();
  const auto busy = busy_queue_.begin();
  const bool may_be_idle = idle != idle_queue_.end() && (shares_.Next() || FindStraggler(now));
  const bool may_be_busy = busy != busy_queue_.end() &&
                           !(may_be_idle && idle->first < busy->first) && HasBatchesToSpare(now);
  if (!may_be_idle && !may_be_busy) return std::nullopt;
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
  SetConnected(worker_id, found->second, false);
  TakeBackAll(found->second, "its connection broke");
}

void Scheduler::RemoveWorker(const std::string& worker_id) {
  const MutexLock lock(mutex_);
  const auto found = workers_.find(worker_id);
  if (found == workers_.end()) return;
  TakeBackAll(found->second, "");
  Uncount(found->second);
  workers_.erase(found);
  affected_.insert(worker_id);
}

// Work
// ---------------------------------------------------------------------------------------------

void Scheduler::AddWork(const PassKey& key, Work work) {
  if (work.kind == WorkKind::kPasses) round_passes_ += work.total;
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
  for (const auto& [range, lease_ids] : found->second.lent) {
    const std::vector<std::string> ids(lease_ids.begin(), lease_ids.end());
    for (const std::string& id : ids)
      EraseLease(id);
  }
  if (found->second.kind == WorkKind::kPasses) round_passes_ -= found->second.total;
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
  if (is_held) return;
  for (auto work = open_.lower_bound({job_id, 0});
       work != open_.end() && work->first.job_id == job_id; ++work)
    work->second.losses.clear();
}

void Scheduler::CountWork(const std::string& job_id, WorkKind kind, std::uint64_t size,
                          Duration worker_cpu) {
  const MutexLock lock(mutex_);
  shares_.CountWork(job_id, kind, size, worker_cpu);
}

void Scheduler::ForgetJob(const std::string& job_id) {
  const MutexLock lock(mutex_);
  const auto work = open_.lower_bound({job_id, 0});
  if (work == open_.end() || work->first.job_id != job_id) shares_.Forget(job_id);
}

bool Scheduler::Expects(const PassKey& key, WorkKind kind, WorkRange range) const {
  const MutexLock lock(mutex_);
  const auto found = open_.find(key);
  if (found == open_.end() || found->second.kind != kind) return false;
  return found->second.lent.contains(range) || found->second.returned.contains(range);
}

void Scheduler::Commit(const PassKey& key, WorkRange range, SteadyTime now) {
  const MutexLock lock(mutex_);
  const auto found = open_.find(key);
  if (found == open_.end()) return;
  Work& work = found->second;
  work.returned.erase(range);
  UpdateLendable(key, work);
  work.losses.erase(range);
  const auto lent = work.lent.find(range);
  if (lent == work.lent.end()) return;
  Duration lease_time = Duration::max();
  for (const std::string& id : lent->second) {
    // The shortest: a lease that had to be doubled says nothing of how long a batch takes.
    lease_time = std::min(lease_time, now - leases_.at(id).lent_at);
    EraseLease(id);
  }
  work.lent.erase(lent);
  const auto kind = static_cast<std::size_t>(work.kind);
  times_[kind].push_back(Seconds(lease_time) / static_cast<double>(range.size()));
  if (times_[kind].size() > kTimesKept) times_[kind].pop_front();
  usual_times_[kind] = MedianOf(times_[kind]);
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
    } else {
      TakeBack(id, "it stopped answering");
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
    TakeBackAll(worker->second, "it stopped answering");
    Uncount(worker->second);
    workers_.erase(worker);
    affected_.insert(id);
  }
}

std::vector<Scheduler::Poisoned> Scheduler::TakePoisoned() {
  const MutexLock lock(mutex_);
  return std::exchange(poisoned_, {});
}

int Scheduler::LiveWorkers() const {
  const MutexLock lock(mutex_);
  return static_cast<int>(live_workers_);
}

std::string Scheduler::NameOf(const std::string& worker) const {
  const MutexLock lock(mutex_);
  const auto found = workers_.find(worker);
  return found == workers_.end() ? std::string() : found->second.name;
}

// Leases
// ---------------------------------------------------------------------------------------------

std::uint64_t Scheduler::BatchSize(const Work& work, SteadyTime now) const {
  if (work.kind == WorkKind::kPasses) return SliceSize(work, now);
  if (options_.fixed_batch > 0) return std::min(options_.fixed_batch, work.rest.size());
  const std::uint64_t share = CeilDivide(work.total, std::max<std::uint64_t>(live_workers_, 1));
  return std::min(std::clamp(share, options_.min_batch, options_.max_batch), work.rest.size());
}

// Long slices cost the coordinator and the network least; but every worker shall have one and find
// a second one waiting, and what is not done when time is up is lost.
std::uint64_t Scheduler::SliceSize(const Work& work, SteadyTime now) const {
  std::uint64_t size = std::min(
      {round_passes_ / (options_.slices_per_worker * std::max<std::uint64_t>(live_workers_, 1)),
       options_.max_slice, work.rest.size()});
  if (work.due) {
    const std::optional<double> time = UsualTime(WorkKind::kPasses);
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
    if (work.rest.size() > 0) batches += CeilDivide(work.rest.size(), BatchSize(work, now));
    if (batches > idle_workers_) return true;
  }
  return false;
}

std::optional<BatchLease> Scheduler::Lend(const std::string& worker_id, SteadyTime now) {
  const std::optional<std::string> job_id = shares_.Next();
  if (!job_id) return std::nullopt;
  // A worker that is busy fetches ahead only what the idle ones leave over; else one worker would
  // take a whole last pass and the others would stand by.
  if (!workers_.at(worker_id).leases.empty() && !HasBatchesToSpare(now)) return std::nullopt;
  const PassKey key = *lendable_.lower_bound({*job_id, 0});
  Work& work = open_.at(key);
  WorkRange range;
  if (!work.returned.empty()) {
    // One that this worker has not failed at, if there is one.
    const std::map<WorkRange, Losses>& losses = work.losses;
    const auto is_new_to_worker = [&](const WorkRange& returned) {
      const auto found = losses.find(returned);
      return found == losses.end() || !found->second.workers.contains(worker_id);
    };
    auto choice = std::find_if(work.returned.begin(), work.returned.end(), is_new_to_worker);
    if (choice == work.returned.end()) choice = work.returned.begin();
    range = *choice;
    work.returned.erase(choice);
  } else {
    range = {work.rest.first, work.rest.first + BatchSize(work, now)};
    work.rest.first = range.last;
  }
  UpdateLendable(key, work);
  return Enter(worker_id, key, range, now);
}

std::optional<Scheduler::Straggler> Scheduler::FindStraggler(SteadyTime now) const {
  std::optional<Straggler> first;
  for (const auto& [kind_and_size, leases] : sole_leases_) {
    const auto& [kind, size] = kind_and_size;
    const std::optional<double> usual = UsualTime(kind);
    if (!usual) continue;
    const double patience = std::max(*usual * static_cast<double>(size) * options_.speculate_after,
                                     Seconds(options_.speculate_at_least));
    auto oldest = leases.begin();
    while (oldest != leases.end() && shares_.IsHeld(leases_.at(oldest->second).pass.job_id))
      ++oldest;
    if (oldest == leases.end() || Seconds(now - oldest->first) < patience) continue;
    const Lease& lease = leases_.at(oldest->second);
    if (const Straggler found = {lease.pass, lease.range}; !first || found < *first) first = found;
  }
  return first;
}

std::optional<BatchLease> Scheduler::LendTwice(const std::string& worker_id, SteadyTime now) {
  // Only an idle worker, and only a batch that has one holder.
  if (!workers_.at(worker_id).leases.empty()) return std::nullopt;
  const std::optional<Straggler> straggler = FindStraggler(now);
  if (!straggler) return std::nullopt;
  return Enter(worker_id, straggler->pass, straggler->range, now);
}

BatchLease Scheduler::Enter(const std::string& worker_id, const PassKey& key, WorkRange range,
                            SteadyTime now) {
  const std::string id = absl::StrCat(worker_id, "/", next_lease_++);
  Work& work = open_.at(key);
  shares_.CountLent(key.job_id, work.kind, range.size());
  leases_[id] = {worker_id, key, range, work.kind, now, now + options_.lease_time};
  lease_deadlines_.emplace(now + options_.lease_time, id);
  Worker& worker = workers_.at(worker_id);
  Uncount(worker);
  worker.leases.insert(id);
  Count(worker_id, worker);
  std::set<std::string>& holders = work.lent[range];
  if (holders.empty()) {
    AddSole(id);
  } else {
    for (const std::string& other : holders)
      EraseSole(other, leases_.at(other));
  }
  holders.insert(id);
  return {id, key, range, work.kind};
}

void Scheduler::AddSole(const std::string& lease_id) {
  const Lease& lease = leases_.at(lease_id);
  sole_leases_[{lease.kind, lease.range.size()}].emplace(lease.lent_at, lease_id);
}

void Scheduler::EraseSole(const std::string& lease_id, const Lease& lease) {
  const auto found = sole_leases_.find({lease.kind, lease.range.size()});
  if (found == sole_leases_.end()) return;
  found->second.erase({lease.lent_at, lease_id});
  if (found->second.empty()) sole_leases_.erase(found);
}

void Scheduler::EraseLease(const std::string& lease_id) {
  const auto lease = leases_.find(lease_id);
  EraseSole(lease_id, lease->second);
  const auto found = workers_.find(lease->second.worker);
  if (found != workers_.end()) {
    Uncount(found->second);
    found->second.leases.erase(lease_id);
    Count(found->first, found->second);
    affected_.insert(found->first);
  }
  leases_.erase(lease);
}

void Scheduler::TakeBack(const std::string& lease_id, std::string_view failure) {
  const Lease lease = leases_.at(lease_id);
  const std::string worker_name = workers_.at(lease.worker).name;
  EraseLease(lease_id);
  Work& work = open_.at(lease.pass);
  const auto lent = work.lent.find(lease.range);
  lent->second.erase(lease_id);
  if (lent->second.empty()) {
    work.lent.erase(lent);
    work.returned.insert(lease.range);
    UpdateLendable(lease.pass, work);
  } else if (lent->second.size() == 1) {
    AddSole(*lent->second.begin());
  }
  if (failure.empty()) return;
  Losses& losses = work.losses[lease.range];
  losses.workers.insert(lease.worker);
  ++losses.leases;
  if (losses.workers.size() < options_.poison_workers && losses.leases < options_.poison_losses) {
    return;
  }
  const std::string range = absl::StrCat(lease.range.first, " to ", lease.range.last);
  poisoned_.push_back(
      {lease.pass,
       absl::StrCat(work.kind == WorkKind::kPasses
                        ? absl::StrCat("passes ", range)
                        : absl::StrCat("photons ", range, " of pass ", lease.pass.pass),
                    " were given up ", losses.leases, " times by ", losses.workers.size(),
                    " workers, last by ", worker_name, ": ", std::string(failure))});
}

void Scheduler::TakeBackAll(Worker& worker, std::string_view failure) {
  const std::vector<std::string> ids(worker.leases.begin(), worker.leases.end());
  for (const std::string& id : ids)
    TakeBack(id, failure);
}

}  // namespace lucerna
