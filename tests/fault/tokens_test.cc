// What may a caller with this token do?
//
// Real programs on loopback. The methods come from the protocol itself, so that one which is added
// without a rule fails here.
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "gtest/gtest.h"
#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/dynamic_message.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <signal.h>

#include "proto/lucerna/v1/images.grpc.pb.h"
#include "proto/lucerna/v1/jobs.grpc.pb.h"
#include "render/base/digest.h"
#include "render/base/files.h"
#include "render/wire/channel.h"
#include "server/access.h"
#include "tests/fault/coordinator_process.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace {

using grpc::StatusCode;
using std::chrono::milliseconds;

std::string Line(const std::string& name, const std::string& roles) {
  return name + " " + roles + " " + Sha256("token-of-" + name).Hex() + "\n";
}

// A file with the tokens "token-of-NAME".
class TokensFile {
 public:
  TokensFile() {
    Write(Line("alice", "submit") + Line("bob", "submit") + Line("farm", "work") +
          Line("root", "admin"));
  }
  void Write(const std::string& text) const {
    ASSERT_TRUE(WriteFile(path(), text).ok());
    std::filesystem::permissions(
        path(), std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
  }
  [[nodiscard]] std::string path() const { return folder_.At("tokens"); }

 private:
  TemporaryFolder folder_;
};

// The protocol as its source files say.
class Protocol {
 public:
  Protocol() {
    std::vector<std::string> command = {"/usr/bin/protoc", "-I", LUCERNA_SOURCE_DIR,
                                        "--include_imports",
                                        "--descriptor_set_out=" + folder_.At("protocol")};
    for (const auto& entry :
         std::filesystem::directory_iterator(LUCERNA_SOURCE_DIR "/proto/lucerna/v1"))
      command.push_back(entry.path().string());
    const Finished compiled = RunProgram(command);
    EXPECT_EQ(compiled.exit_code, 0) << compiled.errors;
    google::protobuf::FileDescriptorSet files;
    EXPECT_TRUE(files.ParseFromString(ReadFile(folder_.At("protocol")).value_or("")));
    // Imports come before the files that need them.
    for (const google::protobuf::FileDescriptorProto& each : files.file()) {
      const google::protobuf::FileDescriptor* const file = pool_.BuildFile(each);
      EXPECT_NE(file, nullptr) << each.name();
      for (int s = 0; file != nullptr && s < file->service_count(); ++s) {
        for (int m = 0; m < file->service(s)->method_count(); ++m)
          methods_.push_back(file->service(s)->method(m));
      }
    }
  }

  [[nodiscard]] const std::vector<const google::protobuf::MethodDescriptor*>& methods() const {
    return methods_;
  }
  // "/package.Service/Method".
  static std::string PathOf(const google::protobuf::MethodDescriptor& method) {
    return "/" + method.service()->full_name() + "/" + method.name();
  }
  // A request with this job's id, as bytes; absent for methods that are not about one job.
  std::optional<std::string> RequestFor(const google::protobuf::MethodDescriptor& method,
                                        const std::string& job_id) {
    const google::protobuf::FieldDescriptor* const field =
        method.input_type()->FindFieldByName("job_id");
    if (field == nullptr) return std::nullopt;
    const std::unique_ptr<google::protobuf::Message> request(
        factory_.GetPrototype(method.input_type())->New());
    request->GetReflection()->SetString(request.get(), field, job_id);
    return request->SerializeAsString();
  }

 private:
  TemporaryFolder folder_;
  google::protobuf::DescriptorPool pool_;
  google::protobuf::DynamicMessageFactory factory_;
  std::vector<const google::protobuf::MethodDescriptor*> methods_;
};

// Calls any method, with one request or an empty stream of them.
grpc::Status Call(const std::shared_ptr<grpc::Channel>& channel, const std::string& method,
                  const std::optional<std::string>& request) {
  grpc::GenericStub stub(channel);
  grpc::ClientContext context;
  context.set_deadline(DeadlineIn(kPatience));
  grpc::CompletionQueue queue;
  const auto wait = [&queue] {
    void* tag = nullptr;
    bool ok = false;
    queue.Next(&tag, &ok);
  };
  const auto call = stub.PrepareCall(&context, method, &queue);
  call->StartCall(nullptr);
  wait();
  if (request) {
    const grpc::Slice slice(*request);
    call->Write(grpc::ByteBuffer(&slice, 1), nullptr);
    wait();
  }
  call->WritesDone(nullptr);
  wait();
  grpc::Status status;
  call->Finish(&status, nullptr);
  wait();
  return status;
}

grpc::Status CallEmpty(const std::shared_ptr<grpc::Channel>& channel, const std::string& method) {
  return Call(channel, method, std::nullopt);
}

std::shared_ptr<grpc::Channel> ChannelOf(const CoordinatorProcess& coordinator,
                                         const std::string& name) {
  return MakeChannel({coordinator.address(), {}, name.empty() ? "" : "token-of-" + name});
}

TEST(TokensTest, EveryMethodHasARuleAndKeepsIt) {
  const Protocol protocol;
  ASSERT_GE(protocol.methods().size(), 17U);
  const TokensFile tokens;
  CoordinatorProcess coordinator({"--tokens", tokens.path()});
  const std::map<std::string, Roles> callers = {{"alice", static_cast<Roles>(Role::kSubmit)},
                                                {"farm", static_cast<Roles>(Role::kWork)},
                                                {"root", static_cast<Roles>(Role::kAdmin)}};
  for (const auto* const described : protocol.methods()) {
    const std::string method = Protocol::PathOf(*described);
    const std::optional<MethodRule> rule = RuleOf(method);
    ASSERT_TRUE(rule) << method << ": what role does it need? (server/access.cc)";
    EXPECT_FALSE(rule->is_open) << method;
    EXPECT_TRUE(Has(rule->roles, Role::kAdmin)) << method << ": an admin may do everything";
    EXPECT_EQ(CallEmpty(ChannelOf(coordinator, ""), method).error_code(),
              StatusCode::UNAUTHENTICATED)
        << method;
    EXPECT_EQ(CallEmpty(ChannelOf(coordinator, "mallory"), method).error_code(),
              StatusCode::UNAUTHENTICATED)
        << method;
    for (const auto& [name, roles] : callers) {
      const StatusCode code = CallEmpty(ChannelOf(coordinator, name), method).error_code();
      EXPECT_NE(code, StatusCode::UNAUTHENTICATED) << method << " by " << name;
      EXPECT_EQ(code == StatusCode::PERMISSION_DENIED, (roles & rule->roles) == 0)
          << method << " by " << name;
    }
  }
  EXPECT_EQ(
      CallEmpty(ChannelOf(coordinator, "root"), "/lucerna.v1.JobService/NotThere").error_code(),
      StatusCode::UNIMPLEMENTED);
  EXPECT_TRUE(CallEmpty(ChannelOf(coordinator, ""), "/grpc.health.v1.Health/Check").error_code() !=
              StatusCode::UNAUTHENTICATED);
}

TEST(TokensTest, AJobIsChangedByItsOwnerAndByAdmins) {
  const TokensFile tokens;
  const TemporaryFolder state;
  const std::vector<std::string> flags = {"--tokens", tokens.path(), "--state", state.path()};
  std::string job;
  const auto code_of_cancel = [&](const CoordinatorProcess& coordinator, const std::string& name) {
    grpc::ClientContext context;
    context.set_deadline(DeadlineIn(kPatience));
    v1::CancelJobRequest request;
    request.set_job_id(job);
    v1::Job answer;
    return v1::JobService::NewStub(ChannelOf(coordinator, name))
        ->Cancel(&context, request, &answer)
        .error_code();
  };
  {
    CoordinatorProcess coordinator(flags);
    coordinator.UseSecurity({}, "token-of-alice");
    job = coordinator.Submit("glass-box.pbrt", 2, 10'000);
    const std::string bobs_lucerna = kBin + "/lucerna";
    const Finished list = RunProgram({"/usr/bin/env", "LUCERNA_TOKEN=token-of-bob", bobs_lucerna,
                                      "jobs", "--server", coordinator.address()});
    EXPECT_NE(list.output.find(job), std::string::npos) << "everybody sees what there is";
    EXPECT_NE(list.output.find("alice"), std::string::npos) << list.output;
    for (const std::string command : {"cancel", "stop", "delete", "fetch", "extend"}) {
      std::vector<std::string> words = {
          "/usr/bin/env", "LUCERNA_TOKEN=token-of-bob", bobs_lucerna, command, job,
          "--server",     coordinator.address()};
      if (command == "fetch") words.insert(words.end(), {"-o", state.At("stolen.exr")});
      if (command == "extend") words.insert(words.end(), {"--passes", "1000"});
      const Finished refused = RunProgram(words);
      EXPECT_EQ(refused.exit_code, 1) << command;
      EXPECT_NE(refused.errors.find("is of alice; only its owner and admins"), std::string::npos)
          << command << ": " << refused.errors;
    }
    EXPECT_FALSE(std::filesystem::exists(state.At("stolen.exr")));
    // The same request id of another user is another job.
    coordinator.UseSecurity({}, "token-of-bob");
    EXPECT_NE(coordinator.Submit("glass-box.pbrt", 2, 10'000), job);
  }
  // The owner is kept with the job.
  CoordinatorProcess coordinator(flags);
  coordinator.UseSecurity({}, "token-of-bob");
  EXPECT_EQ(coordinator.Get(job).owner(), "alice");
  EXPECT_EQ(code_of_cancel(coordinator, "bob"), StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(code_of_cancel(coordinator, "alice"), StatusCode::OK);
  EXPECT_EQ(code_of_cancel(coordinator, "root"), StatusCode::OK);
}

// Also of methods that are added later: whatever is about one job and not only shows it.
TEST(TokensTest, NoMethodThatChangesAJobIsForOthers) {
  Protocol protocol;
  const TokensFile tokens;
  CoordinatorProcess coordinator({"--tokens", tokens.path()});
  coordinator.UseSecurity({}, "token-of-alice");
  const std::string job = coordinator.Submit("glass-box.pbrt", 2, 10'000);
  const std::set<std::string> only_show = {"/lucerna.v1.JobService/Get",
                                           "/lucerna.v1.JobService/Watch"};
  int changing = 0;
  for (const auto* const method : protocol.methods()) {
    const std::string path = Protocol::PathOf(*method);
    const std::optional<std::string> request = protocol.RequestFor(*method, job);
    const std::optional<MethodRule> rule = RuleOf(path);
    if (!request || !rule || !Has(rule->roles, Role::kSubmit) || only_show.contains(path)) continue;
    ++changing;
    EXPECT_EQ(Call(ChannelOf(coordinator, "bob"), path, request).error_code(),
              StatusCode::PERMISSION_DENIED)
        << path;
  }
  EXPECT_GE(changing, 6) << "stop, extend, cancel, delete, the image, and what photons need";
}

TEST(TokensTest, AWorkerNeedsATokenAndRendersWithIt) {
  const TokensFile tokens;
  const TemporaryFolder folder;
  CoordinatorProcess coordinator({"--tokens", tokens.path()});
  const auto stranger = coordinator.StartWorker();
  EXPECT_EQ(stranger->WaitForExit(kPatience), 4);
  EXPECT_NE(stranger->Errors().find("asks for a token"), std::string::npos) << stranger->Errors();

  ASSERT_TRUE(WriteFile(folder.At("token"), "token-of-farm\n").ok());
  std::filesystem::permissions(
      folder.At("token"), std::filesystem::perms::owner_all | std::filesystem::perms::others_read);
  const auto careless = coordinator.StartWorker({"--token-file", folder.At("token")});
  EXPECT_EQ(careless->WaitForExit(kPatience), 2);
  EXPECT_NE(careless->Errors().find("chmod 600"), std::string::npos) << careless->Errors();

  std::filesystem::permissions(folder.At("token"), std::filesystem::perms::owner_all);
  const auto worker = coordinator.StartWorker({"--token-file", folder.At("token")});
  coordinator.UseSecurity({}, "token-of-alice");
  const std::string job = coordinator.Submit("glass-box.pbrt", 1, 10'000);
  EXPECT_EQ(coordinator.Wait(job).state(), v1::JOB_STATE_SUCCEEDED);
}

TEST(TokensTest, TheFileIsReadAgainAndABadOneChangesNothing) {
  const TokensFile tokens;
  CoordinatorProcess coordinator({"--tokens", tokens.path()});
  const std::string list = "/lucerna.v1.JobService/List";
  const auto wait_for = [&](const std::string& name, StatusCode code) {
    for (int i = 0; i < 600; ++i) {
      const bool is_out =
          CallEmpty(ChannelOf(coordinator, name), list).error_code() == StatusCode::UNAUTHENTICATED;
      if (is_out == (code == StatusCode::UNAUTHENTICATED)) return true;
      std::this_thread::sleep_for(milliseconds(50));
    }
    return false;
  };
  ASSERT_TRUE(wait_for("carol", StatusCode::UNAUTHENTICATED));
  tokens.Write(Line("carol", "submit"));
  EXPECT_TRUE(wait_for("carol", StatusCode::OK));
  EXPECT_TRUE(wait_for("alice", StatusCode::UNAUTHENTICATED)) << "taken out";

  tokens.Write(Line("alice", "submit") + "alice conquer 00\n");
  EXPECT_TRUE(coordinator.process().WaitForText("\"conquer\" is no role", kPatience));
  EXPECT_TRUE(coordinator.process().WaitForText("the tokens stay as they were", kPatience));
  EXPECT_TRUE(wait_for("carol", StatusCode::OK));

  std::filesystem::permissions(tokens.path(), std::filesystem::perms::others_read,
                               std::filesystem::perm_options::add);
  const Finished open =
      RunProgram({kBin + "/lucerna-server", "--listen", "127.0.0.1:0", "--tokens", tokens.path()});
  EXPECT_EQ(open.exit_code, 2);
  EXPECT_NE(open.errors.find("every user may read or write this file"), std::string::npos)
      << open.errors;
}

TEST(TokensTest, ATokenIsMadeByTheClient) {
  const Finished made =
      RunProgram({kBin + "/lucerna", "token", "new", "dora", "--roles", "submit,work"});
  ASSERT_EQ(made.exit_code, 0) << made.errors;
  const std::size_t at = made.output.find("lucerna-");
  ASSERT_NE(at, std::string::npos);
  const std::string token = made.output.substr(at, made.output.find('\n', at) - at);
  EXPECT_EQ(token.size(), 8U + 64U);
  const TokensFile tokens;
  const std::size_t line = made.output.find("dora submit,work ");
  ASSERT_NE(line, std::string::npos) << made.output;
  tokens.Write(made.output.substr(line));
  CoordinatorProcess coordinator({"--tokens", tokens.path()});
  EXPECT_NE(
      CallEmpty(MakeChannel({coordinator.address(), {}, token}), "/lucerna.v1.JobService/List")
          .error_code(),
      StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(RunProgram({kBin + "/lucerna", "token", "new", "dora", "--roles", "king"}).exit_code,
            2);
}

}  // namespace
}  // namespace lucerna
