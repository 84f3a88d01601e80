// What is known of each worker beyond its present connection?
//
// A worker makes a random identity when it starts and names it in every registration. It is known
// here by the digest of that, so that a list of workers does not let anyone pass for one of them.
// How its leases ended is counted for each identity, and decides who is lent nothing any more.
//
// Quarantine: a worker is lent nothing after kBadOfRecent of its last kRecentLeases leases failed
// or stalled, as long as another worker can go on, and after a result of it was found to be wrong,
// in any case. It ends when a user releases the worker. Lost connections do not count. Quarantine
// and drain outlive the process where a caller keeps them: TakeChanged, Restore.
//
// Pure values: moments come in as arguments. Time and memory of a call grow with the logarithm of
// the number of workers; of workers that have gone, the newest are kept.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "render/base/clock.h"

namespace lucerna {

inline constexpr int kRecentLeases = 10;
inline constexpr int kBadOfRecent = 3;

enum class WorkerState : std::uint8_t { kActive, kDraining, kQuarantined };

// "active".
[[nodiscard]] const char* NameOf(WorkerState state);

// How the leases of a worker ended, as far as that says something of the worker.
struct LeaseCounts {
  std::uint64_t committed = 0;
  std::uint64_t failed = 0;   // the worker reported so, or its result was refused
  std::uint64_t stalled = 0;  // renewed for too long
  std::uint64_t lost = 0;     // the connection broke, and the worker came back
  std::uint64_t crashed = 0;  // the connection broke, and the worker did not come back
  bool operator==(const LeaseCounts&) const = default;
};

struct WorkerRecord {
  std::string id;
  std::string name;  // as the worker says: untrusted
  WorkerState state = WorkerState::kActive;
  std::string reason;  // of the quarantine
  bool has_lied = false;
  LeaseCounts leases;
  SteadyTime heard_at;
  bool is_connected = false;
  std::size_t held = 0;  // leases

  [[nodiscard]] bool may_be_lent() const { return state == WorkerState::kActive; }
};

// Whether a worker is lent work, and why not: what is kept of it beyond this process.
struct WorkerStanding {
  std::string id;
  std::string name = {};
  WorkerState state = WorkerState::kActive;
  std::string reason = {};
  bool has_lied = false;
  bool operator==(const WorkerStanding&) const = default;
};

// What a worker of this identity is called; not empty.
[[nodiscard]] std::string WorkerIdOf(std::string_view identity);

class WorkerRecords {
 public:
  explicit WorkerRecords(std::size_t max_gone = 1000) : max_gone_(max_gone) {}

  // A worker has registered.
  void Join(const std::string& id, std::string_view name, SteadyTime now);
  // Its registration has ended.
  void Leave(const std::string& id, SteadyTime now);

  // nullptr when there is no such worker (any more).
  [[nodiscard]] const WorkerRecord* Find(const std::string& id) const;
  // By id.
  [[nodiscard]] std::vector<WorkerRecord> All() const;

  enum class End : std::uint8_t { kCommitted, kFailed, kStalled, kLost, kCrashed };
  void Count(const std::string& id, End end);
  // Whether so many of its last leases failed or stalled that it should be lent none.
  [[nodiscard]] bool IsUnreliable(const std::string& id) const;

  // These return false when there is no such worker.
  bool Quarantine(const std::string& id, std::string_view reason, bool has_lied = false);
  bool Drain(const std::string& id);
  // Ends quarantine and drain, and what was counted against it.
  bool Release(const std::string& id);

  // Those whose standing has changed since the last call, as it is now; active, also of one that is
  // not known any more: nothing is to be kept of it.
  [[nodiscard]] std::vector<WorkerStanding> TakeChanged();
  // The caller could not keep the standing of this worker: TakeChanged returns it again.
  void NoteChanged(const std::string& id) { changed_.insert(id); }
  // A worker of an earlier process, which has not registered yet.
  void Restore(const WorkerStanding& standing, SteadyTime now);

 private:
  struct Entry : WorkerRecord {
    std::uint32_t recent = 0;  // a bit a lease, the newest lowest; 1: failed or stalled
  };
  // Those that have gone, the first to be forgotten first: workers that may be lent nothing last.
  using Gone = std::tuple<bool, SteadyTime, std::string>;

  [[nodiscard]] static Gone GoneOf(const Entry& entry) {
    return {!entry.may_be_lent(), entry.heard_at, entry.id};
  }
  // Changes the state of an entry wherever it is listed.
  void SetState(Entry& entry, WorkerState state);
  // Forgets the oldest of those that have gone while they are too many.
  void DropOldestGone();

  std::size_t max_gone_;
  std::map<std::string, Entry> entries_;
  std::set<Gone> gone_;
  std::set<std::string> changed_;  // ids
};

}  // namespace lucerna
