#include "server/state/blob_files.h"

#include <filesystem>
#include <system_error>
#include <vector>

#include <unistd.h>

#include "render/base/files.h"

namespace lucerna {
namespace {

// In any order. A folder that cannot be read has none.
std::vector<std::filesystem::directory_entry> FilesIn(const std::string& folder) {
  std::error_code error;
  std::vector<std::filesystem::directory_entry> files;
  for (auto file = std::filesystem::directory_iterator(folder, error);
       !error && file != std::filesystem::directory_iterator(); file.increment(error)) {
    files.push_back(*file);
  }
  return files;
}

}  // namespace

StatusOr<std::unique_ptr<BlobFiles>> BlobFiles::Open(const std::string& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    return absl::UnavailableError(absl::StrCat(folder, ": cannot create: ", error.message()));
  }
  for (const auto& file : FilesIn(folder)) {
    if (IsUnfinished(file.path().native())) ::unlink(file.path().c_str());
  }
  return std::unique_ptr<BlobFiles>(new BlobFiles(folder));
}

std::string BlobFiles::PathOf(const Digest& digest) const {
  return absl::StrCat(folder_, "/", digest.Hex());
}

Status BlobFiles::Put(const Digest& digest, std::string_view bytes) {
  if (Has(digest) && Get(digest).ok()) return absl::OkStatus();
  return WriteFile(PathOf(digest), bytes, "blob");
}

StatusOr<std::string> BlobFiles::Get(const Digest& digest) const {
  const std::string path = PathOf(digest);
  LUCERNA_ASSIGN_OR_RETURN(std::string bytes, ReadFile(path));
  if (Sha256(bytes) == digest) return bytes;
  ::unlink(path.c_str());
  return absl::DataLossError(
      absl::StrCat(path, ": the bytes on the disk are damaged; the file is removed"));
}

bool BlobFiles::Has(const Digest& digest) const {
  std::error_code error;
  return std::filesystem::is_regular_file(PathOf(digest), error);
}

void BlobFiles::KeepOnly(const std::set<Digest>& needed) {
  std::set<std::string> names;
  for (const Digest& digest : needed)
    names.insert(digest.Hex());
  for (const auto& file : FilesIn(folder_)) {
    const std::string name = file.path().filename();
    if (!names.contains(name) && !IsUnfinished(name)) ::unlink(file.path().c_str());
  }
}

}  // namespace lucerna
