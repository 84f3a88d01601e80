#include "client/connection.h"

#include <algorithm>
#include <chrono>
#include <map>
#include <optional>
#include <string_view>
#include <thread>
#include <utility>

#include "client/exit_code.h"
#include "client/foreign_text.h"
#include "client/interruption.h"
#include "render/base/clock.h"
#include "render/base/mutex.h"
#include "render/report/progress_view.h"
#include "render/wire/channel.h"
#include "render/wire/chunks.h"
#include "render/wire/grpc_status.h"
#include "render/wire/messages.h"
#include "render/wire/stall_guard.h"

namespace lucerna {
namespace {

// For a coordinator that is just being started.
constexpr std::chrono::seconds kConnectTime{3};
// For one that is far away: the connection is being made, and nothing has gone wrong yet.
constexpr std::chrono::seconds kSlowConnectTime{30};
// A watch that lasts longer is opened again.
constexpr std::chrono::seconds kWatchTime{3600};
constexpr std::chrono::milliseconds kFirstPause{100};
constexpr std::chrono::milliseconds kLongestPause{2000};
constexpr int kAttempts = 7;  // about six seconds of pauses in all
// A coordinator that is being restarted needs longer than one that is only slow.
constexpr Duration kWatchSilence = std::chrono::seconds(30);
constexpr std::chrono::milliseconds kTick{100};
constexpr std::uint64_t kMaxImageBytes = std::uint64_t{8} << 30;

Status Interrupted() {
  return Failure(ExitCode::kInterrupted, "interrupted");
}

bool IsWorthAnotherAttempt(grpc::StatusCode code) {
  // CANCELLED comes from a call that raced the coordinator's shutdown.
  return code == grpc::StatusCode::UNAVAILABLE || code == grpc::StatusCode::CANCELLED;
}

// One open Watch: a thread reads, the owner takes the newest.
class WatchStream {
 public:
  WatchStream(v1::JobService::Stub& jobs, const std::string& job_id) {
    context_.set_deadline(DeadlineIn(kWatchTime));
    v1::WatchJobRequest request;
    request.set_job_id(job_id);
    reader_ = jobs.Watch(&context_, request);
    thread_ = std::thread([this] { ReadAll(); });
  }
  ~WatchStream() {
    context_.TryCancel();
    thread_.join();
  }
  WatchStream(const WatchStream&) = delete;
  WatchStream& operator=(const WatchStream&) = delete;

  struct News {
    std::optional<v1::Job> job;
    std::optional<grpc::Status> ended;
  };
  // Waits up to one tick for news.
  [[nodiscard]] News Next() {
    const MutexLock lock(mutex_);
    if (!news_.job && !news_.ended) changed_.WaitFor(mutex_, kTick);
    return std::exchange(news_, {});
  }

 private:
  void ReadAll() {
    v1::Job job;
    while (reader_->Read(&job)) {
      EscapeTexts(job);
      const MutexLock lock(mutex_);
      news_.job = job;
      changed_.NotifyAll();
    }
    const grpc::Status status = reader_->Finish();
    const MutexLock lock(mutex_);
    news_.ended = status;
    changed_.NotifyAll();
  }

  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReader<v1::Job>> reader_;
  Mutex mutex_;
  Condition changed_;
  News news_ LUCERNA_GUARDED_BY(mutex_);
  std::thread thread_;
};

}  // namespace

ClientConnection::ClientConnection(Endpoint endpoint, const std::shared_ptr<grpc::Channel>& channel)
    : endpoint_(std::move(endpoint)),
      admin_(v1::AdminService::NewStub(channel)),
      assets_(v1::AssetService::NewStub(channel)),
      jobs_(v1::JobService::NewStub(channel)),
      images_(v1::ImageService::NewStub(channel)) {}

StatusOr<std::unique_ptr<ClientConnection>> ClientConnection::Open(const Endpoint& endpoint) {
  if (!IsAddress(endpoint.address)) {
    return Failure(ExitCode::kUsage, absl::StrCat("--server \"", endpoint.address,
                                                  "\": give host:port, like 127.0.0.1:7400"));
  }
  if (const Status security = CheckSecurity(endpoint); !security.ok()) {
    return Failure(ExitCode::kUsage, std::string(security.message()));
  }
  const std::shared_ptr<grpc::Channel> channel = MakeChannel(endpoint);
  auto connection = std::unique_ptr<ClientConnection>(new ClientConnection(endpoint, channel));
  const SteadyTime begin = SystemClock().Steady();
  while (!channel->WaitForConnected(DeadlineIn(kTick))) {
    if (IsInterrupted()) return Interrupted();
    const Duration waited = SystemClock().Steady() - begin;
    const bool is_connecting = channel->GetState(false) == GRPC_CHANNEL_CONNECTING;
    if (waited > (is_connecting ? kSlowConnectTime : kConnectTime)) {
      return connection->Unreachable(connection->WhyNotConnected());
    }
  }
  return connection;
}

std::string ClientConnection::WhyNotConnected() {
  // A channel has a state but no reason; a call has one.
  grpc::ClientContext context;
  context.set_deadline(DeadlineIn(kTick));
  v1::Job job;
  return jobs_->Get(&context, v1::GetJobRequest(), &job).error_message();
}

Status ClientConnection::Said(const grpc::Status& status) const {
  if (status.error_code() == grpc::StatusCode::UNIMPLEMENTED) {
    return absl::UnimplementedError(
        absl::StrCat("the coordinator does not offer this at ", endpoint_.address,
                     "; is it of another version, or is that its address for workers?"));
  }
  return FromGrpc(status);
}

Status ClientConnection::Unreachable(const std::string& grpc_message) const {
  const std::string tls = ExplainTls(endpoint_, grpc_message);
  if (!tls.empty()) return Failure(ExitCode::kUnreachable, tls);
  return Failure(ExitCode::kUnreachable,
                 absl::StrCat("cannot reach the coordinator at ", endpoint_.address,
                              "; is lucerna-server running there?"));
}

Status ClientConnection::Retry(Duration time_for_one,
                               const std::function<grpc::Status(grpc::ClientContext&)>& call) {
  std::chrono::milliseconds pause = kFirstPause;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    if (IsInterrupted()) return Interrupted();
    grpc::ClientContext context;
    context.set_deadline(DeadlineIn(time_for_one));
    const grpc::Status status = call(context);
    if (status.ok()) return absl::OkStatus();
    if (IsInterrupted()) return Interrupted();
    if (status.error_code() == grpc::StatusCode::DEADLINE_EXCEEDED) return Unreachable();
    const bool again = IsWorthAnotherAttempt(status.error_code()) ||
                       status.error_code() == grpc::StatusCode::DATA_LOSS;
    if (!again) return Said(status);
    SleepUnlessInterrupted(pause);
    pause = std::min(2 * pause, kLongestPause);
  }
  return IsInterrupted() ? Interrupted() : Unreachable();
}

Status ClientConnection::Upload(const SceneManifest& manifest, SceneFiles& files) {
  // Two files may be the same bytes; they travel once.
  std::map<Digest, std::string> path_of;
  for (const auto& [path, entry] : manifest.entries)
    path_of.emplace(entry.digest, path);
  v1::FindMissingRequest request;
  for (const auto& [digest, path] : path_of)
    request.add_digests(std::string(digest.Bytes()));
  v1::FindMissingResponse response;
  LUCERNA_RETURN_IF_ERROR(Retry(kCallTime, [&](grpc::ClientContext& context) {
    return assets_->FindMissing(&context, request, &response);
  }));

  for (const std::string& missing : response.missing()) {
    LUCERNA_ASSIGN_OR_RETURN(const Digest digest, Digest::FromBytes(missing));
    const auto found = path_of.find(digest);
    if (found == path_of.end()) {
      return absl::InternalError("the coordinator requests a file that is not of this scene");
    }
    LUCERNA_ASSIGN_OR_RETURN(const std::string bytes, files.Read(found->second));
    if (Sha256(bytes) != digest) {
      return absl::FailedPreconditionError(
          absl::StrCat(found->second, ": the file changed while it was being sent; try again"));
    }
    LUCERNA_RETURN_IF_ERROR(UploadBlob(digest, bytes));
  }
  return absl::OkStatus();
}

Status ClientConnection::UploadBlob(const Digest& digest, std::string_view bytes) {
  return Retry(kNoDeadline, [&](grpc::ClientContext& context) {
    StallGuard guard(context, kLongestSilence, IsInterrupted);
    v1::UploadResponse response;
    const auto writer = assets_->Upload(&context, &response);
    v1::UploadRequest request;
    request.mutable_header()->set_digest(std::string(digest.Bytes()));
    request.mutable_header()->set_size_bytes(bytes.size());
    bool is_open = writer->Write(request);
    std::string_view rest = bytes;
    while (is_open && !rest.empty()) {
      request.set_bytes(std::string(NextChunk(rest)));
      // Waits while the other side is busy; false when the call is over, and Finish says why.
      is_open = writer->Write(request);
      guard.Progress();
    }
    writer->WritesDone();
    return writer->Finish();
  });
}

StatusOr<v1::SubmitResponse> ClientConnection::Submit(const v1::SubmitRequest& request) {
  v1::SubmitResponse response;
  // A large scene is read before the answer comes, which takes what it takes while the coordinator
  // lives.
  LUCERNA_RETURN_IF_ERROR(Retry(kNoDeadline, [&](grpc::ClientContext& context) {
    const StallGuard guard(context, kNoDeadline, IsInterrupted);
    return jobs_->Submit(&context, request, &response);
  }));
  EscapeTexts(response);
  return response;
}

StatusOr<std::vector<v1::Job>> ClientConnection::List(const v1::ListJobsRequest& filter) {
  std::vector<v1::Job> jobs;
  v1::ListJobsRequest request = filter;
  request.set_page_size(200);
  for (;;) {
    v1::ListJobsResponse response;
    LUCERNA_RETURN_IF_ERROR(Retry(kCallTime, [&](grpc::ClientContext& context) {
      return jobs_->List(&context, request, &response);
    }));
    for (v1::Job& job : *response.mutable_jobs()) {
      EscapeTexts(job);
      jobs.push_back(std::move(job));
    }
    // A page that leads back to itself would never end.
    if (response.next_page_token().empty() || response.next_page_token() == request.page_token()) {
      return jobs;
    }
    request.set_page_token(response.next_page_token());
  }
}

StatusOr<Digest> ClientConnection::UploadBytes(std::string_view bytes) {
  const Digest digest = Sha256(bytes);
  LUCERNA_RETURN_IF_ERROR(UploadBlob(digest, bytes));
  return digest;
}

StatusOr<v1::Job> ClientConnection::Get(const std::string& job_id) {
  v1::GetJobRequest request;
  request.set_job_id(job_id);
  v1::Job job;
  LUCERNA_RETURN_IF_ERROR(Retry(kCallTime, [&](grpc::ClientContext& context) {
    return jobs_->Get(&context, request, &job);
  }));
  EscapeTexts(job);
  return job;
}

StatusOr<v1::Job> ClientConnection::Stop(const std::string& job_id) {
  v1::StopJobRequest request;
  request.set_job_id(job_id);
  v1::Job job;
  LUCERNA_RETURN_IF_ERROR(Retry(kCallTime, [&](grpc::ClientContext& context) {
    return jobs_->Stop(&context, request, &job);
  }));
  EscapeTexts(job);
  return job;
}

StatusOr<v1::Job> ClientConnection::Pause(const std::string& job_id) {
  v1::PauseJobRequest request;
  request.set_job_id(job_id);
  v1::Job job;
  LUCERNA_RETURN_IF_ERROR(Retry(kCallTime, [&](grpc::ClientContext& context) {
    return jobs_->Pause(&context, request, &job);
  }));
  EscapeTexts(job);
  return job;
}

StatusOr<v1::Job> ClientConnection::Resume(const std::string& job_id) {
  v1::ResumeJobRequest request;
  request.set_job_id(job_id);
  v1::Job job;
  LUCERNA_RETURN_IF_ERROR(Retry(kCallTime, [&](grpc::ClientContext& context) {
    return jobs_->Resume(&context, request, &job);
  }));
  EscapeTexts(job);
  return job;
}

StatusOr<v1::Job> ClientConnection::SetPriority(const std::string& job_id, int priority) {
  v1::SetJobPriorityRequest request;
  request.set_job_id(job_id);
  request.set_priority(priority);
  v1::Job job;
  LUCERNA_RETURN_IF_ERROR(Retry(kCallTime, [&](grpc::ClientContext& context) {
    return jobs_->SetPriority(&context, request, &job);
  }));
  EscapeTexts(job);
  return job;
}

Status ClientConnection::Delete(const std::string& job_id) {
  v1::DeleteJobRequest request;
  request.set_job_id(job_id);
  bool is_first = true;
  const Status status = Retry(kCallTime, [&](grpc::ClientContext& context) {
    v1::DeleteJobResponse response;
    const grpc::Status deleted = jobs_->Delete(&context, request, &response);
    // An attempt whose answer was lost may have done it.
    if (!std::exchange(is_first, false) && deleted.error_code() == grpc::StatusCode::NOT_FOUND) {
      return grpc::Status::OK;
    }
    return deleted;
  });
  return status;
}

StatusOr<v1::Job> ClientConnection::Extend(const std::string& job_id,
                                           const RenderOverrides& until) {
  v1::ExtendJobRequest request;
  request.set_job_id(job_id);
  *request.mutable_until() = ToProto(until);
  v1::Job job;
  LUCERNA_RETURN_IF_ERROR(Retry(kCallTime, [&](grpc::ClientContext& context) {
    return jobs_->Extend(&context, request, &job);
  }));
  EscapeTexts(job);
  return job;
}

StatusOr<std::vector<v1::Worker>> ClientConnection::ListWorkers() {
  v1::ListWorkersResponse response;
  LUCERNA_RETURN_IF_ERROR(Retry(kCallTime, [&](grpc::ClientContext& context) {
    return admin_->ListWorkers(&context, v1::ListWorkersRequest(), &response);
  }));
  return std::vector<v1::Worker>(response.workers().begin(), response.workers().end());
}

StatusOr<v1::Worker> ClientConnection::Order(OrderWorker order, const std::string& worker_id) {
  v1::WorkerRequest request;
  request.set_worker_id(worker_id);
  v1::Worker worker;
  LUCERNA_RETURN_IF_ERROR(Retry(kCallTime, [&](grpc::ClientContext& context) {
    return (admin_.get()->*order)(&context, request, &worker);
  }));
  return worker;
}

StatusOr<v1::Worker> ClientConnection::DrainWorker(const std::string& worker_id) {
  return Order(&v1::AdminService::Stub::DrainWorker, worker_id);
}

StatusOr<v1::Worker> ClientConnection::QuarantineWorker(const std::string& worker_id) {
  return Order(&v1::AdminService::Stub::QuarantineWorker, worker_id);
}

StatusOr<v1::Worker> ClientConnection::ReleaseWorker(const std::string& worker_id) {
  return Order(&v1::AdminService::Stub::ReleaseWorker, worker_id);
}

StatusOr<v1::Job> ClientConnection::Cancel(const std::string& job_id) {
  v1::CancelJobRequest request;
  request.set_job_id(job_id);
  v1::Job job;
  // Also called to clean up after an interruption, so it does not check whether there was one.
  grpc::ClientContext context;
  context.set_deadline(DeadlineIn(kCallTime));
  const grpc::Status status = jobs_->Cancel(&context, request, &job);
  if (status.error_code() == grpc::StatusCode::UNAVAILABLE ||
      status.error_code() == grpc::StatusCode::DEADLINE_EXCEEDED) {
    return Unreachable();
  }
  LUCERNA_RETURN_IF_ERROR(Said(status));
  EscapeTexts(job);
  return job;
}

StatusOr<v1::Job> ClientConnection::Watch(const std::string& job_id, const OnJob& on_job) {
  v1::Job newest;
  SteadyTime last_news = SystemClock().Steady();
  std::chrono::milliseconds pause = kFirstPause;
  for (;;) {
    WatchStream stream(*jobs_, job_id);
    for (;;) {
      const WatchStream::News news = stream.Next();
      if (news.job) {
        newest = *news.job;
        last_news = SystemClock().Steady();
        pause = kFirstPause;
      }
      LUCERNA_RETURN_IF_ERROR(on_job(newest));
      if (HasEnded(newest.state())) return newest;
      if (IsInterrupted()) return Interrupted();
      if (!news.ended) continue;
      const grpc::StatusCode code = news.ended->error_code();
      if (!news.ended->ok() && code != grpc::StatusCode::DEADLINE_EXCEEDED &&
          !IsWorthAnotherAttempt(code)) {
        return Said(*news.ended);
      }
      break;
    }
    if (SystemClock().Steady() - last_news > kWatchSilence) return Unreachable();
    SleepUnlessInterrupted(pause);
    pause = std::min(2 * pause, kLongestPause);
  }
}

StatusOr<std::string> ClientConnection::GetImage(const std::string& job_id,
                                                 const std::function<bool()>& gives_up) {
  v1::GetImageRequest request;
  request.set_job_id(job_id);
  return ReadChunks(
      "the image",
      [&](grpc::ClientContext* context) { return images_->GetImage(context, request); }, gives_up);
}

StatusOr<std::string> ClientConnection::GetUvMesh(const std::string& job_id) {
  v1::GetImageRequest request;
  request.set_job_id(job_id);
  request.set_uv_mesh(true);
  return ReadChunks(
      "the mesh", [&](grpc::ClientContext* context) { return images_->GetImage(context, request); },
      [] { return false; });
}

StatusOr<std::string> ClientConnection::GetTrace(const std::string& job_id) {
  v1::GetTraceRequest request;
  request.set_job_id(job_id);
  return ReadChunks(
      "the timeline",
      [&](grpc::ClientContext* context) { return images_->GetTrace(context, request); },
      [] { return false; });
}

StatusOr<std::string> ClientConnection::ReadChunks(const char* what, const OpenReader& open,
                                                   const std::function<bool()>& gives_up) {
  std::string bytes;
  bool is_too_long = false;
  const Status status = Retry(kNoDeadline, [&](grpc::ClientContext& context) {
    // Not a code that is worth another attempt.
    const grpc::Status given_up(grpc::StatusCode::ABORTED,
                                absl::StrCat("nobody waits for ", what, " any more"));
    if (gives_up()) return given_up;
    bytes.clear();
    StallGuard guard(context, kLongestSilence, [&] { return IsInterrupted() || gives_up(); });
    const auto reader = open(&context);
    v1::Chunk chunk;
    while (!is_too_long && reader->Read(&chunk)) {
      guard.Progress();
      bytes += chunk.bytes();
      is_too_long = bytes.size() > kMaxImageBytes;
      if (is_too_long || IsInterrupted() || gives_up()) context.TryCancel();
    }
    const grpc::Status ended = reader->Finish();
    if (gives_up()) return given_up;
    return is_too_long ? grpc::Status::OK : ended;
  });
  if (is_too_long) return absl::ResourceExhaustedError(absl::StrCat(what, " is longer than 8 GiB"));
  LUCERNA_RETURN_IF_ERROR(status);
  return bytes;
}

}  // namespace lucerna
