// A worker: takes batches of photons from its coordinator, traces them, and returns what they
// brought. Keeps nothing that cannot be fetched again.
//
// Exit: 0 after SIGTERM or SIGINT, 2 for wrong flags, 3 when no coordinator answers, 4 when the
// coordinator refuses this worker, 1 for anything else.
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <string_view>
#include <thread>
#include <utility>

#include <CLI/CLI.hpp>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include "render/base/clock.h"
#include "render/base/escape.h"
#include "render/base/fail_point.h"
#include "render/base/memory.h"
#include "render/base/random_id.h"
#include "render/base/version.h"
#include "render/geometry/numeric_profile.h"
#include "render/wire/channel.h"
#include "render/wire/grpc_process.h"
#include "render/wire/metrics.h"
#include "render/wire/security_flags.h"
#include "worker/replay.h"
#include "worker/session.h"

namespace lucerna {
namespace {

constexpr int kExitFailed = 1;
constexpr int kExitUsage = 2;
constexpr int kExitUnreachable = 3;
constexpr int kExitRefused = 4;
constexpr long kSignalLookNanos = 100'000'000;

int ExitCodeFor(const Status& status) {
  if (status.ok()) return 0;
  if (absl::IsUnavailable(status)) return kExitUnreachable;
  if (absl::IsFailedPrecondition(status) || absl::IsUnauthenticated(status) ||
      absl::IsPermissionDenied(status)) {
    return kExitRefused;
  }
  return kExitFailed;
}

std::string WorkerName() {
  char host[256] = "";
  gethostname(host, sizeof(host) - 1);
  return absl::StrCat(host, ":", getpid());
}

int Work(Session::Options options, const std::string& metrics_address) {
  // Both signals wait to be asked for, in this thread and in every thread it starts.
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);

  Session session(std::move(options), SystemClock());
  std::unique_ptr<MetricsListener> metrics;
  if (!metrics_address.empty()) {
    StatusOr<std::unique_ptr<MetricsListener>> started = MetricsListener::Start(
        metrics_address, [&](MetricsPage& page) { session.counts().Fill(page); });
    if (!started.ok()) {
      std::fprintf(stderr, "lucerna-worker: --metrics: %s\n",
                   std::string(started.status().message()).c_str());
      return kExitUnreachable;
    }
    metrics = *std::move(started);
    std::printf("metrics at http://%s/metrics\n", metrics->address().c_str());
    std::fflush(stdout);
  }
  std::atomic<bool> has_ended = false;
  std::thread listener([&] {
    const timespec look = {0, kSignalLookNanos};
    while (!has_ended) {
      if (sigtimedwait(&signals, nullptr, &look) < 0) continue;
      spdlog::info("ending");
      session.Stop();
      return;
    }
  });
  const Status status = session.Run();
  has_ended = true;
  listener.join();
  if (!status.ok()) {
    std::fprintf(stderr, "lucerna-worker: %s\n",
                 EscapedLines(std::string(status.message())).c_str());
  }
  return ExitCodeFor(status);
}

// Writes what a photon did to the standard output, as a message for `lucerna trace-photon`.
int ReplayPhoton(const ReplayOptions& options) {
  const StatusOr<v1::PhotonPath> path = Replay(options);
  if (!path.ok()) {
    std::fprintf(stderr, "lucerna-worker: %s\n",
                 EscapedLines(std::string(path.status().message())).c_str());
    return ExitCodeFor(path.status());
  }
  const std::string bytes = path->SerializeAsString();
  const bool is_written = std::fwrite(bytes.data(), 1, bytes.size(), stdout) == bytes.size() &&
                          std::fflush(stdout) == 0;
  return is_written ? 0 : kExitFailed;
}

int Main(int argc, char** argv) {
  Session::Options options;
  ReplayOptions replay;
  options.name = WorkerName();
  options.numeric_profile = NumericProfile();
  options.identity = RandomId();
  std::string log_level = "info";
  double connect_timeout_s = 60;
  options.server.address = "127.0.0.1:7400";
  std::string token_file;
  std::string metrics;
  CLI::App app("Lucerna's worker: traces batches of photons for a coordinator.");
  app.set_version_flag("--version", absl::StrCat("lucerna-worker ", Version()));
  app.add_option("--server", options.server.address, "HOST:PORT of the coordinator")
      ->capture_default_str();
  AddTlsFlags(app, options.server.tls);
  app.add_option("--token-file", token_file,
                 "file that holds this worker's token (default: what LUCERNA_TOKEN says)");
  app.add_option("--threads", options.threads, "threads to trace with; 0: all")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  app.add_option("--connect-timeout", connect_timeout_s,
                 "how long to wait for a coordinator that does not answer [s]")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  app.add_option("--metrics", metrics,
                 "HOST:PORT at which GET /metrics tells Prometheus what this worker does; port 0 "
                 "picks a free one")
      ->check([](const std::string& address) {
        return IsAddress(address) ? "" : "give HOST:PORT, such as 127.0.0.1:7481";
      });
  app.add_option("--log-level", log_level, "debug, info, warn, error or off")
      ->check(CLI::IsMember({"debug", "info", "warn", "error", "off"}))
      ->capture_default_str();
  CLI::Option* job =
      app.add_option("--replay", replay.job_id,
                     "trace one photon of this job again, write its way to stdout, end");
  app.add_option("--pass", replay.pass, "of the photon to replay, from 0")->needs(job);
  app.add_option("--index", replay.index, "of the photon to replay in its pass, from 0")
      ->needs(job);
  std::string help = "--help";
  if (argc == 2 && std::string_view(argv[1]) == "help") argv[1] = help.data();
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kExitUsage;
  }
  if (!IsAddress(options.server.address)) {
    std::fprintf(stderr,
                 "lucerna-worker: --server \"%s\": give HOST:PORT, such as 127.0.0.1:7400\n",
                 options.server.address.c_str());
    return kExitUsage;
  }
  StatusOr<std::string> token = ReadToken(token_file, std::getenv("LUCERNA_TOKEN"));
  if (token.ok()) options.server.token = *std::move(token);
  const Status security = token.ok() ? CheckSecurity(options.server) : token.status();
  if (!security.ok()) {
    std::fprintf(stderr, "lucerna-worker: %s\n", std::string(security.message()).c_str());
    return kExitUsage;
  }
  options.connect_timeout =
      std::chrono::duration_cast<Duration>(std::chrono::duration<double>(connect_timeout_s));
  if (const char* const fail_point = std::getenv("LUCERNA_FAIL_POINT")) ArmFailPoint(fail_point);
  spdlog::set_default_logger(spdlog::stderr_color_mt("lucerna-worker"));
  spdlog::set_level(spdlog::level::from_str(log_level));
  TakeGrpcErrors([](const std::string& message) { spdlog::debug("gRPC: {}", Escaped(message)); });
  if (*job) {
    replay.server = options.server;
    replay.connect_timeout = options.connect_timeout;
    replay.numeric_profile = options.numeric_profile;
    return ReplayPhoton(replay);
  }
  return Work(std::move(options), metrics);
}

}  // namespace
}  // namespace lucerna

int main(int argc, char** argv) {
  lucerna::KeepFreedMemory();
  return lucerna::Main(argc, argv);
}
