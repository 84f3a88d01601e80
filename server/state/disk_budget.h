// How many bytes do the files of a coordinator's state take, and may there be more?
//
// Files are written and removed through the budget, which counts them. Files that another library
// writes (the database) are counted as large as they are, and are never refused. While a file is
// replaced, the old one and the new one both count, as both are on the disk. Sizes are those of
// files; what a file system needs besides is not counted.
//
// Threads: any.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "render/base/mutex.h"
#include "render/base/status.h"

namespace lucerna {

class DiskBudget {
 public:
  // 0: no limit.
  explicit DiskBudget(std::uint64_t max_bytes = 0) : max_bytes_(max_bytes) {}

  // The file at `path` grows and shrinks by itself. Before any other thread calls.
  void AddGrowing(std::string path) { growing_.push_back(std::move(path)); }
  // Counts the files that are in the folder, also beyond the limit. Before any other thread calls.
  void CountFolder(const std::string& folder);

  // As lucerna::WriteFile. Errors: also IsOverDiskLimit; then nothing has changed.
  [[nodiscard]] Status Write(const std::string& path, std::span<const std::string_view> pieces,
                             std::string_view step);
  // Nothing when there is no such file.
  void Remove(const std::string& path);

  [[nodiscard]] std::uint64_t max_bytes() const { return max_bytes_; }
  [[nodiscard]] std::uint64_t used_bytes() const;
  [[nodiscard]] std::uint64_t growing_bytes() const;
  // Whether a file of so many bytes may be written.
  [[nodiscard]] bool HasRoom(std::uint64_t bytes) const;

 private:
  [[nodiscard]] std::uint64_t UsedLocked() const LUCERNA_REQUIRES(mutex_);
  [[nodiscard]] bool HasRoomLocked(std::uint64_t bytes) const LUCERNA_REQUIRES(mutex_);

  const std::uint64_t max_bytes_;
  std::vector<std::string> growing_;
  mutable Mutex mutex_;
  std::uint64_t counted_bytes_ LUCERNA_GUARDED_BY(mutex_) = 0;
};

[[nodiscard]] Status OverDiskLimitError(const std::string& message);
// Whether a file was refused for the budget's sake and not by the disk. Such an error is
// RESOURCE_EXHAUSTED too.
[[nodiscard]] bool IsOverDiskLimit(const Status& status);

// Of the file at `path` [bytes]; 0 when there is none.
[[nodiscard]] std::uint64_t SizeOfFile(const std::string& path);

}  // namespace lucerna
