#include "server/job_runner.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"

#include "render/estimate/evidence.h"
#include "render/wire/block_codec.h"

namespace lucerna {

JobRunner::JobRunner(std::string job_id, RenderSettings settings, int threads, RunnerHooks hooks)
    : job_id_(std::move(job_id)),
      settings_(std::move(settings)),
      threads_(threads),
      hooks_(std::move(hooks)),
      end_(EndOf(settings_)) {}

JobRunner::~JobRunner() = default;

JobRunner::End JobRunner::EndOf(const RenderSettings& settings) {
  End end;
  end.passes = static_cast<std::uint64_t>(settings.passes);
  end.time_s = settings.time_s;
  end.error = settings.error;
  if (settings.photons > 0) {
    const auto a_pass = static_cast<std::uint64_t>(settings.photons_per_pass);
    const std::uint64_t passes = (settings.photons - 1) / a_pass + 1;
    if (end.passes == 0 || passes < end.passes) {
      end.passes = passes;
      end.is_photons = true;
    }
  }
  return end;
}

StatusOr<RenderResult> JobRunner::Run(Scene scene, const SceneNeeds& needs,
                                      ReferenceImage reference) {
  LUCERNA_ASSIGN_OR_RETURN(estimator_,
                           JobEstimator::Create(std::move(scene), settings_, needs, threads_));
  reference_ = std::move(reference);
  if (const std::size_t faint = estimator_->faint_lights(); faint > 0) {
    hooks_.on_warning(
        absl::StrCat("warning: ", faint, faint == 1 ? " light has" : " lights have",
                     " less than 4e-15 of the scene's power: photons of it are too faint to count"
                     " beside the others, so what is lit by reflections of that light alone stays"
                     " dark; render it by itself and add the images"));
  }
  return RunToEnd();
}

StatusOr<RenderResult> JobRunner::Resume() {
  return RunToEnd();
}

StatusOr<RenderResult> JobRunner::RunToEnd() {
  LUCERNA_RETURN_IF_ERROR(why_stopped());
  is_running_ = true;
  hooks_.on_running();
  const SteadyTime started_at = hooks_.clock.Steady();
  StatusOr<RenderResult> result = RunPasses();
  ran_before_ += hooks_.clock.Steady() - started_at;
  // Whatever ended it: workers must not go on with passes that will not be merged.
  while (!open_.empty()) {
    hooks_.scheduler.ClosePass(KeyOf(open_.front().traced.eye.pass));
    hooks_.merger.Drop(KeyOf(open_.front().traced.eye.pass));
    Withdraw(open_.front());
    open_.pop_front();
  }
  ahead_.reset();
  return result;
}

StopReason JobRunner::ReasonToStop(const End& end, bool is_time_up) const {
  const auto applied = static_cast<std::uint64_t>(estimator_->passes_applied());
  if (applied == 0) return StopReason::kNone;
  if (end.passes > 0 && applied >= end.passes) {
    return end.is_photons ? StopReason::kPhotons : StopReason::kPasses;
  }
  if (end.error > 0 && error_at_most_ <= end.error) return StopReason::kError;
  if (is_time_up) return StopReason::kTime;
  const MutexLock lock(mutex_);
  return shall_finish_ ? StopReason::kUser : StopReason::kNone;
}

StatusOr<RenderResult> JobRunner::RunPasses() {
  const SteadyTime started_at = hooks_.clock.Steady() - ran_before_;
  auto next_pass = static_cast<std::uint64_t>(estimator_->passes_applied());  // to be opened

  while (true) {
    LUCERNA_RETURN_IF_ERROR(why_stopped());
    End end;
    {
      const MutexLock lock(mutex_);
      end = end_;
    }
    std::optional<SteadyTime> time_is_up;
    if (end.time_s > 0) {
      // A limit beyond a century is no limit, and would not fit.
      const double seconds = std::min(end.time_s, 3.2e9);
      time_is_up =
          started_at + std::chrono::duration_cast<Duration>(std::chrono::duration<double>(seconds));
    }
    const bool is_time_up = time_is_up && hooks_.clock.Steady() >= *time_is_up;
    if (const StopReason reason = ReasonToStop(end, is_time_up); reason != StopReason::kNone) {
      EstimateErrorIfDue(true);
      CheckImage();
      const MutexLock lock(estimator_mutex_);
      return MakeResult(reason);
    }
    const auto applied = static_cast<std::uint64_t>(estimator_->passes_applied());
    const bool wants_more =
        (end.passes == 0 || next_pass < end.passes) && !(is_time_up && next_pass > 0);

    // Radii of a pass follow from the passes up to two before it: it may be opened while the pass
    // before it is out.
    if (wants_more && next_pass <= applied + 1) {
      TracedPass traced;
      if (ahead_) {
        traced = std::move(*ahead_);
        ahead_.reset();
      } else {
        LUCERNA_ASSIGN_OR_RETURN(traced, Trace(next_pass));
      }
      LUCERNA_RETURN_IF_ERROR(Open(std::move(traced)));
      ++next_pass;
      continue;
    }
    if (!open_.empty() && IsComplete(open_.front())) {
      OpenPass complete = std::move(open_.front());
      open_.pop_front();
      TakeIn(std::move(complete));
      EstimateErrorIfDue(false);
      continue;
    }
    if (wants_more && !ahead_) {
      LUCERNA_ASSIGN_OR_RETURN(ahead_, Trace(next_pass));
      continue;
    }
    // When time is up and nothing has been taken in, the first pass is waited for all the same.
    if (!WaitForChange(applied > 0 ? time_is_up : std::nullopt)) return why_stopped();
  }
}

void JobRunner::EstimateErrorIfDue(bool is_last) {
  ErrorCheckpoint checkpoint;
  {
    const MutexLock lock(estimator_mutex_);
    checkpoint.passes = estimator_->passes_applied();
    if (checkpoint.passes < 2 || checkpoint.passes == passes_at_checkpoint_) return;
    if (!is_last && checkpoint.passes < next_checkpoint_) return;
    checkpoint.photons = photons_applied_;
    checkpoint.estimate = estimator_->EstimateError(++checkpoints_);
    checkpoint.missing = estimator_->FindMissingLight();
    if (!reference_.empty()) checkpoint.truth = estimator_->ErrorAgainst(reference_);
  }
  passes_at_checkpoint_ = checkpoint.passes;
  error_at_most_ = std::sqrt(checkpoint.estimate.relative.high);
  next_checkpoint_ = NextCheckpoint(checkpoint.passes);
  hooks_.on_error_estimate(checkpoint);
}

void JobRunner::CheckImage() {
  std::uint64_t photons = 0;
  {
    const MutexLock lock(estimator_mutex_);
    if (has_warned_ || !estimator_->IsBlack()) return;
    photons = photons_applied_;
  }
  has_warned_ = true;
  hooks_.on_warning(absl::StrCat(
      "warning: the image is black after ", photons,
      " photons: no light has reached the"
      " view; check that the scene has lights, which way they and the camera face, and what stands"
      " between them"));
}

StatusOr<JobRunner::TracedPass> JobRunner::Trace(std::uint64_t pass) {
  TracedPass traced;
  traced.eye = estimator_->TraceEyePaths(pass);
  // The hitpoints of a set are those of the pass that used it last.
  const int sets = estimator_->needs().eye_sample_sets();
  const std::uint64_t set = EyeSetOf(pass, sets);
  if (const auto known = set_blocks_.find(set); known != set_blocks_.end()) {
    if (auto pin = hooks_.blobs.Pin(known->second); pin.ok()) {
      traced.block = *std::move(pin);
      return traced;
    }
  }
  std::string bytes = EncodeHitpointBlock(traced.eye.block);
  const Digest digest = Sha256(bytes);
  // A block stays for its next turn if it has one.
  LUCERNA_ASSIGN_OR_RETURN(
      traced.block, hooks_.blobs.PutPinned(digest, std::move(bytes),
                                           sets > 0 ? AfterLastPin::kKeep : AfterLastPin::kDrop));
  if (sets > 0) {
    // Sets of an earlier round are not used again.
    if (set_blocks_.size() >= static_cast<std::size_t>(sets)) set_blocks_.clear();
    set_blocks_[set] = digest;
  }
  return traced;
}

Status JobRunner::Open(TracedPass traced) {
  OpenPass open;
  {
    const MutexLock lock(estimator_mutex_);
    open.radii = estimator_->Radii(traced.eye);
  }
  std::string bytes = EncodeRadii(open.radii);
  open.blobs = {traced.block.digest(), Sha256(bytes), traced.eye.block.size()};
  LUCERNA_ASSIGN_OR_RETURN(
      open.encoded_radii,
      hooks_.blobs.PutPinned(open.blobs.radii, std::move(bytes), AfterLastPin::kDrop));
  const std::uint64_t pass = traced.eye.pass;
  open.traced = std::move(traced);
  {
    const MutexLock lock(mutex_);
    blobs_[pass] = open.blobs;
  }
  // Without photons a pass is complete as it is.
  if (HasPhotons(open)) {
    const auto photons = static_cast<std::uint64_t>(settings_.photons_per_pass);
    hooks_.merger.Open(KeyOf(pass), open.blobs.hitpoints, photons,
                       EvidenceColumns(EvidenceOf(settings_.radius_controller, pass)));
    hooks_.scheduler.OpenPass(KeyOf(pass), photons);
  }
  open_.push_back(std::move(open));
  hooks_.on_pass_opened();
  return absl::OkStatus();
}

bool JobRunner::HasPhotons(const OpenPass& open) const {
  // A camera that sees nothing needs none, and without light there are none.
  return open.blobs.hitpoints > 0 && estimator_->needs().Uses(Part::kPhotons);
}

bool JobRunner::IsComplete(const OpenPass& open) const {
  return !HasPhotons(open) || hooks_.merger.IsComplete(KeyOf(open.traced.eye.pass));
}

void JobRunner::TakeIn(OpenPass open) {
  const PassKey key = KeyOf(open.traced.eye.pass);
  PassSums sums(open.blobs.hitpoints,
                EvidenceColumns(EvidenceOf(settings_.radius_controller, key.pass)));
  if (HasPhotons(open)) {
    hooks_.scheduler.ClosePass(key);
    sums = hooks_.merger.Take(key);
  }
  std::int64_t passes = 0;
  {
    const MutexLock lock(estimator_mutex_);
    estimator_->Apply(open.traced.eye, open.radii, sums);
    photons_applied_ += sums.tally().photons;
    passes = estimator_->passes_applied();
  }
  Withdraw(open);
  hooks_.on_pass_merged(passes, sums.tally());
}

void JobRunner::Withdraw(const OpenPass& open) {
  const MutexLock lock(mutex_);
  blobs_.erase(open.traced.eye.pass);
}

bool JobRunner::WaitForChange(std::optional<SteadyTime> until) {
  // Now and then without a reason, so that a wake that is lost costs a moment and not the job.
  constexpr Duration kLongest = std::chrono::seconds(1);
  Duration longest = kLongest;
  if (until) longest = std::clamp(*until - hooks_.clock.Steady(), Duration::zero(), kLongest);
  const MutexLock lock(mutex_);
  if (!was_woken_ && !why_stopped_ && longest > Duration::zero()) {
    changed_.WaitFor(mutex_, longest);
  }
  was_woken_ = false;
  return !why_stopped_;
}

Status JobRunner::why_stopped() const {
  const MutexLock lock(mutex_);
  return why_stopped_.value_or(absl::OkStatus());
}

void JobRunner::SetEnd(const RenderSettings& settings) {
  const MutexLock lock(mutex_);
  end_ = EndOf(settings);
  was_woken_ = true;
  changed_.NotifyAll();
}

void JobRunner::Reopen(const RenderSettings& settings) {
  const MutexLock lock(mutex_);
  shall_finish_ = false;
  end_ = EndOf(settings);
}

void JobRunner::Finish() {
  const MutexLock lock(mutex_);
  shall_finish_ = true;
  was_woken_ = true;
  changed_.NotifyAll();
}

void JobRunner::Stop(Status why) {
  const MutexLock lock(mutex_);
  if (!why_stopped_) why_stopped_ = std::move(why);
  changed_.NotifyAll();
}

void JobRunner::Wake() {
  const MutexLock lock(mutex_);
  was_woken_ = true;
  changed_.NotifyAll();
}

std::optional<PassBlobs> JobRunner::BlobsOf(std::uint64_t pass) const {
  const MutexLock lock(mutex_);
  const auto found = blobs_.find(pass);
  if (found == blobs_.end()) return std::nullopt;
  return found->second;
}

std::optional<std::size_t> JobRunner::HitpointsIn(const Digest& digest) const {
  const MutexLock lock(mutex_);
  for (const auto& [pass, blobs] : blobs_) {
    if (blobs.block == digest) return blobs.hitpoints;
    if (blobs.radii == digest) return std::size_t{0};
  }
  return std::nullopt;
}

RenderResult JobRunner::MakeResult(StopReason reason) const {
  RenderResult result;
  result.reason = reason;
  result.image = estimator_->MakeImage();
  result.passes = estimator_->passes_applied();
  result.photons = photons_applied_;
  return result;
}

StatusOr<RenderResult> JobRunner::ImageSoFar() const {
  if (is_running_) {
    const MutexLock lock(estimator_mutex_);
    if (estimator_->passes_applied() > 0) return MakeResult(StopReason::kNone);
  }
  return absl::FailedPreconditionError("no pass has been merged yet; try again in a moment");
}

}  // namespace lucerna
