// Names that others choose must not move the cursor of whoever reads them.
#include <string>

#include "gtest/gtest.h"
#include <grpcpp/grpcpp.h>

#include "proto/lucerna/v1/jobs.grpc.pb.h"
#include "proto/lucerna/v1/work.grpc.pb.h"
#include "render/geometry/numeric_profile.h"
#include "render/wire/channel.h"
#include "tests/fault/coordinator_process.h"

namespace lucerna {
namespace {

const std::string kEvil = "x\x1b[2J\r\n[info] forged\u202e";

bool IsHarmless(const std::string& text) {
  return text.find('\x1b') == std::string::npos && text.find('\r') == std::string::npos &&
         text.find("\n[info] forged") == std::string::npos &&
         text.find("\u202e") == std::string::npos;
}

TEST(HostileTextTest, NamesAreEscapedInTheLogAndOnTheTerminal) {
  CoordinatorProcess coordinator;
  v1::RegisterRequest worker;
  worker.set_name(kEvil);
  worker.set_numeric_profile(NumericProfile());
  v1::RegisterResponse registered;
  grpc::ClientContext context;
  ASSERT_TRUE(v1::WorkerService::NewStub(coordinator.channel())
                  ->Register(&context, worker, &registered)
                  .ok());
  ASSERT_TRUE(coordinator.process().WaitForText("(x\\x1b[2J\\x0d\\x0a[info]", kPatience))
      << coordinator.process().Errors();
  v1::GoodbyeRequest goodbye;
  goodbye.set_worker_id(kEvil);
  v1::GoodbyeResponse gone;
  grpc::ClientContext second;
  ASSERT_TRUE(
      v1::WorkerService::NewStub(coordinator.channel())->Goodbye(&second, goodbye, &gone).ok());
  EXPECT_TRUE(IsHarmless(coordinator.process().Errors())) << coordinator.process().Errors();

  // A job's name, and what the coordinator says of a job that it does not know.
  const std::string job = coordinator.Submit("glass-box.pbrt", 1, 10'000, kEvil);
  for (const std::string flag : {"--json", ""}) {
    std::vector<std::string> command = {kBin + "/lucerna", "jobs", "--server",
                                        coordinator.address()};
    if (!flag.empty()) command.push_back(flag);
    const Finished list = RunProgram(command);
    EXPECT_EQ(list.exit_code, 0);
    EXPECT_NE(list.output.find("forged"), std::string::npos) << list.output;
    EXPECT_TRUE(IsHarmless(list.output)) << list.output;
  }
  const Finished unknown =
      RunProgram({kBin + "/lucerna", "cancel", "no\x1b[2Jjob", "--server", coordinator.address()});
  EXPECT_EQ(unknown.exit_code, 1);
  EXPECT_TRUE(IsHarmless(unknown.errors)) << unknown.errors;
}

}  // namespace
}  // namespace lucerna
