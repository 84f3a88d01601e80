#include "server/state/durable_state.h"

#include <filesystem>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include "absl/strings/str_format.h"

#include "server/job_message.h"

namespace lucerna {
namespace {

constexpr const char* kQuarantined = "quarantined";
constexpr const char* kDraining = "draining";

// The database does not see flipped bits in its rows.
Digest DigestOf(const StoredJob& row, std::string_view record) {
  return Sha256(
      absl::StrCat(row.serial, "\n", row.turn, "\n", row.request_id, "\n", std::string(record)));
}

}  // namespace

StatusOr<std::unique_ptr<DurableState>> DurableState::Open(const std::string& folder,
                                                           const std::string& new_instance,
                                                           const Moment& moment,
                                                           std::uint64_t max_bytes) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    return absl::UnavailableError(absl::StrCat(folder, ": cannot create: ", error.message()));
  }
  auto state = std::unique_ptr<DurableState>(new DurableState(folder, max_bytes));
  // First, because it keeps other coordinators out.
  const std::string database = folder + "/lucerna.db";
  LUCERNA_ASSIGN_OR_RETURN(state->store_, StateStore::Open(database, new_instance));
  state->budget_->AddGrowing(database);
  state->budget_->AddGrowing(database + "-wal");
  LUCERNA_ASSIGN_OR_RETURN(state->blobs_, BlobFiles::Open(folder + "/blobs", state->budget_));
  LUCERNA_ASSIGN_OR_RETURN(state->checkpoints_,
                           CheckpointFiles::Open(folder + "/checkpoints", state->budget_));
  LUCERNA_RETURN_IF_ERROR(state->Load(moment));
  return state;
}

Status DurableState::Load(const Moment& moment) {
  LUCERNA_ASSIGN_OR_RETURN(const std::vector<StoredJob> rows, store_->Load());
  LUCERNA_ASSIGN_OR_RETURN(next_serial_, store_->NextSerial());
  for (const StoredJob& row : rows) {
    const auto put_aside = [&](std::string_view why) {
      problems_.push_back(absl::StrCat("job ", instance(), "-", row.serial, " cannot be read from ",
                                       folder_, "/lucerna.db: ", std::string(why)));
    };
    const std::string_view bytes = row.record;
    if (bytes.size() < Digest::kSize ||
        DigestOf(row, bytes.substr(Digest::kSize)).Bytes() != bytes.substr(0, Digest::kSize)) {
      put_aside("its row is damaged");
      continue;
    }
    StatusOr<DecodedRecord> record = DecodeRecord(std::string(bytes.substr(Digest::kSize)), moment);
    if (!record.ok()) {
      put_aside(std::string(record.status().message()));
      continue;
    }
    JournalEntry entry;
    entry.serial = row.serial;
    entry.turn = row.turn;
    entry.request_id = row.request_id;
    entry.job = std::move(record->job);
    entry.image_digest = record->image;
    const JobState life = entry.job.life.state();
    entry.has_checkpoint = life != JobState::kCancelled && life != JobState::kFailed &&
                           checkpoints_->Has(entry.job.id);
    jobs_.push_back(std::move(entry));
  }
  LUCERNA_ASSIGN_OR_RETURN(const std::vector<StoredWorker> workers, store_->LoadWorkers());
  for (const StoredWorker& row : workers) {
    if (row.state != kQuarantined && row.state != kDraining) {
      problems_.push_back(absl::StrCat("worker ", row.id, " cannot be read from ", folder_,
                                       "/lucerna.db: its state is \"", row.state, "\""));
      continue;
    }
    workers_.push_back(
        {.id = row.id,
         .name = row.name,
         .state = row.state == kDraining ? WorkerState::kDraining : WorkerState::kQuarantined,
         .reason = row.reason,
         .has_lied = row.has_lied});
  }
  return absl::OkStatus();
}

Status DurableState::SaveWorkers(const std::vector<WorkerStanding>& standings) {
  std::vector<StoredWorker> saved;
  std::vector<std::string> removed;
  for (const WorkerStanding& standing : standings) {
    if (standing.state == WorkerState::kActive) {
      removed.push_back(standing.id);
      continue;
    }
    saved.push_back({.id = standing.id,
                     .state = standing.state == WorkerState::kDraining ? kDraining : kQuarantined,
                     .name = standing.name,
                     .reason = standing.reason,
                     .has_lied = standing.has_lied});
  }
  return store_->SaveWorkers(saved, removed);
}

JobJournal::Written DurableState::BeginSave(const JournalEntry& entry, Duration running) {
  StoredJob row;
  row.serial = entry.serial;
  row.request_id = entry.request_id;
  row.turn = entry.turn;
  row.name = entry.job.name;
  row.state = NameOf(entry.job.life.state());
  const std::string record = EncodeRecord(entry.job, entry.image_digest, running);
  row.record = absl::StrCat(std::string(DigestOf(row, record).Bytes()), record);
  return [this, written = store_->BeginSave(std::move(row))] {
    const Status saved = written();
    return saved.ok() ? saved : Refusal(saved);
  };
}

JobJournal::Written DurableState::BeginRemove(std::uint64_t serial) {
  return store_->BeginRemove(serial);
}

bool DurableState::MayHaveRoom(std::uint64_t bytes, const JobTable::NeededFiles& needed) const {
  if (budget_->max_bytes() == 0) return true;
  const std::uint64_t lasting = budget_->growing_bytes() + blobs_->SizeOf(needed.blobs) +
                                checkpoints_->SizeOf(needed.checkpoints);
  return lasting <= budget_->max_bytes() && bytes <= budget_->max_bytes() - lasting;
}

std::string DurableState::NoRoom(const Status& why) const {
  if (!IsOverDiskLimit(why)) return absl::StrCat("no room in ", folder_);
  return absl::StrFormat("no room in %s within --max-disk (%.1f MB)", folder_,
                         static_cast<double>(budget_->max_bytes()) / 1e6);
}

std::string DurableState::PauseCondition(const Status& why) const {
  if (absl::IsResourceExhausted(why)) {
    return absl::StrCat("paused: ", NoRoom(why), "; it goes on when there is");
  }
  return absl::StrCat("paused: ", folder_, " cannot be written (", std::string(why.message()),
                      "); it goes on when it can");
}

Status DurableState::Refusal(const Status& why) const {
  if (absl::IsResourceExhausted(why)) {
    return absl::ResourceExhaustedError(absl::StrCat(
        "the coordinator takes no job now: there is ", NoRoom(why), "; ",
        IsOverDiskLimit(why) ? "delete jobs that are not needed, or wait for some, and submit again"
                             : "make room there, or delete jobs that are not needed, and submit "
                               "again"));
  }
  return absl::FailedPreconditionError(absl::StrCat("the coordinator takes no job now: ", folder_,
                                                    " cannot be written (",
                                                    std::string(why.message()), ")"));
}

}  // namespace lucerna
