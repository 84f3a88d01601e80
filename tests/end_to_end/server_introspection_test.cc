// An administrator's tools can ask a coordinator whether it is well and what it offers.
//
// Both services are gRPC's own; the messages are small enough to be written and read as bytes.
#include <chrono>
#include <string>

#include "gtest/gtest.h"
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>

#include "render/wire/channel.h"
#include "tests/support/process.h"

namespace lucerna {
namespace {

// Sends one request on a stream of `method` and returns the first answer.
std::string FirstAnswer(const std::string& address, const std::string& method,
                        const std::string& request) {
  grpc::GenericStub stub(MakeChannel(address));
  grpc::ClientContext context;
  context.set_deadline(DeadlineIn(std::chrono::seconds(60)));
  grpc::CompletionQueue queue;
  const auto wait = [&queue] {
    void* tag = nullptr;
    bool ok = false;
    return queue.Next(&tag, &ok) && ok;
  };
  const auto call = stub.PrepareCall(&context, method, &queue);
  call->StartCall(nullptr);
  if (!wait()) return {};
  const grpc::Slice slice(request);
  const grpc::ByteBuffer sent(&slice, 1);
  call->WriteLast(sent, grpc::WriteOptions(), nullptr);
  if (!wait()) return {};
  grpc::ByteBuffer answer;
  call->Read(&answer, nullptr);
  if (!wait()) return {};
  grpc::Slice whole;
  if (!answer.DumpToSingleSlice(&whole).ok()) return {};
  grpc::Status status;
  call->Finish(&status, nullptr);
  wait();
  return {reinterpret_cast<const char*>(whole.begin()), whole.size()};
}

TEST(ServerIntrospectionTest, SaysThatItServesAndWhat) {
  ChildProcess server({std::string(LUCERNA_BIN_DIR) + "/lucerna-server", "--listen", "127.0.0.1:0",
                       "--reflection"});
  ASSERT_TRUE(server.WaitForText("\n", std::chrono::seconds(60)));
  const std::string greeting = "listening on ";
  const std::string line = server.Output();
  const std::string address = line.substr(greeting.size(), line.find('\n') - greeting.size());

  // HealthCheckResponse{status: SERVING}.
  EXPECT_EQ(FirstAnswer(address, "/grpc.health.v1.Health/Check", ""), "\x08\x01");

  // ServerReflectionRequest{list_services: ""}.
  const std::string services =
      FirstAnswer(address, "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo",
                  std::string("\x3a\x00", 2));
  for (const char* name : {"lucerna.v1.AssetService", "lucerna.v1.JobService",
                           "lucerna.v1.ImageService", "lucerna.v1.WorkerService"}) {
    EXPECT_NE(services.find(name), std::string::npos) << name;
  }
}

}  // namespace
}  // namespace lucerna
