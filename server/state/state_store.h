// Which jobs has a coordinator had, in all its lives, and which workers does it lend nothing?
//
// One row a job in an SQLite database, written through to the disk before a call returns: what was
// saved outlives a crash and a power cut, and a row is as it was before a call or as it is after
// it. Changes of several threads that come while the disk is busy share one transaction, and so one
// sync of the disk: the first of these threads that waits writes them all. The record of a job is
// bytes to this class; the columns beside it are what order and requests need, and what people look
// up. Workers have rows of their own while they are in quarantine or drained. One process at a time
// may have the database open.
//
// Threads: any.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "render/base/mutex.h"
#include "render/base/status.h"

struct sqlite3;
struct sqlite3_stmt;

namespace lucerna {

struct StoredJob {
  std::uint64_t serial = 0;  // > 0
  std::string request_id;    // of no other job
  std::uint64_t turn = 0;    // jobs that wait are rendered in this order
  std::string name, state;   // for people
  std::string record;
  bool operator==(const StoredJob&) const = default;
};

struct StoredWorker {
  std::string id;     // of its record
  std::string state;  // "quarantined" or "draining"
  std::string name, reason;
  bool has_lied = false;
  bool operator==(const StoredWorker&) const = default;
};

class StateStore {
 public:
  // Makes the database unless it is there. `new_instance` is what a new one is called for good.
  // Errors: FAILED_PRECONDITION when another process uses it or it is of a newer version of
  // Lucerna, DATA_LOSS when it is damaged, else as Save.
  [[nodiscard]] static StatusOr<std::unique_ptr<StateStore>> Open(const std::string& path,
                                                                  const std::string& new_instance);
  ~StateStore();
  StateStore(const StateStore&) = delete;
  StateStore& operator=(const StateStore&) = delete;

  // In front of the ids of its jobs.
  [[nodiscard]] const std::string& instance() const { return instance_; }

  // Adds the job, or replaces what was saved of it, or of a job with its request id.
  // Errors: RESOURCE_EXHAUSTED when the disk is full, PERMISSION_DENIED when it may not be written,
  // UNAVAILABLE for other faults of it. Then nothing has changed.
  [[nodiscard]] Status Save(StoredJob job) { return BeginSave(std::move(job))(); }
  // Errors: as Save.
  [[nodiscard]] Status Remove(std::uint64_t serial) { return BeginRemove(serial)(); }

  // The same in two steps. Changes are made in the order of these calls, which do not wait for the
  // disk; what they return waits, is called once, and says what became of the change. The store
  // outlives it.
  using Written = std::function<Status()>;
  [[nodiscard]] Written BeginSave(StoredJob job);
  [[nodiscard]] Written BeginRemove(std::uint64_t serial);

  // Adds or replaces the rows of some workers and removes those of others, all or nothing; rows
  // that are not there are removed already. Waits for the disk. Errors: as Save.
  [[nodiscard]] Status SaveWorkers(std::span<const StoredWorker> saved,
                                   std::span<const std::string> removed);
  // By id. Errors: DATA_LOSS.
  [[nodiscard]] StatusOr<std::vector<StoredWorker>> LoadWorkers() const;

  // All jobs, by serial number. Errors: DATA_LOSS.
  [[nodiscard]] StatusOr<std::vector<StoredJob>> Load() const;
  // Larger than that of any job there has been, removed ones too. Errors: DATA_LOSS.
  [[nodiscard]] StatusOr<std::uint64_t> NextSerial() const;

 private:
  StateStore(std::string path, sqlite3* database) : path_(std::move(path)), database_(database) {}

  class Statement;
  struct Change {
    bool removes = false;
    StoredJob job;
    bool is_done = false;  // guarded by queue_mutex_
    Status result;         // set before that
  };
  [[nodiscard]] Written Begin(Change change);
  [[nodiscard]] Status WaitFor(const std::shared_ptr<Change>& change);
  // Sets the results.
  void Write(const std::vector<std::shared_ptr<Change>>& changes);
  // In one transaction: all or none.
  [[nodiscard]] Status WriteTogether(std::span<const std::shared_ptr<Change>> changes)
      LUCERNA_REQUIRES(mutex_);
  [[nodiscard]] Status Make(const Change& change) LUCERNA_REQUIRES(mutex_);
  // Ends a transaction with COMMIT, or without a change when what came before has failed.
  [[nodiscard]] Status EndTransaction(Status result) LUCERNA_REQUIRES(mutex_);
  [[nodiscard]] Status Run(const char* sql) const LUCERNA_REQUIRES(mutex_);
  [[nodiscard]] Status Fault() const LUCERNA_REQUIRES(mutex_);
  [[nodiscard]] Status SetUp(const std::string& new_instance) LUCERNA_REQUIRES(mutex_);
  [[nodiscard]] StatusOr<std::int64_t> Number(const char* sql) const LUCERNA_REQUIRES(mutex_);

  const std::string path_;
  mutable Mutex mutex_;
  sqlite3* const database_;
  std::string instance_;  // set once

  Mutex queue_mutex_;
  Condition written_;
  bool is_writing_ LUCERNA_GUARDED_BY(queue_mutex_) = false;
  std::vector<std::shared_ptr<Change>> queue_ LUCERNA_GUARDED_BY(queue_mutex_);
};

}  // namespace lucerna
