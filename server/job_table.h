// All jobs of a coordinator: which there are, where each stands, and which ones run.
//
// Every request is one step under one lock, so a job and its runner cannot come apart: whoever ends
// a job's life takes its runner in the same step and stops it, and a job that has ended is given no
// runner. Moments come in as arguments.
//
// A job runs in turns (server/job_queue.h). A turn belongs to one thread from WaitForTurn until its
// Turn is destroyed, and no other turn of the job begins meanwhile. It ends with the job, or before
// that when the job is paused or gives way to another; the runner then keeps all it has, and goes
// on in the next turn.
//
// Ended jobs are remembered, with the images of the newest; the very newest also with all their
// photons, so that they can go on (server/job_retention.h).
//
// What is lent of a job, and comes back, has the name RunIdOf. Every call takes that in place of
// the job's id, and finds no job when the round of a bake that it names is not the newest.
//
// With a journal, what a request changes is on the disk before it returns, and no client sees a new
// job before that. Where that fails, a new job is refused; any other change holds in memory and is
// written by SaveUnsaved as soon as it can be.
//
// Threads: any. Only WaitForTurn waits, and others for the journal's disk, without the lock. What
// is dropped is destroyed outside the lock.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"

#include "render/base/clock.h"
#include "render/base/mutex.h"
#include "render/base/status.h"
#include "render/scene/scene.h"
#include "server/audit.h"
#include "server/bake_work.h"
#include "server/blob_store.h"
#include "server/commit_accounting.h"
#include "server/job.h"
#include "server/job_intake.h"
#include "server/job_journal.h"
#include "server/job_queue.h"
#include "server/job_retention.h"
#include "server/running_job.h"

namespace lucerna {

// Now, and the processor time of this process so far.
struct Moment {
  SteadyTime now;
  Duration cpu{};
  WallTime wall{};
};

// A job as it is now, for people.
struct JobReport {
  Job job;
  int workers = 0;  // connected; for the coordinator to fill in
  Duration running{};
  double photons_per_second = 0;
  std::uint64_t version = 0;  // grows with every change
};

// Which jobs a list shows.
struct JobFilter {
  std::set<JobState> states = {};  // empty: all
  std::string owner = {};          // empty: of any
  std::string name_contains = {};
};

class JobTable {
 public:
  struct Options {
    std::string instance;  // in front of every job's id
    // Makes what stands behind every job's id, so that none follows from another; absent: nothing.
    std::function<std::string()> random_part = {};
    std::size_t max_waiting = 256;
    std::size_t max_waiting_of_owner = 128;  // of an owner that is known
    std::size_t max_at_once = 1;             // jobs in progress
    RetentionLimits retention;
    JobJournal* journal = nullptr;  // outlives the table; nullptr: jobs end with the process
  };
  explicit JobTable(Options options);

  // Takes in the jobs of earlier processes: those that have not ended wait for their turns.
  // `next_serial` is larger than the numbers of all jobs there have been. Before all other calls.
  void Restore(std::vector<JournalEntry> jobs, std::uint64_t next_serial, const Moment& moment);
  // Writes what could not be written when it changed.
  void SaveUnsaved(const Moment& moment);
  // What jobs need on the disk.
  struct NeededFiles {
    std::set<Digest> blobs;
    std::set<std::string> checkpoints;  // ids of jobs
    std::uint64_t pixels = 0;           // of all these jobs
  };
  [[nodiscard]] NeededFiles Needed() const;
  // Of those that have not ended.
  [[nodiscard]] NeededFiles NeededByOpenJobs() const;

  struct Submitted {
    std::string job_id;  // empty when only validated
    std::vector<std::string> warnings;
  };
  // The job of an earlier submission of this owner with this request id.
  [[nodiscard]] std::optional<Submitted> FindRequest(const std::string& request_id,
                                                     const std::string& owner = {}) const;
  // The new job, or that of the same request id, if there is one by now.
  // Errors: RESOURCE_EXHAUSTED when too many jobs wait, UNAVAILABLE after Close, or what the
  // journal says.
  [[nodiscard]] StatusOr<Submitted> Add(CheckedJob job, WallTime submitted_at,
                                        const Moment& moment);

  // Errors of all requests: NOT_FOUND.

  // Who submitted it.
  [[nodiscard]] StatusOr<std::string> OwnerOf(const std::string& job_id) const;
  [[nodiscard]] StatusOr<JobReport> ReportOf(const std::string& job_id, const Moment& moment) const;
  // What changes with every change of a job. Errors: NOT_FOUND.
  struct News {
    JobState state = JobState::kQueued;
    std::uint64_t version = 0;
    auto operator<=>(const News&) const = default;
  };
  [[nodiscard]] StatusOr<News> NewsOf(const std::string& job_id) const;
  // Summaries of at most `count` jobs older than `before` (0: from the newest) that `filter` lets
  // pass, newest first, and where the next page begins (0: nowhere).
  [[nodiscard]] std::pair<std::vector<JobReport>, std::uint64_t> List(const JobFilter& filter,
                                                                      std::size_t count,
                                                                      std::uint64_t before,
                                                                      const Moment& moment) const;
  [[nodiscard]] StatusOr<JobReport> Cancel(const std::string& job_id, const Moment& moment);
  // Pauses a job that has not ended, for `cause`; one that the user has paused stays so. Its place
  // is free at once; what is lent of it comes back and is kept. FAILED_PRECONDITION when it has
  // ended.
  [[nodiscard]] StatusOr<JobReport> Pause(const std::string& job_id, PauseCause cause,
                                          std::string reason, const Moment& moment);
  // A paused job waits for its next turn; nothing when it is not paused, or waits for the disk.
  // FAILED_PRECONDITION when it has ended.
  [[nodiscard]] StatusOr<JobReport> Resume(const std::string& job_id, const Moment& moment);
  // INVALID_ARGUMENT outside kLowestPriority to kHighestPriority; FAILED_PRECONDITION when it has
  // ended.
  [[nodiscard]] StatusOr<JobReport> SetPriority(const std::string& job_id, int priority,
                                                const Moment& moment);
  // Ends a job well, with the image as it is, also one that is paused. FAILED_PRECONDITION when it
  // has not begun to run.
  [[nodiscard]] StatusOr<JobReport> Stop(const std::string& job_id, const Moment& moment);
  // Gives a job that has not ended, or that succeeded, the stop criteria of `until`.
  // INVALID_ARGUMENT (SetStopCriteria), FAILED_PRECONDITION when the job was cancelled, failed, or
  // its photons are not kept any more.
  [[nodiscard]] StatusOr<JobReport> Extend(const std::string& job_id, const RenderOverrides& until,
                                           const Moment& moment);
  // Forgets a job that has ended. Errors: FAILED_PRECONDITION when it has not, or what the journal
  // says.
  [[nodiscard]] Status Delete(const std::string& job_id, const Moment& moment);
  // Ends a job as failed. Nothing when there is no such job, or it has ended.
  void Fail(const std::string& job_id, const Status& why, const Moment& moment);

  // The image of a job, or what it can be made from.
  struct ImageSource {
    Blob image;                          // when the job has ended and it is in memory
    Blob uv_mesh;                        // the same, of a light map
    std::optional<Digest> image_digest;  // when it has ended and it is on the disk; else:
    std::shared_ptr<RunningJob> runner;
    Job job;
    Duration running{};
    Duration cpu{};
  };
  // FAILED_PRECONDITION when there is no image (yet).
  [[nodiscard]] StatusOr<ImageSource> FindImage(const std::string& job_id,
                                                const Moment& moment) const;
  // The job's record. Absent when there is no such job.
  [[nodiscard]] std::optional<Job> Find(const std::string& job_id) const;

  // Workers ------------------------------------------------------------------------------------

  // What a worker must know of its work; absent when its pass or round has ended. `workers` are
  // connected.
  [[nodiscard]] std::optional<Loan> MakeLoan(BatchLease lease, int workers);
  // The worker's result is about to be merged: from now on sums may hold its work.
  void NoteContributor(const std::string& job_id, const std::string& record,
                       const std::string& worker_name);
  // Errors: as RunningJob::CheckEmission. OK for a job that does not run.
  [[nodiscard]] Status CheckEmission(const std::string& job_id, const BatchTally& tally) const;
  void CountAudit(const std::string& job_id, AuditOutcome outcome);
  // A result of this worker was found to be wrong. Jobs that go on begin again without its work
  // (TakeBeginsAgain), and jobs that have ended say that they have a part of it and cannot go on.
  void TakeOut(const std::string& record, const Moment& moment);
  // Counts a batch that was merged, and wakes the job's runner.
  void CountMerged(const Delivery& delivery, const DeliveredCounts& counts,
                   const std::string& worker_name, SteadyTime now);
  // Counts bytes that a worker fetched, if they belong to an open pass.
  void CountFetched(const Digest& digest, std::uint64_t size_bytes);

  // So many workers are connected; to be called now and then, also without a change. The time of
  // jobs stands still without workers, and after a few seconds without any, running jobs leave
  // their places to others until there is one again.
  void SetLiveWorkers(int workers, const Moment& moment);

  // Threads of jobs ----------------------------------------------------------------------------

  // Ends a turn when it is destroyed.
  class TurnEnd {
   public:
    TurnEnd() = default;
    TurnEnd(JobTable& table, std::uint64_t serial) : table_(&table), serial_(serial) {}
    TurnEnd(TurnEnd&& other) noexcept
        : table_(std::exchange(other.table_, nullptr)), serial_(other.serial_) {}
    TurnEnd& operator=(TurnEnd&& other) noexcept {
      std::swap(table_, other.table_);
      std::swap(serial_, other.serial_);
      return *this;
    }
    ~TurnEnd() {
      if (table_ != nullptr) table_->EndTurn(serial_);
    }

   private:
    JobTable* table_ = nullptr;
    std::uint64_t serial_ = 0;
  };

  // A job whose turn it is.
  struct Turn {
    std::string job_id;
    std::string run_id;      // RunIdOf
    SceneManifest manifest;  // ManifestOf
    RenderSettings settings;
    SceneNeeds needs;
    std::uint64_t scene_memory = 0;  // see Job
    std::optional<Digest> reference;
    std::optional<Scene> scene;          // absent: to be read again
    std::shared_ptr<RunningJob> runner;  // of a job that goes on
    bool is_bake = false;
    std::shared_ptr<BakeWork> bake;  // of a bake that has work in memory
    bool warns = true;               // what its run warns of is true of the job
    TurnEnd end;
  };
  // Waits for a job and begins its turn. Absent after Close. The table outlives the turn.
  [[nodiscard]] std::optional<Turn> WaitForTurn();
  // Whether the job of this turn is still to be rendered: OK or CANCELLED.
  [[nodiscard]] Status CheckStillNeeded(const std::string& job_id) const;
  // Whether nothing more counts for the job, be it that it is not known any more.
  [[nodiscard]] bool HasEnded(const std::string& job_id) const;
  // States that no job is in are left out.
  [[nodiscard]] std::map<JobState, std::size_t> CountByState() const;
  // Gives a job its runner. False when it has ended meanwhile or begins again, or after Close: it
  // must not run.
  [[nodiscard]] bool Attach(const std::string& job_id, std::shared_ptr<RunningJob> runner);
  // The runner has given up its turn: unless it is paused or has ended, the job waits for its next.
  void GiveUpTurn(const std::string& job_id, const Moment& moment);
  // The job whose turn it is waits for memory, and says so: it leaves its place to others. Empty:
  // it goes on.
  void SetWaitsForMemory(const std::string& job_id, std::string condition, const Moment& moment);
  // What decides what is lent of a job that has a runner and has not ended; absent for others.
  struct Share {
    int priority = 0;
    std::string owner;
    bool is_held = false;  // nothing is lent
    std::string run_id;    // RunIdOf
  };
  [[nodiscard]] std::optional<Share> ShareOf(const std::string& job_id) const;
  // Whether the turn of the job is to be given up.
  [[nodiscard]] bool GivesUpTurn(const std::string& job_id) const;
  // Lets go of the photons of the job that ended first of those that have some in memory, and of
  // its image in memory if it is on the disk too; false when there is none. It can go on no more,
  // unless its checkpoint is on the disk.
  bool DropOldestPhotons();
  // Forgets the oldest job that has ended, with all there is of it; absent when there is none.
  [[nodiscard]] std::optional<std::string> DropOldestEnded();
  // How long the job, of a bake its newest round, has run, and JobLife::WhenItHasRun of that.
  [[nodiscard]] Duration RunningOf(const std::string& job_id, SteadyTime now) const;
  [[nodiscard]] std::optional<SteadyTime> WhenItHasRun(const std::string& job_id,
                                                       Duration time) const;
  // The job as it is now with what it has cost; absent when it has been dropped.
  [[nodiscard]] std::optional<ImageSource> DescribeRun(const std::string& job_id,
                                                       const Moment& moment) const;
  // Of a bake whose turn it is: what it holds in memory from now on.
  void SetBakeWork(const std::string& job_id, std::shared_ptr<BakeWork> work);
  // The newest round of a bake has ended, and its runner goes. `image` is its digest when it is on
  // the disk; `passes` and `reason` are those of its run. False when the job has ended meanwhile,
  // or begins again.
  [[nodiscard]] bool EndRound(const std::string& job_id, std::optional<Digest> image,
                              std::int64_t passes, StopReason reason, const Moment& moment);
  // The next round of a bake, or again the one that is under way: what a round's files were found
  // to be. False as EndRound.
  [[nodiscard]] bool BeginRound(const std::string& job_id, BakeRoundRecord round,
                                const CheckedJob& checked, const Moment& moment);
  // Forgets the rounds of a bake, which begins anew.
  void ForgetRounds(const std::string& job_id, const Moment& moment);
  // What came of a bake; `uv_mesh` is empty when there is none, its digest when it is on the disk.
  void SetBakeResult(const std::string& job_id, const BakeResult& result, Blob uv_mesh,
                     std::optional<Digest> uv_mesh_digest);
  // Whether the user has stopped the job.
  [[nodiscard]] bool IsFinishing(const std::string& job_id) const;
  // `image_digest` when the image is on the disk. False when the job has ended meanwhile.
  bool Succeed(const std::string& job_id, StopReason reason, Blob image, const Moment& moment,
               std::optional<Digest> image_digest = std::nullopt);
  // Whether the run that has ended is to be followed by one without the work of workers that are
  // distrusted. Its runner is dropped.
  [[nodiscard]] bool TakeBeginsAgain(const std::string& job_id);
  [[nodiscard]] bool BeginsAgain(const std::string& job_id) const;
  // The job goes on from a checkpoint: its record is what it was then, but for its settings.
  void GoOnFrom(const std::string& job_id, Job record, Duration ran);

  // The running job cannot go on for now, and why: it is paused, leaves its place to others and
  // keeps its turn. Empty: this cause is over, and the job goes on. Nothing when it is paused for
  // another cause, or has ended; but the disk's cause, which is reported once, takes the place of a
  // dispute, which is reported again and again.
  // Requires GoesOnByItself(cause).
  void SetCondition(const std::string& job_id, PauseCause cause, std::string condition,
                    const Moment& moment);
  void AddEvent(const std::string& job_id, std::string what, const Moment& moment);
  // The job's checkpoint is on the disk.
  void OnCheckpoint(const std::string& job_id);
  // What the runner reports.
  void OnRunning(const std::string& job_id, const Moment& moment);
  void OnWarning(const std::string& job_id, std::string warning);
  void OnPhotonSteps(const std::string& job_id, PhotonSteps steps);
  void OnGuides(const std::string& job_id, GuideSteps guides);
  void OnProgress(const std::string& job_id, std::int64_t passes);
  void OnTail(const std::string& job_id, const BatchTally& tally, std::int64_t passes);
  void OnRoundMerged(const std::string& job_id, const BatchTally& tally, std::int64_t passes);
  void OnErrorEstimate(const std::string& job_id, ErrorSample sample,
                       std::vector<LightFinding> lights, const Moment& moment);
  // Of the newest estimate's image.
  void OnDenoised(const std::string& job_id, const DenoisedSample& denoised);

  // Stops the jobs that have turns, with `why`, and begins no other.
  void Close(const Status& why);

 private:
  struct Entry : JournalEntry {
    std::optional<Scene> scene;  // kept from Add when it will be rendered at once
    std::shared_ptr<RunningJob> runner;
    std::shared_ptr<BakeWork> bake_work;
    Blob image, uv_mesh;
    std::uint64_t version = 0;
    PinnedBlobs pinned;       // while the job may need its files
    bool is_unsaved = false;  // the journal has it as it was before
    bool is_being_deleted = false;
    bool begins_again = false;   // a wrong worker's part is taken out
    bool gives_up_turn = false;  // as its runner was told, or will be
    bool is_finishing = false;   // stopped: its turn is short and comes before all others
  };
  using Entries = std::map<std::uint64_t, Entry>;  // by serial number
  // Changes that are on their way to the journal's disk: made before the lock, waits for them after
  // it.
  class Writes {
   public:
    Writes() = default;
    ~Writes() {
      if (table_ != nullptr) table_->FinishWrites(writes_);
    }
    Writes(const Writes&) = delete;
    Writes& operator=(const Writes&) = delete;
    struct Write {
      std::uint64_t serial = 0;
      bool removes = false;
      JobJournal::Written written;
    };
    void Add(JobTable& table, Write write) {
      table_ = &table;
      writes_.push_back(std::move(write));
    }

   private:
    JobTable* table_ = nullptr;
    std::vector<Write> writes_;
  };
  // What was taken from the table under the lock, to be destroyed after it.
  struct Dropped {
    Writes writes;
    std::vector<std::shared_ptr<RunningJob>> runners;
    std::vector<std::shared_ptr<BakeWork>> bakes;
    std::vector<Blob> images;
    std::vector<PinnedBlobs> pinned;
    std::vector<std::optional<Scene>> scenes;
    std::vector<Entries::node_type> entries;
  };

  [[nodiscard]] static Status UnknownJob(const std::string& job_id);
  [[nodiscard]] std::uint64_t SerialOf(std::string_view job_id) const;
  Entries::iterator FindLocked(const std::string& job_id) LUCERNA_REQUIRES(mutex_);
  Entries::const_iterator FindLocked(const std::string& job_id) const LUCERNA_REQUIRES(mutex_);
  std::optional<Submitted> FindRequestLocked(const std::string& request_id,
                                             const std::string& owner) const
      LUCERNA_REQUIRES(mutex_);
  // Whether one more job of `owner` may wait.
  [[nodiscard]] Status CheckMayAdd(const std::string& owner) const LUCERNA_REQUIRES(mutex_);
  // With the next numbers.
  Entry MakeEntry(CheckedJob checked, WallTime submitted_at, const Moment& moment) const
      LUCERNA_REQUIRES(mutex_);
  // With the job, or with its summary.
  JobReport MakeReport(const Entry& entry, const Moment& moment, bool is_summary = false) const
      LUCERNA_REQUIRES(mutex_);
  ImageSource MakeImageSource(const Entry& entry, const Moment& moment) const
      LUCERNA_REQUIRES(mutex_);
  // Ends a job's life and stops its runner. Nothing when it has ended.
  void End(std::uint64_t serial, Entry& entry, const Status& why, const Moment& moment,
           Dropped& dropped) LUCERNA_REQUIRES(mutex_);
  void Retain(Dropped& dropped, const Moment& moment) LUCERNA_REQUIRES(mutex_);
  // From the table and the journal.
  void DropLocked(Entries::iterator entry, Dropped& dropped) LUCERNA_REQUIRES(mutex_);
  static void AddNeeded(const Entry& entry, NeededFiles& needed);
  void EndTurn(std::uint64_t serial);
  static JobQueue::Claim ClaimOf(const Entry& entry);
  // It waits for a turn.
  void PushLocked(std::uint64_t serial, Entry& entry) LUCERNA_REQUIRES(mutex_);
  void SetGivesUpTurn(Entry& entry, bool gives_up_turn) LUCERNA_REQUIRES(mutex_);
  // Of a job that has ended, to others.
  void LeavePlace(std::uint64_t serial) LUCERNA_REQUIRES(mutex_);
  // After a change of who waits, who has a place, or of priorities.
  void UpdateTurns() LUCERNA_REQUIRES(mutex_);
  bool ResumeLocked(std::uint64_t serial, Entry& entry) LUCERNA_REQUIRES(mutex_);
  // A bake begins anew when it runs next.
  static void ForgetRoundsLocked(Entry& entry, Dropped& dropped);
  // Of a bake that has not ended: what it has measured does not count any more.
  void BeginBakeAgain(std::uint64_t serial, Entry& entry, Dropped& dropped)
      LUCERNA_REQUIRES(mutex_);
  // Whether a bake that has ended has its files in memory, to begin anew with another end.
  static bool HoldsFilesOfBake(const Entry& entry);
  static bool IsFinishingLocked(const Entry& entry);
  // Before a job begins or ceases to run: gives each running job its part of the processor time
  // that the process took since the last call. The time of a process cannot be told apart by jobs.
  void ShareCpu(const Moment& moment) LUCERNA_REQUIRES(mutex_);
  // Makes `change`, a function of JobLife that says whether the life has changed; returns that.
  bool ChangeLife(std::uint64_t serial, Entry& entry, const Moment& moment,
                  absl::FunctionRef<bool(JobLife&)> change) LUCERNA_REQUIRES(mutex_);
  Duration CpuOf(const Entry& entry, const Moment& moment) const LUCERNA_REQUIRES(mutex_);
  // Of an entry that has changed.
  void Save(Entry& entry, SteadyTime now, Writes& writes) LUCERNA_REQUIRES(mutex_);
  // Waits for the writes, and remembers those that failed.
  void FinishWrites(const std::vector<Writes::Write>& writes);
  // What could not be written, first of all jobs; absent when all is written.
  std::optional<Writes::Write> BeginUnsaved(SteadyTime now);

  const Options options_;
  mutable Mutex mutex_;
  Condition job_waits_;
  Condition added_;
  bool is_closed_ LUCERNA_GUARDED_BY(mutex_) = false;
  std::uint64_t next_serial_ LUCERNA_GUARDED_BY(mutex_) = 1;
  std::uint64_t next_turn_ LUCERNA_GUARDED_BY(mutex_) = 1;
  // Owners of new jobs that are on their way to the disk, by request.
  std::map<std::string, std::string> being_added_ LUCERNA_GUARDED_BY(mutex_);
  std::set<std::uint64_t> unremoved_ LUCERNA_GUARDED_BY(mutex_);  // from the journal
  Entries entries_ LUCERNA_GUARDED_BY(mutex_);
  JobQueue queue_ LUCERNA_GUARDED_BY(mutex_);
  std::set<std::uint64_t> running_ LUCERNA_GUARDED_BY(mutex_);  // whose state is kRunning
  Duration shared_cpu_ LUCERNA_GUARDED_BY(mutex_){};            // up to where it was shared
  bool has_workers_ LUCERNA_GUARDED_BY(mutex_) = true;
  SteadyTime no_workers_since_ LUCERNA_GUARDED_BY(mutex_);
};

}  // namespace lucerna
