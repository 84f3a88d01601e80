// One caller follows so many jobs at once, and not more.
#include <chrono>
#include <memory>
#include <string>

#include "gtest/gtest.h"

#include "tests/service/service_under_test.h"

namespace lucerna {
namespace {

class Watch {
 public:
  Watch(v1::JobService::Stub& stub, const std::string& job) {
    v1::WatchJobRequest request;
    request.set_job_id(job);
    context_.set_deadline(std::chrono::system_clock::now() + kCallLimit);
    reader_ = stub.Watch(&context_, request);
  }
  ~Watch() { context_.TryCancel(); }
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;

  [[nodiscard]] bool IsTold() {
    v1::Job job;
    return reader_->Read(&job);
  }
  [[nodiscard]] grpc::Status End() { return reader_->Finish(); }

 private:
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReader<v1::Job>> reader_;
};

TEST(WatchesTest, OneCallerHasSoManyAndAnEndedOneMakesRoom) {
  ServiceUnderTest service({.max_watches = 2});
  TestClient client(service);
  const Answer<v1::SubmitResponse> submitted =
      client.Submit(RequestFor(client.Upload(SmallScene()), "job", 2));
  ASSERT_TRUE(submitted.ok()) << submitted.status.error_message();
  const std::string& job = submitted.message.job_id();
  const auto stub = v1::JobService::NewStub(service.NewChannel());
  Watch first(*stub, job);
  ASSERT_TRUE(first.IsTold());
  auto second = std::make_unique<Watch>(*stub, job);
  ASSERT_TRUE(second->IsTold());
  // Connections of one machine are one caller.
  const auto other_stub = v1::JobService::NewStub(service.NewChannel());
  {
    Watch third(*other_stub, job);
    ASSERT_FALSE(third.IsTold());
    const grpc::Status refused = third.End();
    EXPECT_EQ(refused.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
    EXPECT_EQ(refused.error_message(), "you follow 2 jobs already; end some of that first");
  }
  second.reset();
  // The server hears of the end some time later.
  bool is_told = false;
  for (int i = 0; i < 1000 && !is_told; ++i)
    is_told = Watch(*other_stub, job).IsTold();
  EXPECT_TRUE(is_told);
}

}  // namespace
}  // namespace lucerna
