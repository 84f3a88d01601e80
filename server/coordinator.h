// Where do jobs, workers and bytes meet?
//
// Wires the parts together and decides nothing itself: JobIntake checks submissions, JobTable holds
// the jobs, Scheduler lends work, PassMerger and RoundMerger sum what comes back, ParkedSyncs holds
// the calls of workers that wait, BlobStore the bytes, DurableState what outlives the process.
// Threads of its own render jobs, one for each turn of a job.
//
// Threads: any. Nothing here waits for the network. Submit, Commit and ImageOf may take long: they
// are for the threads of a WorkPool.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <shared_mutex>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "render/base/clock.h"
#include "render/base/latency_counts.h"
#include "render/base/mutex.h"
#include "render/base/status.h"
#include "render/estimate/accumulation.h"
#include "render/scene/render_settings.h"
#include "render/scene/scene_files.h"
#include "server/blob_store.h"
#include "server/commit_accounting.h"
#include "server/job_intake.h"
#include "server/job_runner.h"
#include "server/job_table.h"
#include "server/job_trace.h"
#include "server/memory_budget.h"
#include "server/open_transfers.h"
#include "server/parked_syncs.h"
#include "server/pass_merger.h"
#include "server/round_merger.h"
#include "server/scheduler.h"
#include "server/state/durable_state.h"
#include "server/sync_answer.h"
#include "server/work_pool.h"

namespace lucerna {

class Coordinator {
 public:
  struct Options {
    int threads = 0;                     // of jobs and images; 0: all
    std::uint64_t max_memory_bytes = 0;  // of all parts together; 0: what is free at the start
    std::uint64_t max_store_bytes = std::uint64_t{8} << 30;
    std::uint64_t max_job_bytes =
        0;  // of the image and the scene of one job; 0: what is free at the start
    std::uint64_t batch_photons = 0;  // 0: follows the number of workers
    std::string numeric_profile;
    RetentionLimits retention;
    std::size_t jobs_at_once = 2;    // in progress
    double checkpoint_share = 0.01;  // of the time, in (0, 1]
    double audit_share = 0.005;      // of batches, in [0, 1]
    OpenTransfers::Limits transfers;
    // Of one caller (Access::LimitKeyOf); a page that many people look at is one.
    std::size_t max_watches = 16384;
    std::size_t max_registrations = SchedulerOptions().max_registrations;
  };

  // `state` is what outlives the process; nullptr: nothing does. Goes on with the jobs in it.
  Coordinator(Options options, const Clock& clock, std::unique_ptr<DurableState> state = nullptr);
  ~Coordinator();

  [[nodiscard]] BlobStore& blobs() { return blobs_; }
  [[nodiscard]] OpenTransfers& transfers() { return transfers_; }
  [[nodiscard]] MemoryBudget& budget() { return budget_; }
  [[nodiscard]] std::size_t max_watches() const { return options_.max_watches; }

  // Jobs ---------------------------------------------------------------------------------------

  // Reads the whole scene before it accepts the job. A request id that was accepted before gives
  // the same job. Errors: as JobIntake::Check and JobTable::Add; INVALID_ARGUMENT for a request id.
  [[nodiscard]] StatusOr<JobTable::Submitted> Submit(const Submission& submission,
                                                     const StillNeeded& still_needed);

  // As the functions of JobTable.
  [[nodiscard]] StatusOr<std::string> OwnerOf(const std::string& job_id) const;
  [[nodiscard]] StatusOr<JobReport> ReportOf(const std::string& job_id) const;
  [[nodiscard]] StatusOr<JobTable::News> NewsOf(const std::string& job_id) const {
    return jobs_.NewsOf(job_id);
  }
  [[nodiscard]] std::pair<std::vector<JobReport>, std::uint64_t> List(const JobFilter& filter,
                                                                      std::size_t count,
                                                                      std::uint64_t before) const;
  [[nodiscard]] StatusOr<JobReport> Cancel(const std::string& job_id);
  [[nodiscard]] StatusOr<JobReport> Stop(const std::string& job_id);
  [[nodiscard]] StatusOr<JobReport> Extend(const std::string& job_id, const RenderOverrides& until);
  [[nodiscard]] StatusOr<JobReport> Pause(const std::string& job_id);
  [[nodiscard]] StatusOr<JobReport> Resume(const std::string& job_id);
  [[nodiscard]] StatusOr<JobReport> SetPriority(const std::string& job_id, int priority);
  // Also removes what no other job needs from the disk: may take long.
  [[nodiscard]] Status Delete(const std::string& job_id);
  // EXR bytes; of a bake, its mesh (glTF) or light map (EXR).
  // Errors: NOT_FOUND, FAILED_PRECONDITION when there is no image (yet).
  [[nodiscard]] StatusOr<Blob> ImageOf(const std::string& job_id);
  // The mesh of a light map (glTF). Errors: as ImageOf, and FAILED_PRECONDITION when the job made
  // none.
  [[nodiscard]] StatusOr<Blob> UvMeshOf(const std::string& job_id);

  // What was done for it so far, as a file of Chrome's trace format. Errors: NOT_FOUND,
  // FAILED_PRECONDITION for a job that is not traced (Submission::is_traced).
  [[nodiscard]] StatusOr<Blob> TraceOf(const std::string& job_id);

  // What a program must know to trace a job's photons again.
  struct Description {
    SceneManifest scene;
    RenderSettings settings;
    SceneNeeds needs;
    PhotonSteps photon_steps;
    GuideSteps guides;
    std::string numeric_profile;
  };
  // Errors: NOT_FOUND.
  [[nodiscard]] StatusOr<Description> Describe(const std::string& job_id) const;

  // Workers ------------------------------------------------------------------------------------

  // The id of the registration. Errors: FAILED_PRECONDITION for another numeric profile,
  // INVALID_ARGUMENT for a name or an identity that is too long, and as Scheduler::AddWorker.
  [[nodiscard]] StatusOr<std::string> Register(const std::string& name, int threads,
                                               const std::string& numeric_profile,
                                               const std::string& identity = {},
                                               const std::string& peer = {});

  // Calls `answer` once: now, or from another thread when there is something to say or `wait` is
  // over. Returns a ticket for SyncBroke.
  std::uint64_t Sync(const std::string& worker, Scheduler::Report report, Duration wait,
                     ParkedSyncs::Answer answer);
  // The connection behind a Sync is gone. If it was still waiting, it is answered with CANCELLED
  // and the worker's batches go back.
  void SyncBroke(std::uint64_t ticket);

  // Bytes for a worker. Errors: NOT_FOUND.
  [[nodiscard]] StatusOr<Blob> Fetch(const Digest& digest);

  // Rows of the hitpoint block that a batch of photons is for, or pixels of the image that a slice
  // is for; absent when its pass or round has ended.
  [[nodiscard]] std::optional<std::size_t> RowsOf(const Delivery& delivery) const;
  // What is to be answered before the bytes have come; absent when they are needed.
  // Errors: as Scheduler::StandingOf.
  [[nodiscard]] StatusOr<std::optional<MergeOutcome>> OutcomeOf(const Delivery& delivery) const;
  // Decodes the result of a lease, checks it, and merges it unless another worker's is needed to
  // compare it with. May take long.
  // Errors: as Scheduler::StandingOf; INVALID_ARGUMENT for bytes that are not that result; as
  // EmissionCheck::Check, PassMerger::Merge and RoundMerger::Merge. But for the first, the lease
  // has ended as a failure of the worker.
  [[nodiscard]] StatusOr<MergeOutcome> Commit(const Delivery& delivery, std::string bytes);
  // The result of a lease is not what it should be.
  void Refuse(const Delivery& delivery, const Status& why);

  void Goodbye(const std::string& worker);

  // Workers by the ids of their records (server/worker_records.h). What is ordered is on the disk,
  // if there is a state and it can be written, before the call returns. Errors: NOT_FOUND.
  [[nodiscard]] std::vector<WorkerRecord> ListWorkers() const { return scheduler_.Workers(); }
  [[nodiscard]] Status QuarantineWorker(const std::string& id, const std::string& reason);
  [[nodiscard]] Status DrainWorker(const std::string& id);
  [[nodiscard]] Status ReleaseWorker(const std::string& id);

  // Metrics, since the process began -----------------------------------------------------------

  struct ResultCounts {
    std::atomic<std::uint64_t> photons = 0;  // of results that were merged
    // [outcomes]
    std::array<std::atomic<std::uint64_t>, kMergeOutcomes> of_outcome{};
    std::atomic<std::uint64_t> refused = 0;
    LatencyCounts taking_in;  // decoding, checking and merging
  };
  [[nodiscard]] const ResultCounts& results() const { return results_; }
  [[nodiscard]] std::map<JobState, std::size_t> JobsByState() const { return jobs_.CountByState(); }
  [[nodiscard]] Scheduler::Load LoadNow() const { return scheduler_.LoadAt(clock_.Steady()); }
  [[nodiscard]] const MemoryBudget& memory() const { return budget_; }
  // nullptr: nothing is kept on a disk.
  [[nodiscard]] const DiskBudget* disk() const { return state_ ? &state_->budget() : nullptr; }

  // Time ---------------------------------------------------------------------------------------

  // To be called every 50 ms or so: leases run out, waits end.
  void Tick();
  // Lends nothing any more, and answers every Sync: before the end, so that commits can still come.
  void StopLending();
  // Ends the job that renders, answers every Sync with UNAVAILABLE, and takes no more work. With a
  // state the job is not over: a checkpoint is written, and a later process goes on with it.
  void Close();

 private:
  Moment Now() const { return {clock_.Steady(), ProcessCpuTime(), clock_.Wall()}; }
  StatusOr<JobReport> WithWorkers(StatusOr<JobReport> report) const;

  // Begins turns as they come, each in a thread of its own.
  void RunJobs();
  void RunTurn(JobTable::Turn turn);
  StatusOr<RenderResult> Render(JobTable::Turn& turn);
  // Of a job without a runner: from its checkpoint, or from the beginning.
  StatusOr<RenderResult> BeginRun(JobTable::Turn& turn);
  // Gives the scheduler what decides the job's share of the workers: after each change of that.
  void UpdateClaim(const std::string& job_id);
  std::shared_ptr<JobRunner> MakeRunner(const JobTable::Turn& turn, MemoryClaim memory);
  // Claims what the job needs, and waits for it while others have it; the job then leaves its place
  // to others. Absent when the turn is to be given up.
  // Errors: RESOURCE_EXHAUSTED when it will never fit, CANCELLED.
  StatusOr<std::optional<MemoryClaim>> WaitForMemory(const JobTable::Turn& turn);
  // The same for the memory in which its scene is read. Requires that it has no runner.
  StatusOr<std::optional<MemoryClaim>> WaitForReading(const JobTable::Turn& turn);
  StatusOr<std::optional<MemoryClaim>> WaitForClaim(const JobTable::Turn& turn, MemoryUse use,
                                                    std::uint64_t bytes);
  // The image as one that is claimed, if that is possible; it is kept in any case.
  Blob Claimed(Blob image);
  // Hands the job's newest checkpoint that can be used to its runner, if there is one.
  void RestoreCheckpoint(const std::string& job_id, JobRunner& runner);
  Status KeepCheckpoint(const std::string& job_id, std::vector<std::string_view> sums,
                        std::int64_t passes, const BatchTally& tally);
  // Writes files for a job, if there is a state, however long there is no room, and in the same
  // step notes in the table that it needs them: `note` is given their digests, none where there is
  // no state, and says whether the job has not ended meanwhile. Errors: CANCELLED when the job, or
  // the process, has ended meanwhile.
  Status KeepForJob(const std::string& job_id, std::vector<Blob> files,
                    const std::function<bool(const std::vector<Digest>&)>& note);
  // The job succeeds when its image is on the disk. Errors: as KeepForJob.
  Status EndWell(const std::string& job_id, StopReason reason, const Blob& image);
  // Files of the scene, and of the reference, onto the disk.
  Status KeepFiles(const CheckedJob& job) LUCERNA_REQUIRES(files_mutex_);
  // Makes room for `bytes` within --max-disk: the oldest jobs that have ended go with their files,
  // unless even all of them would not be enough. Keeps `also_needed`. Whether there is room.
  bool MakeDiskRoom(std::uint64_t bytes, const std::set<Digest>& also_needed)
      LUCERNA_REQUIRES(files_mutex_);
  // A blob onto the disk, with room made for it beside `also_needed`. Errors: as BlobFiles::Put.
  Status PutFile(const Digest& digest, const std::string& bytes,
                 const std::set<Digest>& also_needed) LUCERNA_REQUIRES(files_mutex_);
  // Removes the files that no job needs.
  void RemoveUnneeded();
  void RemoveUnneededLocked(const std::set<Digest>& also_needed) LUCERNA_REQUIRES(files_mutex_);
  // Whether the files and checkpoints of so many more bytes and pixels fit into --max-disk beside
  // all that jobs have, or may need, that have not ended. Otherwise such jobs could wait for each
  // other's room for ever.
  bool FitsOnDisk(std::uint64_t bytes, std::uint64_t pixels,
                  const JobTable::NeededFiles& beside) const;
  // Errors: RESOURCE_EXHAUSTED when the job would not fit into --max-disk with all others gone.
  Status CheckDiskNeed(const CheckedJob& job) const;
  // Bakes (server/bake_turn.cc). Whether one can begin: what its names of materials and its spacing
  // come to. Errors: as BakeRounds::Check.
  Status CheckBegins(const CheckedJob& job);
  // Measures the rounds of a bake that are left, to the last one, whose reason is returned without
  // an image, or until it gives up its turn.
  StatusOr<RenderResult> MeasureBake(JobTable::Turn& turn);
  // The mesh of the bake as far as its finished rounds go.
  StatusOr<std::shared_ptr<BakeWork>> ReadBake(const JobTable::Turn& turn);
  // Makes the files and settings of its next round those of the turn.
  Status BeginRound(JobTable::Turn& turn);
  // Takes in what its round has measured.
  Status EndRound(JobTable::Turn& turn, RenderResult result);
  // What becomes of a bake whose last round has ended, for this reason.
  void ConcludeBake(const JobTable::Turn& turn, StopReason reason);

  // What becomes of a job whose runner has come back.
  void Conclude(const std::string& job_id, StatusOr<RenderResult> result);
  // Of a job that did not come to a good end.
  void ConcludeFailed(const std::string& job_id, const Status& failure);
  StatusOr<Blob> Encode(const JobTable::ImageSource& source, RenderResult result) const;
  // A result whose bytes have been read.
  struct DecodedResult {
    std::optional<Accumulation> photons;
    std::optional<SliceSums> slice;
    std::unique_ptr<const PackedSlice> packed;  // the slice again, where it shall wait so
    DeliveredCounts counts;
  };
  // Absent when the pass or round has ended.
  StatusOr<std::optional<DecodedResult>> Decode(const Delivery& delivery, std::string bytes) const;
  StatusOr<MergeOutcome> TakeIn(const Delivery& delivery, std::string bytes);
  // Of a result that counts.
  StatusOr<MergeOutcome> Merge(const Delivery& delivery, DecodedResult decoded);
  // Takes all work of workers whose results were wrong out of the jobs.
  void TakeOut(const std::vector<std::string>& records);
  // Tells the jobs how many workers there are for them: none while nothing is lent, so that the
  // time of jobs stands still and none ends by it.
  void CountWorkers();
  // Jobs in which workers disagree and none is left to decide wait, and say so.
  void ShowDisputes();

  // Keeps what has changed of workers' standings. What cannot be written is tried again by Tick.
  void SaveStandings();

  // Waits until all that is being merged has been counted.
  void WaitForMerges();
  // Logs what went wrong with workers, and pauses jobs whose batches they cannot do.
  void HandleLosses();
  // nullptr for a job that is not traced.
  std::shared_ptr<JobTrace> FindTrace(const std::string& job_id);
  void BeginTrace(const std::string& job_id, SteadyTime submitted_at);
  void EndTrace(const std::string& job_id) LUCERNA_REQUIRES(traces_mutex_);
  // What began at `from` and ends now, if the job is traced; `what` makes its text.
  void TraceOwn(const std::string& job_id, std::string_view row, SteadyTime from,
                const std::function<std::string()>& what);
  // Adds the leases that have ended to the traces of their jobs. Soon after they have: they end
  // now.
  void TraceEndedLeases();
  // What a registration's worker is called in the log.
  std::string ShownWorker(const std::string& worker) const;
  // What there is for a worker now; absent when it should wait on.
  std::optional<StatusOr<SyncAnswer>> TryAnswer(const std::string& worker,
                                                const Scheduler::Report& report);
  void AnswerParked();
  // Answers a Sync that broke, and gives the worker's batches back.
  void EndBroken(const ParkedSyncs::Call& broken);

  const Options options_;
  const Clock& clock_;
  const std::string instance_;  // of this process
  const std::unique_ptr<DurableState> state_;
  ResultCounts results_;
  // Held while files are added for a job, and while those without one are removed.
  Mutex files_mutex_;
  OpenTransfers transfers_;
  MemoryBudget budget_;
  BlobStore blobs_;
  Scheduler scheduler_;
  PassMerger passes_;
  RoundMerger rounds_;
  const JobIntake intake_;
  ParkedSyncs parked_;
  JobTable jobs_;
  // Held together by all that merge, from when the scheduler takes a result until the job counts
  // it; alone, for a moment, by who takes a worker's work out: what was merged by then is counted,
  // and what comes later is refused.
  std::shared_mutex merging_;
  Mutex merge_gate_;
  Mutex traces_mutex_;
  std::map<std::string, std::shared_ptr<JobTrace>> traces_ LUCERNA_GUARDED_BY(traces_mutex_);
  std::deque<std::string> traced_ LUCERNA_GUARDED_BY(traces_mutex_);  // jobs, the oldest first
  std::atomic<bool> is_tracing_ = false;                              // whether there is a trace
  std::set<std::string> disputed_;  // jobs that wait; of the thread of Tick
  Mutex claims_mutex_;              // held from reading a job's share to giving it to the scheduler
  std::atomic<bool> is_lending_ = true;
  std::atomic<bool> is_closing_ = false;
  SteadyTime save_unsaved_at_;  // of the thread of Tick
  // Jobs that have ended since freed memory was given back, and when it is given back next.
  std::atomic<int> ended_since_release_ = 0;
  std::atomic<SteadyTime> release_at_ = SteadyTime();
  // Held from taking changed standings until they are on the disk: the newest is written last.
  Mutex standings_mutex_;

  std::thread job_thread_;  // last, so that all it uses is there
};

}  // namespace lucerna
