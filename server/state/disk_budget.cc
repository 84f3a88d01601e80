#include "server/state/disk_budget.h"

#include <filesystem>
#include <system_error>

#include <unistd.h>

#include "render/base/files.h"

namespace lucerna {
namespace {

// Marks a status, so that it is told from that of a disk that is full.
constexpr const char* kOverLimit = "lucerna/over-disk-limit";

}  // namespace

Status OverDiskLimitError(const std::string& message) {
  Status status = absl::ResourceExhaustedError(message);
  status.SetPayload(kOverLimit, absl::Cord());
  return status;
}

bool IsOverDiskLimit(const Status& status) {
  return status.GetPayload(kOverLimit).has_value();
}

std::uint64_t SizeOfFile(const std::string& path) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  return error ? 0 : size;
}

void DiskBudget::CountFolder(const std::string& folder) {
  const MutexLock lock(mutex_);
  std::error_code error;
  for (auto file = std::filesystem::directory_iterator(folder, error);
       !error && file != std::filesystem::directory_iterator(); file.increment(error)) {
    counted_bytes_ += SizeOfFile(file->path());
  }
}

std::uint64_t DiskBudget::growing_bytes() const {
  std::uint64_t bytes = 0;
  for (const std::string& path : growing_)
    bytes += SizeOfFile(path);
  return bytes;
}

std::uint64_t DiskBudget::UsedLocked() const {
  return counted_bytes_ + growing_bytes();
}

std::uint64_t DiskBudget::used_bytes() const {
  const MutexLock lock(mutex_);
  return UsedLocked();
}

bool DiskBudget::HasRoomLocked(std::uint64_t bytes) const {
  if (max_bytes_ == 0) return true;
  const std::uint64_t used = UsedLocked();
  return used <= max_bytes_ && bytes <= max_bytes_ - used;
}

bool DiskBudget::HasRoom(std::uint64_t bytes) const {
  const MutexLock lock(mutex_);
  return HasRoomLocked(bytes);
}

Status DiskBudget::Write(const std::string& path, std::span<const std::string_view> pieces,
                         std::string_view step) {
  std::uint64_t bytes = 0;
  for (const std::string_view piece : pieces)
    bytes += piece.size();
  {
    const MutexLock lock(mutex_);
    if (!HasRoomLocked(bytes)) {
      return OverDiskLimitError(absl::StrCat(path, ": ", bytes, " bytes do not fit: ", UsedLocked(),
                                             " of ", max_bytes_, " bytes are in use"));
    }
    counted_bytes_ += bytes;
  }
  const std::uint64_t replaced = SizeOfFile(path);
  const Status written = WriteFile(path, pieces, step);
  const MutexLock lock(mutex_);
  counted_bytes_ -= written.ok() ? replaced : bytes;
  return written;
}

void DiskBudget::Remove(const std::string& path) {
  const std::uint64_t size = SizeOfFile(path);
  // Of two threads that remove one file, one finds it.
  if (::unlink(path.c_str()) != 0) return;
  const MutexLock lock(mutex_);
  counted_bytes_ -= size;
}

}  // namespace lucerna
