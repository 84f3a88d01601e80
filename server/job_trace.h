// A job's timeline: what the coordinator and each worker did for it, and when.
//
// Shown by viewers of Chrome's trace format (chrome://tracing, ui.perfetto.dev). Bounded: of more
// than kMostSpans the oldest are dropped, and the file says how many.
//
// Threads: any.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "render/base/clock.h"
#include "render/base/mutex.h"

namespace lucerna {

// One thing that took from `from` to `to`.
struct TraceSpan {
  std::string row;   // who did it: spans of a row that overlap are shown below each other
  std::string what;  // "passes 4 to 8"
  SteadyTime from, to;
  std::vector<std::pair<std::string, std::string>> details = {};  // name and value
};

class JobTrace {
 public:
  static constexpr std::size_t kMostSpans = 1U << 16;

  // Times are shown from `begin` on.
  JobTrace(std::string job_id, SteadyTime begin, std::size_t most_spans = kMostSpans)
      : job_id_(std::move(job_id)), begin_(begin), most_spans_(most_spans) {}

  // A span of the coordinator, and one of a worker, whose row is its name.
  void AddOwn(TraceSpan span) { Add(kCoordinator, std::move(span)); }
  void AddWorkers(TraceSpan span) { Add(kWorkers, std::move(span)); }

  // One JSON object: `traceEvents` with a complete event ("X") for each span and the names of
  // processes and threads ("M"), `otherData` with the job's id and how many spans were dropped. No
  // two spans of a thread overlap.
  [[nodiscard]] std::string Json() const;

 private:
  enum Group : std::uint8_t { kCoordinator = 1, kWorkers = 2 };  // process ids in the file
  void Add(Group group, TraceSpan span);

  const std::string job_id_;
  const SteadyTime begin_;
  const std::size_t most_spans_;
  mutable Mutex mutex_;
  std::deque<std::pair<Group, TraceSpan>> spans_ LUCERNA_GUARDED_BY(mutex_);
  std::uint64_t dropped_ LUCERNA_GUARDED_BY(mutex_) = 0;
};

}  // namespace lucerna
