#include "client/checkpoints.h"

#include <filesystem>
#include <system_error>

#include <fcntl.h>
#include <unistd.h>

#include "client/exit_code.h"

namespace lucerna {
namespace {

// Whether a coordinator that lives has the folder: the database in it is locked then.
bool IsInUse(const std::string& folder) {
  const int file = open(absl::StrCat(folder, "/lucerna.db").c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return false;
  struct flock lock = {};
  lock.l_type = F_WRLCK;
  lock.l_whence = SEEK_SET;
  const bool is_locked = fcntl(file, F_GETLK, &lock) == 0 && lock.l_type != F_UNLCK;
  close(file);
  return is_locked;
}

}  // namespace

std::string CheckpointFolderOf(const std::string& output) {
  std::error_code error;
  const auto type = std::filesystem::status(output, error).type();
  const bool is_file =
      type == std::filesystem::file_type::regular || type == std::filesystem::file_type::not_found;
  return is_file ? output + ".checkpoints" : "";
}

bool HasCheckpoints(const std::string& folder) {
  std::error_code ignored;
  return !folder.empty() && std::filesystem::exists(folder, ignored);
}

Status OpenCheckpoints(const std::string& folder, bool resumes, const std::string& what) {
  if (!folder.empty() && IsInUse(folder)) {
    return absl::FailedPreconditionError(
        absl::StrCat(folder,
                     ": a command that runs keeps its photons there for the same output; "
                     "wait for its end, or name another file with -o"));
  }
  if (resumes && !HasCheckpoints(folder)) {
    return absl::FailedPreconditionError(absl::StrCat(folder, ": there is no interrupted ", what,
                                                      " to go on with; leave --resume away"));
  }
  std::error_code ignored;
  if (!resumes && !folder.empty()) std::filesystem::remove_all(folder, ignored);
  return absl::OkStatus();
}

Status CloseCheckpoints(const std::string& folder, bool resumes, const Status& status) {
  if (folder.empty()) return status;
  // A process that died, or is silent, says nothing about the job.
  if (absl::IsInternal(status)) {
    return absl::InternalError(
        absl::StrCat(std::string(status.message()), "\nthe same command with --resume goes on"));
  }
  if (ExitCodeOf(status) == ExitCode::kUnreachable || (resumes && !status.ok())) return status;
  std::error_code ignored;
  std::filesystem::remove_all(folder, ignored);
  return status;
}

}  // namespace lucerna
