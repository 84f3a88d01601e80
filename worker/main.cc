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
#include <spdlog/spdlog.h>
#include <unistd.h>

#include "render/base/clock.h"
#include "render/base/console.h"
#include "render/base/escape.h"
#include "render/base/fail_point.h"
#include "render/base/memory.h"
#include "render/base/open_ssl.h"
#include "render/base/random_id.h"
#include "render/base/version.h"
#include "render/geometry/numeric_profile.h"
#include "render/wire/channel.h"
#include "render/wire/grpc_process.h"
#include "render/wire/metrics.h"
#include "render/wire/program_log.h"
#include "render/wire/security_flags.h"
#include "render/wire/service_flags.h"
#include "render/wire/service_manager.h"
#include "worker/replay.h"
#include "worker/session.h"

namespace lucerna {
namespace {

constexpr char kProgram[] = "lucerna-worker";
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

int Work(Session::Options options, const std::string& metrics_address, LogFormat format) {
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
      SayWhyItEnds(kProgram, absl::StrCat("--metrics: ", started.status().message()), format);
      return kExitUnreachable;
    }
    metrics = *std::move(started);
    std::printf("metrics at http://%s/metrics\n", metrics->address().c_str());
    std::fflush(stdout);
  }
  std::atomic<bool> has_ended = false;
  std::thread listener([&] {
    // That it runs at all. Whether it works off what it was lent, the coordinator watches.
    ServiceManager manager(SystemClock());
    const timespec look = {0, kSignalLookNanos};
    while (!has_ended) {
      manager.SayAlive();
      if (sigtimedwait(&signals, nullptr, &look) < 0) continue;
      manager.SayEnding();
      spdlog::info("ending");
      session.Stop();
      return;
    }
  });
  const Status status = session.Run();
  has_ended = true;
  listener.join();
  if (!status.ok()) SayWhyItEnds(kProgram, EscapedLines(std::string(status.message())), format);
  return ExitCodeFor(status);
}

// Writes what photons did to the standard output, as a message for `lucerna trace-photon`.
int ReplayPhoton(const ReplayOptions& options) {
  const StatusOr<v1::PhotonPaths> paths = Replay(options);
  if (!paths.ok()) {
    PrintError(
        absl::StrCat(kProgram, ": ", EscapedLines(std::string(paths.status().message())), "\n"));
    return ExitCodeFor(paths.status());
  }
  const std::string bytes = paths->SerializeAsString();
  const bool is_written = std::fwrite(bytes.data(), 1, bytes.size(), stdout) == bytes.size() &&
                          std::fflush(stdout) == 0;
  return is_written ? 0 : kExitFailed;
}

constexpr std::pair<std::string_view, std::string_view> kExits[] = {
    {"0", "It was ended by SIGTERM or SIGINT."},
    {"1", "Anything else."},
    {"2", "The command line is wrong."},
    {"3", "No coordinator answers."},
    {"4", "The coordinator refuses this worker: another build, or no right to work."},
};

constexpr ServiceManual kManual = {
    .program = kProgram,
    .summary = "worker of Lucerna, a distributed renderer",
    .description =
        "Takes batches of photons and passes from the coordinator, traces them and returns what "
        "they brought. It keeps nothing that cannot be fetched again, and may be started and "
        "killed at any time. Its log goes to the standard error.",
    .signals = "SIGTERM and SIGINT make it give back what it holds and end.",
    .exit_codes = kExits,
    .example = "lucerna-worker --server farm.example:7400 --threads 8",
    .see_also = "lucerna(1), lucerna-server(1)",
};

int Main(int argc, char** argv) {
  Session::Options options;
  ReplayOptions replay;
  options.name = WorkerName();
  options.numeric_profile = NumericProfile();
  options.identity = RandomId();
  LogFlags log;
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
  AddLogFlags<CLI::IsMember>(app, log);
  CLI::Option* job =
      app.add_option("--replay", replay.job_id,
                     "trace photons of this job again, write their ways to stdout, end");
  app.add_option("--pass", replay.pass, "of the photons to replay, from 0")->needs(job);
  app.add_option("--index", replay.index, "of the first photon to replay in its pass, from 0")
      ->needs(job);
  app.add_option("--count", replay.count, "how many photons to replay")->needs(job);
  if (const auto code = ParseServiceFlags<CLI::ParseError>(app, argc, argv, kManual, kExitUsage)) {
    return *code;
  }
  if (!IsAddress(options.server.address)) {
    PrintError(absl::StrCat(kProgram, ": --server \"", options.server.address,
                            "\": give HOST:PORT, such as 127.0.0.1:7400\n"));
    return kExitUsage;
  }
  StatusOr<std::string> token = ReadToken(token_file, std::getenv("LUCERNA_TOKEN"));
  if (token.ok()) options.server.token = *std::move(token);
  const Status security = token.ok() ? CheckSecurity(options.server) : token.status();
  if (!security.ok()) {
    PrintError(absl::StrCat(kProgram, ": ", security.message(), "\n"));
    return kExitUsage;
  }
  options.connect_timeout =
      std::chrono::duration_cast<Duration>(std::chrono::duration<double>(connect_timeout_s));
  if (const char* const fail_point = std::getenv("LUCERNA_FAIL_POINT")) ArmFailPoint(fail_point);
  StartLog(kProgram, log.level, log.of_lines());
  TakeGrpcErrors([](const std::string& message) { spdlog::debug("gRPC: {}", Escaped(message)); });
  if (*job) {
    replay.server = options.server;
    replay.connect_timeout = options.connect_timeout;
    replay.numeric_profile = options.numeric_profile;
    return ReplayPhoton(replay);
  }
  return Work(std::move(options), metrics, log.of_lines());
}

}  // namespace
}  // namespace lucerna

int main(int argc, char** argv) {
  lucerna::ReadLocale();
  lucerna::KeepFreedMemory();
  lucerna::KeepOpenSsl();
  return lucerna::Main(argc, argv);
}
