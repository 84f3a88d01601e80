// Does a job end with the same image over a bad line?
//
// Real programs; all that workers and coordinator say to each other goes through a proxy that
// delays, throttles, cuts, swallows or flips it. Each job ends with the digest of a quiet run.
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "gtest/gtest.h"
#include <grpcpp/grpcpp.h>

#include "render/wire/channel.h"
#include "tests/fault/coordinator_process.h"
#include "tests/fault/development_certificates.h"
#include "tests/support/fault_proxy.h"

namespace lucerna {
namespace {

using std::chrono::milliseconds;

// A pass.
constexpr std::int64_t kFewPhotons = 100'000;

std::unique_ptr<ChildProcess> WorkerOver(const FaultProxy& line,
                                         const std::vector<std::string>& more = {}) {
  std::vector<std::string> command = {kBin + "/lucerna-worker", "--server", line.address(),
                                      "--threads", "1"};
  command.insert(command.end(), more.begin(), more.end());
  return std::make_unique<ChildProcess>(std::move(command));
}

const std::string& QuietDigest() {
  static const std::string digest = [] {
    CoordinatorProcess coordinator;
    const auto worker = coordinator.StartWorker();
    const std::string job = coordinator.Submit(kScene, kPasses, kFewPhotons);
    EXPECT_EQ(coordinator.Wait(job).state(), v1::JOB_STATE_SUCCEEDED);
    return coordinator.ImageDigest(job).Hex();
  }();
  return digest;
}

void ExpectQuietDigest(CoordinatorProcess& coordinator, const std::string& job) {
  const v1::Job ended = coordinator.Wait(job);
  ASSERT_EQ(ended.state(), v1::JOB_STATE_SUCCEEDED) << ended.DebugString().substr(0, 2000);
  EXPECT_EQ(coordinator.ImageDigest(job).Hex(), QuietDigest());
}

TEST(BadLinesTest, ASecondOfDelayEachWayAnd100KilobytesASecond) {
  CoordinatorProcess coordinator;
  FaultProxy line(coordinator.address());
  line.SetDelay(std::chrono::seconds(1));
  line.SetRate(100'000);
  const auto worker = WorkerOver(line);
  ASSERT_TRUE(worker->WaitForText("joined", kPatience)) << worker->Errors();
  const std::string job = coordinator.Submit(kScene, kPasses, kFewPhotons);
  ExpectQuietDigest(coordinator, job);
  // A connection for messages and one for bytes in bulk, and no attempt that was given up.
  EXPECT_EQ(line.connections(), 2) << worker->Errors();
}

TEST(BadLinesTest, AClientOverASlowLineWithTls) {
  const DevelopmentCertificates certificates;
  const TlsFiles server = certificates.Of("server");
  const TlsFiles client = certificates.Of("client");
  const std::vector<std::string> of_server = {"--tls-ca",         server.authority, "--tls-cert",
                                              server.certificate, "--tls-key",      server.key};
  CoordinatorProcess coordinator(of_server);
  coordinator.UseSecurity(client, "");
  FaultProxy line(coordinator.address());
  line.SetDelay(std::chrono::seconds(1));
  line.SetRate(100'000);
  const Finished jobs =
      RunProgram({kBin + "/lucerna", "jobs", "--server", line.address(), "--tls-ca",
                  client.authority, "--tls-cert", client.certificate, "--tls-key", client.key});
  EXPECT_EQ(jobs.exit_code, 0) << jobs.errors;
  EXPECT_EQ(line.connections(), 1);
}

TEST(BadLinesTest, ConnectionsThatAreCutAgainAndAgain) {
  CoordinatorProcess coordinator;
  FaultProxy line(coordinator.address());
  const auto worker = WorkerOver(line);
  const std::string job = coordinator.Submit(kScene, kPasses, kFewPhotons);
  for (const int passes : {1, 2, 4}) {
    ASSERT_TRUE(coordinator.WaitForPasses(job, passes));
    const int before = line.connections();
    line.Cut();
    for (int i = 0; i < 6000 && line.connections() == before; ++i)
      std::this_thread::sleep_for(milliseconds(10));
  }
  ExpectQuietDigest(coordinator, job);
}

TEST(BadLinesTest, AHalfOpenConnectionCostsTimeOnly) {
  CoordinatorProcess coordinator;
  FaultProxy line(coordinator.address());
  const auto lost = WorkerOver(line);
  const std::string job = coordinator.Submit(kScene, kPasses, kFewPhotons);
  ASSERT_TRUE(coordinator.WaitForPasses(job, 1));
  // From now on nothing comes through, and neither side is told.
  line.SetSwallow(true);
  const auto worker = coordinator.StartWorker();
  ExpectQuietDigest(coordinator, job);
  // The worker notices too, by pings without answers.
  EXPECT_TRUE(lost->WaitForText("lost the coordinator", 2 * kPatience)) << lost->Errors();
  line.SetSwallow(false);
  line.Cut();
  const std::string joined = "joined";
  for (int i = 0; i < 12000; ++i) {
    const std::string text = lost->Errors();
    if (text.find(joined, text.find("lost the coordinator")) != std::string::npos) break;
    std::this_thread::sleep_for(milliseconds(10));
  }
  const std::string text = lost->Errors();
  EXPECT_NE(text.find(joined, text.find("lost the coordinator")), std::string::npos) << text;
}

TEST(BadLinesTest, FlippedBitsNeverReachTheImage) {
  CoordinatorProcess coordinator;
  FaultProxy line(coordinator.address());
  line.SetFlipEvery(30'000);
  const auto worker = WorkerOver(line);
  const std::string job = coordinator.Submit(kScene, kPasses, kFewPhotons);
  for (int i = 0; i < 12000 && line.flips() < 3; ++i)
    std::this_thread::sleep_for(milliseconds(10));
  ASSERT_GE(line.flips(), 3);
  line.SetFlipEvery(0);
  // What the flips broke on the way is sent again; a batch that a worker could not work off is lent
  // again, to a second worker too.
  const auto second = coordinator.StartWorker();
  ExpectQuietDigest(coordinator, job);
}

}  // namespace
}  // namespace lucerna
