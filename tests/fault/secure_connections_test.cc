// Who gets in, who stays out, and what is each told?
//
// Real programs with certificates of deploy/dev-ca.sh. Whoever is not of the authority, whose
// certificate has expired, or who has none, gets one sentence; so does the coordinator's log.
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "gtest/gtest.h"
#include <grpcpp/grpcpp.h>
#include <signal.h>

#include "proto/lucerna/v1/jobs.grpc.pb.h"
#include "render/wire/channel.h"
#include "tests/fault/coordinator_process.h"
#include "tests/fault/development_certificates.h"

namespace lucerna {
namespace {

using std::chrono::milliseconds;

std::vector<std::string> Flags(const TlsFiles& tls, std::vector<std::string> more = {}) {
  std::vector<std::string> flags = {"--tls-ca",      tls.authority, "--tls-cert",
                                    tls.certificate, "--tls-key",   tls.key};
  flags.insert(flags.end(), more.begin(), more.end());
  return flags;
}

Finished ListJobs(const std::string& address, const std::vector<std::string>& flags) {
  std::vector<std::string> command = {kBin + "/lucerna", "jobs", "--server", address};
  command.insert(command.end(), flags.begin(), flags.end());
  return RunProgram(command);
}

// One call over a new connection, whatever the program would say of its certificates first.
grpc::Status CallWith(const Endpoint& endpoint) {
  grpc::ClientContext context;
  context.set_deadline(DeadlineIn(kPatience));
  v1::ListJobsResponse response;
  return v1::JobService::NewStub(MakeChannel(endpoint))->List(&context, {}, &response);
}

bool Says(const Finished& program, const std::string& text) {
  return program.errors.find(text) != std::string::npos;
}

TEST(SecureConnectionsTest, WithCertificatesTheImageIsTheSame) {
  std::string plain;
  {
    CoordinatorProcess coordinator;
    const auto worker = coordinator.StartWorker();
    const std::string job = coordinator.Submit("glass-box.pbrt", 2, 50'000);
    ASSERT_EQ(coordinator.Wait(job).state(), v1::JOB_STATE_SUCCEEDED);
    plain = coordinator.ImageDigest(job).Hex();
  }
  const DevelopmentCertificates certificates;
  CoordinatorProcess coordinator(Flags(certificates.Of("server")));
  coordinator.UseSecurity(certificates.Of("client"), "");
  const auto worker = coordinator.StartWorker(Flags(certificates.Of("worker")));
  const std::string job = coordinator.Submit("glass-box.pbrt", 2, 50'000);
  const v1::Job ended = coordinator.Wait(job);
  ASSERT_EQ(ended.state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(ended.owner(), "client") << "the common name of the certificate";
  EXPECT_EQ(coordinator.ImageDigest(job).Hex(), plain);
}

TEST(SecureConnectionsTest, WhoIsNotOfTheAuthorityIsToldSo) {
  DevelopmentCertificates certificates;
  const DevelopmentCertificates strangers;
  CoordinatorProcess coordinator(Flags(certificates.Of("server")));
  const TlsFiles ours = certificates.Of("client");
  const TlsFiles theirs = strangers.Of("client");

  const Finished plain = ListJobs(coordinator.address(), {});
  EXPECT_EQ(plain.exit_code, 3);
  EXPECT_TRUE(Says(plain, "if it uses TLS, give --tls-ca")) << plain.errors;
  EXPECT_TRUE(coordinator.process().WaitForText("the other side does not use TLS", kPatience));

  const Finished foreign =
      ListJobs(coordinator.address(), Flags({ours.authority, theirs.certificate, theirs.key}));
  EXPECT_EQ(foreign.exit_code, 3);
  EXPECT_TRUE(Says(foreign, "does not accept the certificate in --tls-cert")) << foreign.errors;
  EXPECT_TRUE(coordinator.process().WaitForText(
      "the certificate of the other side is not of the authority", kPatience));

  const Finished deceived = ListJobs(coordinator.address(), Flags(theirs));
  EXPECT_EQ(deceived.exit_code, 3);
  EXPECT_TRUE(Says(deceived, "the certificate of the coordinator at ")) << deceived.errors;

  // A worker says the same, and gives up after its time.
  const auto worker = coordinator.StartWorker(
      Flags({ours.authority, theirs.certificate, theirs.key}, {"--connect-timeout", "0.5"}));
  EXPECT_EQ(worker->WaitForExit(kPatience), 3);
  EXPECT_NE(worker->Errors().find("does not accept the certificate"), std::string::npos)
      << worker->Errors();
}

TEST(SecureConnectionsTest, AnExpiredCertificateIsRefusedOnBothSides) {
  DevelopmentCertificates certificates;
  certificates.Make("old", -1);
  const TlsFiles old = certificates.Of("old");
  CoordinatorProcess coordinator(Flags(certificates.Of("server")));

  const Finished told = ListJobs(coordinator.address(), Flags(old));
  EXPECT_EQ(told.exit_code, 2);
  EXPECT_TRUE(Says(told, "this certificate expired at 20")) << told.errors;
  EXPECT_EQ(CallWith({coordinator.address(), old}).error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_TRUE(coordinator.process().WaitForText("or it has expired", kPatience));
  EXPECT_TRUE(CallWith({coordinator.address(), certificates.Of("client")}).ok());

  std::vector<std::string> command = {kBin + "/lucerna-server", "--listen", "127.0.0.1:0"};
  for (const std::string& flag : Flags(old))
    command.push_back(flag);
  const Finished server = RunProgram(command);
  EXPECT_EQ(server.exit_code, 2);
  EXPECT_TRUE(Says(server, "this certificate expired at 20")) << server.errors;
}

TEST(SecureConnectionsTest, FilesThatCannotBeUsedAreNamed) {
  const DevelopmentCertificates certificates;
  const TlsFiles good = certificates.Of("client");
  const TlsFiles other = certificates.Of("worker");
  const auto error_of = [](const TlsFiles& files) {
    const Finished told = ListJobs("127.0.0.1:1", Flags(files));
    EXPECT_EQ(told.exit_code, 2) << told.errors;
    return told.errors;
  };
  EXPECT_NE(error_of({good.authority, good.certificate, other.key})
                .find("this key is not that of the certificate in"),
            std::string::npos);
  EXPECT_NE(error_of({good.authority, good.certificate, good.key + "x"}).find("--tls-key "),
            std::string::npos);
  EXPECT_NE(error_of({good.key, good.certificate, good.key})
                .find("there is no certificate in PEM form in this file"),
            std::string::npos);
  EXPECT_NE(error_of({good.authority, good.certificate, good.certificate})
                .find("there is no private key without passphrase in PEM form"),
            std::string::npos);
  const Finished half = ListJobs("127.0.0.1:1", {"--tls-ca", good.authority});
  EXPECT_EQ(half.exit_code, 2);
  EXPECT_NE(half.errors.find("--tls-cert is missing"), std::string::npos) << half.errors;
}

TEST(SecureConnectionsTest, CertificatesAreReadAgainAndConnectionsStay) {
  DevelopmentCertificates certificates;
  const DevelopmentCertificates next;
  // The client's files stay, the server's are replaced, so the client has copies of the first.
  DevelopmentCertificates first_client;
  first_client.ReplaceBy(certificates, "client");
  CoordinatorProcess coordinator(Flags(certificates.Of("server")));
  coordinator.UseSecurity(first_client.Of("client"), "");
  ASSERT_TRUE(coordinator.List().empty());
  ASSERT_FALSE(CallWith({coordinator.address(), next.Of("client")}).ok());

  certificates.ReplaceBy(next, "server");

  bool is_in = false;
  for (int i = 0; i < 600 && !is_in; ++i) {
    is_in = CallWith({coordinator.address(), next.Of("client")}).ok();
    if (!is_in) std::this_thread::sleep_for(milliseconds(100));
  }
  EXPECT_TRUE(is_in) << coordinator.process().Errors();
  EXPECT_FALSE(CallWith({coordinator.address(), first_client.Of("client")}).ok())
      << "its authority is not that of the coordinator any more";
  EXPECT_TRUE(coordinator.List().empty()) << "on the connection that was there before";
}

TEST(SecureConnectionsTest, BeyondThisMachineTlsIsNeededOrAWord) {
  const auto start = [](std::vector<std::string> flags) {
    flags.insert(flags.begin(), kBin + "/lucerna-server");
    return RunProgram(flags);
  };
  const Finished open = start({"--listen", "0.0.0.0:0"});
  EXPECT_EQ(open.exit_code, 2);
  EXPECT_TRUE(Says(open, "traffic is not encrypted")) << open.errors;
  const Finished workers = start({"--listen", "127.0.0.1:0", "--listen-workers", "0.0.0.0:0"});
  EXPECT_EQ(workers.exit_code, 2);
  EXPECT_TRUE(Says(workers, "--listen-workers 0.0.0.0:0")) << workers.errors;
  // Not even then do tokens travel in the clear.
  const Finished tokens =
      start({"--listen", "0.0.0.0:0", "--allow-insecure-network", "--tokens", "/dev/null"});
  EXPECT_EQ(tokens.exit_code, 2);
  EXPECT_TRUE(Says(tokens, "tokens would be readable")) << tokens.errors;
  const Finished client = RunProgram({"/usr/bin/env", "LUCERNA_TOKEN=a-token", kBin + "/lucerna",
                                      "jobs", "--server", "192.0.2.1:7400"});
  EXPECT_EQ(client.exit_code, 2);
  EXPECT_TRUE(Says(client, "the token would be readable")) << client.errors;
}

TEST(SecureConnectionsTest, EachListenerOffersOnlyItsServices) {
  CoordinatorProcess coordinator({"--listen-workers", "127.0.0.1:0"});
  const std::string announced = "listening for workers on ";
  ASSERT_TRUE(coordinator.process().WaitForText(announced, kPatience));
  const std::string output = coordinator.process().Output();
  const std::size_t at = output.find(announced) + announced.size();
  const std::string for_workers = output.substr(at, output.find('\n', at) - at);

  const Finished client = ListJobs(for_workers, {});
  EXPECT_EQ(client.exit_code, 1);
  EXPECT_TRUE(Says(client, "is that its address for workers?")) << client.errors;
  const auto lost = coordinator.StartWorker();
  EXPECT_EQ(lost->WaitForExit(kPatience), 4);
  EXPECT_NE(lost->Errors().find("does not take workers at"), std::string::npos) << lost->Errors();

  const ChildProcess worker({kBin + "/lucerna-worker", "--server", for_workers, "--threads", "1"});
  const std::string job = coordinator.Submit("glass-box.pbrt", 1, 10'000);
  EXPECT_EQ(coordinator.Wait(job).state(), v1::JOB_STATE_SUCCEEDED);
  // Of what workers call, clients have what tracing a photon again needs.
  const Finished traced = RunProgram(
      {kBin + "/lucerna", "trace-photon", job, "0:7", "--server", coordinator.address()});
  EXPECT_EQ(traced.exit_code, 0) << traced.errors;
}

}  // namespace
}  // namespace lucerna
