#include "render/base/files.h"

#include <atomic>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "render/base/fail_point.h"

namespace lucerna {
namespace {

Status FromErrno(int error, const std::string& path, const char* doing) {
  const std::string message = absl::StrCat(path, ": ", doing, ": ", std::strerror(error));
  switch (error) {
    case ENOENT:
    case ENOTDIR:
      return absl::NotFoundError(message);
    case EACCES:
    case EPERM:
    case EROFS:
      return absl::PermissionDeniedError(message);
    case ENOSPC:
    case EDQUOT:
    case EFBIG:
      return absl::ResourceExhaustedError(message);
    case EISDIR:
    case EINVAL:
      return absl::InvalidArgumentError(message);
    default:
      return absl::UnavailableError(message);
  }
}

constexpr std::string_view kTemporarySuffix = ".tmp";

// An open descriptor that closes itself.
class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor() {
    if (number_ >= 0) ::close(number_);
  }
  Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  [[nodiscard]] int number() const { return number_; }
  // Closing can be the call that reports a full disk.
  [[nodiscard]] int Close() { return ::close(std::exchange(number_, -1)); }

 private:
  int number_;
};

std::string FolderOf(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  if (slash == std::string::npos) return ".";
  return slash == 0 ? "/" : path.substr(0, slash);
}

// The file behind a link, so that it is the file that is replaced and not the link: /dev/stdout
// is one, and would be lost to the whole machine.
std::string BehindLinks(const std::string& path) {
  std::error_code error;
  const std::filesystem::path target = std::filesystem::canonical(path, error);
  return error ? path : target.string();
}

// Two writers of one path in one process do not share a temporary name.
std::string TemporaryBeside(const std::string& path) {
  static std::atomic<unsigned> serial = 0;
  return absl::StrCat(path, ".", ::getpid(), ".", serial++, std::string(kTemporarySuffix));
}

Status WriteAll(int descriptor, std::string_view bytes, const std::string& path) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
    if (written < 0) {
      if (errno == EINTR) continue;
      return FromErrno(errno, path, "cannot write");
    }
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return absl::OkStatus();
}

Status WriteAndSync(int descriptor, std::span<const std::string_view> pieces,
                    const std::string& path) {
  for (const std::string_view piece : pieces)
    LUCERNA_RETURN_IF_ERROR(WriteAll(descriptor, piece, path));
  if (::fsync(descriptor) != 0) return FromErrno(errno, path, "cannot write");
  return absl::OkStatus();
}

struct OpenFile {
  Descriptor descriptor;
  std::uint64_t size = 0;  // [bytes]
};

// Errors: as ReadFile.
StatusOr<OpenFile> OpenToRead(const std::string& path) {
  // Not blocking, so that a pipe in place of a file is refused below instead of waited for.
  OpenFile file{Descriptor(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK))};
  if (file.descriptor.number() < 0) return FromErrno(errno, path, "cannot open");
  struct stat status {};
  if (::fstat(file.descriptor.number(), &status) != 0) return FromErrno(errno, path, "cannot read");
  if (!S_ISREG(status.st_mode)) {
    return absl::InvalidArgumentError(absl::StrCat(path, ": not a regular file"));
  }
  file.size = static_cast<std::uint64_t>(status.st_size);
  return file;
}

// So many from its beginning; fewer when it has become shorter.
StatusOr<std::string> ReadBytes(const OpenFile& file, std::uint64_t size, const std::string& path) {
  std::string bytes(size, '\0');
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t got = ::read(file.descriptor.number(), bytes.data() + done, bytes.size() - done);
    if (got < 0) {
      if (errno == EINTR) continue;
      return FromErrno(errno, path, "cannot read");
    }
    if (got == 0) break;
    done += static_cast<std::size_t>(got);
  }
  bytes.resize(done);
  return bytes;
}

}  // namespace

StatusOr<std::string> ReadFile(const std::string& path, std::uint64_t max_size_bytes) {
  LUCERNA_ASSIGN_OR_RETURN(const OpenFile file, OpenToRead(path));
  if (file.size > max_size_bytes) {
    return absl::ResourceExhaustedError(absl::StrCat(
        path, ": ", file.size, " bytes, more than the ", max_size_bytes, " that are allowed"));
  }
  return ReadBytes(file, file.size, path);
}

StatusOr<std::string> ReadFileStart(const std::string& path, std::uint64_t most_bytes) {
  LUCERNA_ASSIGN_OR_RETURN(const OpenFile file, OpenToRead(path));
  return ReadBytes(file, std::min(file.size, most_bytes), path);
}

Status WriteFile(const std::string& path, std::string_view bytes, std::string_view step) {
  return WriteFile(path, std::span<const std::string_view>(&bytes, 1), step);
}

Status WriteFile(const std::string& path, std::span<const std::string_view> pieces,
                 std::string_view step) {
  const auto reach = [&](const char* part) {
    if (!step.empty()) FailPoint(absl::StrCat(std::string(step), part));
  };
  // A device or a pipe cannot be replaced by a rename; it takes the bytes as they come.
  struct stat existing {};
  if (::stat(path.c_str(), &existing) == 0 && !S_ISREG(existing.st_mode)) {
    Descriptor device(::open(path.c_str(), O_WRONLY | O_CLOEXEC));
    if (device.number() < 0) return FromErrno(errno, path, "cannot open");
    for (const std::string_view piece : pieces)
      LUCERNA_RETURN_IF_ERROR(WriteAll(device.number(), piece, path));
    return absl::OkStatus();
  }

  const std::string target = BehindLinks(path);
  const std::string temporary = TemporaryBeside(target);
  Descriptor file(::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
  if (file.number() < 0) return FromErrno(errno, path, "cannot create");
  Status status = WriteAndSync(file.number(), pieces, path);
  if (file.Close() != 0 && status.ok()) status = FromErrno(errno, path, "cannot write");
  if (status.ok()) reach(".synced");
  if (status.ok() && ::rename(temporary.c_str(), target.c_str()) != 0) {
    status = FromErrno(errno, path, "cannot replace");
  }
  if (!status.ok()) {
    ::unlink(temporary.c_str());
    return status;
  }
  // The rename itself is on the disk only when the folder is.
  Descriptor folder(::open(FolderOf(target).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (folder.number() >= 0) ::fsync(folder.number());
  reach(".renamed");
  return absl::OkStatus();
}

bool IsUnfinished(std::string_view path) {
  return path.ends_with(kTemporarySuffix);
}

bool IsSameFile(const std::string& a, const std::string& b) {
  const auto real = [](const std::string& path) {
    std::error_code error;
    std::filesystem::path absolute = std::filesystem::absolute(path, error);
    std::filesystem::path found = std::filesystem::weakly_canonical(absolute, error);
    return error ? absolute : found;
  };
  return real(a) == real(b);
}

Status CheckWritable(const std::string& path) {
  struct stat existing {};
  if (::stat(path.c_str(), &existing) == 0) {
    if (S_ISDIR(existing.st_mode)) return FromErrno(EISDIR, path, "cannot write");
    if (!S_ISREG(existing.st_mode)) return absl::OkStatus();
  }
  const std::string folder = FolderOf(BehindLinks(path));
  if (::access(folder.c_str(), W_OK | X_OK) != 0) return FromErrno(errno, path, "cannot create");
  return absl::OkStatus();
}

}  // namespace lucerna
