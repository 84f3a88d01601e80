#include "server/state/checkpoint_files.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>
#include <optional>
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
constexpr std::string_view kMagic = "Lucerna checkpoint 5\n";
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

// The length and the digest of a piece.
std::string HeadOf(std::string_view piece) {
  return BytesOf(piece.size()) + std::string(Sha256(piece).Bytes());
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

struct Numbered {
  std::uint64_t number = 0;
  Checkpoint checkpoint;
};

// Absent when the bytes are not a whole checkpoint.
std::optional<Numbered> Decode(std::string_view bytes) {
  if (!bytes.starts_with(kMagic)) return std::nullopt;
  bytes.remove_prefix(kMagic.size());
  const auto head = TakePiece(bytes);
  if (!head || head->size() < kNumberBytes) return std::nullopt;
  const auto record = TakePiece(bytes);
  if (!record) return std::nullopt;
  const auto sums = TakePiece(bytes);
  if (!sums || !bytes.empty()) return std::nullopt;
  Numbered result;
  result.number = NumberOf(*head);
  result.checkpoint = {std::string(head->substr(kNumberBytes)), std::string(*record),
                       std::string(*sums)};
  return result;
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

Status CheckpointFiles::Write(const std::string& job_id, const Checkpoint& checkpoint) {
  Newest next;
  {
    const MutexLock lock(mutex_);
    const Newest& newest = newest_[job_id];
    next = {(newest.slot + 1) % kSlots, newest.number + 1};
  }
  const std::string head = BytesOf(next.number) + checkpoint.numeric_profile;
  const std::string head_head = HeadOf(head);
  const std::string record_head = HeadOf(checkpoint.record);
  const std::string sums_head = HeadOf(checkpoint.sums);
  const std::array<std::string_view, 7> pieces = {
      kMagic, head_head, head, record_head, checkpoint.record, sums_head, checkpoint.sums};
  LUCERNA_RETURN_IF_ERROR(budget_->Write(PathOf(job_id, next.slot), pieces, "checkpoint"));
  const MutexLock lock(mutex_);
  newest_[job_id] = next;
  return absl::OkStatus();
}

std::uint64_t CheckpointFiles::SizeAsFile(const Checkpoint& checkpoint) {
  return kMagic.size() + 3 * kHeadBytes + kNumberBytes + checkpoint.numeric_profile.size() +
         checkpoint.record.size() + checkpoint.sums.size();
}

CheckpointFiles::Found CheckpointFiles::Read(const std::string& job_id) {
  Found found;
  std::vector<std::pair<Newest, Checkpoint>> usable;
  for (int slot = 0; slot < kSlots; ++slot) {
    const std::string path = PathOf(job_id, slot);
    const StatusOr<std::string> bytes = ReadFile(path);
    if (absl::IsNotFound(bytes.status())) continue;
    std::optional<Numbered> decoded = bytes.ok() ? Decode(*bytes) : std::nullopt;
    if (decoded) {
      usable.emplace_back(Newest{slot, decoded->number}, std::move(decoded->checkpoint));
    } else {
      found.damaged.push_back(
          bytes.ok() ? absl::StrCat(path, " is damaged, or of another version of Lucerna")
                     : std::string(bytes.status().message()));
    }
  }
  std::ranges::sort(usable, std::ranges::greater(),
                    [](const auto& item) { return item.first.number; });
  {
    const MutexLock lock(mutex_);
    newest_[job_id] = usable.empty() ? Newest() : usable.front().first;
  }
  for (auto& [newest, checkpoint] : usable)
    found.newest_first.push_back(std::move(checkpoint));
  return found;
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
