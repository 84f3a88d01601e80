#include "tests/service/service_under_test.h"

#include <algorithm>
#include <utility>

#include "gtest/gtest.h"
#include <spdlog/spdlog.h>

#include "render/base/digest.h"
#include "render/estimate/accumulation.h"
#include "render/estimate/evidence.h"
#include "render/estimate/hitpoint_block.h"
#include "render/estimate/slice_sums.h"
#include "render/scene/scene_files.h"
#include "render/wire/accumulation_codec.h"
#include "render/wire/block_codec.h"
#include "render/wire/channel.h"
#include "render/wire/chunks.h"
#include "render/wire/messages.h"
#include "render/wire/slice_codec.h"

namespace lucerna {
namespace {

constexpr std::size_t kMostHitpoints = 1024;

class Deadline {
 public:
  Deadline() { context_.set_deadline(std::chrono::system_clock::now() + kCallLimit); }
  grpc::ClientContext* operator&() { return &context_; }
  grpc::ClientContext& operator*() { return context_; }

 private:
  grpc::ClientContext context_;
};

// The header first, then the bytes in chunks. A write that fails has its reason in Finish.
template <typename Writer, typename Request>
grpc::Status Send(Writer& writer, Request header, std::string_view bytes) {
  bool is_open = writer.Write(header);
  for (std::string_view chunk = NextChunk(bytes); is_open && !chunk.empty();
       chunk = NextChunk(bytes)) {
    Request part;
    part.set_bytes(chunk.data(), chunk.size());
    is_open = writer.Write(part);
  }
  writer.WritesDone();
  return writer.Finish();
}

}  // namespace

void SetEscaped(BatchTally& tally, std::uint64_t photons) {
  // Each photon of a single light has the whole power.
  const auto energy = static_cast<std::int64_t>(photons) << kEnergyBits;
  tally.photons = photons;
  tally.energy.emitted = energy;
  tally.energy.escaped = energy;
  tally.lights = {{.sent = photons}};
}

TestScene SmallScene() {
  return {.files = {{"scene.pbrt", R"(
LookAt 0 -3 1  0 0 0  0 0 1
Camera "perspective" "float fov" [50]
Film "rgb" "integer xresolution" [8] "integer yresolution" [8] "string filename" ["small.exr"]
WorldBegin
LightSource "point" "point3 from" [0 0 2] "rgb I" [4 4 4]
Material "diffuse" "rgb reflectance" [0.5 0.5 0.5]
Shape "trianglemesh" "point3 P" [-2 -2 0  2 -2 0  2 2 0  -2 2 0] "integer indices" [0 1 2 0 2 3]
Shape "trianglemesh" "point3 P" [-2 2 0  2 2 0  2 2 3  -2 2 3] "integer indices" [0 1 2 0 2 3]
)"}}};
}

v1::SubmitRequest RequestFor(const v1::SceneManifest& scene, const std::string& request_id,
                             std::int64_t passes) {
  v1::SubmitRequest request;
  request.set_request_id(request_id);
  *request.mutable_scene() = scene;
  RenderOverrides overrides;
  overrides.passes = passes;
  overrides.photons_per_pass = 1000;
  overrides.radius_controller = RadiusControllerKind::kPppm;
  *request.mutable_overrides() = ToProto(overrides);
  return request;
}

// Server
// ---------------------------------------------------------------------------------------------

ServiceUnderTest::ServiceUnderTest(const ServiceChoices& choices) {
  spdlog::set_level(spdlog::level::err);
  Coordinator::Options options;
  options.threads = 1;
  options.audit_share = choices.audit_share;
  options.jobs_at_once = choices.jobs_at_once;
  options.max_memory_bytes = choices.max_memory_bytes;
  options.max_watches = choices.max_watches;
  options.numeric_profile = kNumericProfile;
  coordinator_ = std::make_unique<Coordinator>(options, clock_);
  assets_ = std::make_unique<AssetService>(coordinator_->blobs(), coordinator_->budget(), pools_,
                                           &coordinator_->transfers());
  jobs_ = std::make_unique<JobService>(*coordinator_, pools_, clock_);
  images_ = std::make_unique<ImageService>(*coordinator_, pools_);
  workers_ = std::make_unique<WorkerService>(*coordinator_, pools_);
  admin_ = std::make_unique<AdminService>(*coordinator_, clock_);
  grpc::ServerBuilder builder;
  SetUpConnections(builder);
  builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port_);
  builder.RegisterService(assets_.get());
  builder.RegisterService(jobs_.get());
  builder.RegisterService(images_.get());
  builder.RegisterService(workers_.get());
  builder.RegisterService(admin_.get());
  server_ = builder.BuildAndStart();
  EXPECT_NE(server_, nullptr);
  ticks_ = std::thread([this] {
    while (!is_shut_down_) {
      coordinator_->Tick();
      jobs_->Tick();
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  });
}

ServiceUnderTest::~ServiceUnderTest() {
  ShutDown();
}

void ServiceUnderTest::ShutDown() {
  if (is_shut_down_.exchange(true)) return;
  ticks_.join();
  coordinator_->Close();
  pools_.Close();
  jobs_->Close();
  server_->Shutdown(DeadlineIn(std::chrono::seconds(1)));
  server_->Wait();
  server_.reset();
}

std::shared_ptr<grpc::Channel> ServiceUnderTest::NewChannel() const {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  std::shared_ptr<grpc::Channel> channel = grpc::CreateCustomChannel(
      absl::StrCat("127.0.0.1:", port_), grpc::InsecureChannelCredentials(), arguments);
  // Calls of tests fail when a connection is not there; on a busy machine one attempt may not do.
  EXPECT_TRUE(channel->WaitForConnected(DeadlineIn(std::chrono::seconds(60))));
  return channel;
}

// Client
// ---------------------------------------------------------------------------------------------

TestClient::TestClient(const ServiceUnderTest& service) {
  const std::shared_ptr<grpc::Channel> channel = service.NewChannel();
  assets_ = v1::AssetService::NewStub(channel);
  jobs_ = v1::JobService::NewStub(channel);
  images_ = v1::ImageService::NewStub(channel);
}

grpc::Status TestClient::UploadBytes(const std::string& bytes) {
  Deadline context;
  v1::UploadResponse response;
  const auto writer = assets_->Upload(&context, &response);
  v1::UploadRequest header;
  header.mutable_header()->set_digest(std::string(Sha256(bytes).Bytes()));
  header.mutable_header()->set_size_bytes(bytes.size());
  return Send(*writer, header, bytes);
}

v1::SceneManifest TestClient::Upload(const TestScene& scene) {
  SceneManifest manifest;
  manifest.main_path = scene.main_path;
  for (const auto& [path, bytes] : scene.files) {
    const grpc::Status status = UploadBytes(bytes);
    EXPECT_TRUE(status.ok()) << status.error_message();
    manifest.entries[path] = {Sha256(bytes), bytes.size()};
  }
  return ToProto(manifest);
}

Answer<v1::SubmitResponse> TestClient::Submit(const v1::SubmitRequest& request) {
  Deadline context;
  Answer<v1::SubmitResponse> answer;
  answer.status = jobs_->Submit(&context, request, &answer.message);
  return answer;
}

Answer<v1::Job> TestClient::Get(const std::string& job_id) {
  Deadline context;
  v1::GetJobRequest request;
  request.set_job_id(job_id);
  Answer<v1::Job> answer;
  answer.status = jobs_->Get(&context, request, &answer.message);
  return answer;
}

Answer<v1::Job> TestClient::Cancel(const std::string& job_id) {
  Deadline context;
  v1::CancelJobRequest request;
  request.set_job_id(job_id);
  Answer<v1::Job> answer;
  answer.status = jobs_->Cancel(&context, request, &answer.message);
  return answer;
}

Answer<v1::Job> TestClient::Stop(const std::string& job_id) {
  Deadline context;
  v1::StopJobRequest request;
  request.set_job_id(job_id);
  Answer<v1::Job> answer;
  answer.status = jobs_->Stop(&context, request, &answer.message);
  return answer;
}

Answer<v1::Job> TestClient::Extend(const std::string& job_id, std::int64_t passes) {
  Deadline context;
  v1::ExtendJobRequest request;
  request.set_job_id(job_id);
  RenderOverrides until;
  until.passes = passes;
  *request.mutable_until() = ToProto(until);
  Answer<v1::Job> answer;
  answer.status = jobs_->Extend(&context, request, &answer.message);
  return answer;
}

Answer<v1::Job> TestClient::Pause(const std::string& job_id) {
  Deadline context;
  v1::PauseJobRequest request;
  request.set_job_id(job_id);
  Answer<v1::Job> answer;
  answer.status = jobs_->Pause(&context, request, &answer.message);
  return answer;
}

Answer<v1::Job> TestClient::Resume(const std::string& job_id) {
  Deadline context;
  v1::ResumeJobRequest request;
  request.set_job_id(job_id);
  Answer<v1::Job> answer;
  answer.status = jobs_->Resume(&context, request, &answer.message);
  return answer;
}

Answer<v1::Job> TestClient::SetPriority(const std::string& job_id, int priority) {
  Deadline context;
  v1::SetJobPriorityRequest request;
  request.set_job_id(job_id);
  request.set_priority(priority);
  Answer<v1::Job> answer;
  answer.status = jobs_->SetPriority(&context, request, &answer.message);
  return answer;
}

Answer<v1::ListJobsResponse> TestClient::List(const v1::ListJobsRequest& request) {
  Deadline context;
  Answer<v1::ListJobsResponse> answer;
  answer.status = jobs_->List(&context, request, &answer.message);
  return answer;
}

Answer<v1::Job> TestClient::Watch(const std::string& job_id,
                                  const std::function<bool(const v1::Job&)>& at_each) {
  Deadline context;
  v1::WatchJobRequest request;
  request.set_job_id(job_id);
  const auto reader = jobs_->Watch(&context, request);
  Answer<v1::Job> answer;
  while (reader->Read(&answer.message)) {
    if (!at_each(answer.message)) (*context).TryCancel();
  }
  answer.status = reader->Finish();
  return answer;
}

Answer<v1::Job> TestClient::WaitFor(const std::string& job_id,
                                    const std::vector<v1::JobState>& states) {
  const auto is_there = [&](const v1::Job& job) {
    return std::find(states.begin(), states.end(), job.state()) != states.end();
  };
  std::optional<v1::Job> found;
  Answer<v1::Job> answer = Watch(job_id, [&](const v1::Job& job) {
    if (!found && is_there(job)) found = job;
    return !found;
  });
  if (found) return {grpc::Status::OK, *found};
  EXPECT_TRUE(is_there(answer.message))
      << v1::JobState_Name(answer.message.state()) << " " << answer.message.failure() << " "
      << answer.status.error_message();
  return answer;
}

Answer<std::string> TestClient::Image(const std::string& job_id) {
  Deadline context;
  v1::GetImageRequest request;
  request.set_job_id(job_id);
  const auto reader = images_->GetImage(&context, request);
  Answer<std::string> answer;
  v1::Chunk chunk;
  while (reader->Read(&chunk))
    answer.message += chunk.bytes();
  answer.status = reader->Finish();
  return answer;
}

// Worker
// ---------------------------------------------------------------------------------------------

IdleHandsWorker::IdleHandsWorker(const ServiceUnderTest& service, const std::string& identity)
    : stub_(v1::WorkerService::NewStub(service.NewChannel())) {
  Deadline context;
  v1::RegisterRequest request;
  request.set_name("idle hands");
  request.set_threads(1);
  request.set_identity(identity);
  request.set_numeric_profile(ServiceUnderTest::kNumericProfile);
  v1::RegisterResponse response;
  const grpc::Status status = stub_->Register(&context, request, &response);
  EXPECT_TRUE(status.ok()) << status.error_message();
  id_ = response.worker_id();
}

Answer<v1::SyncResponse> IdleHandsWorker::Sync(bool wants_lease, Duration wait,
                                               std::vector<std::string> held,
                                               grpc::ClientContext* context) {
  Deadline own;
  v1::SyncRequest request;
  request.set_worker_id(id_);
  request.set_wants_lease(wants_lease);
  *request.mutable_wait_at_most() = ToProto(wait);
  for (std::string& lease : held)
    request.add_held_lease_ids(std::move(lease));
  Answer<v1::SyncResponse> answer;
  answer.status = stub_->Sync(context != nullptr ? context : &own, request, &answer.message);
  return answer;
}

std::string IdleHandsWorker::ResultOf(const v1::Lease& lease) {
  if (lease.kind() == v1::WORK_KIND_PASSES) {
    SliceSums slice = EmptySlice({lease.first(), lease.last()}, kSmallScenePixels,
                                 ControllerColumns(RadiusControllerKind::kPppm));
    SetEscaped(slice.tally, lease.photons_per_pass() * slice.passes.size());
    return EncodeSlice(slice);
  }
  Accumulation accumulation;
  accumulation.evidence.resize(EvidenceColumns(Evidence::kNone));
  SetEscaped(accumulation.tally, lease.last() - lease.first());
  // Without a block the pass has ended, and the answer comes before the bytes.
  const StatusOr<HitpointBlock> block =
      DecodeHitpointBlock(Fetch(lease.block_digest()).message, kMostHitpoints);
  return EncodeAccumulation(accumulation, block.ok() ? block->size() : 0);
}

Answer<v1::CommitBatchResponse> IdleHandsWorker::CommitBytes(const v1::Lease& lease,
                                                             const std::string& bytes) {
  v1::CommitBatchRequest part;
  v1::CommitBatchRequest::Header& header = *part.mutable_header();
  header.set_worker_id(id_);
  header.set_lease_id(lease.lease_id());
  header.set_job_id(lease.job_id());
  header.set_kind(lease.kind());
  header.set_pass(lease.pass());
  header.set_first(lease.first());
  header.set_last(lease.last());
  header.set_digest(std::string(Sha256(bytes).Bytes()));
  header.set_size_bytes(bytes.size());
  Deadline context;
  Answer<v1::CommitBatchResponse> answer;
  const auto writer = stub_->CommitBatch(&context, &answer.message);
  answer.status = Send(*writer, part, bytes);
  return answer;
}

grpc::Status IdleHandsWorker::GiveUp(const v1::Lease& lease, const std::string& reason) {
  Deadline context;
  v1::SyncRequest request;
  request.set_worker_id(id_);
  v1::SyncRequest::Failure& failure = *request.add_failures();
  failure.set_lease_id(lease.lease_id());
  failure.set_reason(reason);
  v1::SyncResponse response;
  return stub_->Sync(&context, request, &response);
}

Answer<v1::JobDescription> IdleHandsWorker::DescribeJob(const std::string& job_id) {
  Deadline context;
  v1::DescribeJobRequest request;
  request.set_job_id(job_id);
  Answer<v1::JobDescription> answer;
  answer.status = stub_->DescribeJob(&context, request, &answer.message);
  return answer;
}

Answer<std::string> IdleHandsWorker::Fetch(const std::string& digest) {
  Deadline context;
  v1::FetchBlobRequest request;
  request.set_digest(digest);
  const auto reader = stub_->FetchBlob(&context, request);
  Answer<std::string> answer;
  v1::Chunk chunk;
  while (reader->Read(&chunk))
    answer.message += chunk.bytes();
  answer.status = reader->Finish();
  return answer;
}

std::optional<v1::Lease> IdleHandsWorker::TakeLease(const std::vector<std::string>& held) {
  // The clock stands still, so an answer without a lease comes at once only when none is waited
  // for.
  for (int i = 0; i < 10'000; ++i) {
    const Answer<v1::SyncResponse> answer = Sync(true, Duration::zero(), held);
    EXPECT_TRUE(answer.ok()) << answer.status.error_message();
    if (answer.message.has_lease()) return answer.message.lease();
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  ADD_FAILURE() << "no lease came";
  return std::nullopt;
}

WorkerThread::WorkerThread(const ServiceUnderTest& service) : worker_(service) {
  thread_ = std::thread([this] {
    while (!is_stopped_) {
      const Answer<v1::SyncResponse> answer = worker_.Sync(true, Duration::zero());
      // Unknown after a long silence on the moved clock, or the coordinator has ended.
      if (!answer.ok()) return;
      if (answer.message.has_lease()) {
        const Answer<v1::CommitBatchResponse> committed = worker_.Commit(answer.message.lease());
        EXPECT_TRUE(committed.ok()) << committed.status.error_message();
      } else {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
    }
  });
}

WorkerThread::~WorkerThread() {
  is_stopped_ = true;
  thread_.join();
}

}  // namespace lucerna
