// A client that begins an upload and then says nothing must not hold it open for ever.
#include <atomic>
#include <chrono>
#include <string>
#include <thread>

#include "gtest/gtest.h"

#include "render/base/digest.h"
#include "tests/service/service_under_test.h"

namespace lucerna {
namespace {

TEST(StalledUploadsTest, AnUploadThatStopsIsEndedAndOneThatMovesIsNot) {
  ServiceUnderTest service;
  const auto stub = v1::AssetService::NewStub(service.NewChannel());
  const std::string bytes(3000, 'x');
  v1::UploadRequest header;
  header.mutable_header()->set_digest(std::string(Sha256(bytes).Bytes()));
  header.mutable_header()->set_size_bytes(bytes.size());
  v1::UploadRequest part;
  part.set_bytes(bytes.substr(0, 1000));

  grpc::ClientContext moving_context;
  moving_context.set_deadline(std::chrono::system_clock::now() + kCallLimit);
  v1::UploadResponse response;
  const auto moving = stub->Upload(&moving_context, &response);
  ASSERT_TRUE(moving->Write(header));
  // Longer in all than silence may be, but no two steps are.
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(moving->Write(part));
    v1::FindMissingResponse missing;
    grpc::ClientContext context;
    ASSERT_TRUE(stub->FindMissing(&context, {}, &missing).ok());
    service.clock().Move(std::chrono::seconds(70));
  }
  moving->WritesDone();
  EXPECT_TRUE(moving->Finish().ok());

  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + kCallLimit);
  const auto silent = stub->Upload(&context, &response);
  ASSERT_TRUE(silent->Write(header));
  ASSERT_TRUE(silent->Write(part));
  // Time passes until the call ends, whenever the server reads the part.
  std::atomic<bool> has_ended = false;
  std::thread time([&] {
    while (!has_ended) {
      service.clock().Move(std::chrono::seconds(200));
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  });
  EXPECT_EQ(silent->Finish().error_code(), grpc::StatusCode::CANCELLED);
  has_ended = true;
  time.join();
}

}  // namespace
}  // namespace lucerna
