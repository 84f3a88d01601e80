// What does the coordinator tell those who watch the farm?
//
// Names and meanings are in docs/deploy.md; a page is made for each request and changes nothing.
#pragma once

#include "render/wire/metrics.h"
#include "server/call_latencies.h"
#include "server/coordinator.h"

namespace lucerna {

void FillMetrics(const Coordinator& coordinator, const CallLatencies& calls, MetricsPage& page);

}  // namespace lucerna
