// The coordinator: takes jobs from users, lends batches to workers, and keeps the images.
//
// Says "listening on ADDRESS:PORT" on stdout once it accepts calls; everything else it has to say
// is a log line on stderr. SIGTERM and SIGINT end it in order.
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <optional>
#include <ratio>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/health_check_service_interface.h>
#include <spdlog/sinks/ringbuffer_sink.h>
#include <spdlog/spdlog.h>

#include "render/base/byte_size.h"
#include "render/base/certificate.h"
#include "render/base/clock.h"
#include "render/base/console.h"
#include "render/base/escape.h"
#include "render/base/fail_point.h"
#include "render/base/memory.h"
#include "render/base/open_ssl.h"
#include "render/base/version.h"
#include "render/geometry/numeric_profile.h"
#include "render/wire/channel.h"
#include "render/wire/grpc_process.h"
#include "render/wire/program_log.h"
#include "render/wire/security_flags.h"
#include "render/wire/service_flags.h"
#include "render/wire/service_manager.h"
#include "server/acceptor.h"
#include "server/access.h"
#include "server/admin_service.h"
#include "server/asset_service.h"
#include "server/coordinator.h"
#include "server/image_service.h"
#include "server/job_service.h"
#include "server/listener.h"
#include "server/metrics.h"
#include "server/replay_service.h"
#include "server/security_files.h"
#include "server/state/durable_state.h"
#include "server/web/web_listener.h"
#include "server/work_pool.h"
#include "server/worker_service.h"

namespace lucerna {
namespace {

constexpr char kProgram[] = "lucerna-server";
constexpr int kExitUsage = 2;
constexpr int kExitNoState = 1;
constexpr int kExitCannotListen = 3;
// For commits whose bytes are on their way when the process is to end.
constexpr std::chrono::seconds kTimeForCommits{5};
constexpr long kTickNanos = 50'000'000;
// Of the log, for the page.
constexpr std::size_t kLogLines = 200;

struct Flags {
  std::string listen = "127.0.0.1:7400";
  std::string listen_workers;
  std::string metrics;
  std::string web;
  TlsFiles tls;
  std::string tokens;
  bool offers_reflection = false;
  std::size_t max_connections_per_address = 16384;
  bool allow_insecure_network = false;
  LogFlags log;
  std::string state;
  std::uint64_t max_disk_bytes = 0;
  double keep_days = 0;
  Coordinator::Options coordinator;
};

using LogLines = spdlog::sinks::ringbuffer_sink_mt;

// Both signals wait to be asked for, in this thread and in every thread it starts.
sigset_t BlockEndSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  return signals;
}

int Serve(const Flags& flags, const std::shared_ptr<LogLines>& log) {
  const auto say_why = [&](const std::string& message) {
    SayWhyItEnds(kProgram, message, flags.log.of_lines());
  };
  const sigset_t end_signals = BlockEndSignals();
  KeepGrpc();
  RaiseDescriptorLimit();
  const Clock& clock = SystemClock();
  std::unique_ptr<DurableState> state;
  if (!flags.state.empty()) {
    StatusOr<std::unique_ptr<DurableState>> opened = DurableState::Open(
        flags.state, absl::StrCat(absl::Hex(clock.Wall().time_since_epoch().count() / 1000)),
        {clock.Steady(), ProcessCpuTime(), clock.Wall()}, flags.max_disk_bytes);
    if (!opened.ok()) {
      say_why(absl::StrCat("--state ", flags.state, ": ", opened.status().message()));
      return kExitNoState;
    }
    state = *std::move(opened);
  }
  StatusOr<std::unique_ptr<Access>> access = Access::Open(flags.tokens);
  if (!access.ok()) {
    say_why(absl::StrCat("--tokens ", EscapedLines(std::string(access.status().message()))));
    return kExitUsage;
  }
  Coordinator coordinator(flags.coordinator, clock, std::move(state));
  WorkPools pools;
  AssetService assets(coordinator.blobs(), coordinator.budget(), pools, &coordinator.transfers(),
                      **access);
  JobService jobs(coordinator, pools, SystemClock(), **access);
  ImageService images(coordinator, pools, **access);
  WorkerService workers(coordinator, pools, **access);
  AdminService admin(coordinator, clock);

  grpc::EnableDefaultHealthCheckService(true);
  if (flags.offers_reflection) grpc::reflection::InitProtoReflectionServerBuilderPlugin();
  std::vector<grpc::Service*> for_clients = {&assets, &jobs, &images, &admin};
  std::vector<grpc::Service*> for_workers = {&workers};
  const bool is_one = flags.listen_workers.empty();
  ReplayService replays(workers);
  if (is_one) {
    for_clients.insert(for_clients.end(), for_workers.begin(), for_workers.end());
  } else {
    for_clients.push_back(&replays);
  }
  CallLatencies latencies(clock);
  CallLatencies* const measured = flags.metrics.empty() ? nullptr : &latencies;
  std::vector<Listener::Options> wanted;
  wanted.push_back({flags.listen, flags.tls, access->get(), std::move(for_clients),
                    flags.max_connections_per_address, measured});
  if (!is_one) {
    wanted.push_back({flags.listen_workers, flags.tls, access->get(), std::move(for_workers),
                      flags.max_connections_per_address, measured});
  }
  std::vector<std::unique_ptr<Listener>> listeners;
  for (const Listener::Options& options : wanted) {
    StatusOr<std::unique_ptr<Listener>> listener = Listener::Start(options);
    if (!listener.ok()) {
      say_why(absl::StrCat("cannot listen on ", options.address, " (", listener.status().message(),
                           "); is the port in use, or the address not of this machine?"));
      return kExitCannotListen;
    }
    listeners.push_back(*std::move(listener));
  }
  for (std::size_t i = 0; i < listeners.size(); ++i) {
    std::printf("%s %s\n", i == 0 ? "listening on" : "listening for workers on",
                listeners[i]->address().c_str());
  }
  std::unique_ptr<MetricsListener> metrics;
  if (!flags.metrics.empty()) {
    StatusOr<std::unique_ptr<MetricsListener>> started = MetricsListener::Start(
        flags.metrics, [&](MetricsPage& page) { FillMetrics(coordinator, latencies, page); });
    if (!started.ok()) {
      say_why(absl::StrCat("--metrics: ", started.status().message()));
      return kExitCannotListen;
    }
    metrics = *std::move(started);
    std::printf("metrics at http://%s/metrics\n", metrics->address().c_str());
  }
  std::unique_ptr<WebListener> web;
  if (!flags.web.empty()) {
    StatusOr<std::unique_ptr<WebListener>> started = WebListener::Start(
        coordinator, {flags.web, access->get(), [log] { return log->last_formatted(); }});
    if (!started.ok()) {
      say_why(absl::StrCat("--web: ", started.status().message()));
      return kExitCannotListen;
    }
    web = *std::move(started);
    std::printf("page at http://%s/\n", web->address().c_str());
  }
  std::fflush(stdout);
  spdlog::info("numeric profile: {}", flags.coordinator.numeric_profile);

  SecurityFiles security(flags.tls, **access, clock);
  ServiceManager manager(clock);
  manager.SayReady();
  const timespec tick = {0, kTickNanos};
  while (sigtimedwait(&end_signals, nullptr, &tick) < 0) {
    coordinator.Tick();
    jobs.Tick();
    security.Tick();
    // A tick takes the locks that all calls take: it stands still when they do.
    manager.SayAlive();
  }
  manager.SayEnding();
  spdlog::info("ending");
  for (const auto& listener : listeners)
    listener->StopServing();
  // Calls that are under way end by themselves, commits well, before the job is stopped and kept.
  coordinator.StopLending();
  metrics.reset();
  web.reset();
  for (WorkPool* const pool : {&pools.scenes, &pools.uploads, &pools.images, &pools.changes})
    pool->Close();
  jobs.Close();
  for (const auto& listener : listeners)
    listener->Shutdown(kTimeForCommits);
  pools.Close();
  coordinator.Close();
  return 0;
}

// Whether the flags say how it may be reached. Errors: INVALID_ARGUMENT, NOT_FOUND.
Status CheckListening(const Flags& flags) {
  for (const auto& [name, address] :
       {std::pair("--listen", flags.listen), std::pair("--listen-workers", flags.listen_workers)}) {
    const bool is_given = address != flags.listen_workers || !address.empty();
    if (!is_given) continue;
    if (!IsAddress(address)) {
      return absl::InvalidArgumentError(
          absl::StrCat(name, " ", address, ": give HOST:PORT, such as 127.0.0.1:7400"));
    }
    if (!flags.tls.empty() || IsLoopback(address)) continue;
    if (!flags.tokens.empty()) {
      return absl::InvalidArgumentError(absl::StrCat(
          name, " ", address, " can be reached from other machines, and tokens would be readable ",
          "on their way; give --tls-ca, --tls-cert and --tls-key"));
    }
    if (!flags.allow_insecure_network) {
      return absl::InvalidArgumentError(absl::StrCat(
          name, " ", address, " can be reached from other machines and traffic is not encrypted; ",
          "give --tls-ca, --tls-cert and --tls-key, or --allow-insecure-network if the network is ",
          "trusted"));
    }
  }
  if (!flags.metrics.empty() && !IsAddress(flags.metrics)) {
    return absl::InvalidArgumentError(
        absl::StrCat("--metrics ", flags.metrics, ": give HOST:PORT, such as 127.0.0.1:7480"));
  }
  if (!flags.metrics.empty() && !IsLoopback(flags.metrics) && !flags.allow_insecure_network) {
    return absl::InvalidArgumentError(absl::StrCat(
        "--metrics ", flags.metrics, " can be reached from other machines, and whoever can may ",
        "read the names of workers; give --allow-insecure-network if the network is trusted"));
  }
  if (!flags.web.empty() && !IsAddress(flags.web)) {
    return absl::InvalidArgumentError(
        absl::StrCat("--web ", flags.web, ": give HOST:PORT, such as 127.0.0.1:8400"));
  }
  if (!flags.web.empty() && !IsLoopback(flags.web) && !flags.allow_insecure_network) {
    return absl::InvalidArgumentError(absl::StrCat(
        "--web ", flags.web, " can be reached from other machines and its traffic is not ",
        "encrypted; put a proxy with TLS before a loopback address, or give ",
        "--allow-insecure-network if the network is trusted"));
  }
  if (flags.tls.empty()) return absl::OkStatus();
  return CheckTlsFiles(flags.tls, SystemClock().Wall()).status();
}

constexpr std::pair<std::string_view, std::string_view> kExits[] = {
    {"0", "It was ended in order."},
    {"1", "The folder of --state cannot be used."},
    {"2", "The command line is wrong."},
    {"3", "It cannot listen on an address."},
};

constexpr ServiceManual kManual = {
    .program = kProgram,
    .summary = "coordinator of Lucerna, a distributed renderer",
    .description =
        "Takes jobs from users, lends batches of photons and passes to workers, which may come and "
        "go at any time, and keeps the images. It writes \"listening on ADDRESS:PORT\" to the "
        "standard output once it accepts calls, and its log to the standard error. Without "
        "certificates it listens on its own machine only.",
    .signals =
        "SIGTERM and SIGINT end it in order: it lends nothing more, takes in the results that are "
        "on their way, and writes a checkpoint where it has a --state.",
    .exit_codes = kExits,
    .example = "lucerna-server --listen 127.0.0.1:7400 --state /var/lib/lucerna",
    .see_also = "lucerna(1), lucerna-worker(1)",
};

int Main(int argc, char** argv) {
  Flags flags;
  flags.coordinator.numeric_profile = NumericProfile();
  CLI::App app("Lucerna's coordinator: takes jobs, lends batches to workers, keeps images.");
  app.set_version_flag("--version", absl::StrCat("lucerna-server ", Version()));
  app.add_option("--listen", flags.listen, "HOST:PORT to listen on; port 0 picks a free one")
      ->capture_default_str();
  app.add_option("--listen-workers", flags.listen_workers,
                 "HOST:PORT for workers alone; then --listen is for clients alone");
  app.add_option("--web", flags.web,
                 "HOST:PORT of a page for browsers: jobs, images, errors, workers, log; port 0 "
                 "picks a free one");
  app.add_option("--metrics", flags.metrics,
                 "HOST:PORT at which GET /metrics tells Prometheus about jobs, workers, memory and "
                 "calls; port 0 picks a free one");
  AddTlsFlags(app, flags.tls);
  app.add_option("--tokens", flags.tokens,
                 "file of the tokens that are accepted (lucerna token new); without it everybody "
                 "who can connect may do everything");
  app.add_option("--max-connections", flags.max_connections_per_address,
                 "connections that one address may have; a worker has two")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  app.add_flag("--reflection", flags.offers_reflection, "describe the protocol to tools");
  app.add_flag("--allow-insecure-network", flags.allow_insecure_network,
               "listen beyond this machine although traffic is not encrypted");
  app.add_option("--threads", flags.coordinator.threads, "threads of jobs and images; 0: all")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  app.add_option("--jobs-at-once", flags.coordinator.jobs_at_once,
                 "jobs in progress, which share the workers")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  const CLI::Validator sizes(
      [](std::string& text) -> std::string {
        const std::optional<std::uint64_t> bytes = ParseByteSize(text);
        if (!bytes) return absl::StrCat("give a size, such as 500M, 8G or 8GiB, not ", text);
        text = absl::StrCat(*bytes);
        return "";
      },
      "");
  app.add_option(
         "--max-memory", flags.coordinator.max_memory_bytes,
         "memory for all that the coordinator holds together, such as 8G or 8GiB; 0: what is "
         "free at the start")
      ->transform(sizes)
      ->type_name("SIZE")
      ->capture_default_str();
  app.add_option("--max-store-bytes", flags.coordinator.max_store_bytes,
                 "memory for scene files and hitpoints")
      ->transform(sizes)
      ->type_name("SIZE")
      ->capture_default_str();
  app.add_option("--max-job-bytes", flags.coordinator.max_job_bytes,
                 "memory for the image and the scene of one job; 0: what is free at the start")
      ->transform(sizes)
      ->type_name("SIZE")
      ->capture_default_str();
  CLI::Option* const state = app.add_option(
      "--state", flags.state,
      "folder that keeps jobs, images and checkpoints, so that a later start goes on with "
      "them; without it they end with the process");
  app.add_option(
         "--max-disk", flags.max_disk_bytes,
         "size of the files in that folder together; jobs that ended first are removed for new "
         "ones; 0: no limit")
      ->needs(state)
      ->transform(sizes)
      ->type_name("SIZE")
      ->capture_default_str();
  app.add_option("--checkpoint-share", flags.coordinator.checkpoint_share,
                 "share of a job's time that its checkpoints may take, above 0; 1: one after every "
                 "round")
      ->check(CLI::Range(1e-9, 1.0))
      ->capture_default_str();
  app.add_option("--audit-share", flags.coordinator.audit_share,
                 "share of batches that two workers compute, so that wrong results are found")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  app.add_option("--keep-jobs", flags.coordinator.retention.jobs,
                 "how many jobs that have ended are kept, the newest")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  app.add_option("--keep-days", flags.keep_days,
                 "how long jobs that have ended are kept [days]; 0: no limit")
      ->check(CLI::Range(0.0, 36500.0))
      ->capture_default_str();
  app.add_option("--batch-photons", flags.coordinator.batch_photons,
                 "photons in every batch; 0: by the number of workers")
      ->capture_default_str();
  AddLogFlags<CLI::IsMember>(app, flags.log);
  if (const auto code = ParseServiceFlags<CLI::ParseError>(app, argc, argv, kManual, kExitUsage)) {
    return *code;
  }
  if (const Status checked = CheckListening(flags); !checked.ok()) {
    PrintError(absl::StrCat(kProgram, ": ", EscapedLines(std::string(checked.message())), "\n"));
    return kExitUsage;
  }
  flags.coordinator.retention.age = std::chrono::duration_cast<Duration>(
      std::chrono::duration<double, std::ratio<86400>>(flags.keep_days));
  if (const char* const fail_point = std::getenv("LUCERNA_FAIL_POINT")) ArmFailPoint(fail_point);
  const auto log = std::make_shared<LogLines>(kLogLines);
  StartLog(kProgram, flags.log.level, flags.log.of_lines());
  spdlog::default_logger()->sinks().push_back(log);
  TakeGrpcErrors(LogGrpcError);
  return Serve(flags, log);
}

}  // namespace
}  // namespace lucerna

int main(int argc, char** argv) {
  lucerna::ReadLocale();
  lucerna::KeepFreedMemory();
  lucerna::KeepOpenSsl();
  return lucerna::Main(argc, argv);
}
