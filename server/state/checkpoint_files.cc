#include "server/state/checkpoint_files.h"

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <optional>
#include <span>
#include <string_view>
#include <system_error>
#include <utility>

#include <unistd.h>

#include "render/base/digest.h"
#include "render/base/files.h"

namespace lucerna {
namespace {

// With the version of the format, and of what the sums mean: a checkpoint of another version is not
// used.
constexpr std::string_view kMagic = "Lucerna checkpoint 14\n";
constexpr std::size_t kNumberBytes = sizeof(std::uint64_t);
constexpr int kSlots = 2;

std::string BytesOf(std::uint64_t number) {
  return {reinterpret_cast<const char*>(&number), kNumberBytes};
}

std::uint64_t NumberOf(std::string_view bytes) {
  std::uint64_t number = 0;
  std::memcpy(&number, bytes.data(), kNumberBytes);
  return number;
}

// The length and the digest of a piece, which lies in parts.
std::string HeadOf(std::span<const std::string_view> parts) {
  Sha256Stream digest;
  std::uint64_t size = 0;
  for (const std::string_view part : parts) {
    digest.Add(part);
    size += part.size();
  }
  return BytesOf(size) + std::string(digest.Finish().Bytes());
}
std::string HeadOf(std::string_view piece) {
  return HeadOf(std::span(&piece, 1));
}
constexpr std::size_t kHeadBytes = kNumberBytes + Digest::kSize;

// The next piece of a file, taken off its front; absent when it is truncated or damaged.
std::optional<std::string_view> TakePiece(std::string_view& rest) {
  if (rest.size() < kHeadBytes) return std::nullopt;
  const std::uint64_t size = NumberOf(rest);
  const std::string_view digest = rest.substr(kNumberBytes, Digest::kSize);
  rest.remove_prefix(kHeadBytes);
  if (size > rest.size()) return std::nullopt;
  const std::string_view piece = rest.substr(0, size);
  rest.remove_prefix(size);
  if (Sha256(piece).Bytes() != digest) return std::nullopt;
  return piece;
}

// What a file begins with: its number and a numeric profile. Absent when it is not whole.
struct Beginning {
  std::uint64_t number = 0;
  std::string numeric_profile;
};
std::optional<Beginning> TakeBeginning(std::string_view& bytes) {
  if (!bytes.starts_with(kMagic)) return std::nullopt;
  bytes.remove_prefix(kMagic.size());
  const auto head = TakePiece(bytes);
  if (!head || head->size() < kNumberBytes) return std::nullopt;
  return Beginning{NumberOf(*head), std::string(head->substr(kNumberBytes))};
}
// It has no more bytes than this.
constexpr std::size_t kMostBeginning = std::size_t{1} << 16;

// Absent when the bytes are not a whole checkpoint. They become its sums.
std::optional<Checkpoint> Decode(std::string bytes) {
  std::string_view rest = bytes;
  std::optional<Beginning> beginning = TakeBeginning(rest);
  if (!beginning) return std::nullopt;
  const auto record = TakePiece(rest);
  if (!record) return std::nullopt;
  const auto sums = TakePiece(rest);
  if (!sums || !rest.empty()) return std::nullopt;
  Checkpoint checkpoint = {std::move(beginning->numeric_profile), std::string(*record), {}};
  bytes.erase(0, bytes.size() - sums->size());
  checkpoint.sums = std::move(bytes);
  return checkpoint;
}

}  // namespace

StatusOr<std::unique_ptr<CheckpointFiles>> CheckpointFiles::Open(
    const std::string& folder, std::shared_ptr<DiskBudget> budget) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    return absl::UnavailableError(absl::StrCat(folder, ": cannot create: ", error.message()));
  }
  for (const auto& file : std::filesystem::directory_iterator(folder, error)) {
    if (IsUnfinished(file.path().native())) ::unlink(file.path().c_str());
  }
  budget->CountFolder(folder);
  return std::unique_ptr<CheckpointFiles>(new CheckpointFiles(folder, std::move(budget)));
}

std::string CheckpointFiles::PathOf(const std::string& job_id, int slot) const {
  return absl::StrCat(folder_, "/", job_id, ".", slot);
}

Status CheckpointFiles::Write(const std::string& job_id, const CheckpointPieces& checkpoint) {
  Newest next;
  {
    const MutexLock lock(mutex_);
    const Newest& newest = newest_[job_id];
    next = {(newest.slot + 1) % kSlots, newest.number + 1};
  }
  const std::string head = BytesOf(next.number) + checkpoint.numeric_profile;
  LUCERNA_CHECK(kMagic.size() + kHeadBytes + head.size() <= kMostBeginning);
  const std::string head_head = HeadOf(head);
  const std::string record_head = HeadOf(checkpoint.record);
  const std::string sums_head = HeadOf(checkpoint.sums);
  std::vector<std::string_view> pieces = {kMagic,      head_head,         head,
                                          record_head, checkpoint.record, sums_head};
  pieces.insert(pieces.end(), checkpoint.sums.begin(), checkpoint.sums.end());
  LUCERNA_RETURN_IF_ERROR(budget_->Write(PathOf(job_id, next.slot), pieces, "checkpoint"));
  const MutexLock lock(mutex_);
  newest_[job_id] = next;
  return absl::OkStatus();
}

std::uint64_t CheckpointFiles::SizeAsFile(const CheckpointPieces& checkpoint) {
  std::uint64_t bytes = kMagic.size() + 3 * kHeadBytes + kNumberBytes +
                        checkpoint.numeric_profile.size() + checkpoint.record.size();
  for (const std::string_view piece : checkpoint.sums)
    bytes += piece.size();
  return bytes;
}

std::vector<std::string> CheckpointFiles::Read(const std::string& job_id,
                                               const std::function<bool(Checkpoint)>& use) {
  std::vector<std::string> damaged;
  std::vector<Newest> there;
  const auto is_damaged = [&](const std::string& path, const Status& why) {
    damaged.push_back(why.ok() ? absl::StrCat(path, " is damaged, or of another version of Lucerna")
                               : std::string(why.message()));
  };
  for (int slot = 0; slot < kSlots; ++slot) {
    const std::string path = PathOf(job_id, slot);
    const StatusOr<std::string> bytes = ReadFileStart(path, kMostBeginning);
    if (absl::IsNotFound(bytes.status())) continue;
    std::string_view rest = bytes.ok() ? std::string_view(*bytes) : std::string_view();
    if (const auto beginning = TakeBeginning(rest)) {
      there.push_back({slot, beginning->number});
    } else {
      is_damaged(path, bytes.status());
    }
  }
  std::ranges::sort(there, std::ranges::greater(), &Newest::number);
  bool is_newest = true;
  bool is_used = false;
  for (const Newest& file : there) {
    const std::string path = PathOf(job_id, file.slot);
    StatusOr<std::string> bytes = ReadFile(path);
    std::optional<Checkpoint> checkpoint = bytes.ok() ? Decode(*std::move(bytes)) : std::nullopt;
    if (!checkpoint) {
      is_damaged(path, bytes.status());
      continue;
    }
    if (std::exchange(is_newest, false)) {
      const MutexLock lock(mutex_);
      newest_[job_id] = file;
    }
    // Others are read all the same: whether a disk damages files is to be said before they are
    // needed.
    is_used = is_used || use(*std::move(checkpoint));
  }
  if (is_newest) {
    const MutexLock lock(mutex_);
    newest_[job_id] = Newest();
  }
  return damaged;
}

bool CheckpointFiles::Has(const std::string& job_id) const {
  std::error_code error;
  return std::filesystem::exists(PathOf(job_id, 0), error) ||
         std::filesystem::exists(PathOf(job_id, 1), error);
}

void CheckpointFiles::KeepOnly(const std::set<std::string>& job_ids) {
  std::error_code error;
  std::vector<std::filesystem::path> dropped;
  for (const auto& file : std::filesystem::directory_iterator(folder_, error)) {
    if (!job_ids.contains(file.path().stem()) && !IsUnfinished(file.path().native())) {
      dropped.push_back(file.path());
    }
  }
  for (const auto& path : dropped)
    budget_->Remove(path);
}

std::uint64_t CheckpointFiles::SizeOf(const std::set<std::string>& job_ids) const {
  std::uint64_t bytes = 0;
  for (const std::string& job_id : job_ids) {
    for (int slot = 0; slot < kSlots; ++slot)
      bytes += SizeOfFile(PathOf(job_id, slot));
  }
  return bytes;
}

}  // namespace lucerna
