// Turns of jobs, and who waits for one: part of server/job_table.h.
#include <algorithm>
#include <utility>

#include "server/job_table.h"

namespace lucerna {
namespace {

// A worker that comes back within this time finds its jobs as they were.
constexpr Duration kPatienceWithoutWorkers = std::chrono::seconds(5);

}  // namespace

void JobTable::ShareCpu(const Moment& moment) {
  const Duration taken = moment.cpu - shared_cpu_;
  if (taken <= Duration::zero()) return;
  for (const std::uint64_t serial : running_)
    entries_.at(serial).job.counters.coordinator_cpu += taken / running_.size();
  shared_cpu_ = moment.cpu;
}

Duration JobTable::CpuOf(const Entry& entry, const Moment& moment) const {
  const Duration shared = entry.job.counters.coordinator_cpu;
  if (!running_.contains(entry.serial)) return shared;
  return shared + std::max(moment.cpu - shared_cpu_, Duration::zero()) / running_.size();
}

bool JobTable::ChangeLife(std::uint64_t serial, Entry& entry, const Moment& moment,
                          absl::FunctionRef<bool(JobLife&)> change) {
  ShareCpu(moment);
  if (!change(entry.job.life)) return false;
  if (entry.job.life.state() == JobState::kRunning) {
    running_.insert(serial);
  } else {
    running_.erase(serial);
  }
  ++entry.version;
  return true;
}

JobQueue::Claim JobTable::ClaimOf(const Entry& entry) {
  return {.priority = entry.is_finishing ? kHighestPriority + 1 : entry.job.priority,
          .owner = entry.job.owner,
          .number = entry.turn};
}

void JobTable::PushLocked(std::uint64_t serial, Entry& entry) {
  queue_.Push(serial, ClaimOf(entry));
  UpdateTurns();
}

void JobTable::SetGivesUpTurn(Entry& entry, bool gives_up_turn) {
  entry.gives_up_turn = gives_up_turn;
  if (entry.runner) entry.runner->SetGivesUpTurn(gives_up_turn);
}

// The rest of its turn is short, and its record may be dropped before that has ended.
void JobTable::LeavePlace(std::uint64_t serial) {
  queue_.SetHasPlace(serial, false);
  job_waits_.NotifyAll();
}

void JobTable::UpdateTurns() {
  while (const std::optional<std::uint64_t> serial = queue_.TakeYielding())
    SetGivesUpTurn(entries_.at(*serial), true);
  job_waits_.NotifyAll();
}

bool JobTable::ResumeLocked(std::uint64_t serial, Entry& entry) {
  if (GoesOnByItself(entry.job.pause_cause) || !entry.job.life.Resume()) return false;
  entry.job.pause_cause = PauseCause::kNone;
  entry.job.condition.clear();
  ++entry.version;
  PushLocked(serial, entry);
  return true;
}

StatusOr<JobReport> JobTable::Pause(const std::string& job_id, PauseCause cause, std::string reason,
                                    const Moment& moment) {
  Writes writes;
  const MutexLock lock(mutex_);
  const auto found = FindLocked(job_id);
  if (found == entries_.end()) return UnknownJob(job_id);
  const std::uint64_t serial = found->first;
  Entry& entry = found->second;
  Job& job = entry.job;
  if (job.life.has_ended()) {
    return absl::FailedPreconditionError(absl::StrCat("job ", job_id, " has ended"));
  }
  if (job.pause_cause == PauseCause::kUser || job.pause_cause == cause) {
    return MakeReport(entry, moment);
  }
  ChangeLife(serial, entry, moment, [&](JobLife& life) { return life.Pause(moment.now); });
  job.pause_cause = cause;
  job.condition = std::move(reason);
  job.AddEvent(moment.wall, job.condition);
  ++entry.version;
  queue_.Remove(serial);
  queue_.SetHasPlace(serial, false);
  SetGivesUpTurn(entry, true);
  UpdateTurns();
  Save(entry, moment.now, writes);
  return MakeReport(entry, moment);
}

StatusOr<JobReport> JobTable::Resume(const std::string& job_id, const Moment& moment) {
  Writes writes;
  const MutexLock lock(mutex_);
  const auto found = FindLocked(job_id);
  if (found == entries_.end()) return UnknownJob(job_id);
  Entry& entry = found->second;
  if (entry.job.life.has_ended()) {
    return absl::FailedPreconditionError(absl::StrCat("job ", job_id, " has ended"));
  }
  if (ResumeLocked(found->first, entry)) {
    entry.job.AddEvent(moment.wall, "resumed");
    Save(entry, moment.now, writes);
  }
  return MakeReport(entry, moment);
}

StatusOr<JobReport> JobTable::SetPriority(const std::string& job_id, int priority,
                                          const Moment& moment) {
  if (priority < kLowestPriority || priority > kHighestPriority) {
    return absl::InvalidArgumentError(
        absl::StrCat("a priority is a number from ", kLowestPriority, " to ", kHighestPriority));
  }
  Writes writes;
  const MutexLock lock(mutex_);
  const auto found = FindLocked(job_id);
  if (found == entries_.end()) return UnknownJob(job_id);
  Entry& entry = found->second;
  if (entry.job.life.has_ended()) {
    return absl::FailedPreconditionError(absl::StrCat("job ", job_id, " has ended"));
  }
  if (entry.job.priority != priority) {
    entry.job.priority = priority;
    ++entry.version;
    queue_.SetPriority(found->first, ClaimOf(entry).priority);
    UpdateTurns();
    Save(entry, moment.now, writes);
  }
  return MakeReport(entry, moment);
}

void JobTable::SetLiveWorkers(int workers, const Moment& moment) {
  const bool has_workers = workers > 0;
  const MutexLock lock(mutex_);
  if (has_workers != has_workers_) {
    has_workers_ = has_workers;
    no_workers_since_ = moment.now;
    for (auto& [serial, entry] : entries_) {
      if (entry.job.life.has_ended()) continue;
      entry.job.life.SetHasWorkers(has_workers, moment.now);
      ++entry.version;
      // When its time is up has changed.
      if (entry.runner) entry.runner->Wake();
    }
    if (has_workers) {
      for (const std::uint64_t serial : running_)
        queue_.SetHasPlace(serial, !entries_.at(serial).gives_up_turn);
      UpdateTurns();
    }
  }
  if (has_workers || moment.now - no_workers_since_ < kPatienceWithoutWorkers) return;
  for (const std::uint64_t serial : running_)
    queue_.SetHasPlace(serial, false);
  UpdateTurns();
}

std::optional<JobTable::Turn> JobTable::WaitForTurn() {
  const MutexLock lock(mutex_);
  std::optional<std::uint64_t> next;
  while (!is_closed_ && !(next = queue_.Next()))
    job_waits_.Wait(mutex_);
  if (is_closed_) return std::nullopt;
  Entry& entry = entries_.at(*next);
  queue_.Begin(*next);
  SetGivesUpTurn(entry, false);
  // A job that ends while it waits leaves the queue in the same step.
  LUCERNA_CHECK(entry.job.life.Prepare());
  ++entry.version;
  return Turn{entry.job.id,          RunIdOf(entry.job),
              ManifestOf(entry.job), entry.job.settings,
              entry.job.needs,       entry.job.scene_memory,
              entry.job.reference,   std::exchange(entry.scene, std::nullopt),
              entry.runner,          entry.job.bake.has_value(),
              entry.bake_work,       /*warns=*/true,
              TurnEnd(*this, *next)};
}

void JobTable::EndTurn(std::uint64_t serial) {
  Dropped dropped;
  const MutexLock lock(mutex_);
  queue_.End(serial);
  job_waits_.NotifyAll();
  const auto found = entries_.find(serial);
  if (found == entries_.end()) return;
  Entry& entry = found->second;
  // A bake may be given another end.
  const bool needs_files =
      entry.runner || (entry.job.bake && entry.job.life.state() == JobState::kSucceeded);
  if (entry.job.life.has_ended() && !needs_files) {
    dropped.pinned.push_back(std::exchange(entry.pinned, {}));
  }
}

void JobTable::GiveUpTurn(const std::string& job_id, const Moment& moment) {
  const MutexLock lock(mutex_);
  const auto found = FindLocked(job_id);
  if (found == entries_.end()) return;
  Entry& entry = found->second;
  // Something may have come that it waits for, after it was told to give its turn up; what ends
  // that does not wake a job without a turn.
  const bool waits = GoesOnByItself(entry.job.pause_cause);
  if (ChangeLife(found->first, entry, moment, [&](JobLife& life) {
        return waits ? life.Resume() : life.GiveUpTurn(moment.now);
      })) {
    if (waits) {
      entry.job.pause_cause = PauseCause::kNone;
      entry.job.condition.clear();
    }
    PushLocked(found->first, entry);
  }
}

void JobTable::SetWaitsForMemory(const std::string& job_id, std::string condition,
                                 const Moment& moment) {
  const MutexLock lock(mutex_);
  const auto found = FindLocked(job_id);
  if (found == entries_.end()) return;
  Entry& entry = found->second;
  const JobState state = entry.job.life.state();
  if (state != JobState::kPreparing && (state != JobState::kRunning || entry.runner)) return;
  queue_.SetHasPlace(found->first, condition.empty() && !entry.gives_up_turn);
  UpdateTurns();
  if (entry.job.condition == condition) return;
  if (!condition.empty()) entry.job.AddEvent(moment.wall, condition);
  entry.job.condition = std::move(condition);
  ++entry.version;
}

std::optional<JobTable::Share> JobTable::ShareOf(const std::string& job_id) const {
  const MutexLock lock(mutex_);
  const auto found = FindLocked(job_id);
  if (found == entries_.end() || !found->second.runner) return std::nullopt;
  const Job& job = found->second.job;
  if (job.life.has_ended()) return std::nullopt;
  return Share{job.priority, job.owner, found->second.gives_up_turn, RunIdOf(job)};
}

bool JobTable::GivesUpTurn(const std::string& job_id) const {
  const MutexLock lock(mutex_);
  const auto found = FindLocked(job_id);
  return found != entries_.end() && found->second.gives_up_turn;
}

}  // namespace lucerna
