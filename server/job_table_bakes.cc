// The rounds of bakes: part of server/job_table.h.
#include <algorithm>
#include <utility>

#include "server/job_table.h"
#include "server/memory_need.h"

namespace lucerna {
namespace {

// The record of a round that has ended with what the job has.
void EndRecord(const Job& job, BakeRoundRecord& round, const std::vector<BakeRoundRecord>& before,
               Duration cpu) {
  round.has_ended = true;
  round.photons = job.counters.photons;
  round.cpu = cpu;
  for (const BakeRoundRecord& earlier : before) {
    if (&earlier != &round) round.cpu -= earlier.cpu;
  }
  round.cpu = std::max(round.cpu, Duration::zero());
  if (!job.convergence.empty()) round.error = job.convergence.back();
  round.lights = job.lights;
}

}  // namespace

void JobTable::BeginBakeAgain(std::uint64_t serial, Entry& entry, Dropped& dropped) {
  if (!queue_.HasTurn(serial)) {
    ForgetRoundsLocked(entry, dropped);
    return;
  }
  // The thread of its turn does it, or a later process.
  entry.begins_again = true;
  entry.job.bake->begins_again = true;
  if (entry.runner) entry.runner->Stop(absl::AbortedError("the bake begins again"));
}

void JobTable::ForgetRoundsLocked(Entry& entry, Dropped& dropped) {
  dropped.runners.push_back(std::exchange(entry.runner, nullptr));
  dropped.bakes.push_back(std::exchange(entry.bake_work, nullptr));
  entry.job.bake->rounds.clear();
  entry.job.bake->begins_again = false;
  entry.job.bake->figures.clear();
  entry.job.bake->interpolation_error.reset();
  entry.job.bake->uv_mesh.reset();
  entry.job.ClearProgress();
  ++entry.version;
}

bool JobTable::HoldsFilesOfBake(const Entry& entry) {
  return entry.job.bake && entry.job.life.has_ended() && !entry.pinned.empty();
}

void JobTable::SetBakeWork(const std::string& job_id, std::shared_ptr<BakeWork> work) {
  Dropped dropped;
  const MutexLock lock(mutex_);
  const auto found = FindLocked(job_id);
  if (found == entries_.end() || found->second.job.life.has_ended()) return;
  dropped.bakes.push_back(std::exchange(found->second.bake_work, std::move(work)));
}

bool JobTable::EndRound(const std::string& job_id, std::optional<Digest> image, std::int64_t passes,
                        StopReason reason, const Moment& moment) {
  Dropped dropped;
  const MutexLock lock(mutex_);
  const auto found = FindLocked(job_id);
  if (found == entries_.end()) return false;
  Entry& entry = found->second;
  if (entry.job.life.has_ended() || entry.begins_again) return false;
  dropped.runners.push_back(std::exchange(entry.runner, nullptr));
  BakeRoundRecord& round = entry.job.bake->rounds.back();
  EndRecord(entry.job, round, entry.job.bake->rounds,
            CpuOf(entry, moment) + entry.job.counters.worker_cpu);
  round.image = image;
  round.passes = passes;
  round.reason = reason;
  ++entry.version;
  Save(entry, moment.now, dropped.writes);
  return true;
}

bool JobTable::BeginRound(const std::string& job_id, BakeRoundRecord round,
                          const CheckedJob& checked, const Moment& moment) {
  Dropped dropped;
  const MutexLock lock(mutex_);
  const auto found = FindLocked(job_id);
  if (found == entries_.end()) return false;
  Entry& entry = found->second;
  Job& job = entry.job;
  if (job.life.has_ended() || entry.begins_again) return false;
  dropped.runners.push_back(std::exchange(entry.runner, nullptr));
  std::vector<BakeRoundRecord>& rounds = job.bake->rounds;
  const bool goes_on =
      !rounds.empty() && !rounds.back().has_ended && rounds.back().sensors == round.sensors;
  if (!goes_on) {
    if (!rounds.empty() && !rounds.back().has_ended) rounds.pop_back();
    round.run = ++job.bake->runs;
    round.ran_before = job.life.Running(moment.now);
    rounds.push_back(std::move(round));
    job.ClearRound();
  }
  // What it waited for was of the round before.
  if (GoesOnByItself(job.pause_cause) &&
      ChangeLife(found->first, entry, moment,
                 [&](JobLife& life) { return life.Run(moment.now); })) {
    job.pause_cause = PauseCause::kNone;
    job.condition.clear();
    queue_.SetHasPlace(found->first, !entry.gives_up_turn);
    UpdateTurns();
  }
  job.settings = checked.settings;
  job.needs = checked.needs;
  job.scene_memory = HeldOfScene(checked.scene_memory);
  ++entry.version;
  if (!goes_on) Save(entry, moment.now, dropped.writes);
  return true;
}

void JobTable::ForgetRounds(const std::string& job_id, const Moment& moment) {
  Dropped dropped;
  const MutexLock lock(mutex_);
  const auto found = FindLocked(job_id);
  if (found == entries_.end() || !found->second.job.bake) return;
  ForgetRoundsLocked(found->second, dropped);
  Save(found->second, moment.now, dropped.writes);
}

void JobTable::SetBakeResult(const std::string& job_id, const BakeResult& result, Blob uv_mesh,
                             std::optional<Digest> uv_mesh_digest) {
  const MutexLock lock(mutex_);
  const auto found = FindLocked(job_id);
  if (found == entries_.end() || found->second.job.life.has_ended()) return;
  BakeRecord& bake = *found->second.job.bake;
  // What is known of the error is what the points know that are spread evenly.
  if (const BakeRoundRecord* const round = EvenRoundOf(bake)) {
    found->second.job.convergence.clear();
    if (round->error) found->second.job.convergence.push_back(*round->error);
    found->second.job.lights = round->lights;
  }
  bake.figures = result.figures;
  bake.interpolation_error = result.interpolation_error;
  bake.uv_mesh = uv_mesh_digest;
  found->second.uv_mesh = std::move(uv_mesh);
}

}  // namespace lucerna
