// What does a table of jobs write down, so that a later process finds it?
//
// Implemented by server/state/; the table of jobs needs no more of it, and its tests no disk.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "render/base/clock.h"
#include "render/base/digest.h"
#include "render/base/status.h"
#include "server/job.h"

namespace lucerna {

// A job as it stands in a table, and beside it.
struct JournalEntry {
  std::uint64_t serial = 0;
  std::uint64_t turn = 0;  // jobs that wait are rendered in this order
  std::string request_id;
  Job job;
  std::optional<Digest> image_digest;  // of the EXR file of a job that succeeded, on the disk
  // Whether a job that succeeded has its photons on the disk, to go on from.
  bool has_checkpoint = false;
};

class JobJournal {
 public:
  virtual ~JobJournal() = default;

  // Waits until a change is on the disk. To be called once, without a lock that others need.
  // Errors: as StateStore::Save; then nothing has changed.
  using Written = std::function<Status()>;

  // Changes reach the disk in the order of these calls, which do not wait for it. `running` is the
  // time that the job has run. The journal outlives what they return.
  [[nodiscard]] virtual Written BeginSave(const JournalEntry& entry, Duration running) = 0;
  [[nodiscard]] virtual Written BeginRemove(std::uint64_t serial) = 0;
};

}  // namespace lucerna
