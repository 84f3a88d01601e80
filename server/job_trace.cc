#include "server/job_trace.h"

#include <algorithm>
#include <chrono>

#include <nlohmann/json.hpp>

namespace lucerna {
namespace {

using Value = nlohmann::ordered_json;

// [µs], as the format has it; with its decimals.
double Microseconds(Duration duration) {
  return std::chrono::duration<double, std::micro>(duration).count();
}

Value NameOf(const char* kind, int process, int thread, const std::string& name) {
  return {
      {"name", kind}, {"ph", "M"}, {"pid", process}, {"tid", thread}, {"args", {{"name", name}}}};
}

}  // namespace

void JobTrace::Add(Group group, TraceSpan span) {
  const MutexLock lock(mutex_);
  spans_.emplace_back(group, std::move(span));
  if (spans_.size() <= most_spans_) return;
  spans_.pop_front();
  ++dropped_;
}

std::string JobTrace::Json() const {
  std::vector<std::pair<Group, TraceSpan>> spans;
  std::uint64_t dropped = 0;
  {
    const MutexLock lock(mutex_);
    spans.assign(spans_.begin(), spans_.end());
    dropped = dropped_;
  }
  std::ranges::stable_sort(spans, {}, [](const auto& item) { return item.second.from; });
  // Each row has as many threads as it has spans at once: a span goes to the first that is free.
  struct Lane {
    int thread = 0;
    SteadyTime free_at;
  };
  std::map<std::pair<Group, std::string>, std::vector<Lane>> rows;
  int threads = 0;
  Value events = Value::array();
  events.push_back(NameOf("process_name", kCoordinator, 0, "coordinator"));
  events.push_back(NameOf("process_name", kWorkers, 0, "workers"));
  for (const auto& [group, span] : spans) {
    std::vector<Lane>& lanes = rows[{group, span.row}];
    auto lane = std::ranges::find_if(
        lanes, [from = span.from](const Lane& one) { return one.free_at <= from; });
    if (lane == lanes.end()) {
      lanes.push_back({++threads, {}});
      lane = std::prev(lanes.end());
      events.push_back(NameOf("thread_name", group, lane->thread, span.row));
    }
    lane->free_at = span.to;
    Value details = Value::object();
    for (const auto& [name, value] : span.details)
      details[name] = value;
    events.push_back({{"name", span.what},
                      {"ph", "X"},
                      {"ts", Microseconds(span.from - begin_)},
                      {"dur", Microseconds(std::max(Duration::zero(), span.to - span.from))},
                      {"pid", static_cast<int>(group)},
                      {"tid", lane->thread},
                      {"args", std::move(details)}});
  }
  const Value file = {{"traceEvents", std::move(events)},
                      {"displayTimeUnit", "ms"},
                      {"otherData", {{"job", job_id_}, {"spans_dropped", dropped}}}};
  return file.dump(-1, ' ', /*ensure_ascii=*/false, Value::error_handler_t::replace) + "\n";
}

}  // namespace lucerna
