#include "server/worker_records.h"

#include <bit>

#include "absl/strings/str_cat.h"

#include "render/base/digest.h"
#include "render/base/text.h"

namespace lucerna {
namespace {

constexpr std::size_t kIdDigits = 16;
constexpr std::uint32_t kRecentMask = (1U << kRecentLeases) - 1;

}  // namespace

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
  if (gone_.size() <= max_gone_) return;
  entries_.erase(std::get<std::string>(*gone_.begin()));
  gone_.erase(gone_.begin());
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
