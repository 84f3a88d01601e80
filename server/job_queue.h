// Which job is rendered next? One at a time, in the order in which they came.
//
// Jobs are named by their serial numbers. Locking is the caller's.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>

namespace lucerna {

class JobQueue {
 public:
  explicit JobQueue(std::size_t max_waiting) : max_waiting_(max_waiting) {}

  [[nodiscard]] bool is_full() const { return waiting_.size() >= max_waiting_; }
  [[nodiscard]] bool has_waiting() const { return !waiting_.empty(); }
  [[nodiscard]] std::size_t size() const { return waiting_.size(); }
  // Whether a job that came now would be rendered at once.
  [[nodiscard]] bool is_idle() const { return waiting_.empty() && !current_; }
  // The job that is being rendered.
  [[nodiscard]] std::optional<std::uint64_t> current() const { return current_; }

  // At the end, also when the queue is full: the bound is for new jobs.
  void Push(std::uint64_t serial) { waiting_.push_back(serial); }
  // If it waits.
  void Remove(std::uint64_t serial) { std::erase(waiting_, serial); }
  // Makes the first one that waits the current one. Requires has_waiting() and no current job.
  std::uint64_t Begin();
  // The current job is not rendered any more. Requires one.
  void End();

 private:
  const std::size_t max_waiting_;
  std::deque<std::uint64_t> waiting_;
  std::optional<std::uint64_t> current_;
};

}  // namespace lucerna
