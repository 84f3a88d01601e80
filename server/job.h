// Where does a job stand, and what has it cost so far?
//
// A job's life is a small state machine that only moves forward:
//
//   queued -> preparing -> running -> succeeded
//   any of the first three -> paused -> queued, when it is resumed
//   preparing or running -> queued, when it gives up its turn to another job
//   any that has not ended -> cancelled or failed
//
//   succeeded -> queued, when it is given a new end
//
// An ended job otherwise never changes again. The time of a job is the time in which it is running
// and a worker is connected. Pure values: moments come in as arguments.
#pragma once

#include <compare>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "render/analysis/needs.h"
#include "render/bake/bake_rounds.h"
#include "render/bake/bake_settings.h"
#include "render/bake/surface_figures.h"
#include "render/base/clock.h"
#include "render/base/digest.h"
#include "render/estimate/accumulation.h"
#include "render/estimate/guide_learning.h"
#include "render/estimate/photon_steps.h"
#include "render/scene/render_settings.h"
#include "render/scene/scene_files.h"
#include "server/job_estimator.h"

namespace lucerna {

enum class JobState : std::uint8_t {
  kQueued,
  kPreparing,
  kRunning,
  kPaused,
  kSucceeded,
  kCancelled,
  kFailed,
};
// "queued".
[[nodiscard]] const char* NameOf(JobState state);
enum class StopReason : std::uint8_t { kNone, kPasses, kTime, kError, kPhotons, kUser };
// Why a job is paused.
enum class PauseCause : std::uint8_t {
  kNone,         // it is not
  kUser,         // until the user resumes it
  kDisk,         // its checkpoint or image cannot be written; until that can be done
  kFailedBatch,  // a batch failed at all workers; until the user resumes it
  kDispute,      // workers returned different results of a batch; until another one has decided
};
// Whether a job that is paused for this goes on without its user.
[[nodiscard]] constexpr bool GoesOnByItself(PauseCause cause) {
  return cause == PauseCause::kDisk || cause == PauseCause::kDispute;
}

// Of a job among the jobs of one coordinator.
inline constexpr int kLowestPriority = -100;
inline constexpr int kHighestPriority = 100;

class JobLife {
 public:
  JobLife() = default;
  explicit JobLife(SteadyTime submitted_at) : submitted_at_(submitted_at) {}

  // What is known of a life that began in an earlier process; one that has neither ended nor is
  // paused waits again.
  struct Past {
    JobState state = JobState::kQueued;
    StopReason stop_reason = StopReason::kNone;
    std::string failure = {};
    SteadyTime submitted_at = {};
    Duration ran{};
  };
  explicit JobLife(Past past);

  // Each returns whether the job could go there; if not, nothing has changed.
  bool Prepare();
  // Of a job that prepares, or that is paused with all that it needs to run.
  bool Run(SteadyTime now);
  // Of a job that prepares or runs: it waits for its next turn.
  bool GiveUpTurn(SteadyTime now);
  bool Pause(SteadyTime now);
  // Of a paused job: it waits for its next turn.
  bool Resume();
  // Of any that has run and has not ended: one that was paused, or gave up its turn, may be done by
  // then.
  bool Succeed(StopReason reason, SteadyTime now);
  // Of a job that succeeded: it waits to go on.
  bool Extend();
  bool Cancel(SteadyTime now);
  bool Fail(std::string failure, SteadyTime now);
  // Whether a worker is connected; true at first.
  void SetHasWorkers(bool has_workers, SteadyTime now);
  // Of one that has not begun to run in this process: it ran so long in earlier ones.
  void SetRanBefore(Duration ran) { ran_before_ = ran; }

  [[nodiscard]] JobState state() const { return state_; }
  [[nodiscard]] StopReason stop_reason() const { return stop_reason_; }
  [[nodiscard]] const std::string& failure() const { return failure_; }
  [[nodiscard]] bool has_ended() const { return state_ >= JobState::kSucceeded; }
  [[nodiscard]] SteadyTime submitted_at() const { return submitted_at_; }
  // In all its runs; zero before.
  [[nodiscard]] Duration Running(SteadyTime now) const;
  // When the job will have run so long; absent while its time stands still.
  [[nodiscard]] std::optional<SteadyTime> WhenItHasRun(Duration time) const;

 private:
  bool GoTo(JobState state, SteadyTime now);
  bool End(JobState state, SteadyTime now);
  // After a change of what decides whether time counts.
  void SetClock(SteadyTime now);

  JobState state_ = JobState::kQueued;
  StopReason stop_reason_ = StopReason::kNone;
  std::string failure_;
  SteadyTime submitted_at_;
  bool has_run_ = false;  // in this process
  bool has_workers_ = true;
  Duration ran_before_{};                 // until time began to count, the last time
  std::optional<SteadyTime> started_at_;  // counting; absent: time stands still
};

// Events per second over the last few seconds, or over the last few arrivals where these take
// longer: a pass of a large image arrives as a whole, a minute after the one before. What arrives
// within one second of the clock is one arrival, however many workers send it.
class SlidingRate {
 public:
  explicit SlidingRate(Duration window) : window_(window) {}
  // Requires that `now` does not go back.
  void Add(std::uint64_t events, SteadyTime now);
  // `since` is when counting began: a window that is not full yet is not divided by its length.
  [[nodiscard]] double PerSecond(SteadyTime since, SteadyTime now) const;

 private:
  // So many are counted, however old.
  static constexpr std::size_t kFewestArrivals = 4;

  // The index of the first arrival that is counted. The one before it, if any, is when they began.
  [[nodiscard]] std::size_t FirstCounted(SteadyTime now) const;

  Duration window_;
  std::deque<std::pair<SteadyTime, std::uint64_t>> arrivals_;
};

// Of the batches that two workers were to compute (server/audit.h).
struct AuditCounts {
  std::uint64_t agreed = 0;
  std::uint64_t not_audited = 0;  // no other worker was there
  std::uint64_t disputed = 0;     // two results differed
};

// What a job has cost and brought.
struct JobCounters {
  std::int64_t passes = 0;                   // merged into the image
  std::uint64_t photons = 0;                 // merged, also of a pass that is not complete
  std::optional<Duration> to_first_photons;  // from submission
  Duration coordinator_cpu{};
  Duration worker_cpu{};
  BatchTally tally;
  // The first of the photons that were dropped, in order, at most kDroppedNamed.
  std::vector<PhotonKey> dropped_photons;
  std::uint64_t bytes_sent = 0, bytes_received = 0;          // blocks and radii; accumulations
  std::uint64_t hitpoints_sent = 0, hitpoints_returned = 0;  // rows in them
  AuditCounts audits;
  SlidingRate rate{std::chrono::seconds(5)};

  // Takes in which photons a batch has dropped, in any order of batches.
  void NameDropped(const std::vector<PhotonKey>& named);
};

// What became of the photons of so many passes.
struct PassTally {
  std::int64_t first_pass = 0, passes = 0;
  BatchTally tally;
};

// The tally of each pass. From kMostTallies on neighbours are joined, so that each tells of twice
// as many passes as before.
class PassRecord {
 public:
  static constexpr std::size_t kMostTallies = 256;

  PassRecord() = default;
  // Of an earlier process.
  explicit PassRecord(std::vector<PassTally> tallies);

  // Takes in the next passes.
  void Add(const BatchTally& tally, std::int64_t passes = 1);
  [[nodiscard]] const std::vector<PassTally>& tallies() const { return tallies_; }

 private:
  std::vector<PassTally> tallies_;
  std::int64_t passes_each_ = 1;
};

// What is known of the error of a denoised image.
struct DenoisedSample {
  DenoisedError estimate;
  std::optional<TrueError> truth;  // when the job has a reference
};

// What was known of a job's error at one moment.
struct ErrorSample {
  std::int64_t passes = 0;
  std::uint64_t photons = 0;
  Duration running{};
  Duration cpu{};  // of coordinator and workers
  ErrorEstimate estimate;
  std::optional<TrueError> truth;  // when the job has a reference
  // What light that may not have been found adds to the upper end of the relative interval.
  double missing_relative = 0;
  bool nothing_found = false;  // the image was black
  // Of the denoised image, where the job has one, in the sample of its end.
  std::optional<DenoisedSample> denoised;
};

// What happened to a job beside its progress.
struct JobEvent {
  WallTime at;
  std::string what;  // a sentence
};
inline constexpr std::size_t kMostEvents = 100;  // that are kept of a job, the newest

// A worker's part in a job.
struct WorkerShare {
  std::string name;
  std::uint64_t photons = 0;
  std::uint64_t batches = 0;
  Duration cpu{};
};

// A round of a bake (render/bake/bake_rounds.h).
struct BakeRoundRecord {
  std::string name;      // "survey", "round 1"
  std::int64_t run = 0;  // a number that no other round of the job has or had
  std::uint64_t points = 0;
  SceneManifest::Entry sensors;
  Duration ran_before{};  // of the job, when the round began
  bool has_ended = false;
  // Of a round that has ended:
  std::optional<Digest> image;  // on the disk, if there is one
  std::int64_t passes = 0;
  std::uint64_t photons = 0;
  Duration cpu{};
  StopReason reason = StopReason::kNone;
  std::optional<ErrorSample> error;  // the newest sample
  std::vector<LightFinding> lights;  // of it
};

// A job that measures the irradiance of its scene's surfaces, in rounds.
struct BakeRecord {
  BakeSettings settings;
  RenderOverrides overrides;
  std::vector<BakeRoundRecord> rounds;  // the last one is under way, unless it has ended
  std::int64_t runs = 0;                // rounds that have begun, forgotten ones too
  bool begins_again = false;            // what it has measured does not count any more
  bool is_stopped = false;              // by its user: it measures what its mesh needs, and ends
  // Of what came of it, once the job has succeeded:
  std::vector<SurfaceFigures> figures;
  std::optional<double> interpolation_error;
  std::optional<Digest> uv_mesh;
};

// Of a bake settings, needs, counters and all that was found are those of the newest round; when it
// has ended well, what was found of the error is that of EvenRoundOf.
struct Job {
  std::string id;
  std::string name;
  std::string owner;  // who submitted it; empty: unknown
  SceneManifest manifest;
  Digest scene_digest;
  RenderSettings settings;
  std::vector<std::string> warnings;
  SceneNeeds needs;
  // Of the coordinator's memory, as counted when it was submitted [bytes]; 0: not known.
  std::uint64_t scene_memory = 0;
  WallTime submitted_at;
  JobLife life;
  JobCounters counters;
  std::optional<Digest> reference;  // of an EXR image
  std::vector<ErrorSample> convergence;
  std::vector<LightFinding> lights;            // of the newest sample
  PassRecord pass_record;                      // of whole rounds
  PassTally tail;                              // of the passes after them, when the job has stopped
  PhotonSteps photon_steps;                    // of the passes opened so far
  GuideSteps guides;                           // the same
  std::map<std::string, WorkerShare> workers;  // by id of their records
  // Of them, those of which a result was found to be wrong: nothing of theirs may be in the image.
  std::set<std::string> distrusted;
  int most_workers = 0;  // connected at one time while it ran
  std::optional<WallTime> ended_at;
  int priority = 0;
  PauseCause pause_cause = PauseCause::kNone;
  std::string condition;  // why it does not go on; empty: it does, or waits for its turn
  std::vector<JobEvent> events;
  std::optional<BakeRecord> bake;  // absent: an image is rendered

  void AddEvent(WallTime at, std::string what);
  // All that rendering has counted and found.
  void ClearProgress();
  // The same of a round of a bake: who had a part in the job, and what it has cost, stays.
  void ClearRound();
};

// The name of what is lent of the job now: of a bake, one for each round.
[[nodiscard]] std::string RunIdOf(const Job& job);
// The files of what is lent of the job now: of a bake, with the sensors of its round.
[[nodiscard]] SceneManifest ManifestOf(const Job& job);
// The round of kEvenRoundName; nullptr before it.
[[nodiscard]] const BakeRoundRecord* EvenRoundOf(const BakeRecord& bake);

// What a list of jobs shows: without the parts that grow with the length of a job.
[[nodiscard]] Job SummaryOf(const Job& job);

}  // namespace lucerna
