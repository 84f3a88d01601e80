// How does a job get from its scene to its image?
//
// The loop of one job, on a thread of its own: plan rounds of passes as soon as their radii are
// known, open them for workers, take in their sums in order, and again. While there are fewer open
// passes than workers, and for the first image, passes are split: this thread traces their eye
// paths and publishes their hitpoints, and several workers trace the photons of one pass.
//
// What a round's radii are computed from is fixed (estimate/rounds.h), and a pass brings the same
// bits however it was traced, so the image does not depend on when anything comes back.
#pragma once

#include <atomic>
#include <cmath>
#include <cstdint>
#include <deque>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "render/base/clock.h"
#include "render/base/mutex.h"
#include "render/base/status.h"
#include "render/image/image.h"
#include "render/scene/render_settings.h"
#include "render/scene/scene.h"
#include "render/wire/bytes.h"
#include "server/blob_store.h"
#include "server/emission_check.h"
#include "server/job.h"
#include "server/job_estimator.h"
#include "server/memory_budget.h"
#include "server/pass_merger.h"
#include "server/round_merger.h"
#include "server/running_job.h"
#include "server/scheduler.h"

namespace lucerna {

// The error of the image after so many passes.
struct ErrorCheckpoint {
  std::int64_t passes = 0;
  std::uint64_t photons = 0;
  ErrorEstimate estimate;
  std::optional<TrueError> truth;
  MissingLight missing;
};

struct RunnerHooks {
  BlobStore& blobs;
  Scheduler& scheduler;
  PassMerger& passes;
  RoundMerger& rounds;
  const Clock& clock;
  // What the job holds; let go of with the runner.
  std::shared_ptr<MemoryClaim> memory = nullptr;
  // Claims memory for what the job holds beyond that; absent: there is enough.
  // Errors: RESOURCE_EXHAUSTED.
  std::function<StatusOr<MemoryClaim>(std::uint64_t bytes)> claim_memory = nullptr;
  // Passes are never given out whole (for tests of batches of photons).
  bool always_splits = false;
  // Called on the runner's thread, never under a lock.
  // A run begins; what is open may be lent from then on (Scheduler::SetHeld).
  std::function<void()> on_running;
  std::function<void(std::string warning)> on_warning;
  // How many photons passes have, each time that it changes.
  std::function<void(PhotonSteps steps)> on_photon_steps;
  // The same of the guides that their photons are drawn by.
  std::function<void(GuideSteps guides)> on_guides;
  std::function<void()> on_work_opened;
  // So many passes from the first on without a gap have come.
  std::function<void(std::int64_t passes)> on_progress;
  std::function<void(const BatchTally& tally, std::int64_t passes)> on_round_merged;
  // At a stop: the same of the passes after the last round merged. They are part of a later round.
  std::function<void(const BatchTally& tally, std::int64_t passes)> on_tail;
  std::function<void(const ErrorCheckpoint& checkpoint)> on_error_estimate;
  // At the end, after the last estimate.
  std::function<void(const DenoisedSample& denoised)> on_denoised;
  // Keeps the pieces that Save gave, so that a later process can Restore it; absent: nothing is
  // kept. `tally` is of the `passes` in it. When it fails the job pauses, and it is called again
  // every second.
  std::function<Status(std::vector<std::string_view> sums, std::int64_t passes,
                       const BatchTally& tally)>
      on_checkpoint;
  // How much of the time checkpoints may take, in (0, 1]; 1: one after every round.
  double checkpoint_share = 0.01;
  // Something began at `from` and ends now, on a row of the job's timeline; `what` makes its text
  // and is called where the job is traced. Called from the runner's thread and that of estimates.
  std::function<void(std::string_view row, SteadyTime from,
                     const std::function<std::string()>& what)>
      on_timed;
  // The job pauses and why, or goes on (OK).
  std::function<void(const Status& why)> on_pause;
  // How long the job has run, and when it will have run so long (absent while its time stands
  // still).
  std::function<Duration()> running;
  std::function<std::optional<SteadyTime>(Duration time)> when_it_has_run;
};

class JobRunner final : public RunningJob {
 public:
  JobRunner(std::string job_id, RenderSettings settings, int threads, RunnerHooks hooks);
  ~JobRunner() override;

  // Renders to the end. `reference` may be empty; else it is as large as the image. Once only.
  // Errors: what JobEstimator says of the scene, RESOURCE_EXHAUSTED when blobs do not fit, or what
  // Stop was given.
  [[nodiscard]] StatusOr<RenderResult> Run(Scene scene, const SceneNeeds& needs,
                                           ReferenceImage reference);
  [[nodiscard]] StatusOr<RenderResult> Resume() override;

  // Run in its parts: Prepare once, then Restore as often as it fails, then Resume.
  [[nodiscard]] Status Prepare(Scene scene, const SceneNeeds& needs, ReferenceImage reference);
  // Goes on from a checkpoint of the same job. Errors: as JobEstimator::Restore.
  [[nodiscard]] Status Restore(std::string_view sums);

  void SetEnd(const RenderSettings& settings) override;
  void Reopen(const RenderSettings& settings) override;
  void Finish() override;
  void SetGivesUpTurn(bool gives_up_turn) override;
  void Stop(Status why) override;
  [[nodiscard]] Status CheckEmission(const BatchTally& tally) const override;
  void Wake() override;
  [[nodiscard]] std::optional<WorkBlobs> BlobsOf(std::uint64_t pass) const override;
  [[nodiscard]] std::optional<std::size_t> HitpointsIn(const Digest& digest) const override;
  [[nodiscard]] StatusOr<RenderResult> ImageSoFar() const override;

 private:
  // A round whose passes are out.
  struct OpenRound {
    PassRange round;
    RoundPlan plan;
    std::size_t guide = 0;  // so many of guides_ with its own
    BlobPin radii;          // of pixels, encoded; of rounds that are not split
    BlobPin eye_paths;      // of pixels, encoded, where the plan has them; of such rounds
    bool is_split = false;
    MemoryClaim sums;  // of the slices that come; the first few rounds are part of the job's need
  };
  struct TracedPass {
    EyePass eye;
    BlobPin block;  // the hitpoints, encoded
  };
  // A pass whose photons are out.
  struct SplitPass {
    TracedPass traced;
    BlobPin radii;  // of hitpoints, encoded
    WorkBlobs blobs;
  };

  // When to stop.
  struct End {
    // 0: no limit.
    std::uint64_t passes = 0;
    double time_s = 0;
    double error = 0;
    std::uint64_t photons = 0;
  };
  static End EndOf(const RenderSettings& settings);

  StatusOr<RenderResult> RunToEnd();
  // The beginning of a run without open rounds.
  void BeginRounds();
  StatusOr<RenderResult> RunRounds();
  // All that a later run follows from: the whole rounds taken in. It borrows the sums, which stay
  // while this thread adds no round.
  ByteWriter Save() const;
  // Hands a checkpoint on when enough time has passed since the last. Pauses while that fails.
  void CheckpointIfDue();
  Status KeepCheckpoint();
  // Before the process ends: rounds that have come, and a checkpoint.
  void KeepWholeRounds();
  // One thing that can be done now: opens, traces or takes in. False when there is nothing.
  // `wants_more`: passes beside the first, which an image needs.
  StatusOr<bool> Step(const End& end, bool wants_more);
  // Begins to estimate the error of the passes so far, on another thread and from a copy of the
  // sums, at the next checkpoint or if `is_last`.
  void BeginEstimateIfDue(bool is_last);
  // Takes in the estimate that has been begun, if any, when it is there or `shall_wait`.
  void TakeInEstimate(bool shall_wait);
  bool IsEstimating() const { return estimate_.valid(); }
  // Whether what has come, or the estimate under way, may still say that the target is met: a job
  // stops at the first checkpoint that meets it, however much has come since.
  bool MayMeetTarget(const End& end) const;
  // Warns of a black image.
  void CheckImage();
  // Why to stop now; kNone: go on.
  StopReason ReasonToStop(const End& end, bool is_time_up) const;
  // Passes from the first on without a gap.
  std::uint64_t PassesDone() const;
  // Whether the photons of the first pass, if it is split, are there and wait to be taken in.
  bool IsFirstPassComplete() const;
  // When the job will have run as long as it may; absent without a limit, and while its time stands
  // still.
  std::optional<SteadyTime> WhenTimeIsUp(const End& end) const;
  bool IsTimeUp(const End& end) const;
  // Whether eye paths that are being traced here would be of no use.
  bool ShallInterrupt() const;
  // Says, once, that the first pass is finished although the job should have ended.
  void WarnOfFirstPass(const End& end);

  void ReportProgress();
  void Timed(std::string_view row, SteadyTime from,
             const std::function<std::string()>& what) const {
    if (hooks_.on_timed) hooks_.on_timed(row, from, what);
  }
  // Takes in the oldest round if all of it has come.
  bool TakeInIfWhole();
  bool IsOldestRoundWhole() const;
  // At a stop: what has come of the oldest round counts too.
  void TakeInTail();
  Status OpenNextRound(const End& end, RoundPlan plan);
  void TakeIn(const OpenRound& open);
  // Whether one more round may be opened, for the memory of those that are open.
  bool MayOpenMore() const;
  // Claims the memory of one more round, in next_sums_ until it is opened. False while others hold
  // what it needs; the first few belong to the job's own claim, so that it goes on.
  bool ClaimNextRound();
  // How many passes are wanted, as far as is known now.
  std::uint64_t WantedPasses(const End& end) const;
  // Lends more, or fewer, passes of the open rounds: those before `last`.
  void SetRoundEnds(std::uint64_t last);
  // The next pass of the open rounds that is to be split; absent when there is none.
  std::optional<std::uint64_t> NextToSplit(const End& end) const;
  // Requires that the round of the pass is open.
  const OpenRound& OpenRoundOf(std::uint64_t pass) const;
  // Nothing when it was interrupted.
  StatusOr<std::optional<TracedPass>> Trace(std::uint64_t pass);
  Status OpenSplitPass(TracedPass traced);
  bool HasPhotons(const SplitPass& open) const;
  Status TakeInSplitPass(SplitPass open);
  void CloseAll();
  // Publishes what workers need of a pass or round, or withdraws it.
  void Publish(std::uint64_t pass, const WorkBlobs& blobs);
  void Withdraw(std::uint64_t pass);

  // Waits for a wake, until `until` if there is one. False when Run must end now.
  bool WaitForChange(std::optional<SteadyTime> until);
  Status why_stopped() const;
  bool shall_finish() const;
  bool gives_up_turn() const;
  PassKey KeyOf(std::uint64_t pass) const { return {job_id_, pass}; }
  // Of all but the image.
  RenderResult MakeResult(StopReason reason) const LUCERNA_REQUIRES(estimator_mutex_);
  // nullptr where the job asks for no denoised image, or has too few passes for one.
  std::shared_ptr<const DenoisedImage> DenoiseIfAsked();

  const std::string job_id_;
  const RenderSettings settings_;
  const int threads_;
  const RunnerHooks hooks_;

  // Held for one step of the estimator at a time, except its eye paths.
  mutable Mutex estimator_mutex_;
  std::shared_ptr<JobEstimator> estimator_;  // set once, before any other thread may ask
  std::atomic<bool> is_running_ = false;
  EmissionCheck emission_check_;  // set with the estimator
  // Of the photons of all guides so far, those that count for their lights at least.
  std::atomic<double> unguided_share_ = 1;

  // The runner's thread only.
  ReferenceImage reference_;
  std::future<ErrorCheckpoint> estimate_;  // under way
  std::thread estimate_thread_;
  bool gave_up_turn_ = false;  // rounds may be open
  SteadyTime save_at_;         // no checkpoint is kept before this
  std::uint64_t saved_passes_ = 0;
  std::int64_t next_checkpoint_ = kFirstCheckpoint;
  int checkpoints_ = 0;
  bool has_warned_ = false;                // of a black image
  bool has_warned_of_time_ = false;        // that has passed before the first pass is whole
  std::int64_t passes_at_checkpoint_ = 0;  // passes
  double error_at_most_ = HUGE_VAL;        // the upper end of the last interval
  std::optional<SteadyTime> due_;          // when time is up
  // What the open rounds are lent for.
  std::pair<std::uint64_t, std::optional<SteadyTime>> opened_until_;
  std::uint64_t next_round_ = 0;  // its first pass
  PhotonSteps photon_steps_;      // of the rounds opened so far
  GuideSteps guides_;             // the same
  std::uint64_t reported_passes_ = 0;
  std::deque<OpenRound> open_rounds_;
  MemoryClaim next_sums_;         // of the next one
  std::uint64_t next_split_ = 0;  // pass
  ImageSums::Slices tail_;        // of the round that was not whole when the run before ended
  std::deque<SplitPass> split_passes_;
  std::optional<TracedPass> ahead_;

  mutable Mutex mutex_;
  Condition changed_;
  bool was_woken_ LUCERNA_GUARDED_BY(mutex_) = false;
  End end_ LUCERNA_GUARDED_BY(mutex_);
  bool shall_finish_ LUCERNA_GUARDED_BY(mutex_) = false;
  bool gives_up_turn_ LUCERNA_GUARDED_BY(mutex_) = false;
  std::optional<Status> why_stopped_ LUCERNA_GUARDED_BY(mutex_);
  std::map<std::uint64_t, WorkBlobs> blobs_ LUCERNA_GUARDED_BY(mutex_);  // by first pass
};

}  // namespace lucerna
