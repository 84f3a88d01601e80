#include "server/commit_accounting.h"

namespace lucerna {

void CountCommit(Job& job, const Delivery& delivery, const DeliveredCounts& counts,
                 std::string_view worker_name, SteadyTime now) {
  JobCounters& counters = job.counters;
  if (!counters.to_first_photons) counters.to_first_photons = now - job.life.submitted_at();
  counters.photons += counts.tally.photons;
  counters.tally += counts.tally;
  counters.NameDropped(counts.dropped_photons);
  counters.worker_cpu = SaturatingSum(counters.worker_cpu, delivery.cpu);
  counters.bytes_received += delivery.size_bytes;
  counters.hitpoints_returned += counts.rows;
  counters.rate.Add(counts.tally.photons, now);
  WorkerShare& share = job.workers[delivery.record];
  if (share.name.empty()) share.name = worker_name;
  share.photons += counts.tally.photons;
  share.batches += 1;
  share.cpu = SaturatingSum(share.cpu, delivery.cpu);
}

void CountFetch(Job& job, std::uint64_t size_bytes, std::uint64_t hitpoints) {
  job.counters.bytes_sent += size_bytes;
  job.counters.hitpoints_sent += hitpoints;
}

}  // namespace lucerna
