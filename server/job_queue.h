// Which job gets a turn next, and which gives its turn up to another?
//
// So many jobs have a turn at once. Of those that wait
//   1. the one with the highest priority comes first;
//   2. among equals, one of the owner who has the fewest turns now;
//   3. among these, the one that has waited longest, by its number in the queue.
// When all turns are taken, a job gives its turn up and waits again if the first of those that wait
// has a higher priority, or the same priority and an owner with at least two turns fewer. So an
// owner with one job never waits for several jobs of another owner, and turns do not change hands
// back and forth: after the change, neither owner has two more than the other. Jobs of one owner
// and one priority come in their order, each when one before it has ended.
//
// A job that cannot go on for now (no room on the disk, no worker) leaves its place to others and
// keeps its turn: its thread waits where it is. When it goes on there may be one turn too many, and
// then the job that comes last by the rules above gives up its turn.
//
// Jobs are named by their serial numbers. Pure; locking is the caller's.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

namespace lucerna {

class JobQueue {
 public:
  // Both at least 1.
  JobQueue(std::size_t max_waiting, std::size_t max_at_once)
      : max_waiting_(max_waiting), max_at_once_(max_at_once) {}

  // What decides when a job comes.
  struct Claim {
    int priority = 0;
    std::string owner = {};
    std::uint64_t number = 0;  // smaller: has waited longer
  };

  [[nodiscard]] bool is_full() const { return waiting_.size() >= max_waiting_; }
  // Jobs that wait.
  [[nodiscard]] std::size_t size() const { return waiting_.size(); }
  // Whether a job that came now would be given a turn at once.
  [[nodiscard]] bool has_room() const { return waiting_.empty() && places_taken() < max_at_once_; }
  // Whether the turn of the job has begun and has not ended.
  [[nodiscard]] bool HasTurn(std::uint64_t serial) const { return turns_.contains(serial); }

  // Also when the queue is full: the bound is for new jobs. A job that has a turn still may wait
  // already for its next.
  void Push(std::uint64_t serial, Claim claim);
  // If it waits.
  void Remove(std::uint64_t serial) { waiting_.erase(serial); }
  // Of a job that waits or has a turn, if it does.
  void SetPriority(std::uint64_t serial, int priority);

  // The job whose turn can begin now; absent when none waits or all places are taken.
  [[nodiscard]] std::optional<std::uint64_t> Next() const;
  // Requires that the job waits and has no turn.
  void Begin(std::uint64_t serial);
  // Requires that the job has a turn.
  void End(std::uint64_t serial);
  // The job leaves its place to others, or takes it again. Nothing when it has no turn.
  void SetHasPlace(std::uint64_t serial, bool has_place);
  // The job that is to give up its turn; it leaves its place at once. Absent when there is none.
  [[nodiscard]] std::optional<std::uint64_t> TakeYielding();

 private:
  struct Turn {
    Claim claim;
    bool has_place = true;
  };
  // Turns of the owner that have a place.
  [[nodiscard]] std::size_t PlacesOf(const std::string& owner) const;
  [[nodiscard]] std::size_t places_taken() const;
  // The first of those that wait; absent when there is none that has no turn.
  [[nodiscard]] std::optional<std::uint64_t> First() const;

  const std::size_t max_waiting_;
  const std::size_t max_at_once_;
  std::map<std::uint64_t, Claim> waiting_;  // by serial
  std::map<std::uint64_t, Turn> turns_;     // by serial
};

}  // namespace lucerna
