#include "worker/lease_runner.h"

#include <algorithm>
#include <new>
#include <thread>

#include <spdlog/spdlog.h>

#include "render/base/escape.h"
#include "render/base/fail_point.h"
#include "render/wire/accumulation_codec.h"
#include "render/wire/messages.h"
#include "render/wire/slice_codec.h"

namespace lucerna {
namespace {

constexpr int kCommitTries = 3;
// Descriptions of jobs, whose leases may alternate.
constexpr std::size_t kJobsKept = 8;
constexpr std::chrono::milliseconds kBusyPause{200};

bool IsGone(const Status& status) {
  return absl::IsUnavailable(status) || absl::IsDeadlineExceeded(status) ||
         absl::IsCancelled(status) || absl::IsUnimplemented(status);
}

// What `work` returns, or that memory ran out in it.
template <typename Work>
auto UnlessOutOfMemory(const Work& work) -> decltype(work()) {
  try {
    return work();
  } catch (const std::bad_alloc&) {
    return absl::ResourceExhaustedError(
        "the worker ran out of memory; use a machine with more, or make the image or the scene "
        "smaller");
  }
}

Status NoSuchGuide() {
  return absl::InvalidArgumentError("a lease's photon guide is not one of its job");
}

}  // namespace

Status LeaseRunner::Run() {
  std::thread fetch([this] { FetchStage(); });
  std::thread commit([this] { CommitStage(); });
  std::thread heartbeat([this] { Heartbeat(); });
  ComputeStage();
  fetch.join();
  commit.join();
  heartbeat.join();
  const MutexLock lock(mutex_);
  return why_stopped_;
}

void LeaseRunner::Stop(Status why) {
  {
    const MutexLock lock(mutex_);
    if (is_stopped_) return;
    is_stopped_ = true;
    why_stopped_ = std::move(why);
    for (const auto& [id, held] : held_)
      held->is_revoked = true;
  }
  fetched_.Close();
  computed_.Close();
  connection_.BreakOff();
}

bool LeaseRunner::StopIfGone(const Status& status) {
  if (!IsGone(status)) return false;
  Stop(status);
  return true;
}

v1::SyncRequest LeaseRunner::Report(bool wants_lease) {
  v1::SyncRequest request;
  request.set_worker_id(worker_id_);
  request.set_wants_lease(wants_lease);
  const MutexLock lock(mutex_);
  for (const auto& [id, held] : held_)
    request.add_held_lease_ids(id);
  for (auto& [id, reason] : std::exchange(failures_, {})) {
    v1::SyncRequest::Failure& failure = *request.add_failures();
    failure.set_lease_id(std::move(id));
    failure.set_reason(std::move(reason));
  }
  return request;
}

void LeaseRunner::Revoke(const v1::SyncResponse& response) {
  const MutexLock lock(mutex_);
  for (const std::string& id : response.revoked_lease_ids()) {
    const auto found = held_.find(id);
    if (found == held_.end()) continue;
    found->second->is_revoked = true;
    // Not spoken of again, or the coordinator would say the same again at once.
    held_.erase(found);
  }
}

void LeaseRunner::Release(const Held& held, const Status& status) {
  const MutexLock lock(mutex_);
  held_.erase(held.work.lease_id);
  // A refused result ends its lease too, and the news of that may come before the answer.
  if (status.ok() || (held.is_revoked && !absl::IsInvalidArgument(status))) return;
  spdlog::warn("lease {}: {}", Escaped(held.work.lease_id), Escaped(std::string(status.message())));
  if (held.is_revoked) return;
  ++counts_.failed;
  failures_.emplace_back(held.work.lease_id, std::string(status.message()));
}

void LeaseRunner::FetchStage() {
  while (fetched_.WaitForRoom()) {
    const StatusOr<v1::SyncResponse> response =
        connection_.Sync(Report(/*wants_lease=*/true), sync_every_);
    if (!response.ok()) {
      // Whatever it is: without an answer to this call there is no work. NOT_FOUND means that the
      // coordinator was started anew.
      Stop(response.status());
      return;
    }
    Revoke(*response);
    if (!response->has_lease()) continue;
    StatusOr<LentWork> work = ReadLease(response->lease());
    const auto held = std::make_shared<Held>();
    held->work.lease_id = response->lease().lease_id();
    if (work.ok()) held->work = std::move(*work);
    {
      const MutexLock lock(mutex_);
      if (is_stopped_) return;
      held_[held->work.lease_id] = held;
    }
    if (!work.ok()) {
      Release(*held, work.status());
      continue;
    }
    StatusOr<Fetched> fetched = UnlessOutOfMemory([&] { return Fetch(held); });
    if (!fetched.ok()) {
      if (StopIfGone(fetched.status())) return;
      // The pass ended while its lease was on the way.
      Release(*held, absl::IsNotFound(fetched.status()) ? absl::OkStatus() : fetched.status());
      continue;
    }
    if (!fetched_.Give(*std::move(fetched))) return;
  }
}

StatusOr<std::shared_ptr<const JobToTrace>> LeaseRunner::JobOf(const std::string& job_id,
                                                               std::uint64_t guides) {
  const auto known = std::ranges::find(jobs_, job_id, [](const auto& job) { return job.first; });
  if (known != jobs_.end()) {
    if (known->second->guides.size() >= guides) return known->second;
    LUCERNA_ASSIGN_OR_RETURN(const v1::JobDescription message,
                             connection_.DescribeJob(job_id, /*guides_only=*/true));
    JobToTrace job = *known->second;
    LUCERNA_RETURN_IF_ERROR(ReadGuides(message, job));
    if (job.guides.size() < guides) return NoSuchGuide();
    known->second = std::make_shared<const JobToTrace>(std::move(job));
    return known->second;
  }
  LUCERNA_ASSIGN_OR_RETURN(const v1::JobDescription message, connection_.DescribeJob(job_id));
  LUCERNA_ASSIGN_OR_RETURN(JobToTrace job, ReadJob(message));
  if (job.guides.size() < guides) return NoSuchGuide();
  jobs_.emplace_front(job_id, std::make_shared<const JobToTrace>(std::move(job)));
  if (jobs_.size() > kJobsKept) jobs_.pop_back();
  return jobs_.front().second;
}

StatusOr<LeaseRunner::Fetched> LeaseRunner::Fetch(const std::shared_ptr<Held>& held) {
  const LentWork& work = held->work;
  Fetched fetched;
  fetched.held = held;
  LUCERNA_ASSIGN_OR_RETURN(fetched.job, JobOf(work.job_id, work.guide));
  const RenderSettings& settings = fetched.job->settings;
  const std::size_t pixels = static_cast<std::size_t>(settings.crop_width()) *
                             static_cast<std::size_t>(settings.crop_height());
  LUCERNA_ASSIGN_OR_RETURN(fetched.tracer, cache_.TracerFor(fetched.job->scene));
  std::size_t rows = pixels;
  if (work.kind == v1::WORK_KIND_PHOTONS) {
    const SceneNeeds& needs = fetched.job->needs;
    const std::size_t per_pixel = std::size_t{1} + (needs.Uses(Part::kCausticHitpoints) ? 1 : 0) +
                                  (needs.Uses(Part::kMedia) ? 1 : 0);
    LUCERNA_ASSIGN_OR_RETURN(fetched.block,
                             cache_.BlockFor(work.block, pixels * per_pixel * kMostEyePaths));
    rows = fetched.block->size();
  }
  LUCERNA_ASSIGN_OR_RETURN(fetched.radii, cache_.RadiiFor(work.radii, rows));
  if (work.eye_paths.has_value()) {
    LUCERNA_ASSIGN_OR_RETURN(fetched.eye_paths, cache_.EyePathsFor(*work.eye_paths, pixels));
  }
  return fetched;
}

void LeaseRunner::ComputeStage() {
  while (auto fetched = fetched_.Take()) {
    const Duration cpu_before = ProcessCpuTime();
    const SteadyTime began_at = SystemClock().Steady();
    StatusOr<std::string> bytes = UnlessOutOfMemory([&] { return Compute(*fetched); });
    counts_.computing.Count(SystemClock().Steady() - began_at);
    if (!bytes.ok()) {
      Release(*fetched->held, bytes.status());
      continue;
    }
    Computed computed{fetched->held, *std::move(bytes), ProcessCpuTime() - cpu_before};
    if (!computed_.Give(std::move(computed))) return;
  }
}

StatusOr<std::string> LeaseRunner::Compute(const Fetched& fetched) {
  const LentWork& work = fetched.held->work;
  const JobToTrace& job = *fetched.job;
  const std::atomic<bool>& stop = fetched.held->is_revoked;
  const std::shared_ptr<const PhotonGuide> guide =
      work.guide > 0 ? job.guides[work.guide - 1] : nullptr;
  if (work.kind == v1::WORK_KIND_PHOTONS) {
    LUCERNA_ASSIGN_OR_RETURN(Accumulation accumulation,
                             fetched.tracer->Run(job.settings, job.needs, work.pass, work.first,
                                                 work.last, *fetched.block, *fetched.radii, stop,
                                                 work.photons_per_pass, guide.get()));
    counts_.photons += accumulation.tally.photons;
    if (FaultIsDue("result.flipped") && accumulation.size() > 0) accumulation.flux[0][0] ^= 1;
    if (FaultIsDue("result.zeros")) {
      Accumulation zeros;
      zeros.evidence.resize(accumulation.evidence.size());
      zeros.tally.photons = accumulation.tally.photons;
      accumulation = std::move(zeros);
    }
    if (stop) return absl::CancelledError("the batch was given up");
    return EncodeAccumulation(accumulation, fetched.block->size());
  }
  const RoundPlan plan = {.photons_per_pass = work.photons_per_pass,
                          .radii = fetched.radii,
                          .caustic_radius = work.caustic_radius,
                          .guide = guide,
                          .eye_paths = fetched.eye_paths};
  LUCERNA_ASSIGN_OR_RETURN(
      SliceSums slice,
      fetched.tracer->RunSlice(job.settings, job.needs, {work.first, work.last}, plan, stop));
  counts_.photons += slice.tally.photons;
  if (FaultIsDue("result.flipped")) {
    PackedFloats& red = slice.columns[kPhotonRadiance];
    red.Set(0, Rounded(static_cast<double>(red[0]) + 1, 16));
  }
  if (FaultIsDue("result.zeros")) {
    const std::uint64_t photons = slice.tally.photons;
    slice = EmptySlice(slice.passes, slice.pixels(), slice.evidence);
    slice.tally.photons = photons;
  }
  if (stop) return absl::CancelledError("the slice was given up");
  return EncodeSlice(slice, &fetched.tracer->team());
}

void LeaseRunner::CommitStage() {
  while (auto computed = computed_.Take()) {
    if (computed->held->is_revoked) continue;
    FailPoint("commit.before");
    const StatusOr<v1::CommitOutcome> outcome = Commit(*computed);
    if (outcome.ok()) FailPoint("commit.after");
    if (outcome.ok()) {
      ++counts_.committed;
      Release(*computed->held, absl::OkStatus());
    } else if (StopIfGone(outcome.status())) {
      return;
    } else {
      Release(*computed->held, outcome.status());
    }
  }
}

StatusOr<v1::CommitOutcome> LeaseRunner::Commit(const Computed& computed) {
  const LentWork& work = computed.held->work;
  std::string_view bytes = computed.bytes;
  if (FaultIsDue("commit.truncated")) bytes.remove_suffix(bytes.size() / 2);
  v1::CommitBatchRequest::Header header;
  header.set_worker_id(worker_id_);
  header.set_lease_id(work.lease_id);
  header.set_job_id(work.job_id);
  header.set_kind(work.kind);
  header.set_pass(work.pass);
  header.set_first(work.first);
  header.set_last(work.last);
  *header.mutable_cpu() = ToProto(computed.cpu);
  if (FaultIsDue("commit.forged")) header.set_first(work.first + 1);
  StatusOr<v1::CommitOutcome> outcome = connection_.Commit(header, bytes);
  if (FaultIsDue("commit.twice")) outcome = connection_.Commit(header, bytes);
  // Bytes that were damaged on the way are sent again.
  for (int i = 1; i < kCommitTries && absl::IsDataLoss(outcome.status()); ++i) {
    outcome = connection_.Commit(header, bytes);
  }
  // The coordinator has more commits than it can merge: this worker's batch is no failure. A lease
  // that is revoked, also by Stop, ends the waiting.
  while (absl::IsResourceExhausted(outcome.status()) && !computed.held->is_revoked) {
    std::this_thread::sleep_for(kBusyPause);
    outcome = connection_.Commit(header, bytes);
  }
  return outcome;
}

void LeaseRunner::Heartbeat() {
  while (true) {
    {
      const MutexLock lock(mutex_);
      if (is_stopped_) return;
    }
    const StatusOr<v1::SyncResponse> response =
        connection_.Sync(Report(/*wants_lease=*/false), sync_every_);
    if (!response.ok()) {
      Stop(response.status());
      return;
    }
    Revoke(*response);
  }
}

}  // namespace lucerna
