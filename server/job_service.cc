#include "server/job_service.h"

#include <algorithm>
#include <charconv>
#include <optional>
#include <utility>

#include "render/wire/grpc_status.h"
#include "render/wire/messages.h"
#include "server/rpc_caller.h"

namespace lucerna {
namespace {

constexpr Duration kWatchAtMostEvery = std::chrono::milliseconds(100);
constexpr Duration kWatchAtLeastEvery = std::chrono::seconds(5);
constexpr std::size_t kLargestPage = 1000;
constexpr std::size_t kUsualPage = 100;
// A job's warnings go with every message about it.
constexpr std::size_t kMostWarnings = 200;
constexpr std::size_t kMostShares = 1000;

v1::JobState StateToProto(JobState state) {
  switch (state) {
    case JobState::kQueued:
      return v1::JOB_STATE_QUEUED;
    case JobState::kPreparing:
      return v1::JOB_STATE_PREPARING;
    case JobState::kRunning:
      return v1::JOB_STATE_RUNNING;
    case JobState::kSucceeded:
      return v1::JOB_STATE_SUCCEEDED;
    case JobState::kCancelled:
      return v1::JOB_STATE_CANCELLED;
    case JobState::kFailed:
      return v1::JOB_STATE_FAILED;
  }
  return v1::JOB_STATE_UNSPECIFIED;
}

v1::StopReason ReasonToProto(StopReason reason) {
  switch (reason) {
    case StopReason::kNone:
      return v1::STOP_REASON_UNSPECIFIED;
    case StopReason::kPasses:
      return v1::STOP_REASON_PASSES;
    case StopReason::kTime:
      return v1::STOP_REASON_TIME;
    case StopReason::kError:
      return v1::STOP_REASON_ERROR;
    case StopReason::kPhotons:
      return v1::STOP_REASON_PHOTONS;
    case StopReason::kUser:
      return v1::STOP_REASON_USER;
  }
  return v1::STOP_REASON_UNSPECIFIED;
}

v1::Progress ProgressToProto(const JobReport& report) {
  const JobCounters& counters = report.job.counters;
  v1::Progress message;
  message.set_passes(counters.passes);
  message.set_photons(counters.photons);
  *message.mutable_running() = ToProto(report.running);
  if (counters.to_first_photons) {
    *message.mutable_to_first_photons() = ToProto(*counters.to_first_photons);
  }
  *message.mutable_coordinator_cpu() = ToProto(counters.coordinator_cpu);
  *message.mutable_worker_cpu() = ToProto(counters.worker_cpu);
  message.set_photons_per_second(report.photons_per_second);
  message.set_workers(report.workers);
  *message.mutable_tally() = ToProto(counters.tally);
  message.set_bytes_sent(counters.bytes_sent);
  message.set_bytes_received(counters.bytes_received);
  message.set_hitpoints_sent(counters.hitpoints_sent);
  message.set_hitpoints_returned(counters.hitpoints_returned);
  return message;
}

v1::SquaredError ErrorToProto(const SquaredError& error) {
  v1::SquaredError message;
  message.set_noise(error.noise);
  message.set_bias(error.bias);
  message.set_low(error.low);
  message.set_high(error.high);
  return message;
}

v1::ErrorSample SampleToProto(const ErrorSample& sample) {
  v1::ErrorSample message;
  message.set_passes(sample.passes);
  message.set_photons(sample.photons);
  *message.mutable_running() = ToProto(sample.running);
  *message.mutable_cpu() = ToProto(sample.cpu);
  *message.mutable_relative() = ErrorToProto(sample.estimate.relative);
  *message.mutable_absolute() = ErrorToProto(sample.estimate.absolute);
  message.set_relative_untrimmed(sample.estimate.untrimmed);
  message.set_left_out_pixels(sample.estimate.left_out_pixels);
  if (sample.truth) {
    message.set_true_relative(sample.truth->relative);
    message.set_true_absolute(sample.truth->absolute);
    message.set_true_relative_untrimmed(sample.truth->untrimmed);
  }
  message.set_missing_relative(sample.missing_relative);
  message.set_nothing_found(sample.nothing_found);
  return message;
}

// The busiest first.
void AddShares(const std::map<std::string, WorkerShare>& workers, v1::Job& message) {
  std::vector<std::pair<std::string, WorkerShare>> shares(workers.begin(), workers.end());
  std::stable_sort(shares.begin(), shares.end(), [](const auto& a, const auto& b) {
    return a.second.photons > b.second.photons;
  });
  for (std::size_t i = 0; i < std::min(shares.size(), kMostShares); ++i) {
    const auto& [id, share] = shares[i];
    v1::WorkerShare& item = *message.add_worker_shares();
    item.set_worker_id(id);
    item.set_name(share.name);
    item.set_photons(share.photons);
    item.set_batches(share.batches);
    *item.mutable_cpu() = ToProto(share.cpu);
  }
}

v1::Job JobToProto(const JobReport& report) {
  const Job& job = report.job;
  const JobState state = job.life.state();
  v1::Job message;
  message.set_job_id(job.id);
  message.set_name(job.name);
  message.set_state(StateToProto(state));
  message.set_stop_reason(ReasonToProto(job.life.stop_reason()));
  message.set_failure(job.life.failure());
  *message.mutable_settings() = ToProto(job.settings);
  message.set_scene_digest(std::string(job.scene_digest.Bytes()));
  for (std::size_t i = 0; i < std::min(job.warnings.size(), kMostWarnings); ++i) {
    message.add_warnings(job.warnings[i]);
  }
  for (const Part part : AllParts()) {
    v1::PartUse& use = *message.add_parts();
    use.set_part(std::string(NameOf(part)));
    use.set_is_used(job.needs.Uses(part));
    use.set_reason(job.needs.ReasonOf(part));
  }
  *message.mutable_progress() = ProgressToProto(report);
  *message.mutable_submitted_at() = ToProto(job.submitted_at);
  message.set_no_workers(state == JobState::kRunning && report.workers == 0);
  for (const ErrorSample& sample : job.convergence)
    *message.add_convergence() = SampleToProto(sample);
  for (const LightFinding& light : job.lights) {
    v1::LightFinding& item = *message.add_lights();
    item.set_name(light.name);
    item.set_power_share(light.power_share);
    item.set_photons_sent(light.photons.sent);
    item.set_in_view_caustic(light.photons.InView(PathClass::kCaustic));
    item.set_in_view_other(light.photons.InView(PathClass::kOther));
    item.set_missing_share(light.missing_share);
  }
  AddShares(job.workers, message);
  message.set_has_reference(job.reference.has_value());
  for (const PhotonStep& step : job.photon_steps)
    *message.add_photon_steps() = ToProto(step);
  std::vector<PassTally> parts = job.pass_record.tallies();
  if (job.tail.passes > 0) parts.push_back(job.tail);
  for (const PassTally& part : parts) {
    v1::PassEnergy& item = *message.add_energy_of_passes();
    item.set_first_pass(part.first_pass);
    item.set_passes(part.passes);
    *item.mutable_energy() = ToProto(part.tally).energy();
  }
  for (const PhotonKey& key : job.counters.dropped_photons) {
    v1::PhotonKey& item = *message.add_dropped_photons();
    item.set_pass(key.pass);
    item.set_index(key.index);
  }
  return message;
}

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
  if (report.ok()) *response = JobToProto(*report);
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
    message_ = JobToProto(*report);
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

grpc::ServerUnaryReactor* JobService::Submit(grpc::CallbackServerContext* context,
                                             const v1::SubmitRequest* request,
                                             v1::SubmitResponse* response) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  const StillNeeded still_needed = NeededByCaller(context);
  const auto submit = [this, request, response, still_needed]() -> Status {
    LUCERNA_ASSIGN_OR_RETURN(const Submission submission, ReadSubmission(*request));
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
    *response->add_jobs() = JobToProto(report);
  if (next != 0) response->set_next_page_token(absl::StrCat(next));
  reactor->Finish(grpc::Status::OK);
  return reactor;
}

grpc::ServerUnaryReactor* JobService::Cancel(grpc::CallbackServerContext* context,
                                             const v1::CancelJobRequest* request,
                                             v1::Job* response) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  reactor->Finish(Put(coordinator_.Cancel(request->job_id()), response));
  return reactor;
}

grpc::ServerUnaryReactor* JobService::Stop(grpc::CallbackServerContext* context,
                                           const v1::StopJobRequest* request, v1::Job* response) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  reactor->Finish(Put(coordinator_.Stop(request->job_id()), response));
  return reactor;
}

grpc::ServerUnaryReactor* JobService::Extend(grpc::CallbackServerContext* context,
                                             const v1::ExtendJobRequest* request,
                                             v1::Job* response) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
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
