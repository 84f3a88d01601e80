// What does the coordinator know, and who may ask it what?
//
// The one place where jobs, workers and bytes meet. Services ask it in values; it asks the
// scheduler, the merger, the store and the runner of the job that is being rendered. One job
// renders at a time, the others wait in order.
//
// Ended jobs are remembered until the coordinator ends, with the images of the newest; the very
// newest also with all their photons, so that they can go on.
//
// Threads: any. Nothing here waits for the network; ImageSoFar of a running job waits for the step
// that its estimator is in.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "render/base/clock.h"
#include "render/base/mutex.h"
#include "render/base/status.h"
#include "render/estimate/accumulation.h"
#include "render/image/image.h"
#include "render/scene/render_settings.h"
#include "render/scene/scene.h"
#include "render/scene/scene_files.h"
#include "server/blob_store.h"
#include "server/job.h"
#include "server/job_runner.h"
#include "server/pass_merger.h"
#include "server/scheduler.h"
#include "server/work_pool.h"

namespace lucerna {

class Coordinator {
 public:
  struct Options {
    int threads = 0;  // for eye paths; 0: all
    std::uint64_t max_store_bytes = std::uint64_t{8} << 30;
    std::uint64_t max_job_bytes = 0;  // for the image of one job; 0: what is free at the start
    std::uint64_t batch_photons = 0;  // 0: follows the number of workers
    std::string numeric_profile;
  };

  Coordinator(Options options, const Clock& clock);
  ~Coordinator();

  [[nodiscard]] BlobStore& blobs() { return blobs_; }

  // Jobs ---------------------------------------------------------------------------------------

  struct Submission {
    std::string request_id;
    std::string name;
    SceneManifest manifest;
    RenderOverrides overrides;
    bool validate_only = false;
    std::optional<Digest> reference;  // of an EXR image among the blobs
  };
  struct Submitted {
    std::string job_id;  // empty when only validated
    std::vector<std::string> warnings;
  };
  // Reads the whole scene before it says yes.
  // Errors: INVALID_ARGUMENT with all errors of scene and settings, FAILED_PRECONDITION when
  // blobs are missing, RESOURCE_EXHAUSTED when too many jobs wait.
  // What `still_needed` says ends the reading between two files.
  [[nodiscard]] StatusOr<Submitted> Submit(const Submission& submission,
                                           const StillNeeded& still_needed);

  // A job as it is now, for people.
  struct Report {
    Job job;
    int workers = 0;
    Duration running{};
    double photons_per_second = 0;
    std::uint64_t version = 0;  // grows with every change
  };
  // Errors: NOT_FOUND.
  [[nodiscard]] StatusOr<Report> ReportOf(const std::string& job_id) const;
  // At most `count` jobs older than `before` (0: from the newest), newest first, and where the
  // next page begins (0: nowhere).
  [[nodiscard]] std::pair<std::vector<Report>, std::uint64_t> List(std::size_t count,
                                                                   std::uint64_t before) const;
  // Errors: NOT_FOUND.
  [[nodiscard]] StatusOr<Report> Cancel(const std::string& job_id);
  // Ends a job well, with the image as it is. Errors: NOT_FOUND, FAILED_PRECONDITION when it has
  // not begun to run.
  [[nodiscard]] StatusOr<Report> Stop(const std::string& job_id);
  // Gives a job that has not ended, or that succeeded, the stop criteria of `until`.
  // Errors: NOT_FOUND, INVALID_ARGUMENT (SetStopCriteria), FAILED_PRECONDITION when the job was
  // cancelled, failed, or its photons are not kept any more.
  [[nodiscard]] StatusOr<Report> Extend(const std::string& job_id, const RenderOverrides& until);
  // EXR bytes. Errors: NOT_FOUND, FAILED_PRECONDITION when there is no image (yet).
  [[nodiscard]] StatusOr<Blob> ImageOf(const std::string& job_id);

  // Workers ------------------------------------------------------------------------------------

  // The worker's id. Errors: FAILED_PRECONDITION for another numeric profile.
  [[nodiscard]] StatusOr<std::string> Register(const std::string& name, int threads,
                                               const std::string& numeric_profile);

  // A batch with all that a worker must know of it.
  struct Loan {
    BatchLease lease;
    SceneManifest scene;
    RenderSettings settings;
    SceneNeeds needs;
    PassBlobs blobs;
  };
  struct SyncAnswer {
    std::optional<Loan> loan;
    std::vector<std::string> revoked;
  };
  using AnswerSync = std::function<void(StatusOr<SyncAnswer>)>;
  // Calls `answer` once: now, or from another thread when there is something to say or `wait` is
  // over. Returns a ticket for SyncBroke.
  std::uint64_t Sync(const std::string& worker, Scheduler::Report report, Duration wait,
                     AnswerSync answer);
  // The connection behind a Sync is gone. If it was still waiting, it is answered with CANCELLED
  // and the worker's batches go back.
  void SyncBroke(std::uint64_t ticket);

  // Bytes that a worker asks for. Errors: NOT_FOUND.
  [[nodiscard]] StatusOr<Blob> Fetch(const Digest& digest);

  // Rows of the hitpoint block that a batch is for; absent when its pass has ended.
  [[nodiscard]] std::optional<std::size_t> HitpointsOf(const PassKey& pass) const {
    return merger_.Hitpoints(pass);
  }
  struct Delivery {
    std::string worker;
    PassKey pass;
    PhotonRange range;
    Duration cpu{};
    std::uint64_t size_bytes = 0;  // as it came over the wire
  };
  // Errors: as PassMerger::Merge.
  [[nodiscard]] StatusOr<PassMerger::Outcome> Commit(const Delivery& delivery,
                                                     const Accumulation& accumulation);

  // What a program must know to trace a job's photons again.
  struct Description {
    SceneManifest scene;
    RenderSettings settings;
    SceneNeeds needs;
    std::string numeric_profile;
  };
  // Errors: NOT_FOUND.
  [[nodiscard]] StatusOr<Description> Describe(const std::string& job_id) const;

  void Goodbye(const std::string& worker);

  // Time ---------------------------------------------------------------------------------------

  // To be called every 50 ms or so: leases run out, waits end.
  void Tick();
  // Ends the job that renders, answers every Sync with UNAVAILABLE, and takes no more work.
  void Close();

 private:
  struct JobEntry {
    std::uint64_t serial = 0;
    std::string request_id;
    Job job;
    std::optional<Scene> scene;  // kept from Submit when it will be rendered at once
    std::shared_ptr<JobRunner> runner;
    Blob image;
    std::uint64_t version = 0;
    Duration cpu_at_start{};  // less what earlier runs took
    PinnedBlobs pinned;  // the files of the scene and the reference, while the job may need them
  };
  struct WaitingSync {
    std::string worker;
    Scheduler::Report report;
    SteadyTime until;
    AnswerSync answer;
    bool is_being_tried = false;  // by AnswerWaiting, which then decides what becomes of it
    bool is_broken = false;
  };

  StatusOr<std::pair<Scene, std::vector<std::string>>> ReadScene(const SceneManifest& manifest,
                                                                 const StillNeeded& still_needed);
  void RunJobs();
  void RunJob(const std::shared_ptr<JobEntry>& entry);
  // What becomes of a job whose runner has come back.
  void Conclude(const std::shared_ptr<JobEntry>& entry, StatusOr<JobRunner::Result> result);
  StatusOr<Blob> Encode(const Job& job, JobRunner::Result result, Duration running,
                        Duration coordinator_cpu) const;
  void EndJob(const std::shared_ptr<JobEntry>& entry, const Status& failure);
  void ForgetOldJobs() LUCERNA_REQUIRES(mutex_);
  Report MakeReport(const JobEntry& entry) const LUCERNA_REQUIRES(mutex_);
  std::shared_ptr<JobEntry> Find(const std::string& job_id) const LUCERNA_REQUIRES(mutex_);
  void StopPoisonedJobs();
  // What there is to tell a worker now; absent when it should wait on.
  std::optional<StatusOr<SyncAnswer>> TryAnswer(const std::string& worker,
                                                const Scheduler::Report& report);
  void AnswerWaiting();
  // Answers a Sync that broke, and gives the worker's batches back.
  void EndBroken(const WaitingSync& broken);

  const Options options_;
  const Clock& clock_;
  const std::string instance_;
  BlobStore blobs_;
  Scheduler scheduler_;
  PassMerger merger_;

  mutable Mutex mutex_;
  Condition job_waits_;
  bool is_closed_ LUCERNA_GUARDED_BY(mutex_) = false;
  std::uint64_t next_serial_ LUCERNA_GUARDED_BY(mutex_) = 1;
  std::map<std::uint64_t, std::shared_ptr<JobEntry>> jobs_ LUCERNA_GUARDED_BY(mutex_);
  std::deque<std::shared_ptr<JobEntry>> queue_ LUCERNA_GUARDED_BY(mutex_);
  std::shared_ptr<JobEntry> current_ LUCERNA_GUARDED_BY(mutex_);

  // Never held together with mutex_. Scheduler, merger, store and runner lock beneath either.
  Mutex waiting_mutex_;
  bool syncs_closed_ LUCERNA_GUARDED_BY(waiting_mutex_) = false;
  std::uint64_t next_ticket_ LUCERNA_GUARDED_BY(waiting_mutex_) = 1;
  std::map<std::uint64_t, WaitingSync> waiting_ LUCERNA_GUARDED_BY(waiting_mutex_);

  std::thread job_thread_;  // last, so that all it uses is there
};

}  // namespace lucerna
