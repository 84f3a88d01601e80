#include "server/job_service.h"

#include <algorithm>
#include <charconv>
#include <optional>
#include <utility>

#include "render/wire/grpc_status.h"
#include "render/wire/messages.h"
#include "server/job_message.h"
#include "server/rpc_caller.h"

namespace lucerna {
namespace {

constexpr Duration kWatchAtMostEvery = std::chrono::milliseconds(100);
constexpr Duration kWatchAtLeastEvery = std::chrono::seconds(5);
constexpr std::size_t kLargestPage = 1000;
constexpr std::size_t kUsualPage = 100;

StatusOr<Submission> ReadSubmission(const v1::SubmitRequest& request) {
  Submission submission;
  submission.request_id = request.request_id();
  submission.name = request.name();
  if (submission.name.size() > 1024) {
    return absl::InvalidArgumentError("a job's name has at most 1024 characters");
  }
  LUCERNA_ASSIGN_OR_RETURN(submission.manifest, FromProto(request.scene()));
  LUCERNA_ASSIGN_OR_RETURN(submission.overrides, FromProto(request.overrides()));
  submission.validate_only = request.validate_only();
  if (!request.reference_digest().empty()) {
    LUCERNA_ASSIGN_OR_RETURN(submission.reference, Digest::FromBytes(request.reference_digest()));
  }
  return submission;
}

grpc::Status Put(const StatusOr<JobReport>& report, v1::Job* response) {
  if (report.ok()) *response = ToProto(*report);
  return ToGrpc(report.status());
}

}  // namespace

// One watcher. All of it is touched under its own lock; gRPC's callbacks never run inside a call
// of ours.
class JobService::WatchReactor final : public grpc::ServerWriteReactor<v1::Job> {
 public:
  WatchReactor(JobService& service, std::string job_id)
      : service_(service), job_id_(std::move(job_id)) {}

  // Sends what is new, if it is time to.
  void SendIfDue(SteadyTime now) {
    const MutexLock lock(mutex_);
    if (is_writing_ || is_finished_) return;
    if (is_cancelled_) {
      End(absl::CancelledError("the watcher left"));
      return;
    }
    if (has_sent_end_) {
      End(absl::OkStatus());
      return;
    }
    const StatusOr<JobReport> report = service_.coordinator_.ReportOf(job_id_);
    if (!report.ok()) {
      End(report.status());
      return;
    }
    const JobState state = report->job.life.state();
    const bool is_news = !sent_at_ || state != sent_state_;
    const bool is_time =
        sent_at_ && ((report->version != sent_version_ && now - *sent_at_ >= kWatchAtMostEvery) ||
                     now - *sent_at_ >= kWatchAtLeastEvery);
    if (!is_news && !is_time) return;
    sent_at_ = now;
    sent_state_ = state;
    sent_version_ = report->version;
    has_sent_end_ = report->job.life.has_ended();
    message_ = ToProto(*report);
    is_writing_ = true;
    StartWrite(&message_);
  }

  void Close() {
    const MutexLock lock(mutex_);
    // A write that is under way ends first; OnWriteDone then finds is_closed_.
    is_closed_ = true;
    if (!is_writing_ && !is_finished_) End(absl::UnavailableError("the coordinator shuts down"));
  }

  void OnWriteDone(bool ok) override {
    const MutexLock lock(mutex_);
    is_writing_ = false;
    if (is_finished_) return;
    if (!ok) {
      End(absl::CancelledError("the watcher left"));
    } else if (has_sent_end_) {
      End(absl::OkStatus());
    } else if (is_closed_) {
      End(absl::UnavailableError("the coordinator shuts down"));
    }
  }

  void OnCancel() override {
    const MutexLock lock(mutex_);
    is_cancelled_ = true;
    if (!is_writing_ && !is_finished_) End(absl::CancelledError("the watcher left"));
  }

  void OnDone() override {
    {
      const MutexLock lock(service_.mutex_);
      service_.watches_.erase(this);
    }
    delete this;
  }

 private:
  void End(const Status& status) LUCERNA_REQUIRES(mutex_) {
    is_finished_ = true;
    Finish(ToGrpc(status));
  }

  JobService& service_;
  const std::string job_id_;
  Mutex mutex_;
  v1::Job message_;
  bool is_writing_ LUCERNA_GUARDED_BY(mutex_) = false;
  bool is_finished_ LUCERNA_GUARDED_BY(mutex_) = false;
  bool is_cancelled_ LUCERNA_GUARDED_BY(mutex_) = false;
  bool is_closed_ LUCERNA_GUARDED_BY(mutex_) = false;
  bool has_sent_end_ LUCERNA_GUARDED_BY(mutex_) = false;
  std::optional<SteadyTime> sent_at_ LUCERNA_GUARDED_BY(mutex_);
  JobState sent_state_ LUCERNA_GUARDED_BY(mutex_) = JobState::kQueued;
  std::uint64_t sent_version_ LUCERNA_GUARDED_BY(mutex_) = 0;
};

Status JobService::CheckMayChange(const grpc::CallbackServerContext* context,
                                  const std::string& job_id) const {
  LUCERNA_ASSIGN_OR_RETURN(const std::string owner, coordinator_.OwnerOf(job_id));
  return access_.CheckOwns(*context, job_id, owner);
}

grpc::ServerUnaryReactor* JobService::Submit(grpc::CallbackServerContext* context,
                                             const v1::SubmitRequest* request,
                                             v1::SubmitResponse* response) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  const StillNeeded still_needed = NeededByCaller(context);
  const auto submit = [this, request, response, still_needed,
                       owner = access_.CallerOf(*context).name]() -> Status {
    LUCERNA_ASSIGN_OR_RETURN(Submission submission, ReadSubmission(*request));
    submission.owner = owner;
    LUCERNA_ASSIGN_OR_RETURN(const JobTable::Submitted submitted,
                             coordinator_.Submit(submission, still_needed));
    response->set_job_id(submitted.job_id);
    for (std::size_t i = 0; i < std::min(submitted.warnings.size(), kMostWarnings); ++i) {
      response->add_warnings(submitted.warnings[i]);
    }
    return absl::OkStatus();
  };
  pools_.scenes.Run(still_needed, [reactor, submit](const Status& may_begin) {
    reactor->Finish(ToGrpc(may_begin.ok() ? submit() : may_begin));
  });
  return reactor;
}

grpc::ServerUnaryReactor* JobService::Get(grpc::CallbackServerContext* context,
                                          const v1::GetJobRequest* request, v1::Job* response) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  reactor->Finish(Put(coordinator_.ReportOf(request->job_id()), response));
  return reactor;
}

grpc::ServerUnaryReactor* JobService::List(grpc::CallbackServerContext* context,
                                           const v1::ListJobsRequest* request,
                                           v1::ListJobsResponse* response) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  const std::string& token = request->page_token();
  std::uint64_t before = 0;
  const auto parsed = std::from_chars(token.data(), token.data() + token.size(), before);
  if (request->page_size() < 0 ||
      (!token.empty() && (parsed.ec != std::errc() || parsed.ptr != token.data() + token.size()))) {
    reactor->Finish(ToGrpc(absl::InvalidArgumentError("a page size or page token is not ours")));
    return reactor;
  }
  const std::size_t count =
      request->page_size() == 0
          ? kUsualPage
          : std::min(static_cast<std::size_t>(request->page_size()), kLargestPage);
  const auto [reports, next] = coordinator_.List(count, before);
  for (const JobReport& report : reports)
    *response->add_jobs() = ToProto(report);
  if (next != 0) response->set_next_page_token(absl::StrCat(next));
  reactor->Finish(grpc::Status::OK);
  return reactor;
}

grpc::ServerUnaryReactor* JobService::Cancel(grpc::CallbackServerContext* context,
                                             const v1::CancelJobRequest* request,
                                             v1::Job* response) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  const Status allowed = CheckMayChange(context, request->job_id());
  reactor->Finish(allowed.ok() ? Put(coordinator_.Cancel(request->job_id()), response)
                               : ToGrpc(allowed));
  return reactor;
}

grpc::ServerUnaryReactor* JobService::Delete(grpc::CallbackServerContext* context,
                                             const v1::DeleteJobRequest* request,
                                             v1::DeleteJobResponse* /*response*/) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  if (const Status allowed = CheckMayChange(context, request->job_id()); !allowed.ok()) {
    reactor->Finish(ToGrpc(allowed));
    return reactor;
  }
  // Removes files, which may take long.
  pools_.scenes.Run(NeededByCaller(context), [this, reactor,
                                              job_id = request->job_id()](const Status& may_begin) {
    reactor->Finish(ToGrpc(may_begin.ok() ? coordinator_.Delete(job_id) : may_begin));
  });
  return reactor;
}

grpc::ServerUnaryReactor* JobService::Stop(grpc::CallbackServerContext* context,
                                           const v1::StopJobRequest* request, v1::Job* response) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  const Status allowed = CheckMayChange(context, request->job_id());
  reactor->Finish(allowed.ok() ? Put(coordinator_.Stop(request->job_id()), response)
                               : ToGrpc(allowed));
  return reactor;
}

grpc::ServerUnaryReactor* JobService::Extend(grpc::CallbackServerContext* context,
                                             const v1::ExtendJobRequest* request,
                                             v1::Job* response) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  if (const Status allowed = CheckMayChange(context, request->job_id()); !allowed.ok()) {
    reactor->Finish(ToGrpc(allowed));
    return reactor;
  }
  const StatusOr<RenderOverrides> until = FromProto(request->until());
  reactor->Finish(until.ok() ? Put(coordinator_.Extend(request->job_id(), *until), response)
                             : ToGrpc(until.status()));
  return reactor;
}

grpc::ServerWriteReactor<v1::Job>* JobService::Watch(grpc::CallbackServerContext* /*context*/,
                                                     const v1::WatchJobRequest* request) {
  auto* const watch = new WatchReactor(*this, request->job_id());
  bool is_closed = false;
  {
    const MutexLock lock(mutex_);
    is_closed = is_closed_;
    watches_.insert(watch);
  }
  if (is_closed) {
    watch->Close();
  } else {
    watch->SendIfDue(clock_.Steady());
  }
  return watch;
}

void JobService::Tick() {
  // Under the lock, so that no watcher is deleted meanwhile: OnDone needs it first.
  const MutexLock lock(mutex_);
  for (WatchReactor* const watch : watches_)
    watch->SendIfDue(clock_.Steady());
}

void JobService::Close() {
  const MutexLock lock(mutex_);
  is_closed_ = true;
  for (WatchReactor* const watch : watches_)
    watch->Close();
}

}  // namespace lucerna
