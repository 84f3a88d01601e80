#include "server/security_files.h"

#include <utility>

#include <spdlog/spdlog.h>

#include "render/base/escape.h"
#include "render/base/mutex.h"

namespace lucerna {
namespace {

constexpr Duration kLookEvery = std::chrono::seconds(1);
constexpr Duration kRepeatEvery = std::chrono::seconds(10);
constexpr Duration kExpiresSoon = std::chrono::hours(24 * 14);

// Whether `line` is another than before, or was last written long ago.
bool IsNews(const std::string& line) {
  static Mutex mutex;
  static std::string last_line;
  static SteadyTime last_at;
  const SteadyTime now = SystemClock().Steady();
  const MutexLock lock(mutex);
  if (line == last_line && now - last_at < kRepeatEvery) return false;
  last_line = line;
  last_at = now;
  return true;
}

bool Contains(const std::string& text, const char* part) {
  return text.find(part) != std::string::npos;
}

}  // namespace

SecurityFiles::SecurityFiles(TlsFiles tls, Access& access, const Clock& clock)
    : tls_(std::move(tls)), access_(access), clock_(clock) {}

void SecurityFiles::Tick() {
  if (clock_.Steady() < look_at_) return;
  look_at_ = clock_.Steady() + kLookEvery;
  if (!tls_.empty()) LookAtCertificates();
  const StatusOr<bool> tokens = access_.Reread();
  if (!tokens.ok()) {
    spdlog::error("--tokens {}; the tokens stay as they were",
                  Escaped(std::string(tokens.status().message())));
  } else if (*tokens) {
    spdlog::info("the tokens were read again");
  }
}

void SecurityFiles::LookAtCertificates() {
  const WallTime now = clock_.Wall();
  const StatusOr<CertificateFacts> facts = CheckTlsFiles(tls_, now);
  const bool is_late = facts.ok() && facts->valid_until - now < kExpiresSoon;
  std::string line =
      facts.ok() ? absl::StrCat("the certificate of ", facts->common_name, " is valid until ",
                                UtcText(facts->valid_until))
                 : absl::StrCat("new connections fail: ", std::string(facts.status().message()));
  if (is_late) line += "; renew it";
  if (line == said_) return;
  said_ = line;
  spdlog::log(!facts.ok() ? spdlog::level::err
              : is_late   ? spdlog::level::warn
                          : spdlog::level::info,
              "{}", Escaped(line));
}

void LogGrpcError(const std::string& message) {
  std::string line = absl::StrCat("gRPC: ", message);
  if (Contains(message, "peer did not return a certificate")) {
    line = "a connection was refused: the other side showed no certificate";
  } else if (Contains(message, "certificate verify failed")) {
    line =
        "a connection was refused: the certificate of the other side is not of the authority in "
        "--tls-ca, or it has expired";
  } else if (Contains(message, "wrong version number") || Contains(message, "http request")) {
    line = "a connection was refused: the other side does not use TLS";
  } else if (Contains(message, "No match found for server name")) {
    // Of the server's own certificate, which the client judges.
    return;
  }
  if (IsNews(line)) spdlog::warn("{}", Escaped(line));
}

}  // namespace lucerna
