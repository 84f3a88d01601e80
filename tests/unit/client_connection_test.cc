// A coordinator that is slow to start, drops a stream or lacks a file must not cost the user the
// job; one that is not there must be named.
#include <atomic>
#include <map>
#include <string>
#include <vector>

#include "gtest/gtest.h"

#include "client/connection.h"
#include "client/exit_code.h"
#include "render/report/progress_view.h"

namespace lucerna {
namespace {

class FakeAssets final : public v1::AssetService::Service {
 public:
  grpc::Status FindMissing(grpc::ServerContext*, const v1::FindMissingRequest* request,
                           v1::FindMissingResponse* response) override {
    if (failures_left_-- > 0) return {grpc::StatusCode::UNAVAILABLE, "starting"};
    for (const std::string& digest : request->digests()) {
      if (!blobs.contains(digest)) response->add_missing(digest);
    }
    return grpc::Status::OK;
  }
  grpc::Status Upload(grpc::ServerContext*, grpc::ServerReader<v1::UploadRequest>* reader,
                      v1::UploadResponse*) override {
    ++uploads;
    v1::UploadRequest request;
    if (!reader->Read(&request) || !request.has_header()) {
      return {grpc::StatusCode::INVALID_ARGUMENT, "no header"};
    }
    const v1::UploadRequest::Header header = request.header();
    std::string bytes;
    while (reader->Read(&request)) {
      longest_chunk = std::max(longest_chunk, request.bytes().size());
      bytes += request.bytes();
      if (breaks_left_ > 0 && bytes.size() > 1000) {
        --breaks_left_;
        return {grpc::StatusCode::UNAVAILABLE, "draining"};
      }
    }
    if (bytes.size() != header.size_bytes() || Sha256(bytes).Bytes() != header.digest()) {
      return {grpc::StatusCode::DATA_LOSS, "not these bytes"};
    }
    blobs[header.digest()] = bytes;
    return grpc::Status::OK;
  }

  std::map<std::string, std::string> blobs;
  int uploads = 0;
  std::size_t longest_chunk = 0;
  int failures_left_ = 0;
  int breaks_left_ = 0;
};

class FakeJobs final : public v1::JobService::Service {
 public:
  // The first stream tells half and breaks, the second one ends without an end, the third tells
  // the rest.
  grpc::Status Watch(grpc::ServerContext*, const v1::WatchJobRequest* request,
                     grpc::ServerWriter<v1::Job>* writer) override {
    if (request->job_id() != "j1") return {grpc::StatusCode::NOT_FOUND, "no job of that name"};
    const int stream = ++watches;
    v1::Job job;
    job.set_job_id("j1");
    job.set_state(v1::JOB_STATE_RUNNING);
    writer->Write(job);
    if (stream == 1) return {grpc::StatusCode::UNAVAILABLE, "going down"};
    if (stream == 2) return grpc::Status::OK;
    job.set_state(v1::JOB_STATE_SUCCEEDED);
    writer->Write(job);
    return grpc::Status::OK;
  }
  grpc::Status List(grpc::ServerContext*, const v1::ListJobsRequest* request,
                    v1::ListJobsResponse* response) override {
    response->add_jobs()->set_job_id("page " + request->page_token());
    if (request->page_token().empty()) response->set_next_page_token("2");
    return grpc::Status::OK;
  }
  grpc::Status Submit(grpc::ServerContext*, const v1::SubmitRequest* request,
                      v1::SubmitResponse* response) override {
    request_ids.push_back(request->request_id());
    if (request_ids.size() == 1) return {grpc::StatusCode::CANCELLED, "raced a shutdown"};
    if (request->name() == "bad") return {grpc::StatusCode::INVALID_ARGUMENT, "a.pbrt:1:1: no"};
    response->set_job_id("j1");
    return grpc::Status::OK;
  }

  std::atomic<int> watches = 0;
  std::vector<std::string> request_ids;
};

class FakeImages final : public v1::ImageService::Service {
 public:
  grpc::Status GetImage(grpc::ServerContext*, const v1::GetImageRequest*,
                        grpc::ServerWriter<v1::Chunk>* writer) override {
    v1::Chunk chunk;
    chunk.set_bytes("abc");
    writer->Write(chunk);
    if (++calls == 1) return {grpc::StatusCode::UNAVAILABLE, "broken off"};
    chunk.set_bytes("def");
    writer->Write(chunk);
    return grpc::Status::OK;
  }
  int calls = 0;
};

class FixedFiles final : public SceneFiles {
 public:
  StatusOr<std::string> Read(const std::string& path) override { return bytes[path]; }
  std::map<std::string, std::string> bytes;
};

class ConnectionTest : public testing::Test {
 protected:
  ConnectionTest() {
    int port = 0;
    grpc::ServerBuilder builder;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
    builder.RegisterService(&assets_);
    builder.RegisterService(&jobs_);
    builder.RegisterService(&images_);
    server_ = builder.BuildAndStart();
    auto opened = ClientConnection::Open(Endpoint{"127.0.0.1:" + std::to_string(port)});
    EXPECT_TRUE(opened.ok()) << opened.status();
    connection_ = std::move(opened).value();
    files_.bytes = {{"a.pbrt", "the main file"},
                    {"big.ply", std::string(3'000'000, 'x')},
                    {"copy.ply", std::string(3'000'000, 'x')},
                    {"empty.ply", ""}};
    manifest_.main_path = "a.pbrt";
    for (const auto& [path, bytes] : files_.bytes) {
      manifest_.entries[path] = {Sha256(bytes), bytes.size()};
    }
  }

  FakeAssets assets_;
  FakeJobs jobs_;
  FakeImages images_;
  std::unique_ptr<grpc::Server> server_;
  std::unique_ptr<ClientConnection> connection_;
  FixedFiles files_;
  SceneManifest manifest_;
};

TEST_F(ConnectionTest, UploadsWhatIsMissingOnceAndInChunks) {
  assets_.blobs[std::string(Sha256("the main file").Bytes())] = "the main file";
  const Status status = connection_->Upload(manifest_, files_);
  ASSERT_TRUE(status.ok()) << status;
  EXPECT_EQ(assets_.uploads, 2) << "the mesh once for both its names, and the empty file";
  EXPECT_EQ(assets_.blobs.size(), 3U);
  EXPECT_LE(assets_.longest_chunk, std::size_t{1} << 20);
}

TEST_F(ConnectionTest, TriesAgainWhatBrokeOff) {
  assets_.failures_left_ = 2;
  assets_.breaks_left_ = 1;
  const Status status = connection_->Upload(manifest_, files_);
  ASSERT_TRUE(status.ok()) << status;
  EXPECT_EQ(assets_.blobs.size(), 3U);
}

TEST_F(ConnectionTest, SaysWhichFileChangedMeanwhile) {
  files_.bytes["big.ply"][7] = 'y';
  const Status status = connection_->Upload(manifest_, files_);
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_NE(std::string(status.message()).find("big.ply"), std::string::npos) << status;
}

TEST_F(ConnectionTest, ARetriedSubmissionCarriesTheSameRequestId) {
  v1::SubmitRequest request;
  request.set_request_id("r1");
  const auto submitted = connection_->Submit(request);
  ASSERT_TRUE(submitted.ok()) << submitted.status();
  EXPECT_EQ(jobs_.request_ids, (std::vector<std::string>{"r1", "r1"}));
  request.set_name("bad");
  EXPECT_EQ(connection_->Submit(request).status().message(), "a.pbrt:1:1: no");
}

TEST_F(ConnectionTest, OpensABrokenWatchAgainUntilTheJobHasEnded) {
  int seen = 0;
  const auto job = connection_->Watch("j1", [&](const v1::Job&) {
    ++seen;
    return absl::OkStatus();
  });
  ASSERT_TRUE(job.ok()) << job.status();
  EXPECT_EQ(job->state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(jobs_.watches, 3);
  EXPECT_GE(seen, 3);
}

TEST_F(ConnectionTest, AWatchEndsWhenItsCallerHasEnough) {
  const auto job =
      connection_->Watch("j1", [](const v1::Job&) { return absl::InternalError("a worker died"); });
  EXPECT_EQ(job.status().message(), "a worker died");
}

TEST_F(ConnectionTest, AnUnknownJobIsNotWaitedFor) {
  const auto job = connection_->Watch("j2", [](const v1::Job&) { return absl::OkStatus(); });
  EXPECT_EQ(job.status().code(), absl::StatusCode::kNotFound);
}

TEST_F(ConnectionTest, AnImageThatBrokeOffIsFetchedFromItsBeginning) {
  const auto bytes = connection_->GetImage("j1");
  ASSERT_TRUE(bytes.ok()) << bytes.status();
  EXPECT_EQ(*bytes, "abcdef");
}

TEST_F(ConnectionTest, ListsAllPages) {
  const auto jobs = connection_->List();
  ASSERT_TRUE(jobs.ok());
  ASSERT_EQ(jobs->size(), 2U);
  EXPECT_EQ((*jobs)[1].job_id(), "page 2");
}

TEST_F(ConnectionTest, NamesACoordinatorThatIsGone) {
  server_->Shutdown();
  const Status status = connection_->List().status();
  EXPECT_EQ(ExitCodeOf(status), ExitCode::kUnreachable) << status;
  EXPECT_NE(std::string(status.message()).find("is lucerna-server running there?"),
            std::string::npos);
}

TEST(ConnectionOpenTest, NamesACoordinatorThatIsNotThere) {
  const Status status = ClientConnection::Open(Endpoint{"127.0.0.1:1"}).status();
  EXPECT_EQ(ExitCodeOf(status), ExitCode::kUnreachable) << status;
  EXPECT_NE(std::string(status.message()).find("cannot reach the coordinator at 127.0.0.1:1"),
            std::string::npos);
}

}  // namespace
}  // namespace lucerna
