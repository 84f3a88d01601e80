#include "server/state/blob_files.h"

#include <filesystem>
#include <system_error>
#include <utility>
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

StatusOr<std::unique_ptr<BlobFiles>> BlobFiles::Open(const std::string& folder,
                                                     std::shared_ptr<DiskBudget> budget) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    return absl::UnavailableError(absl::StrCat(folder, ": cannot create: ", error.message()));
  }
  for (const auto& file : FilesIn(folder)) {
    if (IsUnfinished(file.path().native())) ::unlink(file.path().c_str());
  }
  budget->CountFolder(folder);
  return std::unique_ptr<BlobFiles>(new BlobFiles(folder, std::move(budget)));
}

std::string BlobFiles::PathOf(const Digest& digest) const {
  return absl::StrCat(folder_, "/", digest.Hex());
}

Status BlobFiles::Put(const Digest& digest, std::string_view bytes) {
  if (Has(digest) && Get(digest).ok()) return absl::OkStatus();
  return budget_->Write(PathOf(digest), {&bytes, 1}, "blob");
}

StatusOr<std::string> BlobFiles::Get(const Digest& digest) const {
  const std::string path = PathOf(digest);
  LUCERNA_ASSIGN_OR_RETURN(std::string bytes, ReadFile(path));
  if (Sha256(bytes) == digest) return bytes;
  budget_->Remove(path);
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
    if (!names.contains(name) && !IsUnfinished(name)) budget_->Remove(file.path());
  }
}

std::uint64_t BlobFiles::SizeOf(const std::set<Digest>& digests) const {
  std::uint64_t bytes = 0;
  for (const Digest& digest : digests)
    bytes += SizeOfFile(PathOf(digest));
  return bytes;
}

}  // namespace lucerna
