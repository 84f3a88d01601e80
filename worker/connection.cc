#include "worker/connection.h"

#include <cmath>
#include <string_view>

#include "render/base/fail_point.h"
#include "render/estimate/rounds.h"
#include "render/wire/chunks.h"
#include "render/wire/grpc_status.h"
#include "render/wire/messages.h"
#include "render/wire/stall_guard.h"

namespace lucerna {
namespace {

// A coordinator that is to answer at once and does not within this has gone.
constexpr std::chrono::seconds kGoodbyeTime{5};
constexpr std::uint64_t kMostPhotonsPerPass = std::uint64_t{1} << 40;

}  // namespace

// One call's context, which BreakOff can reach for as long as it lives.
class Connection::Call {
 public:
  Call(Connection& connection, Duration time) : connection_(connection) {
    context_.set_deadline(DeadlineIn(time));
    const MutexLock lock(connection_.mutex_);
    if (connection_.is_broken_off_) context_.TryCancel();
    connection_.calls_.insert(&context_);
  }
  ~Call() {
    const MutexLock lock(connection_.mutex_);
    connection_.calls_.erase(&context_);
  }
  Call(const Call&) = delete;
  Call& operator=(const Call&) = delete;

  [[nodiscard]] grpc::ClientContext* context() { return &context_; }

 private:
  Connection& connection_;
  grpc::ClientContext context_;
};

Connection::Channels::Channels(const Endpoint& endpoint)
    : messages(MakeChannel(endpoint, Traffic::kMessages)),
      bulk(MakeChannel(endpoint, Traffic::kBulk)) {}

Connection::Connection(const Channels& channels)
    : channel_(channels.messages),
      stub_(v1::WorkerService::NewStub(channels.messages)),
      bulk_stub_(v1::WorkerService::NewStub(channels.bulk)) {}

bool Connection::WaitUntilConnected(Duration wait) {
  return channel_->WaitForConnected(DeadlineIn(wait));
}

StatusOr<v1::RegisterResponse> Connection::Register(const v1::RegisterRequest& request) {
  Call call(*this, kCallTime);
  v1::RegisterResponse response;
  LUCERNA_RETURN_IF_ERROR(FromGrpc(stub_->Register(call.context(), request, &response)));
  return response;
}

StatusOr<v1::SyncResponse> Connection::Sync(const v1::SyncRequest& request, Duration wait) {
  Call call(*this, wait + kCallTime);
  v1::SyncRequest waiting = request;
  *waiting.mutable_wait_at_most() = ToProto(wait);
  v1::SyncResponse response;
  LUCERNA_RETURN_IF_ERROR(FromGrpc(stub_->Sync(call.context(), waiting, &response)));
  return response;
}

StatusOr<v1::JobDescription> Connection::DescribeJob(const std::string& job_id, bool guides_only) {
  Call call(*this, kCallTime);
  v1::DescribeJobRequest request;
  request.set_job_id(job_id);
  request.set_guides_only(guides_only);
  v1::JobDescription response;
  LUCERNA_RETURN_IF_ERROR(FromGrpc(stub_->DescribeJob(call.context(), request, &response)));
  return response;
}

StatusOr<std::string> Connection::Fetch(const Digest& digest, std::uint64_t max_bytes) {
  Call call(*this, kNoDeadline);
  StallGuard guard(*call.context(), kLongestSilence);
  v1::FetchBlobRequest request;
  request.set_digest(std::string(digest.Bytes()));
  const auto reader = bulk_stub_->FetchBlob(call.context(), request);
  std::string bytes;
  v1::Chunk chunk;
  while (reader->Read(&chunk)) {
    guard.Progress();
    if (chunk.bytes().size() > max_bytes - bytes.size()) {
      call.context()->TryCancel();
      return absl::InvalidArgumentError(
          absl::StrCat("blob ", digest.Hex(), " has more than ", max_bytes, " bytes"));
    }
    bytes += chunk.bytes();
  }
  LUCERNA_RETURN_IF_ERROR(FromGrpc(reader->Finish()));
  if (Sha256(bytes) != digest) {
    return absl::DataLossError(absl::StrCat("bytes arrived that are not ", digest.Hex()));
  }
  return bytes;
}

StatusOr<v1::CommitOutcome> Connection::Commit(v1::CommitBatchRequest::Header header,
                                               std::string_view bytes) {
  Call call(*this, kNoDeadline);
  StallGuard guard(*call.context(), kLongestSilence);
  v1::CommitBatchResponse response;
  const auto writer = bulk_stub_->CommitBatch(call.context(), &response);
  v1::CommitBatchRequest part;
  header.set_digest(std::string(Sha256(bytes).Bytes()));
  header.set_size_bytes(bytes.size());
  *part.mutable_header() = std::move(header);
  // A write fails when the answer is there already; Finish then brings it.
  bool is_open = writer->Write(part);
  std::string_view rest = bytes;
  if (FaultIsDue("commit.short")) rest.remove_suffix(rest.size() / 2);
  FailPoint("commit.during");
  for (std::string_view chunk = NextChunk(rest); is_open && !chunk.empty();
       chunk = NextChunk(rest)) {
    part.set_bytes(chunk.data(), chunk.size());
    is_open = writer->Write(part);
    guard.Progress();
  }
  writer->WritesDone();
  LUCERNA_RETURN_IF_ERROR(FromGrpc(writer->Finish()));
  return response.outcome();
}

Status Connection::Goodbye(const std::string& worker_id) {
  grpc::ClientContext context;
  context.set_deadline(DeadlineIn(kGoodbyeTime));
  v1::GoodbyeRequest request;
  request.set_worker_id(worker_id);
  v1::GoodbyeResponse response;
  return FromGrpc(stub_->Goodbye(&context, request, &response));
}

void Connection::BreakOff() {
  const MutexLock lock(mutex_);
  is_broken_off_ = true;
  for (grpc::ClientContext* const context : calls_)
    context->TryCancel();
}

StatusOr<LentWork> ReadLease(const v1::Lease& message) {
  LentWork work;
  work.lease_id = message.lease_id();
  work.job_id = message.job_id();
  work.kind = message.kind();
  work.pass = message.pass();
  work.first = message.first();
  work.last = message.last();
  work.photons_per_pass = message.photons_per_pass();
  work.guide = message.guide();
  LUCERNA_ASSIGN_OR_RETURN(work.radii, Digest::FromBytes(message.radii_digest()));
  if (work.photons_per_pass > kMostPhotonsPerPass) {
    return absl::InvalidArgumentError("a lease's passes have too many photons");
  }
  if (work.kind == v1::WORK_KIND_PHOTONS) {
    if (work.first >= work.last || work.last > work.photons_per_pass) {
      return absl::InvalidArgumentError("a lease's photons are not a range of its pass");
    }
    LUCERNA_ASSIGN_OR_RETURN(work.block, Digest::FromBytes(message.block_digest()));
    return work;
  }
  if (work.kind != v1::WORK_KIND_PASSES) {
    return absl::InvalidArgumentError("a lease of an unknown kind of work");
  }
  work.caustic_radius = message.caustic_radius();
  if (!message.eye_paths_digest().empty()) {
    LUCERNA_ASSIGN_OR_RETURN(work.eye_paths, Digest::FromBytes(message.eye_paths_digest()));
  }
  if (!IsSlice({work.first, work.last}) || RoundOf(work.first).first != work.pass) {
    return absl::InvalidArgumentError("a lease's passes are not a slice of its round");
  }
  if (!(work.caustic_radius > 0) || !std::isfinite(work.caustic_radius)) {
    return absl::InvalidArgumentError("a lease's radius is not finite and positive");
  }
  return work;
}

Status ReadGuides(const v1::JobDescription& message, JobToTrace& job) {
  LUCERNA_ASSIGN_OR_RETURN(const GuideSteps steps, FromProto(message.guides()));
  job.guides.clear();
  for (const GuideStep& step : steps)
    job.guides.push_back(step.guide);
  return absl::OkStatus();
}

StatusOr<JobToTrace> ReadJob(const v1::JobDescription& message) {
  JobToTrace job;
  LUCERNA_ASSIGN_OR_RETURN(job.scene, FromProto(message.scene()));
  LUCERNA_ASSIGN_OR_RETURN(job.settings, FromProto(message.settings()));
  LUCERNA_ASSIGN_OR_RETURN(job.needs, FromProto(message.needs()));
  LUCERNA_RETURN_IF_ERROR(ReadGuides(message, job));
  return job;
}

}  // namespace lucerna
