// What does a coordinator keep on its disk, in one folder?
//
//   lucerna.db      all jobs, and workers that are lent nothing (StateStore)
//   blobs/          their scene files, references and images, by digest (BlobFiles)
//   checkpoints/    sums of jobs that go on from them (CheckpointFiles)
//
// A job's files are on the disk before its row says so, and are removed after the row: whatever is
// killed when, rows never name a file that was not written, and files without a row are removed by
// KeepOnly.
//
// Threads: any.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "render/base/status.h"
#include "server/job_journal.h"
#include "server/job_table.h"
#include "server/state/blob_files.h"
#include "server/state/checkpoint_files.h"
#include "server/state/disk_budget.h"
#include "server/state/state_store.h"
#include "server/worker_records.h"

namespace lucerna {

class DurableState final : public JobJournal {
 public:
  // Makes the folder unless it is there. `new_instance` names a new one for good, `moment` is now,
  // and its files may have `max_bytes` together; 0: no limit.
  // Errors: as StateStore::Open, with the folder.
  [[nodiscard]] static StatusOr<std::unique_ptr<DurableState>> Open(const std::string& folder,
                                                                    const std::string& new_instance,
                                                                    const Moment& moment,
                                                                    std::uint64_t max_bytes = 0);

  [[nodiscard]] const std::string& folder() const { return folder_; }
  // In front of the ids of its jobs.
  [[nodiscard]] const std::string& instance() const { return store_->instance(); }
  [[nodiscard]] BlobFiles& blobs() { return *blobs_; }
  [[nodiscard]] CheckpointFiles& checkpoints() { return *checkpoints_; }
  [[nodiscard]] const DiskBudget& budget() const { return *budget_; }
  // Whether a file of `bytes` could be written if all files but those that are needed were removed.
  [[nodiscard]] bool MayHaveRoom(std::uint64_t bytes, const JobTable::NeededFiles& needed) const;

  // The jobs of earlier processes. Once.
  [[nodiscard]] std::vector<JournalEntry> TakeJobs() { return std::move(jobs_); }
  // Larger than the numbers of all jobs there have been, when it was opened.
  [[nodiscard]] std::uint64_t next_serial() const { return next_serial_; }
  // A sentence for each job or worker whose row cannot be read; such rows stay as they are.
  [[nodiscard]] const std::vector<std::string>& problems() const { return problems_; }

  // Workers that were lent nothing in earlier processes. Once.
  [[nodiscard]] std::vector<WorkerStanding> TakeWorkers() { return std::move(workers_); }
  // Keeps these, and nothing of those that are active. Waits for the disk. Errors: as
  // StateStore::Save.
  [[nodiscard]] Status SaveWorkers(const std::vector<WorkerStanding>& standings);

  // Errors: Refusal of what StateStore says.
  [[nodiscard]] Written BeginSave(const JournalEntry& entry, Duration running) override;
  [[nodiscard]] Written BeginRemove(std::uint64_t serial) override;

  // When `why` keeps bytes from the disk: what a running job shows ("paused: no room in DIR; ..."),
  // and what a new job is refused with.
  [[nodiscard]] std::string PauseCondition(const Status& why) const;
  [[nodiscard]] Status Refusal(const Status& why) const;

 private:
  DurableState(std::string folder, std::uint64_t max_bytes)
      : folder_(std::move(folder)), budget_(std::make_shared<DiskBudget>(max_bytes)) {}
  // Where what `why` says has no room.
  [[nodiscard]] std::string NoRoom(const Status& why) const;
  [[nodiscard]] Status Load(const Moment& moment);

  const std::string folder_;
  const std::shared_ptr<DiskBudget> budget_;
  std::unique_ptr<StateStore> store_;
  std::unique_ptr<BlobFiles> blobs_;
  std::unique_ptr<CheckpointFiles> checkpoints_;
  std::vector<JournalEntry> jobs_;
  std::vector<WorkerStanding> workers_;
  std::uint64_t next_serial_ = 1;
  std::vector<std::string> problems_;
};

}  // namespace lucerna
