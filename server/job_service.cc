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
  submission.is_traced = request.is_traced();
  if (request.has_bake()) {
    LUCERNA_ASSIGN_OR_RETURN(submission.bake, FromProto(request.bake()));
  }
  submission.priority = request.priority();
  if (submission.priority < kLowestPriority || submission.priority > kHighestPriority) {
    return absl::InvalidArgumentError(
        absl::StrCat("a priority is a number from ", kLowestPriority, " to ", kHighestPriority));
  }
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
class JobService::WatchReactor final : public grpc::ServerWriteReactor<grpc::ByteBuffer> {
 public:
  WatchReactor(JobService& service, std::string job_id, std::string caller)
      : service_(service), job_id_(std::move(job_id)), caller_(std::move(caller)) {}

  [[nodiscard]] const std::string& job_id() const { return job_id_; }
  [[nodiscard]] const std::string& caller() const { return caller_; }

  // Before anything is sent.
  void Refuse(const Status& why) {
    const MutexLock lock(mutex_);
    if (!is_finished_) End(why);
  }

  // Sends `newest` unless it has been sent.
  void SendIfNew(std::shared_ptr<const Snapshot> newest) {
    const MutexLock lock(mutex_);
    if (is_writing_ || is_finished_) return;
    if (is_cancelled_) {
      End(absl::CancelledError("the watcher left"));
    } else if (sent_ && sent_->has_ended) {
      End(absl::OkStatus());
    } else if (!newest->failure.ok()) {
      End(newest->failure);
    } else if (newest != sent_) {
      sent_ = std::move(newest);
      is_writing_ = true;
      StartWrite(&sent_->bytes);
    }
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
    } else if (sent_ && sent_->has_ended) {
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
      const auto of_caller = service_.watches_of_.find(caller_);
      if (--of_caller->second == 0) service_.watches_of_.erase(of_caller);
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
  const std::string caller_;
  Mutex mutex_;
  bool is_writing_ LUCERNA_GUARDED_BY(mutex_) = false;
  bool is_finished_ LUCERNA_GUARDED_BY(mutex_) = false;
  bool is_cancelled_ LUCERNA_GUARDED_BY(mutex_) = false;
  bool is_closed_ LUCERNA_GUARDED_BY(mutex_) = false;
  std::shared_ptr<const Snapshot> sent_ LUCERNA_GUARDED_BY(mutex_);  // or being sent
};

Status JobService::CheckMayChange(const grpc::CallbackServerContext* context,
                                  const std::string& job_id) const {
  LUCERNA_ASSIGN_OR_RETURN(const std::string owner, coordinator_.OwnerOf(job_id));
  return access_.CheckOwns(*context, job_id, owner);
}

grpc::ServerUnaryReactor* JobService::Change(grpc::CallbackServerContext* context,
                                             const std::string& job_id, v1::Job* response,
                                             std::function<StatusOr<JobReport>()> change) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  if (const Status allowed = CheckMayChange(context, job_id); !allowed.ok()) {
    reactor->Finish(ToGrpc(allowed));
    return reactor;
  }
  pools_.changes.Run(NeededByCaller(context), [reactor, response, change = std::move(change)](
                                                  const Status& may_begin) {
    reactor->Finish(may_begin.ok() ? Put(WithinMemory(change), response) : ToGrpc(may_begin));
  });
  return reactor;
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
    reactor->Finish(ToGrpc(may_begin.ok() ? WithinMemory(submit) : may_begin));
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
  JobFilter filter;
  for (const int state : request->states()) {
    const std::optional<JobState> known = FromProto(static_cast<v1::JobState>(state));
    if (!known) {
      reactor->Finish(ToGrpc(absl::InvalidArgumentError("a state to list is none of a job")));
      return reactor;
    }
    filter.states.insert(*known);
  }
  filter.owner = request->owner();
  filter.name_contains = request->name_contains();
  const auto [reports, next] = coordinator_.List(filter, count, before);
  for (const JobReport& report : reports)
    *response->add_jobs() = SummaryToProto(report);
  if (next != 0) response->set_next_page_token(absl::StrCat(next));
  reactor->Finish(grpc::Status::OK);
  return reactor;
}

grpc::ServerUnaryReactor* JobService::Cancel(grpc::CallbackServerContext* context,
                                             const v1::CancelJobRequest* request,
                                             v1::Job* response) {
  return Change(context, request->job_id(), response,
                [this, request] { return coordinator_.Cancel(request->job_id()); });
}

grpc::ServerUnaryReactor* JobService::Pause(grpc::CallbackServerContext* context,
                                            const v1::PauseJobRequest* request, v1::Job* response) {
  return Change(context, request->job_id(), response,
                [this, request] { return coordinator_.Pause(request->job_id()); });
}

grpc::ServerUnaryReactor* JobService::Resume(grpc::CallbackServerContext* context,
                                             const v1::ResumeJobRequest* request,
                                             v1::Job* response) {
  return Change(context, request->job_id(), response,
                [this, request] { return coordinator_.Resume(request->job_id()); });
}

grpc::ServerUnaryReactor* JobService::SetPriority(grpc::CallbackServerContext* context,
                                                  const v1::SetJobPriorityRequest* request,
                                                  v1::Job* response) {
  return Change(context, request->job_id(), response, [this, request] {
    return coordinator_.SetPriority(request->job_id(), request->priority());
  });
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
  return Change(context, request->job_id(), response,
                [this, request] { return coordinator_.Stop(request->job_id()); });
}

grpc::ServerUnaryReactor* JobService::Extend(grpc::CallbackServerContext* context,
                                             const v1::ExtendJobRequest* request,
                                             v1::Job* response) {
  return Change(context, request->job_id(), response, [this, request]() -> StatusOr<JobReport> {
    LUCERNA_ASSIGN_OR_RETURN(const RenderOverrides until, FromProto(request->until()));
    return coordinator_.Extend(request->job_id(), until);
  });
}

std::shared_ptr<const JobService::Snapshot> JobService::Refresh(const std::string& job_id) {
  const SteadyTime now = clock_.Steady();
  std::shared_ptr<const Snapshot>& newest = snapshots_[job_id];
  const StatusOr<JobTable::News> news = coordinator_.NewsOf(job_id);
  if (newest && news.ok()) {
    const Duration age = now - newest->made_at;
    const bool is_due = news->state != newest->news.state ||
                        (*news != newest->news && age >= kWatchAtMostEvery) ||
                        age >= kWatchAtLeastEvery;
    if (!is_due) return newest;
  }
  auto snapshot = std::make_shared<Snapshot>();
  snapshot->made_at = now;
  const StatusOr<JobReport> report = coordinator_.ReportOf(job_id);
  snapshot->failure = report.status();
  if (report.ok()) {
    snapshot->news = {report->job.life.state(), report->version};
    snapshot->has_ended = report->job.life.has_ended();
    const grpc::Slice bytes(ToProto(*report).SerializeAsString());
    snapshot->bytes = grpc::ByteBuffer(&bytes, 1);
  }
  newest = std::move(snapshot);
  return newest;
}

grpc::ServerWriteReactor<grpc::ByteBuffer>* JobService::Watch(grpc::CallbackServerContext* context,
                                                              const grpc::ByteBuffer* request) {
  v1::WatchJobRequest message;
  grpc::ByteBuffer bytes = *request;
  const bool is_read =
      grpc::SerializationTraits<v1::WatchJobRequest>::Deserialize(&bytes, &message).ok();
  // What cannot be read names no job.
  auto* const watch = new WatchReactor(*this, is_read ? message.job_id() : std::string(),
                                       access_.LimitKeyOf(*context));
  // Under the lock, so that the watcher is not deleted meanwhile: OnDone needs it first.
  const MutexLock lock(mutex_);
  watches_.insert(watch);
  const std::size_t of_caller = ++watches_of_[watch->caller()];
  if (is_closed_) {
    watch->Close();
  } else if (of_caller > coordinator_.max_watches()) {
    watch->Refuse(absl::ResourceExhaustedError(
        absl::StrCat("you follow ", of_caller - 1, " jobs already; end some of that first")));
  } else {
    watch->SendIfNew(Refresh(watch->job_id()));
  }
  return watch;
}

void JobService::Tick() {
  // Under the lock, so that no watcher is deleted meanwhile: OnDone needs it first.
  const MutexLock lock(mutex_);
  std::set<std::string> watched;
  for (WatchReactor* const watch : watches_) {
    const bool is_new = watched.insert(watch->job_id()).second;
    watch->SendIfNew(is_new ? Refresh(watch->job_id()) : snapshots_.at(watch->job_id()));
  }
  std::erase_if(snapshots_, [&](const auto& item) { return !watched.contains(item.first); });
}

void JobService::Close() {
  const MutexLock lock(mutex_);
  is_closed_ = true;
  for (WatchReactor* const watch : watches_)
    watch->Close();
}

}  // namespace lucerna
