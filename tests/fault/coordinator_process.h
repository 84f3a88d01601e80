// A real coordinator on loopback, and a user of it: what fault tests start, kill and start again.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <grpcpp/grpcpp.h>

#include "proto/lucerna/v1/jobs.pb.h"
#include "render/base/certificate.h"
#include "render/base/digest.h"
#include "render/base/status.h"
#include "tests/support/process.h"

namespace lucerna {

// For what must happen, however busy the machine is: ends only what hangs.
inline constexpr std::chrono::seconds kPatience{60};
inline const std::string kBin = LUCERNA_BIN_DIR;
inline const std::string kTestScenes = LUCERNA_SOURCE_DIR "/tests/scenes";

// A loopback address of this process alone, with a port that was free a moment ago: tests that run
// at the same time, and the ports that the system gives to connections of 127.0.0.1, cannot take
// it.
[[nodiscard]] std::string FreeAddress();

// The job of most of these tests.
inline constexpr const char* kScene = "glass-box.pbrt";
inline constexpr int kPasses = 6;
inline constexpr std::int64_t kPhotonsAPass = 400'000;

// What a job of these tests is: a scene of ours in 64×64 pixels.
struct SmallJob {
  std::string scene = kScene;
  int passes = kPasses;
  std::int64_t photons = kPhotonsAPass;  // a pass
  std::string request_id = "the only one";
  std::string name = {};  // empty: the scene's
  double time_s = 0;      // above 0: ends after so long, and not by passes
};

class CoordinatorProcess {
 public:
  // Waits until it listens. Of an `address` with port 0 it picks a free one.
  explicit CoordinatorProcess(std::vector<std::string> flags = {},
                              const std::string& address = "127.0.0.1:0");
  // One that kills itself at a step (render/base/fail_point.h), perhaps before it listens: does not
  // wait.
  static std::unique_ptr<CoordinatorProcess> Doomed(const std::string& fail_point,
                                                    std::vector<std::string> flags,
                                                    const std::string& address);

  // A user of a coordinator that the test has started itself; there is no process().
  enum class Elsewhere {};
  CoordinatorProcess(std::string address, Elsewhere tag);

  [[nodiscard]] const std::string& address() const { return address_; }
  [[nodiscard]] ChildProcess& process() { return *process_; }
  [[nodiscard]] const std::shared_ptr<grpc::Channel>& channel() const { return channel_; }

  [[nodiscard]] std::unique_ptr<ChildProcess> StartWorker(
      std::vector<std::string> more_flags = {}) const;
  // One that kills itself at a step, or does wrong (render/base/fail_point.h).
  [[nodiscard]] std::unique_ptr<ChildProcess> StartFaultyWorker(const std::string& fault) const;

  // From now on calls go over a connection of their own with these certificates and this token.
  void UseSecurity(const TlsFiles& tls, const std::string& token);

  // The errors of these are those of the calls.
  // Uploads and submits; the job's id.
  [[nodiscard]] StatusOr<std::string> TrySubmit(const SmallJob& job);
  // Watches until the job has ended or the call breaks; its newest state.
  [[nodiscard]] StatusOr<v1::Job> TryWait(const std::string& job_id);
  [[nodiscard]] Status TryDelete(const std::string& job_id);

  // These must succeed.
  std::string Submit(const std::string& scene, int passes, std::int64_t photons,
                     const std::string& name = {});
  v1::Job Get(const std::string& job_id);
  std::vector<v1::Job> List();
  // The job when it has ended, or as it is after some minutes.
  v1::Job Wait(const std::string& job_id);
  // Until the job has merged so much; false when it ended before, or kPatience passed.
  [[nodiscard]] bool WaitForPasses(const std::string& job_id, std::int64_t passes);
  [[nodiscard]] bool WaitForPhotons(const std::string& job_id, std::uint64_t photons);
  Digest ImageDigest(const std::string& job_id);

 private:
  enum class NotStarted {};
  explicit CoordinatorProcess(NotStarted /*tag*/) {}
  void Start(std::vector<std::string> command, std::vector<std::string> flags,
             const std::string& address);

  bool WaitForProgress(const std::string& job_id,
                       const std::function<bool(const v1::Progress&)>& is_there);

  std::unique_ptr<ChildProcess> process_;
  std::string address_;
  std::shared_ptr<grpc::Channel> channel_;
};

// Of the image of such a job in which nothing fails, with one worker. Rendered once a process.
// Threads: one.
[[nodiscard]] Digest UnfaultedDigest(const std::string& scene, int passes, std::int64_t photons);

}  // namespace lucerna
