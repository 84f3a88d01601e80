#include "server/metrics.h"

#include <array>
#include <chrono>
#include <utility>

namespace lucerna {
namespace {

constexpr std::array kStates = {JobState::kQueued, JobState::kPreparing, JobState::kRunning,
                                JobState::kPaused, JobState::kSucceeded, JobState::kCancelled,
                                JobState::kFailed};
constexpr std::array<const char*, kMergeOutcomes> kOutcomes = {"accepted", "duplicate",
                                                               "superseded"};
constexpr std::array<std::pair<MemoryUse, const char*>, kMemoryUses> kUses = {
    {{MemoryUse::kUploads, "uploads"},
     {MemoryUse::kBlobs, "blobs"},
     {MemoryUse::kScenes, "scenes"},
     {MemoryUse::kJobs, "jobs"},
     {MemoryUse::kImages, "images"},
     {MemoryUse::kCommits, "commits"}}};

void FillWorkers(const std::vector<WorkerRecord>& workers, MetricsPage& page) {
  std::array<double, 3> connected{};
  for (const WorkerRecord& worker : workers)
    connected[static_cast<std::size_t>(worker.state)] += worker.is_connected ? 1 : 0;
  for (const WorkerState state :
       {WorkerState::kActive, WorkerState::kDraining, WorkerState::kQuarantined}) {
    page.Gauge("lucerna_workers", "Workers that are connected.",
               connected[static_cast<std::size_t>(state)], {{"state", NameOf(state)}});
  }
  for (const WorkerRecord& worker : workers) {
    const LeaseCounts& counts = worker.leases;
    for (const auto& [ending, count] :
         {std::pair("committed", counts.committed), std::pair("failed", counts.failed),
          std::pair("stalled", counts.stalled), std::pair("lost", counts.lost),
          std::pair("crashed", counts.crashed)}) {
      page.Counter("lucerna_worker_leases_total", "Leases that have ended, by how they ended.",
                   static_cast<double>(count),
                   {{"worker", worker.id}, {"name", worker.name}, {"ending", ending}});
    }
  }
}

}  // namespace

void FillMetrics(const Coordinator& coordinator, const CallLatencies& calls, MetricsPage& page) {
  const auto seconds = [](Duration time) { return std::chrono::duration<double>(time).count(); };
  const std::map<JobState, std::size_t> jobs = coordinator.JobsByState();
  for (const JobState state : kStates) {
    const auto found = jobs.find(state);
    page.Gauge("lucerna_jobs", "Jobs that are kept, by state.",
               found == jobs.end() ? 0 : static_cast<double>(found->second),
               {{"state", NameOf(state)}});
  }

  const Scheduler::Load load = coordinator.LoadNow();
  FillWorkers(coordinator.ListWorkers(), page);
  page.Gauge("lucerna_workers_idle", "Connected workers that may be lent work and hold none.",
             static_cast<double>(load.idle_workers));
  page.Gauge("lucerna_leases", "Leases that workers hold.", static_cast<double>(load.leases));
  page.Gauge("lucerna_lease_oldest_seconds", "How long ago the oldest of them was lent.",
             seconds(load.oldest_lease));
  page.Counter("lucerna_leases_total", "Leases that were lent.", static_cast<double>(load.lent));
  page.Counter("lucerna_leases_again_total",
               "Of those, of work that had been lent before: it came back, its worker is late, or "
               "its result is audited.",
               static_cast<double>(load.lent_again));

  const Coordinator::ResultCounts& results = coordinator.results();
  page.Counter("lucerna_photons_total", "Photons of results that were merged.",
               static_cast<double>(results.photons));
  for (std::size_t i = 0; i < kOutcomes.size(); ++i) {
    page.Counter("lucerna_results_total", "Results of workers, by what became of them.",
                 static_cast<double>(results.of_outcome[i]), {{"outcome", kOutcomes[i]}});
  }
  page.Counter("lucerna_results_total", "", static_cast<double>(results.refused),
               {{"outcome", "refused"}});
  page.Histogram("lucerna_result_seconds", "Decoding, checking and merging of a result.",
                 results.taking_in);

  const MemoryBudget& memory = coordinator.memory();
  for (const auto& [use, name] : kUses) {
    page.Gauge("lucerna_memory_claimed_bytes", "Memory that is claimed, by use.",
               static_cast<double>(memory.HeldFor(use)), {{"use", name}});
  }
  page.Gauge("lucerna_memory_limit_bytes", "Memory that may be claimed (--max-memory).",
             static_cast<double>(memory.max_bytes()));
  if (const DiskBudget* disk = coordinator.disk()) {
    page.Gauge("lucerna_disk_used_bytes", "Size of the files in --state.",
               static_cast<double>(disk->used_bytes()));
    page.Gauge("lucerna_disk_limit_bytes", "What they may have (--max-disk); 0: no limit.",
               static_cast<double>(disk->max_bytes()));
  }
  calls.ForEach([&](const std::string& method, const LatencyCounts& counts) {
    page.Histogram("lucerna_call_seconds",
                   "Calls that have ended, by method; Sync and Watch wait on purpose.", counts,
                   {{"method", method}});
  });
  page.Process();
}

}  // namespace lucerna
