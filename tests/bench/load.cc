// What does a coordinator take with many watchers and idle workers, many changes, or many jobs?
//
//   lucerna-load changes ADDRESS JOB CALLERS SECONDS
//
// So many callers change the priority of a job, each as soon as its last change was answered.
// Prints the changes a second and their latency.
//
//   lucerna-load jobs ADDRESS JOB PID COUNT
//
// Submits COUNT jobs of the scene of JOB, at 64 x 64 pixels and 4 passes, one after the other, and
// prints the coordinator's memory after each 100.
//
//   lucerna-load ADDRESS JOB PID [WATCHERS WORKERS SECONDS]
//
// Connects so many watchers of one job and registers so many workers that never finish anything,
// each a blocking call on a thread of this program. Meanwhile a worker of its own asks for work
// without waiting, again and again. Prints the coordinator's memory and processor time (of
// /proc/PID), the messages that watchers got, and the latency of those calls. Each worker may be
// lent one batch, which runs out after some seconds: give a job that is paused, so that nothing is
// lent.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <grpcpp/grpcpp.h>
#include <unistd.h>

#include "proto/lucerna/v1/jobs.grpc.pb.h"
#include "proto/lucerna/v1/work.grpc.pb.h"
#include "render/geometry/numeric_profile.h"
#include "render/wire/messages.h"

namespace lucerna {
namespace {

using Clock = std::chrono::steady_clock;

double SecondsSince(Clock::time_point since) {
  return std::chrono::duration<double>(Clock::now() - since).count();
}

// [MB]
double MemoryOf(const std::string& pid) {
  std::ifstream file("/proc/" + pid + "/statm");
  double all = 0;
  double resident = 0;
  file >> all >> resident;
  return resident * static_cast<double>(::sysconf(_SC_PAGESIZE)) / 1e6;
}

// Of all threads so far [s].
double CpuOf(const std::string& pid) {
  std::ifstream file("/proc/" + pid + "/stat");
  std::string word;
  for (int i = 0; i < 13; ++i)
    file >> word;
  double user = 0;
  double system = 0;
  file >> user >> system;
  return (user + system) / static_cast<double>(::sysconf(_SC_CLK_TCK));
}

class Load {
 public:
  Load(const std::string& address, std::string job, int watchers, int workers)
      : job_(std::move(job)) {
    for (int i = 0; i < kChannels; ++i) {
      grpc::ChannelArguments arguments;
      arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
      channels_.push_back(
          grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments));
    }
    for (int i = 0; i < watchers; ++i)
      threads_.emplace_back([this, i] { Watch(i); });
    for (int i = 0; i < workers; ++i)
      threads_.emplace_back([this, i] { Idle(i); });
  }
  ~Load() {
    is_over_ = true;
    for (std::thread& thread : threads_)
      thread.join();
  }
  Load(const Load&) = delete;
  Load& operator=(const Load&) = delete;

  [[nodiscard]] std::uint64_t messages() const { return messages_; }
  [[nodiscard]] std::uint64_t failures() const { return failures_; }

  std::string Register(v1::WorkerService::Stub& stub) {
    grpc::ClientContext context;
    v1::RegisterRequest request;
    request.set_name("load");
    request.set_threads(1);
    request.set_numeric_profile(NumericProfile());
    v1::RegisterResponse response;
    if (!stub.Register(&context, request, &response).ok()) ++failures_;
    return response.worker_id();
  }
  bool Sync(v1::WorkerService::Stub& stub, const std::string& worker, int wait_s) {
    grpc::ClientContext context;
    v1::SyncRequest request;
    request.set_worker_id(worker);
    request.set_wants_lease(true);
    request.mutable_wait_at_most()->set_seconds(wait_s);
    v1::SyncResponse response;
    const bool is_ok = stub.Sync(&context, request, &response).ok();
    if (!is_ok) ++failures_;
    return is_ok;
  }
  const std::shared_ptr<grpc::Channel>& channel(int i) {
    return channels_[static_cast<std::size_t>(i % kChannels)];
  }

 private:
  static constexpr int kChannels = 50;

  void Watch(int i) {
    const auto stub = v1::JobService::NewStub(channel(i));
    while (!is_over_) {
      grpc::ClientContext context;
      v1::WatchJobRequest request;
      request.set_job_id(job_);
      const auto reader = stub->Watch(&context, request);
      v1::Job job;
      while (!is_over_ && reader->Read(&job))
        ++messages_;
      context.TryCancel();
      if (!reader->Finish().ok() && !is_over_) ++failures_;
    }
  }
  void Idle(int i) {
    const auto stub = v1::WorkerService::NewStub(channel(i));
    const std::string worker = Register(*stub);
    while (!is_over_ && Sync(*stub, worker, 5)) {
    }
  }

  const std::string job_;
  std::atomic<bool> is_over_ = false;
  std::atomic<std::uint64_t> messages_ = 0;
  std::atomic<std::uint64_t> failures_ = 0;
  std::vector<std::shared_ptr<grpc::Channel>> channels_;
  std::vector<std::thread> threads_;
};

// Of latencies, in any order [ms].
double Quantile(std::vector<double> latencies_ms, double share) {
  if (latencies_ms.empty()) return 0;
  std::sort(latencies_ms.begin(), latencies_ms.end());
  return latencies_ms[static_cast<std::size_t>(share *
                                               static_cast<double>(latencies_ms.size() - 1))];
}

int ChangeJobs(const std::string& address, const std::string& job, int callers, double seconds) {
  std::vector<std::vector<double>> latencies_ms(static_cast<std::size_t>(callers));
  std::atomic<std::uint64_t> failures = 0;
  const Clock::time_point began_at = Clock::now();
  std::vector<std::thread> threads;
  for (int caller = 0; caller < callers; ++caller) {
    threads.emplace_back([&, caller] {
      const auto stub =
          v1::JobService::NewStub(grpc::CreateChannel(address, grpc::InsecureChannelCredentials()));
      for (int i = 0; SecondsSince(began_at) < seconds; ++i) {
        grpc::ClientContext context;
        v1::SetJobPriorityRequest request;
        request.set_job_id(job);
        request.set_priority((caller + i) % 100);
        v1::Job changed;
        const Clock::time_point asked_at = Clock::now();
        if (!stub->SetPriority(&context, request, &changed).ok()) ++failures;
        latencies_ms[static_cast<std::size_t>(caller)].push_back(1e3 * SecondsSince(asked_at));
      }
    });
  }
  for (std::thread& thread : threads)
    thread.join();
  const double measured_s = SecondsSince(began_at);
  std::vector<double> all;
  for (const std::vector<double>& of_caller : latencies_ms)
    all.insert(all.end(), of_caller.begin(), of_caller.end());
  std::printf("%d callers: %.0f changes/s, median %.2f ms, p99 %.2f ms, failures: %llu\n", callers,
              static_cast<double>(all.size()) / measured_s, Quantile(all, 0.5), Quantile(all, 0.99),
              static_cast<unsigned long long>(failures));
  return 0;
}

int RunJobs(const std::string& address, const std::string& job, const std::string& pid, int count) {
  const auto channel = grpc::CreateChannel(address, grpc::InsecureChannelCredentials());
  const auto jobs = v1::JobService::NewStub(channel);
  v1::JobDescription description;
  {
    grpc::ClientContext context;
    v1::DescribeJobRequest request;
    request.set_job_id(job);
    const grpc::Status described =
        v1::WorkerService::NewStub(channel)->DescribeJob(&context, request, &description);
    if (!described.ok()) {
      std::fprintf(stderr, "%s\n", described.error_message().c_str());
      return 1;
    }
  }
  RenderOverrides overrides;
  overrides.width = overrides.height = 64;
  overrides.passes = 4;
  overrides.photons_per_pass = 1000;
  std::printf("jobs,memory_mb\n0,%.1f\n", MemoryOf(pid));
  for (int i = 1; i <= count; ++i) {
    v1::SubmitRequest request;
    request.set_request_id(pid + " " + std::to_string(i));
    *request.mutable_scene() = description.scene();
    *request.mutable_overrides() = ToProto(overrides);
    v1::SubmitResponse submitted;
    grpc::ClientContext context;
    const grpc::Status status = jobs->Submit(&context, request, &submitted);
    if (!status.ok()) {
      std::fprintf(stderr, "%s\n", status.error_message().c_str());
      return 1;
    }
    grpc::ClientContext watching;
    v1::WatchJobRequest watch;
    watch.set_job_id(submitted.job_id());
    const auto reader = jobs->Watch(&watching, watch);
    v1::Job newest;
    while (reader->Read(&newest)) {
    }
    if (!reader->Finish().ok() || newest.state() != v1::JOB_STATE_SUCCEEDED) {
      std::fprintf(stderr, "job %d did not succeed\n", i);
      return 1;
    }
    if (i % 100 == 0) {
      std::printf("%d,%.1f\n", i, MemoryOf(pid));
      std::fflush(stdout);
    }
  }
  return 0;
}

int Main(int argc, char** argv) {
  if (argc == 6 && std::string(argv[1]) == "changes") {
    return ChangeJobs(argv[2], argv[3], std::atoi(argv[4]), std::atof(argv[5]));
  }
  if (argc == 6 && std::string(argv[1]) == "jobs") {
    return RunJobs(argv[2], argv[3], argv[4], std::atoi(argv[5]));
  }
  if (argc < 4) {
    std::fprintf(stderr,
                 "usage: lucerna-load ADDRESS JOB PID [WATCHERS WORKERS SECONDS]\n"
                 "       lucerna-load changes ADDRESS JOB CALLERS SECONDS\n"
                 "       lucerna-load jobs ADDRESS JOB PID COUNT\n");
    return 2;
  }
  const std::string pid = argv[3];
  const int watchers = argc > 4 ? std::atoi(argv[4]) : 1000;
  const int workers = argc > 5 ? std::atoi(argv[5]) : 1000;
  const double seconds = argc > 6 ? std::atof(argv[6]) : 30;
  std::printf("before: %.1f MB\n", MemoryOf(pid));
  Load load(argv[1], argv[2], watchers, workers);
  // All are there.
  std::this_thread::sleep_for(std::chrono::seconds(10));
  const double cpu = CpuOf(pid);
  const std::uint64_t messages = load.messages();
  const Clock::time_point began_at = Clock::now();
  const auto stub = v1::WorkerService::NewStub(load.channel(0));
  const std::string worker = load.Register(*stub);
  std::vector<double> latencies_ms;
  while (SecondsSince(began_at) < seconds) {
    const Clock::time_point asked_at = Clock::now();
    load.Sync(*stub, worker, 0);
    latencies_ms.push_back(1e3 * SecondsSince(asked_at));
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  const double measured_s = SecondsSince(began_at);
  const auto quantile = [&](double share) { return Quantile(latencies_ms, share); };
  std::printf("with %d watchers and %d workers: %.1f MB, %.3f cores, %.0f messages/s\n", watchers,
              workers, MemoryOf(pid), (CpuOf(pid) - cpu) / measured_s,
              static_cast<double>(load.messages() - messages) / measured_s);
  std::printf("Sync latency of %zu calls: median %.2f ms, p99 %.2f ms, most %.2f ms\n",
              latencies_ms.size(), quantile(0.5), quantile(0.99), quantile(1));
  std::printf("failures: %llu\n", static_cast<unsigned long long>(load.failures()));
  return 0;
}

}  // namespace
}  // namespace lucerna

int main(int argc, char** argv) {
  return lucerna::Main(argc, argv);
}
