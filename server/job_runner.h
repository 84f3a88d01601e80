// How does a job get from its scene to its image?
//
// The pass loop of one job, on a thread of its own: trace eye paths, publish hitpoints and radii,
// open the pass for workers, take in its sums when every photon has come back, and again. Two
// passes may be open at once, and the eye paths of a third are traced while workers are busy.
//
// What a pass's radii are computed from is fixed (the passes up to two before it), so the image
// does not depend on when batches come back.
#pragma once

#include <atomic>
#include <cmath>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "render/base/clock.h"
#include "render/base/mutex.h"
#include "render/base/status.h"
#include "render/image/image.h"
#include "render/scene/render_settings.h"
#include "render/scene/scene.h"
#include "server/blob_store.h"
#include "server/job.h"
#include "server/job_estimator.h"
#include "server/pass_merger.h"
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
  PassMerger& merger;
  const Clock& clock;
  // Called on the runner's thread, never under a lock.
  std::function<void()> on_running;
  std::function<void(std::string warning)> on_warning;
  std::function<void()> on_pass_opened;
  std::function<void(std::int64_t passes, const BatchTally& of_pass)> on_pass_merged;
  std::function<void(const ErrorCheckpoint& checkpoint)> on_error_estimate;
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

  void SetEnd(const RenderSettings& settings) override;
  void Reopen(const RenderSettings& settings) override;
  void Finish() override;
  void Stop(Status why) override;
  void Wake() override;
  [[nodiscard]] std::optional<PassBlobs> BlobsOf(std::uint64_t pass) const override;
  [[nodiscard]] std::optional<std::size_t> HitpointsIn(const Digest& digest) const override;
  [[nodiscard]] StatusOr<RenderResult> ImageSoFar() const override;

 private:
  struct TracedPass {
    EyePass eye;
    BlobPin block;  // the hitpoints, encoded
  };
  struct OpenPass {
    TracedPass traced;
    RadiusColumn radii;
    BlobPin encoded_radii;
    PassBlobs blobs;
  };

  // When to stop.
  struct End {
    std::uint64_t passes = 0;  // 0: no limit; also that of the photons
    double time_s = 0;
    double error = 0;
    bool is_photons = false;  // `passes` follows from a number of photons
  };
  static End EndOf(const RenderSettings& settings);

  StatusOr<RenderResult> RunToEnd();
  StatusOr<RenderResult> RunPasses();
  // Estimates the error at the next checkpoint, or if `is_last`.
  void EstimateErrorIfDue(bool is_last);
  // Warns of a black image.
  void CheckImage();
  // Why to stop now; kNone: go on.
  StopReason ReasonToStop(const End& end, bool is_time_up) const;
  StatusOr<TracedPass> Trace(std::uint64_t pass);
  Status Open(TracedPass traced);
  bool HasPhotons(const OpenPass& open) const;
  bool IsComplete(const OpenPass& open) const;
  void TakeIn(OpenPass open);
  // Workers are not given the pass any more.
  void Withdraw(const OpenPass& open);
  // Waits for a wake, until `until` if there is one. False when Run must end now.
  bool WaitForChange(std::optional<SteadyTime> until);
  Status why_stopped() const;
  PassKey KeyOf(std::uint64_t pass) const { return {job_id_, pass}; }
  RenderResult MakeResult(StopReason reason) const LUCERNA_REQUIRES(estimator_mutex_);

  const std::string job_id_;
  const RenderSettings settings_;
  const int threads_;
  const RunnerHooks hooks_;

  // Held for one step of the estimator at a time, except its eye paths.
  mutable Mutex estimator_mutex_;
  std::unique_ptr<JobEstimator> estimator_;  // set once, before any other thread may ask
  std::atomic<bool> is_running_ = false;
  std::uint64_t photons_applied_ LUCERNA_GUARDED_BY(estimator_mutex_) = 0;

  // The runner's thread only.
  ReferenceImage reference_;
  Duration ran_before_{};
  std::int64_t next_checkpoint_ = kFirstCheckpoint;
  int checkpoints_ = 0;
  bool has_warned_ = false;                // of a black image
  std::int64_t passes_at_checkpoint_ = 0;  // passes
  double error_at_most_ = HUGE_VAL;        // the upper end of the last interval
  std::deque<OpenPass> open_;
  std::optional<TracedPass> ahead_;
  std::map<std::uint64_t, Digest> set_blocks_;  // by set of eye paths, where they take turns

  mutable Mutex mutex_;
  Condition changed_;
  bool was_woken_ LUCERNA_GUARDED_BY(mutex_) = false;
  End end_ LUCERNA_GUARDED_BY(mutex_);
  bool shall_finish_ LUCERNA_GUARDED_BY(mutex_) = false;
  std::optional<Status> why_stopped_ LUCERNA_GUARDED_BY(mutex_);
  std::map<std::uint64_t, PassBlobs> blobs_ LUCERNA_GUARDED_BY(mutex_);
};

}  // namespace lucerna
