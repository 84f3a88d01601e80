#include "server/worker_records.h"

#include <bit>
#include <utility>

#include "absl/strings/str_cat.h"

#include "render/base/digest.h"
#include "render/base/text.h"

namespace lucerna {
namespace {

constexpr std::size_t kIdDigits = 16;
constexpr std::uint32_t kRecentMask = (1U << kRecentLeases) - 1;

}  // namespace

const char* NameOf(WorkerState state) {
  switch (state) {
    case WorkerState::kActive:
      return "active";
    case WorkerState::kDraining:
      return "draining";
    case WorkerState::kQuarantined:
      return "quarantined";
  }
  return "";
}

std::string WorkerIdOf(std::string_view identity) {
  return Sha256(absl::StrCat("worker ", std::string(identity))).Hex().substr(0, kIdDigits);
}

void WorkerRecords::Join(const std::string& id, std::string_view name, SteadyTime now) {
  Entry& entry = entries_[id];
  if (!entry.is_connected) gone_.erase(GoneOf(entry));
  entry.id = id;
  entry.name = name;
  entry.heard_at = now;
  entry.is_connected = true;
}

void WorkerRecords::Leave(const std::string& id, SteadyTime now) {
  const auto found = entries_.find(id);
  if (found == entries_.end() || !found->second.is_connected) return;
  Entry& entry = found->second;
  entry.is_connected = false;
  entry.heard_at = now;
  gone_.insert(GoneOf(entry));
  DropOldestGone();
}

void WorkerRecords::DropOldestGone() {
  while (gone_.size() > max_gone_) {
    const auto oldest = entries_.find(std::get<std::string>(*gone_.begin()));
    if (!oldest->second.may_be_lent()) changed_.insert(oldest->first);
    entries_.erase(oldest);
    gone_.erase(gone_.begin());
  }
}

const WorkerRecord* WorkerRecords::Find(const std::string& id) const {
  const auto found = entries_.find(id);
  return found == entries_.end() ? nullptr : &found->second;
}

std::vector<WorkerRecord> WorkerRecords::All() const {
  std::vector<WorkerRecord> all;
  all.reserve(entries_.size());
  for (const auto& [id, entry] : entries_)
    all.push_back(entry);
  return all;
}

void WorkerRecords::Count(const std::string& id, End end) {
  const auto found = entries_.find(id);
  if (found == entries_.end()) return;
  Entry& entry = found->second;
  const auto remember = [&](bool is_bad) {
    entry.recent = ((entry.recent << 1) | (is_bad ? 1U : 0U)) & kRecentMask;
  };
  switch (end) {
    case End::kCommitted:
      ++entry.leases.committed;
      remember(false);
      return;
    case End::kFailed:
      ++entry.leases.failed;
      remember(true);
      return;
    case End::kStalled:
      ++entry.leases.stalled;
      remember(true);
      return;
    case End::kLost:
      ++entry.leases.lost;
      return;
    case End::kCrashed:
      ++entry.leases.crashed;
      return;
  }
}

bool WorkerRecords::IsUnreliable(const std::string& id) const {
  const auto found = entries_.find(id);
  return found != entries_.end() && std::popcount(found->second.recent) >= kBadOfRecent;
}

void WorkerRecords::SetState(Entry& entry, WorkerState state) {
  if (!entry.is_connected) gone_.erase(GoneOf(entry));
  entry.state = state;
  if (!entry.is_connected) gone_.insert(GoneOf(entry));
  changed_.insert(entry.id);
}

std::vector<WorkerStanding> WorkerRecords::TakeChanged() {
  std::vector<WorkerStanding> changed;
  for (const std::string& id : std::exchange(changed_, {})) {
    const auto found = entries_.find(id);
    if (found == entries_.end()) {
      changed.push_back({.id = id});
    } else {
      const Entry& entry = found->second;
      changed.push_back({entry.id, entry.name, entry.state, entry.reason, entry.has_lied});
    }
  }
  return changed;
}

void WorkerRecords::Restore(const WorkerStanding& standing, SteadyTime now) {
  Entry& entry = entries_[standing.id];
  if (entry.is_connected) return;
  if (!entry.id.empty()) gone_.erase(GoneOf(entry));
  entry.id = standing.id;
  entry.name = standing.name;
  entry.state = standing.state;
  entry.reason = standing.reason;
  entry.has_lied = standing.has_lied;
  entry.heard_at = now;
  gone_.insert(GoneOf(entry));
  DropOldestGone();
}

bool WorkerRecords::Quarantine(const std::string& id, std::string_view reason, bool has_lied) {
  const auto found = entries_.find(id);
  if (found == entries_.end()) return false;
  Entry& entry = found->second;
  // That a result was wrong is the graver reason, and stays.
  if (!entry.has_lied) entry.reason = reason;
  entry.has_lied = entry.has_lied || has_lied;
  SetState(entry, WorkerState::kQuarantined);
  return true;
}

bool WorkerRecords::Drain(const std::string& id) {
  const auto found = entries_.find(id);
  if (found == entries_.end()) return false;
  if (found->second.state == WorkerState::kActive) {
    SetState(found->second, WorkerState::kDraining);
  }
  return true;
}

bool WorkerRecords::Release(const std::string& id) {
  const auto found = entries_.find(id);
  if (found == entries_.end()) return false;
  Entry& entry = found->second;
  entry.reason.clear();
  entry.has_lied = false;
  entry.recent = 0;
  SetState(entry, WorkerState::kActive);
  return true;
}

}  // namespace lucerna
