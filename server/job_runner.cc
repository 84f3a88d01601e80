#include "server/job_runner.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "absl/strings/str_cat.h"

#include "render/base/memory.h"
#include "render/estimate/evidence.h"
#include "render/wire/block_codec.h"
#include "render/wire/bytes.h"
#include "server/state/sums_codec.h"

namespace lucerna {
namespace {

// A job is young for so many passes.
constexpr std::uint64_t kYoungPasses = 16;
// So many passes are split at once: while the last photons of one are out, workers trace the next.
constexpr std::size_t kMostSplitPasses = 2;
// Rounds are opened so many passes ahead for each worker, and at least so many in all.
constexpr std::uint64_t kOpenPassesPerWorker = 64;
constexpr std::uint64_t kFewestOpenPasses = 512;
// While the oldest round is not whole, the sums of all others that are open are kept.
constexpr std::uint64_t kMostOpenBytes = std::uint64_t{4} << 30;
constexpr std::uint64_t kFewestOpenRounds = 4;
constexpr std::uint64_t kBytesOfSums = 48;  // a pixel and round
// The error is near its target when its upper end is below so many times that.
constexpr double kNearTarget = 1.5;
constexpr Duration kPauseBeforeRetry = std::chrono::seconds(1);
// How long the first checkpoint is expected to take: a job of a few seconds needs none.
constexpr Duration kFirstSave = std::chrono::milliseconds(100);

// A limit beyond a century is no limit, and would not fit.
Duration LimitOf(double time_s) {
  return std::chrono::duration_cast<Duration>(
      std::chrono::duration<double>(std::min(time_s, 3.2e9)));
}

// How long to wait after a checkpoint that took `time`, for `share` of the time. Decades at most,
// so that sums fit.
Duration PauseAfterSave(Duration time, double share) {
  const double pause_s = std::min(Seconds(time) * (1 / share - 1), 1e9);
  return std::chrono::duration_cast<Duration>(std::chrono::duration<double>(pause_s));
}

}  // namespace

JobRunner::JobRunner(std::string job_id, RenderSettings settings, int threads, RunnerHooks hooks)
    : job_id_(std::move(job_id)),
      settings_(std::move(settings)),
      threads_(threads),
      hooks_(std::move(hooks)),
      end_(EndOf(settings_)) {}

JobRunner::~JobRunner() {
  if (estimate_thread_.joinable()) estimate_thread_.join();
  // A job that was ended while it had no turn.
  const bool was_held = gave_up_turn_;
  CloseAll();
  if (was_held) hooks_.scheduler.ForgetJob(job_id_);
}

JobRunner::End JobRunner::EndOf(const RenderSettings& settings) {
  return {.passes = static_cast<std::uint64_t>(settings.passes),
          .time_s = settings.time_s,
          .error = settings.error,
          .photons = settings.photons};
}

bool JobRunner::MayOpenMore() const {
  if (open_rounds_.empty()) return true;
  const auto pixels = static_cast<std::uint64_t>(settings_.crop_width()) *
                      static_cast<std::uint64_t>(settings_.crop_height());
  if (open_rounds_.size() < kFewestOpenRounds) return true;
  if (open_rounds_.size() * pixels * kBytesOfSums > kMostOpenBytes) return false;
  const auto workers = static_cast<std::uint64_t>(hooks_.scheduler.LiveWorkers());
  return next_round_ - open_rounds_.front().round.first <
         std::max(kFewestOpenPasses, kOpenPassesPerWorker * workers);
}

bool JobRunner::ClaimNextRound() {
  if (open_rounds_.size() < kFewestOpenRounds || !hooks_.claim_memory) return true;
  if (!next_sums_.is_empty()) return true;
  const auto pixels = static_cast<std::uint64_t>(settings_.crop_width()) *
                      static_cast<std::uint64_t>(settings_.crop_height());
  StatusOr<MemoryClaim> claim = hooks_.claim_memory(pixels * kBytesOfSums);
  if (claim.ok()) next_sums_ = *std::move(claim);
  return claim.ok();
}

std::uint64_t JobRunner::WantedPasses(const End& end) const {
  std::uint64_t passes = end.passes > 0 ? end.passes : UINT64_MAX;
  if (end.photons > 0 && !photon_steps_.empty()) {
    passes = std::min(passes, PassesFor(photon_steps_, end.photons));
  }
  return passes;
}

StatusOr<RenderResult> JobRunner::Run(Scene scene, const SceneNeeds& needs,
                                      ReferenceImage reference) {
  LUCERNA_RETURN_IF_ERROR(Prepare(std::move(scene), needs, std::move(reference)));
  return RunToEnd();
}

Status JobRunner::Prepare(Scene scene, const SceneNeeds& needs, ReferenceImage reference) {
  LUCERNA_ASSIGN_OR_RETURN(estimator_,
                           JobEstimator::Create(std::move(scene), settings_, needs, threads_));
  emission_check_ = estimator_->emission_check();
  reference_ = std::move(reference);
  if (const std::size_t faint = estimator_->faint_lights(); faint > 0) {
    hooks_.on_warning(
        absl::StrCat("warning: ", faint, faint == 1 ? " light has" : " lights have",
                     " less than 4e-15 of the scene's power: photons of it are too faint to count"
                     " beside the others, so what is lit by reflections of that light alone stays"
                     " dark; render it by itself and add the images"));
  }
  return absl::OkStatus();
}

StatusOr<RenderResult> JobRunner::Resume() {
  return RunToEnd();
}

StatusOr<RenderResult> JobRunner::RunToEnd() {
  if (Status why = why_stopped(); !why.ok()) {
    // What a turn before left open must be closed before another runner opens it.
    CloseAll();
    hooks_.scheduler.ForgetJob(job_id_);
    return why;
  }
  is_running_ = true;
  hooks_.on_running();
  if (!std::exchange(gave_up_turn_, false)) BeginRounds();
  save_at_ = hooks_.clock.Steady() + PauseAfterSave(kFirstSave, hooks_.checkpoint_share);
  hooks_.on_work_opened();
  StatusOr<RenderResult> result = RunRounds();
  // The process ends, and a later one may go on.
  if (absl::IsUnavailable(result.status())) KeepWholeRounds();
  if (result.ok() && result->gave_up_turn) {
    // What is out comes back and is kept; nothing more is lent.
    hooks_.scheduler.SetHeld(job_id_, true);
    KeepWholeRounds();
    TakeInEstimate(true);
    gave_up_turn_ = true;
    return result;
  }
  // Whatever ended it: workers must not go on with passes that will not be merged.
  CloseAll();
  hooks_.scheduler.ForgetJob(job_id_);
  hooks_.on_work_opened();
  TakeInEstimate(true);
  return result;
}

void JobRunner::BeginRounds() {
  next_round_ = estimator_->whole_passes();
  // Rounds that were open when the job stopped are planned again.
  while (!photon_steps_.empty() && photon_steps_.back().first_pass >= next_round_)
    photon_steps_.pop_back();
  while (!guides_.empty() && guides_.back().first_pass >= next_round_)
    guides_.pop_back();
  hooks_.on_guides(guides_);
  next_split_ = next_round_;
  reported_passes_ = next_round_;
  saved_passes_ = next_round_;
}

void JobRunner::CloseAll() {
  for (const SplitPass& open : split_passes_) {
    const PassKey key = KeyOf(open.traced.eye.pass);
    hooks_.scheduler.Close(key);
    hooks_.passes.Drop(key);
    Withdraw(key.pass);
  }
  for (const OpenRound& open : open_rounds_) {
    const PassKey key = KeyOf(open.round.first);
    hooks_.scheduler.Close(key);
    hooks_.rounds.Drop(key);
    Withdraw(key.pass);
  }
  if (std::exchange(gave_up_turn_, false)) hooks_.scheduler.SetHeld(job_id_, false);
  split_passes_.clear();
  open_rounds_.clear();
  next_sums_ = MemoryClaim();
  ahead_.reset();
}

std::uint64_t JobRunner::PassesDone() const {
  const std::uint64_t whole = estimator_->whole_passes();
  if (open_rounds_.empty()) return whole;
  return hooks_.rounds.PrefixEnd(KeyOf(open_rounds_.front().round.first)).value_or(whole);
}

StopReason JobRunner::ReasonToStop(const End& end, bool is_time_up) const {
  const std::uint64_t done = PassesDone();
  if (done == 0) return StopReason::kNone;
  // Before all others: passes that have come since do not count, however many they are.
  if (end.error > 0 && error_at_most_ <= end.error) return StopReason::kError;
  if (done >= WantedPasses(end) && !MayMeetTarget(end)) {
    return end.passes > 0 && done >= end.passes ? StopReason::kPasses : StopReason::kPhotons;
  }
  if (is_time_up) return StopReason::kTime;
  return shall_finish() ? StopReason::kUser : StopReason::kNone;
}

std::optional<SteadyTime> JobRunner::WhenTimeIsUp(const End& end) const {
  if (!(end.time_s > 0)) return std::nullopt;
  return hooks_.when_it_has_run(LimitOf(end.time_s));
}

bool JobRunner::IsTimeUp(const End& end) const {
  return end.time_s > 0 && hooks_.running() >= LimitOf(end.time_s);
}

bool JobRunner::IsFirstPassComplete() const {
  if (split_passes_.empty()) return false;
  const SplitPass& oldest = split_passes_.front();
  return oldest.traced.eye.pass == 0 && (!HasPhotons(oldest) || hooks_.passes.IsComplete(KeyOf(0)));
}

bool JobRunner::ShallInterrupt() const {
  End end;
  bool shall_end = false;
  {
    const MutexLock lock(mutex_);
    if (why_stopped_) return true;
    end = end_;
    shall_end = shall_finish_;
  }
  return (shall_end || IsTimeUp(end)) && (PassesDone() > 0 || IsFirstPassComplete());
}

void JobRunner::WarnOfFirstPass(const End& end) {
  if (std::exchange(has_warned_of_time_, true)) return;
  hooks_.on_warning(absl::StrCat(
      "warning: the ", end.time_s,
      " s were over before the first pass was whole; an image has at"
      " least one, so the job ends with it: give it more time, or make the image smaller"));
}

bool JobRunner::MayMeetTarget(const End& end) const {
  return end.error > 0 && (IsEstimating() || IsOldestRoundWhole());
}

StatusOr<RenderResult> JobRunner::RunRounds() {
  while (true) {
    LUCERNA_RETURN_IF_ERROR(why_stopped());
    if (gives_up_turn()) {
      RenderResult result;
      result.gave_up_turn = true;
      return result;
    }
    End end;
    {
      const MutexLock lock(mutex_);
      end = end_;
    }
    due_ = WhenTimeIsUp(end);
    const bool is_time_up = IsTimeUp(end);
    TakeInEstimate(false);
    if (const StopReason reason = ReasonToStop(end, is_time_up); reason != StopReason::kNone) {
      // A stop by error leaves later passes out: no estimate covers them.
      if (reason != StopReason::kError) TakeInTail();
      ReportProgress();
      // What is out counts no more: workers hear of it before the last estimate, which may take
      // long.
      CloseAll();
      hooks_.on_work_opened();
      BeginEstimateIfDue(true);
      TakeInEstimate(true);
      CheckImage();
      std::shared_ptr<const DenoisedImage> denoised = DenoiseIfAsked();
      const MutexLock lock(estimator_mutex_);
      RenderResult result = MakeResult(reason);
      result.image = estimator_->MakeBands(std::move(denoised));
      // What has ended may be let go of before its image has been made.
      result.image.rows = [estimator = estimator_, rows = std::move(result.image.rows)](
                              int first, int last) { return rows(first, last); };
      return result;
    }
    // An image has at least one pass.
    const bool ends_with_first = PassesDone() == 0 && (is_time_up || shall_finish());
    if (ends_with_first && is_time_up) WarnOfFirstPass(end);
    const std::uint64_t lent_until = ends_with_first ? 1 : WantedPasses(end);
    if (lent_until != opened_until_.first || due_ != opened_until_.second) SetRoundEnds(lent_until);
    LUCERNA_ASSIGN_OR_RETURN(const bool has_done_something,
                             Step(end, !is_time_up && !ends_with_first));
    ReportProgress();
    if (has_done_something) continue;
    // When time is up and nothing has been taken in, the first pass is waited for all the same.
    if (!WaitForChange(PassesDone() > 0 ? due_ : std::nullopt)) return why_stopped();
  }
}

void JobRunner::ReportProgress() {
  const std::uint64_t done = PassesDone();
  if (done <= reported_passes_) return;
  reported_passes_ = done;
  hooks_.on_progress(static_cast<std::int64_t>(done));
}

bool JobRunner::IsOldestRoundWhole() const {
  if (open_rounds_.empty()) return false;
  const PassRange& oldest = open_rounds_.front().round;
  return hooks_.rounds.PrefixEnd(KeyOf(oldest.first)) == oldest.last;
}

bool JobRunner::TakeInIfWhole() {
  if (!IsOldestRoundWhole()) return false;
  TakeIn(open_rounds_.front());
  open_rounds_.pop_front();
  return true;
}

void JobRunner::TakeInTail() {
  while (TakeInIfWhole()) {
  }
  if (open_rounds_.empty()) return;
  tail_ = hooks_.rounds.Prefix(KeyOf(open_rounds_.front().round.first));
  if (tail_.empty()) return;
  BatchTally tally;
  for (const auto& slice : tail_)
    tally += slice->tally;
  {
    const MutexLock lock(estimator_mutex_);
    estimator_->SetTail(tail_, open_rounds_.front().plan);
  }
  hooks_.on_tail(
      tally, static_cast<std::int64_t>(tail_.back()->passes.last - tail_.front()->passes.first));
}

StatusOr<bool> JobRunner::Step(const End& end, bool wants_more) {
  // First what gives workers something to do, then what makes the image grow, then what saves time
  // later.
  // Nothing is opened before the hitpoints of the first pass are out, so that its image comes
  // first.
  const bool first_is_out = next_round_ == 0 || next_split_ > 0;
  if ((wants_more || next_round_ == 0) && first_is_out && next_round_ < WantedPasses(end) &&
      MayOpenMore() && ClaimNextRound()) {
    std::optional<RoundPlan> plan;
    {
      const MutexLock lock(estimator_mutex_);
      plan = estimator_->PlanFor(RoundOf(next_round_));
    }
    if (plan) {
      LUCERNA_RETURN_IF_ERROR(OpenNextRound(end, *std::move(plan)));
      return true;
    }
  }
  std::optional<std::uint64_t> to_split = NextToSplit(end);
  if (!wants_more && to_split > std::uint64_t{0}) to_split.reset();
  if (to_split && split_passes_.size() < kMostSplitPasses) {
    std::optional<TracedPass> traced = std::exchange(ahead_, std::nullopt);
    if (!traced) {
      LUCERNA_ASSIGN_OR_RETURN(traced, Trace(*to_split));
      if (!traced) return true;
    }
    LUCERNA_RETURN_IF_ERROR(OpenSplitPass(*std::move(traced)));
    next_split_ = *to_split + 1;
    return true;
  }
  for (auto open = split_passes_.begin(); open != split_passes_.end(); ++open) {
    if (HasPhotons(*open) && !hooks_.passes.IsComplete(KeyOf(open->traced.eye.pass))) continue;
    SplitPass complete = std::move(*open);
    split_passes_.erase(open);
    LUCERNA_RETURN_IF_ERROR(TakeInSplitPass(std::move(complete)));
    return true;
  }
  // With a target, the image must not grow beyond a checkpoint before it is known to miss it.
  const bool must_wait = end.error > 0 && IsEstimating();
  if (!must_wait && TakeInIfWhole()) {
    BeginEstimateIfDue(false);
    CheckpointIfDue();
    return true;
  }
  if (to_split && !ahead_) {
    LUCERNA_ASSIGN_OR_RETURN(ahead_, Trace(*to_split));
    return true;
  }
  return false;
}

void JobRunner::SetRoundEnds(std::uint64_t last) {
  opened_until_ = {last, due_};
  for (const OpenRound& open : open_rounds_) {
    if (open.is_split) continue;
    hooks_.scheduler.SetRoundEnd(KeyOf(open.round.first),
                                 std::min(open.round.last, opened_until_.first), due_);
  }
  hooks_.on_work_opened();
}

Status JobRunner::OpenNextRound(const End& end, RoundPlan plan) {
  const PassRange round = RoundOf(next_round_);
  OpenRound open;
  open.round = round;
  open.plan = std::move(plan);
  open.sums = std::exchange(next_sums_, MemoryClaim());
  // As many passes can be out at once as lie between this round's end and those that its radii
  // follow from. While a job is young and these are fewer than the workers, several share one.
  // Later that would cost more than it brings: hitpoints would travel to every worker. Before any
  // worker has come this process has nothing better to do than the eye paths of the first.
  const std::uint64_t at_once = round.last - RadiiFrom(round);
  const bool is_young = round.first < kYoungPasses;
  const auto workers = static_cast<std::uint64_t>(hooks_.scheduler.LiveWorkers());
  open.is_split =
      hooks_.always_splits || (is_young && at_once < workers) || (round.first == 0 && workers == 0);
  if (photon_steps_.empty() ||
      photon_steps_.back().photons_per_pass != open.plan.photons_per_pass) {
    photon_steps_.push_back({round.first, open.plan.photons_per_pass});
    hooks_.on_photon_steps(photon_steps_);
  }
  if (open.plan.guide != nullptr &&
      (guides_.empty() || *guides_.back().guide != *open.plan.guide)) {
    unguided_share_ = std::min(unguided_share_.load(), open.plan.guide->UnguidedShare());
    guides_.push_back({round.first, open.plan.guide});
    hooks_.on_guides(guides_);
  }
  open.guide = guides_.size();
  const PassKey key = KeyOf(round.first);
  hooks_.rounds.Open(key, estimator_->ShapeOf(round, open.plan));
  // What a run that is over had of this round.
  std::uint64_t first = round.first;
  for (const auto& slice : std::exchange(tail_, {})) {
    if (slice->passes.first != first || slice->passes.last > round.last) continue;
    LUCERNA_RETURN_IF_ERROR(hooks_.rounds.Merge(key, *slice).status());
    first = slice->passes.last;
  }
  if (first > round.first) next_split_ = first;
  if (round.first == 0 && !open.is_split) next_split_ = round.last;
  if (!open.is_split) {
    std::string bytes = EncodeRadii(*open.plan.radii, &estimator_->team());
    const Digest digest = Sha256(bytes);
    LUCERNA_ASSIGN_OR_RETURN(open.radii,
                             hooks_.blobs.PutPinned(digest, std::move(bytes), AfterLastPin::kDrop));
    std::optional<Digest> eye_paths;
    if (open.plan.eye_paths != nullptr) {
      std::string counts = EncodeEyePathCounts(*open.plan.eye_paths);
      eye_paths = Sha256(counts);
      LUCERNA_ASSIGN_OR_RETURN(open.eye_paths, hooks_.blobs.PutPinned(*eye_paths, std::move(counts),
                                                                      AfterLastPin::kDrop));
    }
    Publish(round.first, {.block = {},
                          .radii = digest,
                          .rows = open.plan.radii->size(),
                          .photons_per_pass = open.plan.photons_per_pass,
                          .caustic_radius = open.plan.caustic_radius,
                          .guide = open.guide,
                          .eye_paths = eye_paths});
    hooks_.scheduler.OpenRound(
        key, {first, std::max(first, std::min(round.last, WantedPasses(end)))}, due_);
  }
  open_rounds_.push_back(std::move(open));
  next_round_ = round.last;
  if (!open_rounds_.back().is_split) hooks_.on_work_opened();
  return absl::OkStatus();
}

void JobRunner::TakeIn(const OpenRound& open) {
  const SteadyTime began_at = hooks_.clock.Steady();
  const PassKey key = KeyOf(open.round.first);
  if (!open.is_split) hooks_.scheduler.Close(key);
  std::shared_ptr<const SliceSums> sums = hooks_.rounds.Take(key);
  const BatchTally tally = sums->tally;
  {
    const MutexLock lock(estimator_mutex_);
    estimator_->AddRound(std::move(sums), open.plan);
  }
  if (!open.is_split) Withdraw(key.pass);
  hooks_.on_round_merged(tally, static_cast<std::int64_t>(open.round.size()));
  Timed("rounds", began_at, [&] {
    return absl::StrCat("passes ", open.round.first, " to ", open.round.last, " are added up");
  });
}

std::optional<std::uint64_t> JobRunner::NextToSplit(const End& end) const {
  for (const OpenRound& open : open_rounds_) {
    if (!open.is_split || open.round.last <= next_split_) continue;
    const std::uint64_t pass = std::max(next_split_, open.round.first);
    if (pass >= WantedPasses(end)) return std::nullopt;
    return pass;
  }
  return std::nullopt;
}

StatusOr<std::optional<JobRunner::TracedPass>> JobRunner::Trace(std::uint64_t pass) {
  TracedPass traced;
  const SteadyTime began_at = hooks_.clock.Steady();
  LUCERNA_ASSIGN_OR_RETURN(traced.eye,
                           estimator_->TraceEyePaths(pass, OpenRoundOf(pass).plan.eye_paths.get(),
                                                     [this] { return ShallInterrupt(); }));
  Timed("eye paths", began_at, [&] { return absl::StrCat("eye paths of pass ", pass); });
  if (!traced.eye.is_whole) return std::optional<TracedPass>();
  std::string bytes = EncodeHitpointBlock(traced.eye.block, &estimator_->team());
  const Digest digest = Sha256(bytes);
  LUCERNA_ASSIGN_OR_RETURN(traced.block,
                           hooks_.blobs.PutPinned(digest, std::move(bytes), AfterLastPin::kDrop));
  return std::optional<TracedPass>(std::move(traced));
}

const JobRunner::OpenRound& JobRunner::OpenRoundOf(std::uint64_t pass) const {
  const std::uint64_t first = RoundOf(pass).first;
  const auto open = std::ranges::find(open_rounds_, first,
                                      [](const OpenRound& round) { return round.round.first; });
  LUCERNA_CHECK(open != open_rounds_.end());
  return *open;
}

Status JobRunner::OpenSplitPass(TracedPass traced) {
  const OpenRound& round = OpenRoundOf(traced.eye.pass);
  const RoundPlan& plan = round.plan;
  SplitPass open;
  std::string bytes = EncodeRadii(HitpointRadii(traced.eye, plan), &estimator_->team());
  open.blobs = {.block = traced.block.digest(),
                .radii = Sha256(bytes),
                .rows = traced.eye.block.size(),
                .photons_per_pass = plan.photons_per_pass,
                .guide = round.guide};
  LUCERNA_ASSIGN_OR_RETURN(
      open.radii, hooks_.blobs.PutPinned(open.blobs.radii, std::move(bytes), AfterLastPin::kDrop));
  const std::uint64_t pass = traced.eye.pass;
  open.traced = std::move(traced);
  Publish(pass, open.blobs);
  // Without photons a pass is complete as it is.
  if (HasPhotons(open)) {
    const std::uint64_t photons = open.blobs.photons_per_pass;
    hooks_.passes.Open(KeyOf(pass), open.blobs.rows, photons,
                       EvidenceColumns(EvidenceOf(settings_.radius_controller, pass)));
    hooks_.scheduler.OpenPass(KeyOf(pass), photons);
  }
  split_passes_.push_back(std::move(open));
  hooks_.on_work_opened();
  return absl::OkStatus();
}

bool JobRunner::HasPhotons(const SplitPass& open) const {
  // A camera that sees nothing needs none, and without light there are none.
  return open.blobs.rows > 0 && estimator_->needs().Uses(Part::kPhotons);
}

Status JobRunner::TakeInSplitPass(SplitPass open) {
  const PassKey key = KeyOf(open.traced.eye.pass);
  PassSums sums(open.blobs.rows,
                EvidenceColumns(EvidenceOf(settings_.radius_controller, key.pass)));
  if (HasPhotons(open)) {
    hooks_.scheduler.Close(key);
    sums = hooks_.passes.Take(key);
  }
  Withdraw(key.pass);
  SliceSums slice;
  {
    const MutexLock lock(estimator_mutex_);
    const RoundPlan& plan = OpenRoundOf(key.pass).plan;
    slice = estimator_->SliceOf(std::move(open.traced.eye), plan, std::move(sums));
  }
  return hooks_.rounds.Merge(KeyOf(RoundOf(key.pass).first), std::move(slice)).status();
}

void JobRunner::Publish(std::uint64_t pass, const WorkBlobs& blobs) {
  const MutexLock lock(mutex_);
  blobs_[pass] = blobs;
}

void JobRunner::Withdraw(std::uint64_t pass) {
  const MutexLock lock(mutex_);
  blobs_.erase(pass);
}

void JobRunner::BeginEstimateIfDue(bool is_last) {
  {
    const MutexLock lock(estimator_mutex_);
    const std::int64_t passes = estimator_->passes();
    if (passes < 2 || passes == passes_at_checkpoint_) return;
    if (!is_last && passes < next_checkpoint_) return;
  }
  // One at a time, so that which passes are estimated does not depend on how long that takes.
  TakeInEstimate(true);
  // It holds the most that a job holds, and what is free is seldom in pieces of its size.
  ReleaseFreedMemory();
  EstimatorSnapshot snapshot;
  {
    const MutexLock lock(estimator_mutex_);
    snapshot = estimator_->Snapshot();
  }
  passes_at_checkpoint_ = snapshot.image.passes;
  next_checkpoint_ = NextCheckpoint(snapshot.image.passes, /*near_target=*/false);
  std::packaged_task<ErrorCheckpoint()> task([this, look = ++checkpoints_,
                                              snapshot = std::move(snapshot)]() mutable {
    const SteadyTime began_at = hooks_.clock.Steady();
    ErrorCheckpoint checkpoint;
    checkpoint.passes = snapshot.image.passes;
    checkpoint.photons = snapshot.photons;
    checkpoint.missing = estimator_->FindMissingLight(snapshot);
    if (!reference_.empty()) checkpoint.truth = JobEstimator::ErrorAgainst(reference_, snapshot);
    checkpoint.estimate = estimator_->EstimateError(std::move(snapshot), checkpoint.missing, look);
    Timed("estimate", began_at,
          [&] { return absl::StrCat("error after ", checkpoint.passes, " passes"); });
    return checkpoint;
  });
  estimate_ = task.get_future();
  estimate_thread_ = std::thread([this, task = std::move(task)]() mutable {
    task();
    Wake();
  });
}

void JobRunner::TakeInEstimate(bool shall_wait) {
  if (!IsEstimating()) return;
  if (!shall_wait && estimate_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) {
    return;
  }
  estimate_thread_.join();
  const ErrorCheckpoint checkpoint = estimate_.get();
  error_at_most_ = std::sqrt(checkpoint.estimate.relative.high);
  double target = 0;
  {
    const MutexLock lock(mutex_);
    target = end_.error;
  }
  // Passes wait for the estimate where there is a target (Step).
  if (target > 0 && error_at_most_ < kNearTarget * target)
    next_checkpoint_ = NextCheckpoint(checkpoint.passes, /*near_target=*/true);
  hooks_.on_error_estimate(checkpoint);
}

void JobRunner::CheckImage() {
  std::uint64_t photons = 0;
  {
    const MutexLock lock(estimator_mutex_);
    if (has_warned_ || !estimator_->IsBlack()) return;
    photons = estimator_->photons();
  }
  has_warned_ = true;
  hooks_.on_warning(absl::StrCat(
      "warning: the image is black after ", photons,
      " photons: no light has reached the"
      " view; check that the scene has lights, which way they and the camera face, and what stands"
      " between them"));
}

ByteWriter JobRunner::Save() const {
  ByteWriter writer;
  writer.Varint(static_cast<std::uint64_t>(hooks_.running().count()));
  writer.Varint(static_cast<std::uint64_t>(next_checkpoint_));
  writer.Varint(static_cast<std::uint64_t>(checkpoints_));
  writer.Varint(has_warned_ ? 1 : 0);
  writer.Varint(static_cast<std::uint64_t>(passes_at_checkpoint_));
  WriteDouble(writer, error_at_most_);
  writer.Varint(photon_steps_.size());
  for (const PhotonStep& step : photon_steps_) {
    writer.Varint(step.first_pass);
    writer.Varint(step.photons_per_pass);
  }
  writer.Varint(guides_.size());
  for (const GuideStep& step : guides_) {
    writer.Varint(step.first_pass);
    WriteGuide(writer, *step.guide);
  }
  const MutexLock lock(estimator_mutex_);
  estimator_->Save(writer);
  return writer;
}

Status JobRunner::Restore(std::string_view sums) {
  ByteReader reader(sums);
  reader.Varint();  // the time that the job has run: the record says so too
  const auto next_checkpoint = static_cast<std::int64_t>(reader.Varint());
  const auto checkpoints = static_cast<int>(reader.Varint());
  const bool has_warned = reader.Varint() != 0;
  const auto passes_at_checkpoint = static_cast<std::int64_t>(reader.Varint());
  const double error_at_most = ReadDouble(reader);
  PhotonSteps steps;
  for (std::uint64_t left = reader.Varint(); left > 0 && reader.ok(); --left) {
    const std::uint64_t first_pass = reader.Varint();
    steps.push_back({first_pass, reader.Varint()});
  }
  GuideSteps guides;
  for (std::uint64_t left = reader.Varint(); left > 0 && reader.ok(); --left) {
    const std::uint64_t first_pass = reader.Varint();
    LUCERNA_ASSIGN_OR_RETURN(PhotonGuide guide, ReadGuide(reader));
    guides.push_back({first_pass, std::make_shared<const PhotonGuide>(std::move(guide))});
  }
  const MutexLock lock(estimator_mutex_);
  LUCERNA_RETURN_IF_ERROR(estimator_->Restore(reader));
  next_checkpoint_ = next_checkpoint;
  checkpoints_ = checkpoints;
  has_warned_ = has_warned;
  passes_at_checkpoint_ = passes_at_checkpoint;
  error_at_most_ = error_at_most;
  photon_steps_ = std::move(steps);
  guides_ = std::move(guides);
  unguided_share_ = 1;
  for (const GuideStep& step : guides_)
    unguided_share_ = std::min(unguided_share_.load(), step.guide->UnguidedShare());
  return absl::OkStatus();
}

Status JobRunner::KeepCheckpoint() {
  // What is known of the error of these passes belongs to them.
  TakeInEstimate(true);
  const SteadyTime began_at = hooks_.clock.Steady();
  const ByteWriter saved = Save();
  LUCERNA_RETURN_IF_ERROR(
      hooks_.on_checkpoint(saved.Pieces(), static_cast<std::int64_t>(estimator_->whole_passes()),
                           estimator_->whole_tally()));
  Timed("checkpoint", began_at,
        [&] { return absl::StrCat("checkpoint of ", estimator_->whole_passes(), " passes"); });
  const SteadyTime now = hooks_.clock.Steady();
  save_at_ = now + PauseAfterSave(now - began_at, hooks_.checkpoint_share);
  saved_passes_ = estimator_->whole_passes();
  return absl::OkStatus();
}

void JobRunner::CheckpointIfDue() {
  if (!hooks_.on_checkpoint || hooks_.clock.Steady() < save_at_) return;
  Status kept = KeepCheckpoint();
  if (kept.ok()) return;
  while (!kept.ok()) {
    hooks_.on_pause(kept);
    {
      // A cancel, a stop and a pause by the user end the pause too; wakes by workers do not.
      const MutexLock lock(mutex_);
      const SteadyTime until = hooks_.clock.Steady() + kPauseBeforeRetry;
      while (!why_stopped_ && !shall_finish_ && !gives_up_turn_ && hooks_.clock.Steady() < until)
        changed_.WaitFor(mutex_, kPauseBeforeRetry);
      if (why_stopped_ || shall_finish_ || gives_up_turn_) break;
    }
    kept = KeepCheckpoint();
  }
  hooks_.on_pause(absl::OkStatus());
}

void JobRunner::KeepWholeRounds() {
  if (!hooks_.on_checkpoint) return;
  double target = 0;
  {
    const MutexLock lock(mutex_);
    target = end_.error;
  }
  // As while it runs: nothing is added to an image that meets the target.
  while (!(target > 0 && error_at_most_ <= target) && TakeInIfWhole()) {
    BeginEstimateIfDue(false);
    TakeInEstimate(true);
  }
  // When it fails, the one before is there.
  if (estimator_->whole_passes() > saved_passes_) KeepCheckpoint().IgnoreError();
}

bool JobRunner::WaitForChange(std::optional<SteadyTime> until) {
  // Now and then without a reason, so that a wake that is lost costs a moment and not the job.
  constexpr Duration kLongest = std::chrono::seconds(1);
  Duration longest = kLongest;
  if (until) longest = std::clamp(*until - hooks_.clock.Steady(), Duration::zero(), kLongest);
  const MutexLock lock(mutex_);
  if (!was_woken_ && !why_stopped_ && !gives_up_turn_ && longest > Duration::zero()) {
    changed_.WaitFor(mutex_, longest);
  }
  was_woken_ = false;
  return !why_stopped_;
}

bool JobRunner::shall_finish() const {
  const MutexLock lock(mutex_);
  return shall_finish_;
}

Status JobRunner::why_stopped() const {
  const MutexLock lock(mutex_);
  return why_stopped_.value_or(absl::OkStatus());
}

bool JobRunner::gives_up_turn() const {
  const MutexLock lock(mutex_);
  return gives_up_turn_;
}

void JobRunner::SetGivesUpTurn(bool gives_up_turn) {
  const MutexLock lock(mutex_);
  gives_up_turn_ = gives_up_turn;
  changed_.NotifyAll();
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

// Called for results of leases, so after Prepare.
Status JobRunner::CheckEmission(const BatchTally& tally) const {
  return emission_check_.Check(tally, unguided_share_);
}

void JobRunner::Wake() {
  const MutexLock lock(mutex_);
  was_woken_ = true;
  changed_.NotifyAll();
}

std::optional<WorkBlobs> JobRunner::BlobsOf(std::uint64_t pass) const {
  const MutexLock lock(mutex_);
  const auto found = blobs_.find(pass);
  if (found == blobs_.end()) return std::nullopt;
  return found->second;
}

std::optional<std::size_t> JobRunner::HitpointsIn(const Digest& digest) const {
  const MutexLock lock(mutex_);
  for (const auto& [pass, blobs] : blobs_) {
    if (blobs.block == digest) return blobs.rows;
    if (blobs.radii == digest || blobs.eye_paths == digest) return std::size_t{0};
  }
  return std::nullopt;
}

std::shared_ptr<const DenoisedImage> JobRunner::DenoiseIfAsked() {
  if (!settings_.denoise) return nullptr;
  ReleaseFreedMemory();
  const SteadyTime began_at = hooks_.clock.Steady();
  NoisyImage noisy;
  ErrorEstimate estimate;
  double missing = 0;  // in both
  {
    const MutexLock lock(estimator_mutex_);
    if (estimator_->passes() < 2) return nullptr;
    noisy = estimator_->MakeNoisyImage();
    EstimatorSnapshot snapshot = estimator_->Snapshot();
    missing = estimator_->FindMissingLight(snapshot).relative;
    estimate =
        estimator_->EstimateError(std::move(snapshot), MissingLight(), std::max(checkpoints_, 1));
  }
  // Without the lock, for which those wait who fetch the image meanwhile.
  const auto denoised =
      std::make_shared<const DenoisedImage>(estimator_->Denoise(std::move(noisy)));
  DenoisedSample sample;
  sample.estimate = ErrorOfDenoised(*denoised, estimate);
  sample.estimate.relative.high += missing;
  if (!reference_.empty()) sample.truth = JobEstimator::ErrorAgainst(reference_, *denoised);
  Timed("estimate", began_at, [] { return std::string("denoised image"); });
  hooks_.on_denoised(sample);
  return denoised;
}

RenderResult JobRunner::MakeResult(StopReason reason) const {
  RenderResult result;
  result.reason = reason;
  result.passes = estimator_->passes();
  result.photons = estimator_->photons();
  return result;
}

StatusOr<RenderResult> JobRunner::ImageSoFar() const {
  if (is_running_) {
    const MutexLock lock(estimator_mutex_);
    if (estimator_->passes() > 0) {
      RenderResult result = MakeResult(StopReason::kNone);
      // Of the passes so far: more are added while it is written.
      result.image = InBands(estimator_->MakeImage());
      return result;
    }
  }
  return absl::FailedPreconditionError("no pass has been merged yet; try again in a moment");
}

}  // namespace lucerna
