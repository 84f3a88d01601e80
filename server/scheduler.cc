#include "server/scheduler.h"

#include <algorithm>
#include <utility>

namespace lucerna {
namespace {

constexpr std::size_t kBatchTimesKept = 31;
// With fewer batches than this the usual time of one is unknown.
constexpr std::size_t kBatchTimesNeeded = 3;

Status UnknownWorker(const std::string& worker) {
  return absl::NotFoundError(
      absl::StrCat("the coordinator does not know worker ", worker, "; register again"));
}

std::uint64_t CeilDivide(std::uint64_t a, std::uint64_t b) {
  return a / b + (a % b != 0 ? 1 : 0);
}

}  // namespace

std::string Scheduler::AddWorker(std::string_view name, SteadyTime now) {
  const MutexLock lock(mutex_);
  std::string id = absl::StrCat(options_.instance, "-", next_worker_++);
  Worker& worker = workers_[id];
  worker.name = name;
  worker.heard_at = now;
  return id;
}

Status Scheduler::Hear(const std::string& worker_id, const Report& report, SteadyTime now) {
  const MutexLock lock(mutex_);
  const auto found = workers_.find(worker_id);
  if (found == workers_.end()) return UnknownWorker(worker_id);
  Worker& worker = found->second;
  worker.heard_at = now;
  worker.is_connected = true;
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

StatusOr<Scheduler::Answer> Scheduler::Tell(const std::string& worker_id, const Report& report,
                                            SteadyTime now) {
  const MutexLock lock(mutex_);
  const auto found = workers_.find(worker_id);
  if (found == workers_.end()) return UnknownWorker(worker_id);
  Answer answer;
  for (const std::string& lease_id : report.held) {
    if (!found->second.leases.contains(lease_id)) answer.revoked.push_back(lease_id);
  }
  if (report.wants_lease) {
    answer.lease = Lend(worker_id, now);
    if (!answer.lease) answer.lease = LendTwice(worker_id, now);
  }
  return answer;
}

void Scheduler::LoseWorker(const std::string& worker_id) {
  const MutexLock lock(mutex_);
  const auto found = workers_.find(worker_id);
  if (found == workers_.end()) return;
  found->second.is_connected = false;
  TakeBackAll(found->second, "its connection broke");
}

void Scheduler::RemoveWorker(const std::string& worker_id) {
  const MutexLock lock(mutex_);
  const auto found = workers_.find(worker_id);
  if (found == workers_.end()) return;
  TakeBackAll(found->second, "");
  workers_.erase(found);
}

void Scheduler::OpenPass(const PassKey& key, std::uint64_t photons) {
  const MutexLock lock(mutex_);
  Pass pass;
  pass.photons = photons;
  LUCERNA_CHECK(passes_.emplace(key, std::move(pass)).second);
}

void Scheduler::ClosePass(const PassKey& key) {
  const MutexLock lock(mutex_);
  const auto found = passes_.find(key);
  if (found == passes_.end()) return;
  for (const auto& [range, lease_ids] : found->second.lent) {
    const std::vector<std::string> ids(lease_ids.begin(), lease_ids.end());
    for (const std::string& id : ids)
      EraseLease(id);
  }
  passes_.erase(found);
}

void Scheduler::Commit(const PassKey& key, PhotonRange range, SteadyTime now) {
  const MutexLock lock(mutex_);
  const auto found = passes_.find(key);
  if (found == passes_.end()) return;
  Pass& pass = found->second;
  pass.returned.erase(range);
  pass.losses.erase(range);
  const auto lent = pass.lent.find(range);
  if (lent == pass.lent.end()) return;
  Duration batch_time = Duration::max();
  for (const std::string& id : lent->second) {
    // The shortest: a lease that had to be doubled says nothing of how long a batch takes.
    batch_time = std::min(batch_time, now - leases_.at(id).lent_at);
    EraseLease(id);
  }
  pass.lent.erase(lent);
  batch_times_.push_back(batch_time);
  if (batch_times_.size() > kBatchTimesKept) batch_times_.pop_front();
}

void Scheduler::Expire(SteadyTime now) {
  const MutexLock lock(mutex_);
  std::vector<std::string> expired;
  for (const auto& [id, lease] : leases_) {
    if (lease.expires_at <= now) expired.push_back(id);
  }
  for (const std::string& id : expired)
    TakeBack(id, "it stopped answering");
  for (auto worker = workers_.begin(); worker != workers_.end();) {
    if (worker->second.heard_at + options_.worker_silence > now) {
      ++worker;
      continue;
    }
    TakeBackAll(worker->second, "it stopped answering");
    worker = workers_.erase(worker);
  }
}

std::vector<Scheduler::Poisoned> Scheduler::TakePoisoned() {
  const MutexLock lock(mutex_);
  return std::exchange(poisoned_, {});
}

int Scheduler::LiveWorkers() const {
  const MutexLock lock(mutex_);
  return static_cast<int>(std::count_if(workers_.begin(), workers_.end(), [](const auto& entry) {
    return entry.second.is_connected;
  }));
}

std::string Scheduler::NameOf(const std::string& worker) const {
  const MutexLock lock(mutex_);
  const auto found = workers_.find(worker);
  return found == workers_.end() ? std::string() : found->second.name;
}

std::uint64_t Scheduler::BatchSize(const Pass& pass) const {
  if (options_.fixed_batch > 0) return options_.fixed_batch;
  std::uint64_t live = 0;
  for (const auto& [id, worker] : workers_)
    live += worker.is_connected ? 1 : 0;
  const std::uint64_t share = CeilDivide(pass.photons, std::max<std::uint64_t>(live, 1));
  return std::clamp(share, options_.min_batch, options_.max_batch);
}

std::uint64_t Scheduler::PendingBatches() const {
  std::uint64_t pending = 0;
  for (const auto& [key, pass] : passes_) {
    pending += pass.returned.size() + CeilDivide(pass.photons - pass.next_photon, BatchSize(pass));
  }
  return pending;
}

std::optional<BatchLease> Scheduler::Lend(const std::string& worker_id, SteadyTime now) {
  // A worker that is busy fetches ahead only what the idle ones leave over; else one worker would
  // take a whole last pass and the others would stand by.
  if (!workers_.at(worker_id).leases.empty()) {
    std::uint64_t idle = 0;
    for (const auto& [id, worker] : workers_) {
      idle += worker.is_connected && worker.leases.empty() ? 1 : 0;
    }
    if (PendingBatches() <= idle) return std::nullopt;
  }
  for (auto& [key, pass] : passes_) {
    if (!pass.returned.empty()) {
      // One that this worker has not failed at, if there is one.
      const std::map<PhotonRange, Losses>& losses = pass.losses;
      const auto is_new_to_worker = [&](const PhotonRange& range) {
        const auto found = losses.find(range);
        return found == losses.end() || !found->second.workers.contains(worker_id);
      };
      auto choice = std::find_if(pass.returned.begin(), pass.returned.end(), is_new_to_worker);
      if (choice == pass.returned.end()) choice = pass.returned.begin();
      const PhotonRange range = *choice;
      pass.returned.erase(choice);
      return Enter(worker_id, key, range, now);
    }
    if (pass.next_photon < pass.photons) {
      const std::uint64_t size = std::min(BatchSize(pass), pass.photons - pass.next_photon);
      const PhotonRange range = {pass.next_photon, pass.next_photon + size};
      pass.next_photon = range.last;
      return Enter(worker_id, key, range, now);
    }
  }
  return std::nullopt;
}

std::optional<BatchLease> Scheduler::LendTwice(const std::string& worker_id, SteadyTime now) {
  // Only an idle worker, and only a batch that has one holder.
  if (!workers_.at(worker_id).leases.empty()) return std::nullopt;
  const std::optional<Duration> median = MedianBatchTime();
  if (!median) return std::nullopt;
  const Duration patience =
      std::max(*median * options_.speculate_after, options_.speculate_at_least);
  for (const auto& [key, pass] : passes_) {
    for (const auto& [range, lease_ids] : pass.lent) {
      if (lease_ids.size() != 1) continue;
      if (now - leases_.at(*lease_ids.begin()).lent_at < patience) continue;
      return Enter(worker_id, key, range, now);
    }
  }
  return std::nullopt;
}

BatchLease Scheduler::Enter(const std::string& worker_id, const PassKey& key, PhotonRange range,
                            SteadyTime now) {
  const std::string id = absl::StrCat(worker_id, "/", next_lease_++);
  leases_[id] = {worker_id, key, range, now, now + options_.lease_time};
  workers_.at(worker_id).leases.insert(id);
  passes_.at(key).lent[range].insert(id);
  return {id, key, range};
}

void Scheduler::EraseLease(const std::string& lease_id) {
  const auto lease = leases_.find(lease_id);
  const auto worker = workers_.find(lease->second.worker);
  if (worker != workers_.end()) worker->second.leases.erase(lease_id);
  leases_.erase(lease);
}

void Scheduler::TakeBack(const std::string& lease_id, std::string_view failure) {
  const Lease lease = leases_.at(lease_id);
  const std::string worker_name = workers_.at(lease.worker).name;
  EraseLease(lease_id);
  Pass& pass = passes_.at(lease.pass);
  const auto lent = pass.lent.find(lease.range);
  lent->second.erase(lease_id);
  if (lent->second.empty()) {
    pass.lent.erase(lent);
    pass.returned.insert(lease.range);
  }
  if (failure.empty()) return;
  Losses& losses = pass.losses[lease.range];
  losses.workers.insert(lease.worker);
  ++losses.leases;
  if (losses.workers.size() < options_.poison_workers && losses.leases < options_.poison_losses) {
    return;
  }
  poisoned_.push_back(
      {lease.pass, absl::StrCat("photons ", lease.range.first, " to ", lease.range.last,
                                " of pass ", lease.pass.pass, " were given up ", losses.leases,
                                " times by ", losses.workers.size(), " workers, last by ",
                                worker_name, ": ", std::string(failure))});
}

void Scheduler::TakeBackAll(Worker& worker, std::string_view failure) {
  const std::vector<std::string> ids(worker.leases.begin(), worker.leases.end());
  for (const std::string& id : ids)
    TakeBack(id, failure);
}

std::optional<Duration> Scheduler::MedianBatchTime() const {
  if (batch_times_.size() < kBatchTimesNeeded) return std::nullopt;
  std::vector<Duration> times(batch_times_.begin(), batch_times_.end());
  const auto middle = times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2);
  std::nth_element(times.begin(), middle, times.end());
  return *middle;
}

}  // namespace lucerna
