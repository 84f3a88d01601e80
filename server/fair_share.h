// Which job's work is lent next, when several have some?
//
//   1. A job of the highest priority.
//   2. Among equals, a job of the owner to whom least has been lent.
//   3. Among jobs of one owner, the one to which least has been lent.
//
// What is lent is weighed by the processor time that workers say such work took, per photon or pass
// of that job; before the first result of a job, a lease of it weighs as much as the one before it.
// Only work lent while owners compete counts: who had nothing to lend for a while begins again
// where the others are by then, neither with a credit nor with a debt. So jobs and owners of one
// priority that always have work to lend never differ by more than one lease each, and none of them
// starves; jobs of lower priority are lent what those of higher priority leave over.
//
// Pure; locking is the caller's. There are a few jobs at a time, and each call looks at all of
// them.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "render/base/clock.h"
#include "server/batch.h"

namespace lucerna {

class FairShare {
 public:
  struct Claim {
    int priority = 0;
    std::string owner = {};
  };
  // A job without a claim has priority 0 and nobody's name.
  void SetClaim(const std::string& job_id, Claim claim);
  // Nothing of a held job is lent.
  void SetHeld(const std::string& job_id, bool is_held);
  [[nodiscard]] bool IsHeld(const std::string& job_id) const;
  // Whether there is work to lend.
  void SetLendable(const std::string& job_id, bool is_lendable);
  void Forget(const std::string& job_id);

  // The job to lend from; absent when no job that is not held has work to lend.
  [[nodiscard]] std::optional<std::string> Next() const;
  // So much of it was lent.
  void CountLent(const std::string& job_id, WorkKind kind, std::uint64_t size);
  // A lease of so much came back and took `worker_cpu`, as the worker says; any value is taken.
  void CountWork(const std::string& job_id, WorkKind kind, std::uint64_t size, Duration worker_cpu);

 private:
  struct JobShare {
    Claim claim;
    bool is_held = false;
    bool is_lendable = false;
    double lent = 0;                                     // weight
    std::array<std::optional<double>, 2> weight_of_one;  // [kinds]
    [[nodiscard]] bool competes() const { return is_lendable && !is_held; }
  };
  struct OwnerShare {
    double lent = 0;  // weight
    double here = 0;  // `lent` of the job that was lent last
  };
  using Rank = std::pair<int, std::string>;  // of an owner's jobs of one priority
  static Rank RankOf(const JobShare& job) { return {job.claim.priority, job.claim.owner}; }

  // Makes `change`, which may let the job compete.
  template <typename Change>
  void Update(const std::string& job_id, const Change& change);
  [[nodiscard]] bool HasCompetitor(const Rank& rank) const;

  std::map<std::string, JobShare> jobs_;
  std::map<Rank, OwnerShare> owners_;
  std::map<int, double> here_;    // by priority: `lent` of the owner that was lent last
  double weight_of_a_lease_ = 1;  // of the newest
};

}  // namespace lucerna
