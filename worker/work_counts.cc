#include "worker/work_counts.h"

namespace lucerna {

void WorkCounts::Fill(MetricsPage& page) const {
  page.Gauge("lucerna_worker_connected", "1: registered with its coordinator.",
             is_connected ? 1 : 0);
  page.Counter("lucerna_worker_photons_total", "Photons that were traced.",
               static_cast<double>(photons));
  page.Counter("lucerna_worker_results_total", "Results that were delivered.",
               static_cast<double>(committed));
  page.Counter("lucerna_worker_failures_total", "Leases that were given back with a reason.",
               static_cast<double>(failed));
  page.Counter("lucerna_worker_connections_lost_total", "Connections that broke.",
               static_cast<double>(lost));
  page.Histogram("lucerna_worker_lease_seconds", "Tracing, gathering and encoding for a lease.",
                 computing);
  page.Process();
}

}  // namespace lucerna
