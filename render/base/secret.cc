#include "render/base/secret.h"

#include <cerrno>
#include <cstring>

#include <openssl/crypto.h>
#include <sys/stat.h>

namespace lucerna {

bool IsSameSecret(std::string_view a, std::string_view b) {
  return a.size() == b.size() && CRYPTO_memcmp(a.data(), b.data(), a.size()) == 0;
}

Status CheckPrivate(const std::string& path) {
  struct stat facts {};
  if (::stat(path.c_str(), &facts) != 0) {
    return absl::NotFoundError(absl::StrCat(path, ": ", std::strerror(errno)));
  }
  // A device or a pipe (/dev/stdin, a shell's <(...)) keeps nothing.
  if (S_ISREG(facts.st_mode) && (facts.st_mode & (S_IROTH | S_IWOTH)) != 0) {
    return absl::InvalidArgumentError(
        absl::StrCat(path, ": every user may read or write this file; chmod 600 it"));
  }
  return absl::OkStatus();
}

}  // namespace lucerna
