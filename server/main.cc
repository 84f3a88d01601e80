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
#include <ratio>
#include <string>
#include <string_view>

#include <CLI/CLI.hpp>
#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/health_check_service_interface.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include "render/base/clock.h"
#include "render/base/fail_point.h"
#include "render/base/memory.h"
#include "render/base/version.h"
#include "render/geometry/numeric_profile.h"
#include "render/wire/channel.h"
#include "server/asset_service.h"
#include "server/coordinator.h"
#include "server/image_service.h"
#include "server/job_service.h"
#include "server/state/durable_state.h"
#include "server/work_pool.h"
#include "server/worker_service.h"

namespace lucerna {
namespace {

constexpr int kExitUsage = 2;
constexpr int kExitNoState = 1;
constexpr int kExitCannotListen = 3;
// For commits whose bytes are on their way when the process is to end.
constexpr std::chrono::seconds kTimeForCommits{5};
constexpr long kTickNanos = 50'000'000;

struct Flags {
  std::string listen = "127.0.0.1:7400";
  bool allow_insecure_network = false;
  std::string log_level = "info";
  std::string state;
  double keep_days = 0;
  Coordinator::Options coordinator;
};

// Both signals wait to be asked for, in this thread and in every thread it starts.
sigset_t BlockEndSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  return signals;
}

int Serve(const Flags& flags) {
  const sigset_t end_signals = BlockEndSignals();
  const Clock& clock = SystemClock();
  std::unique_ptr<DurableState> state;
  if (!flags.state.empty()) {
    StatusOr<std::unique_ptr<DurableState>> opened = DurableState::Open(
        flags.state, absl::StrCat(absl::Hex(clock.Wall().time_since_epoch().count() / 1000)),
        {clock.Steady(), ProcessCpuTime(), clock.Wall()});
    if (!opened.ok()) {
      std::fprintf(stderr, "lucerna-server: --state %s: %s\n", flags.state.c_str(),
                   std::string(opened.status().message()).c_str());
      return kExitNoState;
    }
    state = *std::move(opened);
  }
  Coordinator coordinator(flags.coordinator, clock, std::move(state));
  WorkPools pools;
  AssetService assets(coordinator.blobs(), coordinator.budget(), pools);
  JobService jobs(coordinator, pools, SystemClock());
  ImageService images(coordinator, pools);
  WorkerService workers(coordinator, pools);

  grpc::EnableDefaultHealthCheckService(true);
  grpc::reflection::InitProtoReflectionServerBuilderPlugin();
  grpc::ServerBuilder builder;
  SetUpConnections(builder);
  int port = 0;
  builder.AddListeningPort(flags.listen, grpc::InsecureServerCredentials(), &port);
  builder.RegisterService(&assets);
  builder.RegisterService(&jobs);
  builder.RegisterService(&images);
  builder.RegisterService(&workers);
  const std::unique_ptr<grpc::Server> server = builder.BuildAndStart();
  if (!server || port == 0) {
    std::fprintf(stderr,
                 "lucerna-server: cannot listen on %s; is the port in use, or the address not of "
                 "this machine?\n",
                 flags.listen.c_str());
    return kExitCannotListen;
  }
  std::printf("listening on %s:%d\n", flags.listen.substr(0, flags.listen.rfind(':')).c_str(),
              port);
  std::fflush(stdout);
  spdlog::info("numeric profile: {}", flags.coordinator.numeric_profile);

  const timespec tick = {0, kTickNanos};
  while (sigtimedwait(&end_signals, nullptr, &tick) < 0) {
    coordinator.Tick();
    jobs.Tick();
  }
  spdlog::info("ending");
  server->GetHealthCheckService()->SetServingStatus(false);
  // Calls that are under way end by themselves, commits well, before the job is stopped and kept.
  coordinator.StopLending();
  for (WorkPool* const pool : {&pools.scenes, &pools.uploads, &pools.images})
    pool->Close();
  jobs.Close();
  server->Shutdown(DeadlineIn(kTimeForCommits));
  server->Wait();
  pools.Close();
  coordinator.Close();
  return 0;
}

int Main(int argc, char** argv) {
  Flags flags;
  flags.coordinator.numeric_profile = NumericProfile();
  CLI::App app("Lucerna's coordinator: takes jobs, lends batches to workers, keeps images.");
  app.set_version_flag("--version", absl::StrCat("lucerna-server ", Version()));
  app.add_option("--listen", flags.listen, "HOST:PORT to listen on; port 0 picks a free one")
      ->capture_default_str();
  app.add_flag("--allow-insecure-network", flags.allow_insecure_network,
               "listen beyond this machine although traffic is not encrypted");
  app.add_option("--threads", flags.coordinator.threads, "threads for eye paths; 0: all")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  app.add_option("--jobs-at-once", flags.coordinator.jobs_at_once,
                 "jobs in progress, which share the workers")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  app.add_option("--max-memory", flags.coordinator.max_memory_bytes,
                 "memory for all that the coordinator holds together [bytes]; 0: what is free at "
                 "the start")
      ->capture_default_str();
  app.add_option("--max-store-bytes", flags.coordinator.max_store_bytes,
                 "memory for scene files and hitpoints [bytes]")
      ->capture_default_str();
  app.add_option(
         "--max-job-bytes", flags.coordinator.max_job_bytes,
         "memory for the image and the scene of one job [bytes]; 0: what is free at the start")
      ->capture_default_str();
  app.add_option(
      "--state", flags.state,
      "folder that keeps jobs, images and checkpoints, so that a later start goes on with "
      "them; without it they end with the process");
  app.add_option("--checkpoint-share", flags.coordinator.checkpoint_share,
                 "share of a job's time that its checkpoints may take, above 0; 1: one after every "
                 "round")
      ->check(CLI::Range(1e-9, 1.0))
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
  app.add_option("--log-level", flags.log_level, "debug, info, warn, error or off")
      ->check(CLI::IsMember({"debug", "info", "warn", "error", "off"}))
      ->capture_default_str();
  std::string help = "--help";
  if (argc == 2 && std::string_view(argv[1]) == "help") argv[1] = help.data();
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kExitUsage;
  }
  if (!IsAddress(flags.listen)) {
    std::fprintf(stderr, "lucerna-server: --listen %s: give HOST:PORT, such as 127.0.0.1:7400\n",
                 flags.listen.c_str());
    return kExitUsage;
  }
  if (!flags.allow_insecure_network && !IsLoopback(flags.listen)) {
    std::fprintf(stderr,
                 "lucerna-server: --listen %s can be reached from other machines and traffic is "
                 "not encrypted; give --allow-insecure-network if the network is trusted\n",
                 flags.listen.c_str());
    return kExitUsage;
  }
  flags.coordinator.retention.age = std::chrono::duration_cast<Duration>(
      std::chrono::duration<double, std::ratio<86400>>(flags.keep_days));
  if (const char* const fail_point = std::getenv("LUCERNA_FAIL_POINT")) ArmFailPoint(fail_point);
  spdlog::set_default_logger(spdlog::stderr_color_mt("lucerna-server"));
  spdlog::set_level(spdlog::level::from_str(flags.log_level));
  return Serve(flags);
}

}  // namespace
}  // namespace lucerna

int main(int argc, char** argv) {
  lucerna::KeepFreedMemory();
  return lucerna::Main(argc, argv);
}
