#include "server/fair_share.h"

#include <algorithm>
#include <tuple>

namespace lucerna {
namespace {

// Of a lease, so that work without any time to speak of takes turns too [s].
constexpr double kLeastWeight = 1e-3;
// Of a lease, whatever a worker says [s]: one that lies must not starve a job for long.
constexpr double kMostWeight = 600;
// How much the newest result counts in what one photon or pass weighs.
constexpr double kNewest = 0.25;

}  // namespace

bool FairShare::HasCompetitor(const Rank& rank) const {
  return std::ranges::any_of(jobs_, [&](const auto& item) {
    return item.second.competes() && RankOf(item.second) == rank;
  });
}

template <typename Change>
void FairShare::Update(const std::string& job_id, const Change& change) {
  JobShare& job = jobs_[job_id];
  const bool did_compete = job.competes();
  const Rank before = RankOf(job);
  change(job);
  const Rank rank = RankOf(job);
  if (!job.competes() || (did_compete && rank == before)) return;
  // Among the others it begins where they are.
  const bool is_lendable = std::exchange(job.is_lendable, false);
  OwnerShare& owner = owners_[rank];
  if (!HasCompetitor(rank)) owner.lent = std::max(owner.lent, here_[rank.first]);
  job.lent = rank == before ? std::max(job.lent, owner.here) : owner.here;
  job.is_lendable = is_lendable;
}

void FairShare::SetClaim(const std::string& job_id, Claim claim) {
  Update(job_id, [&](JobShare& job) { job.claim = std::move(claim); });
}

void FairShare::SetHeld(const std::string& job_id, bool is_held) {
  Update(job_id, [&](JobShare& job) { job.is_held = is_held; });
}

void FairShare::SetLendable(const std::string& job_id, bool is_lendable) {
  Update(job_id, [&](JobShare& job) { job.is_lendable = is_lendable; });
}

bool FairShare::IsHeld(const std::string& job_id) const {
  const auto job = jobs_.find(job_id);
  return job != jobs_.end() && job->second.is_held;
}

void FairShare::Forget(const std::string& job_id) {
  const auto job = jobs_.find(job_id);
  if (job == jobs_.end()) return;
  const Rank rank = RankOf(job->second);
  jobs_.erase(job);
  const bool is_last =
      std::ranges::none_of(jobs_, [&](const auto& item) { return RankOf(item.second) == rank; });
  if (is_last) owners_.erase(rank);
}

std::optional<std::string> FairShare::Next() const {
  std::optional<std::string> next;
  std::tuple<int, double, double> rank_of_next;
  for (const auto& [id, job] : jobs_) {
    if (!job.competes()) continue;
    const std::tuple rank(-job.claim.priority, owners_.at(RankOf(job)).lent, job.lent);
    if (next && rank >= rank_of_next) continue;
    next = id;
    rank_of_next = rank;
  }
  return next;
}

void FairShare::CountLent(const std::string& job_id, WorkKind kind, std::uint64_t size) {
  JobShare& job = jobs_[job_id];
  OwnerShare& owner = owners_[RankOf(job)];
  const std::optional<double> one = job.weight_of_one[static_cast<std::size_t>(kind)];
  if (one) {
    weight_of_a_lease_ = std::clamp(*one * static_cast<double>(size), kLeastWeight, kMostWeight);
  }
  double& here = here_[job.claim.priority];
  here = std::max(here, owner.lent);
  owner.here = std::max(owner.here, job.lent);
  owner.lent += weight_of_a_lease_;
  job.lent += weight_of_a_lease_;
}

void FairShare::CountWork(const std::string& job_id, WorkKind kind, std::uint64_t size,
                          Duration worker_cpu) {
  const auto job = jobs_.find(job_id);
  if (job == jobs_.end() || size == 0) return;
  const double weight = std::clamp(Seconds(worker_cpu), kLeastWeight, kMostWeight);
  const double one = weight / static_cast<double>(size);
  std::optional<double>& known = job->second.weight_of_one[static_cast<std::size_t>(kind)];
  known = known ? *known + kNewest * (one - *known) : one;
}

}  // namespace lucerna
