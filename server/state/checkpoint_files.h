// From where can a job go on after a crash?
//
// A checkpoint is three pieces of bytes: what it is of, the job's record, and its runner's sums,
// each with its length and its digest. Each job has two files, which are written in turn: beside
// the name, synced, renamed. A crash while one is written leaves the other, and so does a file
// whose bytes are damaged later. What does not have its digest is never used.
//
// Threads: any; one at a time for one job.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "render/base/mutex.h"
#include "render/base/status.h"
#include "server/state/disk_budget.h"

namespace lucerna {

struct Checkpoint {
  std::string numeric_profile;  // sums of another one are of no use
  std::string record;           // of the job, as it was then
  std::string sums;             // of its runner
  bool operator==(const Checkpoint&) const = default;
};
// One that is to be written: its sums lie in pieces, which are not copied.
struct CheckpointPieces {
  std::string numeric_profile;
  std::string record;
  std::vector<std::string_view> sums;
};

class CheckpointFiles {
 public:
  // Makes the folder unless it is there, and removes what a crash left unfinished.
  // Errors: what the system said.
  [[nodiscard]] static StatusOr<std::unique_ptr<CheckpointFiles>> Open(
      const std::string& folder,
      std::shared_ptr<DiskBudget> budget = std::make_shared<DiskBudget>());

  // Replaces the older of the job's two. A job of an earlier process must have been Read before.
  // Errors: as DiskBudget::Write; then the two are as they were.
  [[nodiscard]] Status Write(const std::string& job_id, const CheckpointPieces& checkpoint);

  // Of the file that it is written to [bytes].
  [[nodiscard]] static std::uint64_t SizeAsFile(const CheckpointPieces& checkpoint);

  // Reads the checkpoints of a job, the newer first, one at a time, and hands them to `use` until
  // it says that it has used one. Returns a sentence for each file that is no whole checkpoint.
  [[nodiscard]] std::vector<std::string> Read(const std::string& job_id,
                                              const std::function<bool(Checkpoint)>& use);
  // Whether there is a file, damaged or not.
  [[nodiscard]] bool Has(const std::string& job_id) const;

  // Removes those of all jobs but these.
  void KeepOnly(const std::set<std::string>& job_ids);
  // Of the checkpoints of these jobs [bytes].
  [[nodiscard]] std::uint64_t SizeOf(const std::set<std::string>& job_ids) const;

 private:
  CheckpointFiles(std::string folder, std::shared_ptr<DiskBudget> budget)
      : folder_(std::move(folder)), budget_(std::move(budget)) {}
  [[nodiscard]] std::string PathOf(const std::string& job_id, int slot) const;

  // Where the newest that can be used is, and its number.
  struct Newest {
    int slot = 1;
    std::uint64_t number = 0;
  };
  const std::string folder_;
  const std::shared_ptr<DiskBudget> budget_;
  Mutex mutex_;
  std::map<std::string, Newest> newest_ LUCERNA_GUARDED_BY(mutex_);  // by job
};

}  // namespace lucerna
