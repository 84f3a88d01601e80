// What may other threads do with a job that has a runner?
//
// Implemented by JobRunner; the table of jobs needs no more of it, and its tests none of the
// renderer.
//
// Threads: any. Nothing here calls back, and nothing but ImageSoFar and Resume takes long.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "render/base/digest.h"
#include "render/base/status.h"
#include "render/estimate/accumulation.h"
#include "render/image/image.h"
#include "render/scene/render_settings.h"
#include "server/job.h"
#include "server/sync_answer.h"

namespace lucerna {

struct RenderResult {
  StopReason reason = StopReason::kNone;
  BandedImage image;  // without metadata; nothing is added to the job before it is made
  std::int64_t passes = 0;
  std::uint64_t photons = 0;  // in the image
  // The job is not over: it was asked to give up its turn, and Resume goes on. No image then.
  bool gave_up_turn = false;
};

class RunningJob {
 public:
  virtual ~RunningJob() = default;

  // Goes on after a run that gave up its turn, or one that ended well, and Reopen, to the end as it
  // is now; by one thread at a time. Errors: what Stop was given, or what rendering fails with.
  [[nodiscard]] virtual StatusOr<RenderResult> Resume() = 0;

  // A new end: passes, photons, time_s and error of `settings`.
  virtual void SetEnd(const RenderSettings& settings) = 0;
  // Before Resume: a new end, and what Finish asked of the run before is over.
  virtual void Reopen(const RenderSettings& settings) = 0;
  // Ends the run well as soon as there is an image; also before it has begun.
  virtual void Finish() = 0;
  // Whether the run gives up its turn as soon as it can, with all that it has; also before it has
  // begun. What is lent then comes back and is kept.
  virtual void SetGivesUpTurn(bool gives_up_turn) = 0;
  // Ends the run soon with `why`. The first call counts.
  virtual void Stop(Status why) = 0;
  // Whether the photons of a result can have been emitted with the energy that its counters say.
  // Errors: as EmissionCheck::Check.
  [[nodiscard]] virtual Status CheckEmission(const BatchTally& tally) const = 0;
  // A batch was merged: the runner checks whether a pass is complete.
  virtual void Wake() = 0;
  // What workers need for an open pass or round, which `pass` is the first of; absent when it is
  // not open.
  [[nodiscard]] virtual std::optional<WorkBlobs> BlobsOf(std::uint64_t pass) const = 0;
  // How many hitpoints the bytes named `digest` describe: those of a block, 0 for radii; absent
  // when they belong to no open pass or round.
  [[nodiscard]] virtual std::optional<std::size_t> HitpointsIn(const Digest& digest) const = 0;
  // The image of the passes merged so far. Waits for the step that the estimator is in.
  // Errors: FAILED_PRECONDITION before the first one.
  [[nodiscard]] virtual StatusOr<RenderResult> ImageSoFar() const = 0;
};

}  // namespace lucerna
