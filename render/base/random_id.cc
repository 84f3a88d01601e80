#include "render/base/random_id.h"

#include <cerrno>

#include "absl/strings/escaping.h"
#include <sys/random.h>
#include <sys/types.h>

#include "render/base/status.h"

namespace lucerna {
namespace {

constexpr std::size_t kIdBytes = 16;

}  // namespace

std::string RandomBytes(std::size_t count) {
  std::string bytes(count, '\0');
  std::size_t done = 0;
  while (done < count) {
    const ssize_t got = getrandom(bytes.data() + done, count - done, 0);
    // A signal may interrupt it; there is no other error that arguments like these can have.
    LUCERNA_CHECK(got >= 0 || errno == EINTR);
    if (got > 0) done += static_cast<std::size_t>(got);
  }
  return bytes;
}

std::string RandomId() {
  return absl::BytesToHexString(RandomBytes(kIdBytes));
}

}  // namespace lucerna
