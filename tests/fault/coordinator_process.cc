#include "tests/fault/coordinator_process.h"

#include <map>
#include <thread>
#include <tuple>
#include <utility>

#include "gtest/gtest.h"
#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "proto/lucerna/v1/assets.grpc.pb.h"
#include "proto/lucerna/v1/images.grpc.pb.h"
#include "proto/lucerna/v1/jobs.grpc.pb.h"
#include "render/base/files.h"
#include "render/formats/read_scene.h"
#include "render/image/exr_file.h"
#include "render/scene/scene_files.h"
#include "render/wire/channel.h"
#include "render/wire/grpc_status.h"
#include "render/wire/messages.h"

namespace lucerna {

std::string FreeAddress() {
  // 127.0.0.0/8 is this machine, and the last three bytes of an address hold any process number: 22
  // bits.
  const auto process = static_cast<std::uint32_t>(getpid());
  const std::string host = absl::StrCat("127.", 1 + (process >> 16 & 0x7F), ".",
                                        process >> 8 & 0xFF, ".", process & 0xFF);
  const int socket = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  EXPECT_EQ(::inet_pton(AF_INET, host.c_str(), &address.sin_addr), 1);
  socklen_t size = sizeof(address);
  EXPECT_EQ(::bind(socket, reinterpret_cast<sockaddr*>(&address), size), 0);
  EXPECT_EQ(::getsockname(socket, reinterpret_cast<sockaddr*>(&address), &size), 0);
  ::close(socket);
  return absl::StrCat(host, ":", ntohs(address.sin_port));
}

void CoordinatorProcess::Start(std::vector<std::string> command, std::vector<std::string> flags,
                               const std::string& address) {
  command.insert(command.end(), {kBin + "/lucerna-server", "--listen", address});
  command.insert(command.end(), flags.begin(), flags.end());
  process_ = std::make_unique<ChildProcess>(std::move(command));
}

CoordinatorProcess::CoordinatorProcess(std::vector<std::string> flags, const std::string& address) {
  Start({}, std::move(flags), address);
  EXPECT_TRUE(process_->WaitForText("listening on ", kPatience));
  const std::string line = process_->Output();
  const std::string begin = "listening on ";
  EXPECT_EQ(line.rfind(begin, 0), 0U) << line << process_->Errors();
  if (line.size() > begin.size()) {
    address_ = line.substr(begin.size(), line.find('\n') - begin.size());
  }
  channel_ = MakeChannel(address_);
}

std::unique_ptr<CoordinatorProcess> CoordinatorProcess::Doomed(const std::string& fail_point,
                                                               std::vector<std::string> flags,
                                                               const std::string& address) {
  auto coordinator = std::unique_ptr<CoordinatorProcess>(new CoordinatorProcess(NotStarted()));
  coordinator->Start({"/usr/bin/env", "LUCERNA_FAIL_POINT=" + fail_point}, std::move(flags),
                     address);
  coordinator->address_ = address;
  coordinator->channel_ = MakeChannel(address);
  return coordinator;
}

std::unique_ptr<ChildProcess> CoordinatorProcess::StartFaultyWorker(
    const std::string& fault) const {
  return std::make_unique<ChildProcess>(
      std::vector<std::string>{"/usr/bin/env", "LUCERNA_FAIL_POINT=" + fault,
                               kBin + "/lucerna-worker", "--server", address_, "--threads", "1"});
}

CoordinatorProcess::CoordinatorProcess(std::string address, Elsewhere /*tag*/)
    : address_(std::move(address)), channel_(MakeChannel(address_)) {}

std::unique_ptr<ChildProcess> CoordinatorProcess::StartWorker(
    std::vector<std::string> more_flags) const {
  std::vector<std::string> command = {kBin + "/lucerna-worker", "--server", address_, "--threads",
                                      "1"};
  command.insert(command.end(), more_flags.begin(), more_flags.end());
  return std::make_unique<ChildProcess>(std::move(command));
}

void CoordinatorProcess::UseSecurity(const TlsFiles& tls, const std::string& token) {
  channel_ = MakeChannel({address_, tls, token});
}

StatusOr<std::string> CoordinatorProcess::TrySubmit(const SmallJob& job) {
  DirectoryFiles files(kTestScenes);
  const ParsedScene parsed = ReadScene(files, job.scene);
  EXPECT_TRUE(parsed.ok()) << parsed.ToStatus();
  const SceneManifest manifest = files.Manifest(job.scene);
  const auto assets = v1::AssetService::NewStub(channel_);
  for (const auto& [path, entry] : manifest.entries) {
    grpc::ClientContext context;
    context.set_wait_for_ready(true);
    context.set_deadline(DeadlineIn(kPatience));
    v1::UploadResponse response;
    const auto writer = assets->Upload(&context, &response);
    v1::UploadRequest part;
    part.mutable_header()->set_digest(std::string(entry.digest.Bytes()));
    part.mutable_header()->set_size_bytes(entry.size_bytes);
    writer->Write(part);
    part.set_bytes(ReadFile(kTestScenes + "/" + path).value());
    writer->Write(part);
    writer->WritesDone();
    LUCERNA_RETURN_IF_ERROR(FromGrpc(writer->Finish()));
  }
  v1::SubmitRequest request;
  request.set_request_id(job.request_id);
  request.set_name(job.name);
  *request.mutable_scene() = ToProto(manifest);
  RenderOverrides overrides;
  if (job.time_s > 0)
    overrides.time_s = job.time_s;
  else
    overrides.passes = job.passes;
  overrides.photons_per_pass = job.photons;
  overrides.width = 64;
  overrides.height = 64;
  *request.mutable_overrides() = ToProto(overrides);
  v1::SubmitResponse response;
  grpc::ClientContext context;
  context.set_deadline(DeadlineIn(kPatience));
  LUCERNA_RETURN_IF_ERROR(
      FromGrpc(v1::JobService::NewStub(channel_)->Submit(&context, request, &response)));
  return response.job_id();
}

StatusOr<v1::Job> CoordinatorProcess::TryWait(const std::string& job_id) {
  v1::WatchJobRequest request;
  request.set_job_id(job_id);
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + 5 * kPatience);
  const auto reader = v1::JobService::NewStub(channel_)->Watch(&context, request);
  v1::Job job;
  while (reader->Read(&job)) {
  }
  LUCERNA_RETURN_IF_ERROR(FromGrpc(reader->Finish()));
  return job;
}

Status CoordinatorProcess::TryDelete(const std::string& job_id) {
  v1::DeleteJobRequest request;
  request.set_job_id(job_id);
  v1::DeleteJobResponse response;
  grpc::ClientContext context;
  context.set_deadline(DeadlineIn(kPatience));
  return FromGrpc(v1::JobService::NewStub(channel_)->Delete(&context, request, &response));
}

std::string CoordinatorProcess::Submit(const std::string& scene, int passes, std::int64_t photons,
                                       const std::string& name) {
  const StatusOr<std::string> job =
      TrySubmit({.scene = scene, .passes = passes, .photons = photons, .name = name});
  EXPECT_TRUE(job.ok()) << job.status();
  return job.value_or("");
}

v1::Job CoordinatorProcess::Get(const std::string& job_id) {
  v1::GetJobRequest request;
  request.set_job_id(job_id);
  v1::Job job;
  grpc::ClientContext context;
  const grpc::Status status = v1::JobService::NewStub(channel_)->Get(&context, request, &job);
  EXPECT_TRUE(status.ok()) << status.error_message();
  return job;
}

std::vector<v1::Job> CoordinatorProcess::List() {
  v1::ListJobsResponse response;
  grpc::ClientContext context;
  const grpc::Status status = v1::JobService::NewStub(channel_)->List(&context, {}, &response);
  EXPECT_TRUE(status.ok()) << status.error_message();
  return {response.jobs().begin(), response.jobs().end()};
}

v1::Job CoordinatorProcess::Wait(const std::string& job_id) {
  return TryWait(job_id).value_or(v1::Job());
}

bool CoordinatorProcess::WaitForProgress(const std::string& job_id,
                                         const std::function<bool(const v1::Progress&)>& is_there) {
  const auto give_up_at = std::chrono::steady_clock::now() + kPatience;
  while (std::chrono::steady_clock::now() < give_up_at) {
    const v1::Job now = Get(job_id);
    if (now.state() > v1::JOB_STATE_RUNNING) return false;
    if (is_there(now.progress())) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return false;
}

bool CoordinatorProcess::WaitForPasses(const std::string& job_id, std::int64_t passes) {
  return WaitForProgress(job_id,
                         [&](const v1::Progress& progress) { return progress.passes() >= passes; });
}

bool CoordinatorProcess::WaitForPhotons(const std::string& job_id, std::uint64_t photons) {
  return WaitForProgress(
      job_id, [&](const v1::Progress& progress) { return progress.photons() >= photons; });
}

Digest CoordinatorProcess::ImageDigest(const std::string& job_id) {
  v1::GetImageRequest request;
  request.set_job_id(job_id);
  grpc::ClientContext context;
  const auto reader = v1::ImageService::NewStub(channel_)->GetImage(&context, request);
  std::string bytes;
  v1::Chunk chunk;
  while (reader->Read(&chunk))
    bytes += chunk.bytes();
  const grpc::Status status = reader->Finish();
  EXPECT_TRUE(status.ok()) << status.error_message();
  const StatusOr<Image> image = DecodeExr(bytes);
  EXPECT_TRUE(image.ok()) << image.status();
  return image.ok() ? image->PixelDigest() : Digest();
}

Digest UnfaultedDigest(const std::string& scene, int passes, std::int64_t photons) {
  static std::map<std::tuple<std::string, int, std::int64_t>, Digest> known;
  const auto [digest, is_new] = known.try_emplace({scene, passes, photons});
  if (is_new) {
    CoordinatorProcess coordinator;
    const auto worker = coordinator.StartWorker();
    const std::string job = coordinator.Submit(scene, passes, photons);
    EXPECT_EQ(coordinator.Wait(job).state(), v1::JOB_STATE_SUCCEEDED);
    digest->second = coordinator.ImageDigest(job);
  }
  return digest->second;
}

}  // namespace lucerna
