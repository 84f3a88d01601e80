// What does a table of jobs write down, so that a later process finds it?
//
// Implemented by server/state/; the table of jobs needs no more of it, and its tests no disk.
#pragma once

#include <cstdint>
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
  // On the disk when it returns. `running` is the time that the job has run.
  // Errors: as StateStore::Save; then nothing has changed.
  [[nodiscard]] virtual Status Save(const JournalEntry& entry, Duration running) = 0;
  // Errors: as Save.
  [[nodiscard]] virtual Status Remove(std::uint64_t serial) = 0;
};

}  // namespace lucerna
