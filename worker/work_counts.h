// What has a worker done since it began? Through all its connections, for its metrics.
//
// Threads: any.
#pragma once

#include <atomic>
#include <cstdint>

#include "render/base/latency_counts.h"
#include "render/wire/metrics.h"

namespace lucerna {

struct WorkCounts {
  std::atomic<bool> is_connected = false;
  std::atomic<std::uint64_t> photons = 0;    // traced
  std::atomic<std::uint64_t> committed = 0;  // results that the coordinator took or had already
  std::atomic<std::uint64_t> failed = 0;     // leases that were given back with a reason
  std::atomic<std::uint64_t> lost = 0;       // connections
  LatencyCounts computing;                   // of a lease: tracing, gathering, encoding

  void Fill(MetricsPage& page) const;
};

}  // namespace lucerna
