// What if connections take all descriptors there are?
//
// A real coordinator with few descriptors, and connections that say nothing. gRPC's own listener
// would be deaf afterwards, for good.
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "gtest/gtest.h"
#include <arpa/inet.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "render/wire/channel.h"
#include "tests/fault/coordinator_process.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace {

using std::chrono::milliseconds;

// A connection that says nothing.
class SilentConnection {
 public:
  explicit SilentConnection(const std::string& address) {
    socket_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in to{};
    to.sin_family = AF_INET;
    const std::size_t colon = address.rfind(':');
    EXPECT_EQ(::inet_pton(AF_INET, address.substr(0, colon).c_str(), &to.sin_addr), 1);
    to.sin_port = htons(static_cast<std::uint16_t>(std::stoi(address.substr(colon + 1))));
    EXPECT_EQ(::connect(socket_, reinterpret_cast<sockaddr*>(&to), sizeof(to)), 0);
  }
  ~SilentConnection() { ::close(socket_); }
  SilentConnection(const SilentConnection&) = delete;
  SilentConnection& operator=(const SilentConnection&) = delete;

  // Whether the other side has sent something (gRPC's greeting) rather than closed it. Waits.
  [[nodiscard]] bool IsTaken() const {
    char byte = 0;
    return ::recv(socket_, &byte, 1, 0) == 1;
  }

 private:
  int socket_ = -1;
};

// The bytes of a HealthCheckResponse.
std::string Health(const std::shared_ptr<grpc::Channel>& channel) {
  grpc::GenericStub stub(channel);
  grpc::ClientContext context;
  context.set_deadline(DeadlineIn(kPatience));
  grpc::CompletionQueue queue;
  const grpc::ByteBuffer nothing;
  const grpc::Slice empty("");
  const grpc::ByteBuffer request(&empty, 1);
  const auto call =
      stub.PrepareUnaryCall(&context, "/grpc.health.v1.Health/Check", request, &queue);
  call->StartCall();
  grpc::ByteBuffer answer;
  grpc::Status status;
  call->Finish(&answer, &status, nullptr);
  void* tag = nullptr;
  bool ok = false;
  queue.Next(&tag, &ok);
  EXPECT_TRUE(status.ok()) << status.error_message();
  grpc::Slice whole;
  if (!status.ok() || !answer.DumpToSingleSlice(&whole).ok()) return {};
  return {reinterpret_cast<const char*>(whole.begin()), whole.size()};
}

bool WaitForHealth(const std::shared_ptr<grpc::Channel>& channel, const std::string& health) {
  for (int i = 0; i < 600; ++i) {
    if (Health(channel) == health) return true;
    std::this_thread::sleep_for(milliseconds(50));
  }
  return false;
}

const std::string kServing = "\x08\x01";
const std::string kNotServing = "\x08\x02";

TEST(DescriptorsTest, UsedUpDescriptorsRefuseConnectionsUntilThereAreFreeOnes) {
  const TemporaryFolder state;
  const std::string address = FreeAddress();
  ChildProcess server({"/bin/bash", "-c", "ulimit -n 128; exec \"$0\" \"$@\"",
                       kBin + "/lucerna-server", "--listen", address, "--state", state.path()});
  ASSERT_TRUE(server.WaitForText("listening on", kPatience)) << server.Errors();
  CoordinatorProcess user(address, CoordinatorProcess::Elsewhere());
  ASSERT_TRUE(user.List().empty());
  EXPECT_EQ(Health(user.channel()), kServing);
  {
    std::vector<std::unique_ptr<SilentConnection>> crowd;
    for (int i = 0; i < 200; ++i)
      crowd.push_back(std::make_unique<SilentConnection>(address));
    EXPECT_TRUE(server.WaitForText("connections are refused: of the 128 descriptors", kPatience))
        << server.Errors();
    EXPECT_TRUE(WaitForHealth(user.channel(), kNotServing));
    EXPECT_FALSE(SilentConnection(address).IsTaken());
    // Who is in works on, with files on the disk too.
    EXPECT_NE(user.Submit("glass-box.pbrt", 1, 10'000), "");
  }
  EXPECT_TRUE(server.WaitForText("connections are accepted again", kPatience)) << server.Errors();
  EXPECT_TRUE(WaitForHealth(user.channel(), kServing));
  EXPECT_TRUE(SilentConnection(address).IsTaken());
  const auto worker = user.StartWorker();
  const std::vector<v1::Job> jobs = user.List();
  ASSERT_EQ(jobs.size(), 1U);
  EXPECT_EQ(user.Wait(jobs[0].job_id()).state(), v1::JOB_STATE_SUCCEEDED);
}

TEST(DescriptorsTest, OneAddressHasSoManyConnections) {
  CoordinatorProcess coordinator({"--max-connections", "3"});
  auto first = std::make_unique<SilentConnection>(coordinator.address());
  const SilentConnection second(coordinator.address());
  const SilentConnection third(coordinator.address());
  EXPECT_TRUE(first->IsTaken());
  EXPECT_TRUE(second.IsTaken());
  EXPECT_TRUE(third.IsTaken());
  EXPECT_FALSE(SilentConnection(coordinator.address()).IsTaken());
  EXPECT_TRUE(coordinator.process().WaitForText("are refused: it has 3 already", kPatience));
  first.reset();
  bool is_taken = false;
  for (int i = 0; i < 600 && !is_taken; ++i) {
    is_taken = SilentConnection(coordinator.address()).IsTaken();
    if (!is_taken) std::this_thread::sleep_for(milliseconds(20));
  }
  EXPECT_TRUE(is_taken);
}

}  // namespace
}  // namespace lucerna
