#include "server/worker_service.h"

#include <memory>
#include <optional>
#include <utility>

#include "render/wire/chunks.h"
#include "render/wire/grpc_status.h"
#include "render/wire/messages.h"
#include "server/rpc_caller.h"

namespace lucerna {
namespace {

constexpr Duration kSyncEvery = std::chrono::seconds(3);
// A slice has up to 100 bytes a pixel and an accumulation 40 a hitpoint before compression, which
// cannot double it.
constexpr std::uint64_t kResultHeadBytes = 4096;
// Photons that the guide asks to be reported take up to 20 bytes.
constexpr std::uint64_t kResultReportBytes = 20 * kMostReports;
constexpr std::uint64_t kResultBytesPerRow = 128;
constexpr int kMostLeases = 64;  // that one worker may speak of

v1::Lease LoanToProto(const Loan& loan) {
  const BatchLease& lease = loan.lease;
  v1::Lease message;
  message.set_lease_id(lease.id);
  message.set_job_id(lease.pass.job_id);
  message.set_pass(lease.pass.pass);
  message.set_first(lease.range.first);
  message.set_last(lease.range.last);
  message.set_radii_digest(std::string(loan.blobs.radii.Bytes()));
  message.set_photons_per_pass(loan.blobs.photons_per_pass);
  message.set_guide(loan.blobs.guide);
  switch (lease.kind) {
    case WorkKind::kPhotons:
      message.set_kind(v1::WORK_KIND_PHOTONS);
      message.set_block_digest(std::string(loan.blobs.block.Bytes()));
      break;
    case WorkKind::kPasses:
      message.set_kind(v1::WORK_KIND_PASSES);
      message.set_caustic_radius(loan.blobs.caustic_radius);
      if (loan.blobs.eye_paths.has_value())
        message.set_eye_paths_digest(std::string(loan.blobs.eye_paths->Bytes()));
      break;
  }
  return message;
}

v1::CommitOutcome OutcomeToProto(MergeOutcome outcome) {
  switch (outcome) {
    case MergeOutcome::kAccepted:
      return v1::COMMIT_OUTCOME_ACCEPTED;
    case MergeOutcome::kDuplicate:
      return v1::COMMIT_OUTCOME_DUPLICATE;
    case MergeOutcome::kSuperseded:
      return v1::COMMIT_OUTCOME_SUPERSEDED;
  }
  return v1::COMMIT_OUTCOME_UNSPECIFIED;
}

class SyncReactor final : public grpc::ServerUnaryReactor {
 public:
  explicit SyncReactor(Coordinator& coordinator) : coordinator_(coordinator) {}

  // Before the handler returns: neither OnCancel nor OnDone can come earlier.
  void set_ticket(std::uint64_t ticket) { ticket_ = ticket; }
  void OnCancel() override { coordinator_.SyncBroke(ticket_); }
  void OnDone() override { delete this; }

 private:
  Coordinator& coordinator_;
  std::uint64_t ticket_ = 0;
};

class CommitReactor final : public grpc::ServerReadReactor<v1::CommitBatchRequest> {
 public:
  CommitReactor(Coordinator& coordinator, WorkPool& pool, const std::string& caller,
                grpc::CallbackServerContext* context, v1::CommitBatchResponse* response)
      : coordinator_(coordinator), pool_(pool), context_(context), response_(response) {
    StatusOr<std::unique_ptr<OpenTransfers::Transfer>> opened =
        coordinator.transfers().Open(caller, [context] { context->TryCancel(); });
    if (!opened.ok()) {
      Finish(ToGrpc(opened.status()));
      return;
    }
    transfer_ = *std::move(opened);
    StartRead(&part_);
  }

  void OnReadDone(bool ok) override {
    transfer_->Progress();
    if (!ok) {
      transfer_->Complete();
      pool_.Run(NeededByCaller(context_), [this](const Status& may_begin) {
        Finish(ToGrpc(may_begin.ok() ? Merge() : may_begin));
      });
      return;
    }
    if (const Status status = Take(); !status.ok()) {
      Finish(ToGrpc(status));
      return;
    }
    if (is_answered_) {
      // The bytes are not needed: the answer goes out before they come.
      Finish(grpc::Status::OK);
      return;
    }
    StartRead(&part_);
  }
  void OnDone() override { delete this; }

 private:
  Status Take() {
    if (part_.has_header() == collector_.has_value()) {
      return absl::InvalidArgumentError("a commit is one header and then bytes");
    }
    if (collector_) return collector_->Add(part_.bytes());
    const v1::CommitBatchRequest::Header& header = part_.header();
    if (header.kind() != v1::WORK_KIND_PHOTONS && header.kind() != v1::WORK_KIND_PASSES) {
      return absl::InvalidArgumentError("a commit of an unknown kind of work");
    }
    delivery_.worker = header.worker_id();
    delivery_.kind =
        header.kind() == v1::WORK_KIND_PHOTONS ? WorkKind::kPhotons : WorkKind::kPasses;
    delivery_.pass = {header.job_id(), header.pass()};
    delivery_.range = {header.first(), header.last()};
    delivery_.cpu = FromProto(header.cpu());
    delivery_.size_bytes = header.size_bytes();
    delivery_.lease = header.lease_id();
    LUCERNA_ASSIGN_OR_RETURN(delivery_.digest, Digest::FromBytes(header.digest()));
    LUCERNA_ASSIGN_OR_RETURN(const std::optional<MergeOutcome> known,
                             coordinator_.OutcomeOf(delivery_));
    const std::optional<std::size_t> rows = coordinator_.RowsOf(delivery_);
    if (known || !rows) {
      is_answered_ = true;
      response_->set_outcome(OutcomeToProto(known.value_or(MergeOutcome::kSuperseded)));
      return absl::OkStatus();
    }
    if (header.size_bytes() > kResultHeadBytes + kResultReportBytes + kResultBytesPerRow * *rows) {
      const Status too_large = absl::InvalidArgumentError(
          absl::StrCat("a result of ", header.size_bytes(), " bytes is too large for ", *rows,
                       " hitpoints or pixels"));
      coordinator_.Refuse(delivery_, too_large);
      return too_large;
    }
    LUCERNA_RETURN_IF_ERROR(transfer_->Announce(header.size_bytes()));
    // The worker sends it again later.
    StatusOr<MemoryClaim> claim =
        coordinator_.budget().Claim(MemoryUse::kCommits, header.size_bytes());
    // One may always come: jobs that hold all memory end only by results.
    if (!claim.ok()) {
      MemoryClaim one =
          coordinator_.budget().ClaimOneAnyway(MemoryUse::kCommits, header.size_bytes());
      if (!one.is_empty()) claim = std::move(one);
    }
    LUCERNA_ASSIGN_OR_RETURN(claim_, std::move(claim));
    collector_.emplace(delivery_.digest, header.size_bytes());
    return WithinMemory([this]() -> Status {
      collector_->Reserve();
      return absl::OkStatus();
    });
  }

  Status Merge() {
    if (!collector_) return absl::InvalidArgumentError("a commit begins with a header");
    LUCERNA_ASSIGN_OR_RETURN(std::string bytes, collector_->Finish());
    LUCERNA_ASSIGN_OR_RETURN(const MergeOutcome outcome, WithinMemory([&] {
                               return coordinator_.Commit(delivery_, std::move(bytes));
                             }));
    response_->set_outcome(OutcomeToProto(outcome));
    return absl::OkStatus();
  }

  Coordinator& coordinator_;
  WorkPool& pool_;
  const grpc::CallbackServerContext* const context_;
  std::unique_ptr<OpenTransfers::Transfer> transfer_;
  v1::CommitBatchResponse* const response_;
  v1::CommitBatchRequest part_;
  Delivery delivery_;
  bool is_answered_ = false;
  MemoryClaim claim_;
  std::optional<ChunkCollector> collector_;
};

}  // namespace

grpc::ServerUnaryReactor* WorkerService::Register(grpc::CallbackServerContext* context,
                                                  const v1::RegisterRequest* request,
                                                  v1::RegisterResponse* response) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  const StatusOr<std::string> id =
      coordinator_.Register(request->name(), request->threads(), request->numeric_profile(),
                            request->identity(), access_.LimitKeyOf(*context));
  if (id.ok()) {
    response->set_worker_id(*id);
    *response->mutable_sync_every() = ToProto(kSyncEvery);
  }
  reactor->Finish(ToGrpc(id.status()));
  return reactor;
}

grpc::ServerUnaryReactor* WorkerService::Sync(grpc::CallbackServerContext* context,
                                              const v1::SyncRequest* request,
                                              v1::SyncResponse* response) {
  if (request->held_lease_ids_size() > kMostLeases || request->failures_size() > kMostLeases) {
    grpc::ServerUnaryReactor* refusal = context->DefaultReactor();
    refusal->Finish(ToGrpc(absl::InvalidArgumentError("a worker holds only a few leases")));
    return refusal;
  }
  Scheduler::Report report;
  report.held.assign(request->held_lease_ids().begin(), request->held_lease_ids().end());
  for (const v1::SyncRequest::Failure& failure : request->failures()) {
    report.failures.emplace_back(failure.lease_id(), failure.reason().substr(0, 1024));
  }
  report.wants_lease = request->wants_lease();

  auto* const reactor = new SyncReactor(coordinator_);
  reactor->set_ticket(
      coordinator_.Sync(request->worker_id(), std::move(report), FromProto(request->wait_at_most()),
                        [reactor, response](StatusOr<SyncAnswer> answer) {
                          if (answer.ok()) {
                            if (answer->loan)
                              *response->mutable_lease() = LoanToProto(*answer->loan);
                            for (const std::string& id : answer->revoked)
                              response->add_revoked_lease_ids(id);
                          }
                          reactor->Finish(ToGrpc(answer.status()));
                        }));
  return reactor;
}

grpc::ServerWriteReactor<v1::Chunk>* WorkerService::FetchBlob(
    grpc::CallbackServerContext* /*context*/, const v1::FetchBlobRequest* request) {
  const StatusOr<Digest> digest = Digest::FromBytes(request->digest());
  auto* const reactor = new BytesReactor;
  reactor->Send(digest.ok() ? coordinator_.Fetch(*digest) : digest.status());
  return reactor;
}

grpc::ServerReadReactor<v1::CommitBatchRequest>* WorkerService::CommitBatch(
    grpc::CallbackServerContext* context, v1::CommitBatchResponse* response) {
  return new CommitReactor(coordinator_, pools_.commits, access_.LimitKeyOf(*context), context,
                           response);
}

grpc::ServerUnaryReactor* WorkerService::DescribeJob(grpc::CallbackServerContext* context,
                                                     const v1::DescribeJobRequest* request,
                                                     v1::JobDescription* response) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  // A user traces photons of their own jobs again; workers trace those of all.
  if (!Has(access_.CallerOf(*context).roles, Role::kWork)) {
    const StatusOr<std::string> owner = coordinator_.OwnerOf(request->job_id());
    const Status allowed =
        owner.ok() ? access_.CheckOwns(*context, request->job_id(), *owner) : owner.status();
    if (!allowed.ok()) {
      reactor->Finish(ToGrpc(allowed));
      return reactor;
    }
  }
  const StatusOr<Coordinator::Description> job = coordinator_.Describe(request->job_id());
  if (job.ok()) {
    for (const GuideStep& step : job->guides)
      *response->add_guides() = ToProto(step);
  }
  if (job.ok() && !request->guides_only()) {
    *response->mutable_scene() = ToProto(job->scene);
    *response->mutable_settings() = ToProto(job->settings);
    *response->mutable_needs() = ToProto(job->needs);
    for (const PhotonStep& step : job->photon_steps)
      *response->add_photon_steps() = ToProto(step);
    response->set_numeric_profile(job->numeric_profile);
  }
  reactor->Finish(ToGrpc(job.status()));
  return reactor;
}

grpc::ServerUnaryReactor* WorkerService::Goodbye(grpc::CallbackServerContext* context,
                                                 const v1::GoodbyeRequest* request,
                                                 v1::GoodbyeResponse* /*response*/) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  coordinator_.Goodbye(request->worker_id());
  reactor->Finish(grpc::Status::OK);
  return reactor;
}

}  // namespace lucerna
