#include "server/coordinator.h"

#include <algorithm>
#include <exception>
#include <future>
#include <list>
#include <map>
#include <new>
#include <utility>

#include "absl/strings/str_format.h"
#include <spdlog/spdlog.h>

#include "render/base/escape.h"
#include "render/base/fail_point.h"
#include "render/base/memory.h"
#include "render/base/random_id.h"
#include "server/job_image.h"
#include "server/job_message.h"
#include "server/memory_need.h"

namespace lucerna {
namespace {

constexpr Duration kSaveUnsavedEvery = std::chrono::seconds(1);
// Freed memory is given back after so many jobs, or when so long none has ended.
constexpr int kReleaseAfterJobs = 64;
constexpr Duration kReleaseAfter = std::chrono::seconds(10);
constexpr std::chrono::milliseconds kRetryPause{100};
constexpr int kPausesBeforeRetry = 10;
constexpr std::size_t kSecretBytes = 32;
constexpr std::size_t kMostTraces = 4;     // each takes some ten MB at most
constexpr std::size_t kRandomDigits = 16;  // of a job's id: 64 bits, short enough to be typed

// Different for every start of a coordinator on one machine.
std::string InstanceName(const Clock& clock) {
  const auto micros =
      std::chrono::duration_cast<std::chrono::microseconds>(clock.Wall().time_since_epoch());
  return absl::StrCat(absl::Hex(micros.count()));
}

Coordinator::Options WithMemory(Coordinator::Options options) {
  if (options.max_memory_bytes == 0) options.max_memory_bytes = AvailableMemory();
  if (options.max_job_bytes == 0) options.max_job_bytes = options.max_memory_bytes;
  return options;
}

std::uint64_t SceneBytes(const SceneManifest& manifest) {
  std::uint64_t bytes = 0;
  for (const auto& [path, file] : manifest.entries)
    bytes += file.size_bytes;
  return bytes;
}

std::uint64_t PixelsOf(const RenderSettings& settings) {
  return static_cast<std::uint64_t>(settings.crop_width()) *
         static_cast<std::uint64_t>(settings.crop_height());
}

SchedulerOptions OptionsFor(const Coordinator::Options& options) {
  SchedulerOptions scheduler;
  scheduler.audit_share = options.audit_share;
  scheduler.audit_secret = RandomBytes(kSecretBytes);
  scheduler.fixed_batch = options.batch_photons;
  scheduler.max_registrations = options.max_registrations;
  return scheduler;
}

}  // namespace

Coordinator::Coordinator(Options options, const Clock& clock, std::unique_ptr<DurableState> state)
    : options_(WithMemory(std::move(options))),
      clock_(clock),
      instance_(InstanceName(clock)),
      state_(std::move(state)),
      transfers_(clock, options_.transfers),
      budget_(options_.max_memory_bytes),
      blobs_(options_.max_store_bytes, state_ ? &state_->blobs() : nullptr, &budget_),
      scheduler_(OptionsFor(options_)),
      intake_(blobs_, options_.max_job_bytes),
      jobs_({.instance = state_ ? state_->instance() : instance_,
             .random_part = [] { return RandomId().substr(0, kRandomDigits); },
             .max_at_once = options_.jobs_at_once,
             .retention = options_.retention,
             .journal = state_.get()}) {
  // What is easily had again first, then what only a job that goes on needs.
  budget_.AddCache([this] { return blobs_.DropOldest(); });
  budget_.AddCache([this] { return jobs_.DropOldestPhotons(); });
  if (state_) {
    for (const std::string& problem : state_->problems())
      spdlog::error("{}", Escaped(problem));
    jobs_.Restore(state_->TakeJobs(), state_->next_serial(), Now());
    for (const WorkerStanding& standing : state_->TakeWorkers())
      scheduler_.RestoreStanding(standing, clock_.Steady());
    const MutexLock lock(files_mutex_);
    RemoveUnneededLocked({});
    // The limit may be a new one.
    MakeDiskRoom(0, {});
  }
  jobs_.SetLiveWorkers(0, Now());
  job_thread_ = std::thread([this] { RunJobs(); });
}

Coordinator::~Coordinator() {
  Close();
  job_thread_.join();
}

void Coordinator::StopLending() {
  is_lending_ = false;
  CountWorkers();
  // Not an error: a worker would drop what it has on its way here.
  for (const ParkedSyncs::Call& call : parked_.Close())
    call.answer(SyncAnswer{});
}

void Coordinator::CountWorkers() {
  jobs_.SetLiveWorkers(is_lending_ ? scheduler_.LiveWorkers() : 0, Now());
}

void Coordinator::Close() {
  is_closing_ = true;
  const Status why = absl::UnavailableError("the coordinator is shutting down");
  jobs_.Close(why);
  for (const ParkedSyncs::Call& call : parked_.Close())
    call.answer(why);
}

void Coordinator::Tick() {
  scheduler_.Expire(clock_.Steady());
  transfers_.Tick();
  HandleLosses();
  ShowDisputes();
  AnswerParked();
  CountWorkers();
  if (clock_.Steady() >= save_unsaved_at_) {
    save_unsaved_at_ = clock_.Steady() + kSaveUnsavedEvery;
    SaveStandings();
    if (state_) jobs_.SaveUnsaved(Now());
  }
  if (const int ended = ended_since_release_;
      ended >= kReleaseAfterJobs || (ended > 0 && clock_.Steady() >= release_at_.load())) {
    ended_since_release_ = 0;
    ReleaseFreedMemory();
  }
}

// Jobs
// ---------------------------------------------------------------------------------------------

StatusOr<JobTable::Submitted> Coordinator::Submit(const Submission& submission,
                                                  const StillNeeded& still_needed) {
  if (submission.request_id.empty() || submission.request_id.size() > 128) {
    return absl::InvalidArgumentError("a request id has 1 to 128 characters");
  }
  if (!submission.validate_only) {
    if (auto earlier = jobs_.FindRequest(submission.request_id, submission.owner)) {
      return *std::move(earlier);
    }
  }
  LUCERNA_ASSIGN_OR_RETURN(
      const MemoryClaim for_reading,
      budget_.Claim(MemoryUse::kScenes, GuessSceneMemory(SceneBytes(submission.manifest))));
  if (submission.bake) {
    LUCERNA_RETURN_IF_ERROR(CheckBake(*submission.bake, submission.overrides));
    if (submission.reference) {
      return absl::InvalidArgumentError("a bake has no reference image");
    }
  }
  Submission checked = submission;
  // The film of a bake does not count, and each round is checked with its own.
  if (submission.bake) checked.overrides.width = checked.overrides.height = 1;
  LUCERNA_ASSIGN_OR_RETURN(CheckedJob job, intake_.Check(checked, still_needed));
  job.submission.overrides = submission.overrides;
  if (submission.bake) {
    LUCERNA_RETURN_IF_ERROR(CheckBegins(job));
  }
  // Its files stay beside it.
  const std::uint64_t files = SceneBytes(submission.manifest);
  if (MemoryNeedOf(job.needs, job.settings, HeldOfScene(job.scene_memory)) + files >
      budget_.max_bytes()) {
    return absl::ResourceExhaustedError(
        "the job needs more memory than the coordinator has for all jobs; make the image or the "
        "scene smaller, or start the coordinator with a larger --max-memory");
  }
  LUCERNA_RETURN_IF_ERROR(CheckDiskNeed(job));
  if (submission.validate_only) return JobTable::Submitted{"", std::move(job.warnings)};
  StatusOr<JobTable::Submitted> submitted;
  const SteadyTime submitted_at = clock_.Steady();
  {
    const MutexLock lock(files_mutex_);
    const Status kept = KeepFiles(job);
    submitted = kept.ok() ? jobs_.Add(std::move(job), clock_.Wall(), Now()) : kept;
  }
  if (!submitted.ok()) {
    // Its files may have taken the last room.
    RemoveUnneeded();
    return submitted.status();
  }
  if (submission.is_traced) BeginTrace(submitted->job_id, submitted_at);
  spdlog::info("job {} submitted: {}", submitted->job_id, Escaped(submission.manifest.main_path));
  return submitted;
}

Status Coordinator::KeepFiles(const CheckedJob& job) {
  const Submission& submission = job.submission;
  if (!state_) return absl::OkStatus();
  std::map<Digest, Blob> files;
  std::set<Digest> digests;
  std::uint64_t missing_bytes = 0;
  const auto add = [&](const Digest& digest) -> Status {
    if (!digests.insert(digest).second) return absl::OkStatus();
    LUCERNA_ASSIGN_OR_RETURN(const Blob blob, blobs_.Get(digest));
    if (!state_->blobs().Has(digest)) missing_bytes += blob->size();
    files[digest] = blob;
    return absl::OkStatus();
  };
  for (const auto& [path, file] : submission.manifest.entries)
    LUCERNA_RETURN_IF_ERROR(add(file.digest));
  if (submission.reference) LUCERNA_RETURN_IF_ERROR(add(*submission.reference));
  JobTable::NeededFiles beside = jobs_.NeededByOpenJobs();
  beside.blobs.insert(digests.begin(), digests.end());
  if (!FitsOnDisk(missing_bytes, PixelsOf(job.settings), beside)) {
    return state_->Refusal(OverDiskLimitError("jobs that have not ended need it"));
  }
  // For all at once: what is written first belongs to no job yet.
  MakeDiskRoom(missing_bytes, digests);
  for (const auto& [digest, blob] : files) {
    if (const Status kept = state_->blobs().Put(digest, *blob); !kept.ok()) {
      return state_->Refusal(kept);
    }
  }
  return absl::OkStatus();
}

void Coordinator::RemoveUnneeded() {
  if (!state_) return;
  const MutexLock lock(files_mutex_);
  RemoveUnneededLocked({});
}

void Coordinator::RemoveUnneededLocked(const std::set<Digest>& also_needed) {
  JobTable::NeededFiles needed = jobs_.Needed();
  needed.blobs.insert(also_needed.begin(), also_needed.end());
  state_->blobs().KeepOnly(needed.blobs);
  state_->checkpoints().KeepOnly(needed.checkpoints);
}

bool Coordinator::MakeDiskRoom(std::uint64_t bytes, const std::set<Digest>& also_needed) {
  const DiskBudget& budget = state_->budget();
  if (budget.HasRoom(bytes)) return true;
  JobTable::NeededFiles lasting = jobs_.NeededByOpenJobs();
  lasting.blobs.insert(also_needed.begin(), also_needed.end());
  if (!state_->MayHaveRoom(bytes, lasting)) return false;
  // Such as files of rounds of bakes that have ended.
  RemoveUnneededLocked(also_needed);
  while (!budget.HasRoom(bytes)) {
    const std::optional<std::string> dropped = jobs_.DropOldestEnded();
    if (!dropped) return false;
    spdlog::info("job {} is removed: --max-disk has no room for it and what is new", *dropped);
    RemoveUnneededLocked(also_needed);
  }
  return true;
}

Status Coordinator::PutFile(const Digest& digest, const std::string& bytes,
                            const std::set<Digest>& also_needed) {
  if (!state_->blobs().Has(digest)) MakeDiskRoom(bytes.size(), also_needed);
  return state_->blobs().Put(digest, bytes);
}

bool Coordinator::FitsOnDisk(std::uint64_t bytes, std::uint64_t pixels,
                             const JobTable::NeededFiles& beside) const {
  // Two checkpoints of a job are kept while a third is written. Its image is smaller than one.
  constexpr std::uint64_t kCheckpointsAtOnce = 3;
  const std::uint64_t max_bytes = state_->budget().max_bytes();
  return max_bytes == 0 || state_->budget().growing_bytes() + state_->blobs().SizeOf(beside.blobs) +
                                   bytes +
                                   kCheckpointsAtOnce * CheckpointBytes(beside.pixels + pixels) <=
                               max_bytes;
}

Status Coordinator::CheckDiskNeed(const CheckedJob& job) const {
  if (!state_) return absl::OkStatus();
  const std::uint64_t files = SceneBytes(job.submission.manifest);
  if (FitsOnDisk(files, PixelsOf(job.settings), {})) return absl::OkStatus();
  constexpr double kMegabyte = 1e6;
  return absl::ResourceExhaustedError(absl::StrFormat(
      "the files (%.1f MB) and the checkpoints of the job do not fit into the %.1f MB of disk that "
      "all jobs may have; make the image or the scene smaller, or start the coordinator with a "
      "larger --max-disk",
      static_cast<double>(files) / kMegabyte,
      static_cast<double>(state_->budget().max_bytes()) / kMegabyte));
}

Status Coordinator::Delete(const std::string& job_id) {
  LUCERNA_RETURN_IF_ERROR(jobs_.Delete(job_id, Now()));
  spdlog::info("job {} is deleted", job_id);
  {
    const MutexLock lock(traces_mutex_);
    EndTrace(job_id);
  }
  RemoveUnneeded();
  return absl::OkStatus();
}

StatusOr<JobReport> Coordinator::WithWorkers(StatusOr<JobReport> report) const {
  if (report.ok()) report->workers = scheduler_.LiveWorkers();
  return report;
}

StatusOr<std::string> Coordinator::OwnerOf(const std::string& job_id) const {
  return jobs_.OwnerOf(job_id);
}

StatusOr<JobReport> Coordinator::ReportOf(const std::string& job_id) const {
  return WithWorkers(jobs_.ReportOf(job_id, Now()));
}

std::pair<std::vector<JobReport>, std::uint64_t> Coordinator::List(const JobFilter& filter,
                                                                   std::size_t count,
                                                                   std::uint64_t before) const {
  auto page = jobs_.List(filter, count, before, Now());
  const int workers = scheduler_.LiveWorkers();
  for (JobReport& report : page.first)
    report.workers = workers;
  return page;
}

StatusOr<JobReport> Coordinator::Cancel(const std::string& job_id) {
  StatusOr<JobReport> report = WithWorkers(jobs_.Cancel(job_id, Now()));
  if (!report.ok()) return report;
  spdlog::info("job {}: a cancel came", job_id);
  // What it kept is room for others. One whose turn it is has its files until the turn has ended.
  RemoveUnneeded();
  return report;
}

StatusOr<JobReport> Coordinator::Stop(const std::string& job_id) {
  return WithWorkers(jobs_.Stop(job_id, Now()));
}

StatusOr<JobReport> Coordinator::Extend(const std::string& job_id, const RenderOverrides& until) {
  StatusOr<JobReport> report = WithWorkers(jobs_.Extend(job_id, until, Now()));
  if (report.ok()) spdlog::info("job {} has a new end", job_id);
  return report;
}

StatusOr<JobReport> Coordinator::Pause(const std::string& job_id) {
  StatusOr<JobReport> report =
      WithWorkers(jobs_.Pause(job_id, PauseCause::kUser, "paused by its user", Now()));
  if (report.ok()) {
    // From now on nothing is lent, though its thread may still be in the middle of a step.
    UpdateClaim(job_id);
    spdlog::info("job {} is paused", job_id);
  }
  return report;
}

StatusOr<JobReport> Coordinator::Resume(const std::string& job_id) {
  StatusOr<JobReport> report = WithWorkers(jobs_.Resume(job_id, Now()));
  if (report.ok()) spdlog::info("job {} is resumed", job_id);
  return report;
}

StatusOr<JobReport> Coordinator::SetPriority(const std::string& job_id, int priority) {
  StatusOr<JobReport> report = WithWorkers(jobs_.SetPriority(job_id, priority, Now()));
  if (report.ok()) {
    spdlog::info("job {} has priority {}", job_id, priority);
    UpdateClaim(job_id);
  }
  return report;
}

void Coordinator::UpdateClaim(const std::string& job_id) {
  const MutexLock lock(claims_mutex_);
  const std::optional<JobTable::Share> share = jobs_.ShareOf(job_id);
  if (!share) return;
  scheduler_.SetClaim(share->run_id, {.priority = share->priority, .owner = share->owner});
  scheduler_.SetHeld(share->run_id, share->is_held);
}

StatusOr<Blob> Coordinator::ImageOf(const std::string& job_id) {
  LUCERNA_ASSIGN_OR_RETURN(const JobTable::ImageSource source, jobs_.FindImage(job_id, Now()));
  if (source.image) return source.image;
  if (source.image_digest) {
    LUCERNA_ASSIGN_OR_RETURN(std::string bytes, state_->blobs().Get(*source.image_digest));
    return std::make_shared<const std::string>(std::move(bytes));
  }
  const SteadyTime began_at = clock_.Steady();
  LUCERNA_ASSIGN_OR_RETURN(RenderResult result, source.runner->ImageSoFar());
  StatusOr<Blob> image = Encode(source, std::move(result));
  TraceOwn(job_id, "image", began_at, [] { return "image so far"; });
  return image;
}

StatusOr<Blob> Coordinator::UvMeshOf(const std::string& job_id) {
  LUCERNA_ASSIGN_OR_RETURN(const JobTable::ImageSource source, jobs_.FindImage(job_id, Now()));
  if (source.uv_mesh) return source.uv_mesh;
  const std::optional<Digest> digest =
      source.job.bake ? source.job.bake->uv_mesh : std::optional<Digest>();
  if (digest && state_) {
    LUCERNA_ASSIGN_OR_RETURN(std::string bytes, state_->blobs().Get(*digest));
    return std::make_shared<const std::string>(std::move(bytes));
  }
  return absl::FailedPreconditionError(
      absl::StrCat("job ", job_id, " made no light map, so there is no mesh of one"));
}

void Coordinator::TraceOwn(const std::string& job_id, std::string_view row, SteadyTime from,
                           const std::function<std::string()>& what) {
  if (const auto trace = FindTrace(job_id)) {
    trace->AddOwn({.row = std::string(row), .what = what(), .from = from, .to = clock_.Steady()});
  }
}

StatusOr<Blob> Coordinator::TraceOf(const std::string& job_id) {
  LUCERNA_RETURN_IF_ERROR(OwnerOf(job_id).status());
  TraceEndedLeases();
  const std::shared_ptr<JobTrace> trace = FindTrace(job_id);
  if (trace == nullptr) {
    return absl::FailedPreconditionError(absl::StrCat(
        "no timeline of job ", job_id,
        " is kept; submit it with --trace, and fetch it before the coordinator is restarted"));
  }
  return std::make_shared<const std::string>(trace->Json());
}

void Coordinator::BeginTrace(const std::string& job_id, SteadyTime submitted_at) {
  const MutexLock lock(traces_mutex_);
  if (traces_.contains(job_id)) return;
  while (traced_.size() >= kMostTraces)
    EndTrace(std::string(traced_.front()));
  traces_[job_id] = std::make_shared<JobTrace>(job_id, submitted_at);
  traced_.push_back(job_id);
  scheduler_.SetTraced(job_id, true);
  is_tracing_ = true;
}

void Coordinator::EndTrace(const std::string& job_id) {
  if (traces_.erase(job_id) == 0) return;
  std::erase(traced_, job_id);
  scheduler_.SetTraced(job_id, false);
  is_tracing_ = !traces_.empty();
}

std::shared_ptr<JobTrace> Coordinator::FindTrace(const std::string& job_id) {
  if (!is_tracing_) return nullptr;
  const MutexLock lock(traces_mutex_);
  // Of a round of a bake, by the job's own id.
  const auto found = traces_.find(job_id.substr(0, job_id.find('.')));
  return found == traces_.end() ? nullptr : found->second;
}

void Coordinator::TraceEndedLeases() {
  if (!is_tracing_) return;
  const SteadyTime now = clock_.Steady();
  for (const Scheduler::EndedLease& lease : scheduler_.TakeEnded()) {
    if (const auto trace = FindTrace(lease.job_id)) {
      trace->AddWorkers({.row = absl::StrCat(lease.record, " (", Escaped(lease.name), ")"),
                         .what = lease.work,
                         .from = lease.lent_at,
                         .to = now,
                         .details = {{"ending", lease.ending}}});
    }
  }
}

StatusOr<Coordinator::Description> Coordinator::Describe(const std::string& job_id) const {
  const std::optional<Job> job = jobs_.Find(job_id);
  if (!job) return absl::NotFoundError(absl::StrCat("there is no job ", job_id));
  return Description{ManifestOf(*job),  job->settings, job->needs,
                     job->photon_steps, job->guides,   options_.numeric_profile};
}

StatusOr<Blob> Coordinator::Encode(const JobTable::ImageSource& source, RenderResult result) const {
  // A file is one large block, for which what is free lies in too small pieces.
  ReleaseFreedMemory();
  return EncodeJobImage(source.job, std::move(result),
                        {.running = source.running,
                         .coordinator_cpu = source.cpu,
                         .finished_at = clock_.Wall(),
                         .numeric_profile = options_.numeric_profile},
                        options_.threads);
}

void Coordinator::RunJobs() {
  std::list<std::future<void>> turns;
  while (std::optional<JobTable::Turn> turn = jobs_.WaitForTurn()) {
    turns.remove_if([](const std::future<void>& under_way) {
      return under_way.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
    });
    const std::string job_id = turn->job_id;
    try {
      turns.push_back(std::async(std::launch::async, [this, turn = *std::move(turn)]() mutable {
        RunTurn(std::move(turn));
      }));
    } catch (const std::exception& no_thread) {
      static_cast<void>(jobs_.TakeBeginsAgain(job_id));
      Conclude(job_id, absl::ResourceExhaustedError(
                           absl::StrCat("the coordinator cannot begin a thread for the job (",
                                        no_thread.what(), "); submit it again later")));
    }
  }
}

void Coordinator::RunTurn(JobTable::Turn turn) {
  const std::string job_id = turn.job_id;
  StatusOr<RenderResult> result = absl::InternalError("no result");
  try {
    result = Render(turn);
    while (true) {
      if (result.ok() && result->gave_up_turn) {
        jobs_.GiveUpTurn(job_id, Now());
        return;
      }
      if (result.ok() && turn.is_bake) {
        ConcludeBake(turn, result->reason);
      } else {
        Conclude(job_id, std::move(result));
      }
      release_at_ = clock_.Steady() + kReleaseAfter;
      ++ended_since_release_;
      // Without the work of a worker whose results were wrong.
      if (!jobs_.TakeBeginsAgain(job_id)) return;
      // What was taken of the run before finds its rounds closed before new ones open.
      WaitForMerges();
      turn.runner = nullptr;
      turn.scene.reset();
      turn.bake = nullptr;
      result = Render(turn);
    }
  } catch (const std::bad_alloc&) {
    // The job alone: what it had is freed with its runner.
    static_cast<void>(jobs_.TakeBeginsAgain(job_id));
    Conclude(job_id, absl::ResourceExhaustedError(
                         "the coordinator ran out of memory while it worked on the job; make the "
                         "image or the scene smaller, or give the coordinator more memory"));
  } catch (const std::exception& error) {
    static_cast<void>(jobs_.TakeBeginsAgain(job_id));
    Conclude(job_id, absl::InternalError(absl::StrCat("rendering failed: ", error.what())));
  }
}

StatusOr<RenderResult> Coordinator::Render(JobTable::Turn& turn) {
  if (turn.is_bake) return MeasureBake(turn);
  return turn.runner ? turn.runner->Resume() : BeginRun(turn);
}

StatusOr<RenderResult> Coordinator::BeginRun(JobTable::Turn& turn) {
  LUCERNA_ASSIGN_OR_RETURN(std::optional<MemoryClaim> memory, WaitForMemory(turn));
  if (!memory) {
    RenderResult later;
    later.gave_up_turn = true;
    return later;
  }
  const SteadyTime began_at = clock_.Steady();
  ReferenceImage reference;
  if (turn.reference) {
    LUCERNA_ASSIGN_OR_RETURN(reference, intake_.ReadReference(*turn.reference, turn.settings));
  }
  if (!turn.scene) {
    LUCERNA_ASSIGN_OR_RETURN(JobIntake::ReadResult read, intake_.ReadScene(turn.manifest, [&] {
      return jobs_.CheckStillNeeded(turn.job_id);
    }));
    turn.scene = std::move(read.scene);
  }
  const std::shared_ptr<JobRunner> runner = MakeRunner(turn, *std::move(memory));
  if (!jobs_.Attach(turn.job_id, runner)) return absl::CancelledError("the job has ended");
  LUCERNA_RETURN_IF_ERROR(
      runner->Prepare(*std::move(turn.scene), turn.needs, std::move(reference)));
  RestoreCheckpoint(turn.job_id, *runner);
  TraceOwn(turn.job_id, "job", began_at, [] { return "scene is read and prepared"; });
  return runner->Resume();
}

StatusOr<std::optional<MemoryClaim>> Coordinator::WaitForMemory(const JobTable::Turn& turn) {
  const std::uint64_t scene_memory =
      turn.scene_memory > 0 ? turn.scene_memory : GuessSceneMemory(SceneBytes(turn.manifest));
  return WaitForClaim(turn, MemoryUse::kJobs,
                      MemoryNeedOf(turn.needs, turn.settings, scene_memory) +
                          (turn.bake ? turn.bake->rounds.MemoryBytes() : 0));
}

StatusOr<std::optional<MemoryClaim>> Coordinator::WaitForReading(const JobTable::Turn& turn) {
  return WaitForClaim(turn, MemoryUse::kScenes, GuessSceneMemory(SceneBytes(turn.manifest)));
}

StatusOr<std::optional<MemoryClaim>> Coordinator::WaitForClaim(const JobTable::Turn& turn,
                                                               MemoryUse use, std::uint64_t bytes) {
  bool has_waited = false;
  while (true) {
    StatusOr<MemoryClaim> claim = budget_.Claim(use, bytes);
    if (!claim.ok() && bytes + SceneBytes(turn.manifest) > budget_.max_bytes()) {
      return claim.status();
    }
    if (claim.ok()) {
      jobs_.SetWaitsForMemory(turn.job_id, "", Now());
      return std::optional<MemoryClaim>(*std::move(claim));
    }
    LUCERNA_RETURN_IF_ERROR(jobs_.CheckStillNeeded(turn.job_id));
    if (!std::exchange(has_waited, true)) {
      spdlog::info("job {} waits for memory", turn.job_id);
      jobs_.SetWaitsForMemory(turn.job_id, "waits for memory that other jobs hold", Now());
    }
    if (jobs_.GivesUpTurn(turn.job_id)) return std::optional<MemoryClaim>();
    budget_.WaitForRelease(kRetryPause);
  }
}

Blob Coordinator::Claimed(Blob image) {
  StatusOr<MemoryClaim> claim = budget_.Claim(MemoryUse::kImages, image->size());
  if (!claim.ok()) return image;
  struct Held {
    Blob image;
    MemoryClaim claim;
  };
  const std::string* const bytes = image.get();
  return {std::make_shared<Held>(Held{std::move(image), *std::move(claim)}), bytes};
}

void Coordinator::RestoreCheckpoint(const std::string& job_id, JobRunner& runner) {
  std::optional<Job> job = jobs_.Find(job_id);
  if (!job) return;
  const auto note = [&](const std::string& what) {
    spdlog::warn("job {}: {}", job_id, what);
    jobs_.AddEvent(job_id, what, Now());
  };
  const auto use = [&](const Checkpoint& checkpoint) {
    if (checkpoint.numeric_profile != options_.numeric_profile) {
      note("a checkpoint of another build is not used: its bits would differ");
      return false;
    }
    StatusOr<DecodedRecord> record = DecodeRecord(checkpoint.record, Now());
    // Of an earlier round of a bake.
    if (record.ok() && ManifestOf(record->job) != ManifestOf(*job)) return false;
    const auto has_part = [&](const std::string& worker) {
      return record->job.workers.contains(worker);
    };
    if (record.ok() && std::ranges::any_of(job->distrusted, has_part)) {
      note("a checkpoint with the work of a worker whose results were wrong is not used");
      return false;
    }
    const Status restored = record.ok() ? runner.Restore(checkpoint.sums) : record.status();
    if (!restored.ok()) {
      note(absl::StrCat("a checkpoint cannot be used: ", std::string(restored.message())));
      return false;
    }
    const std::int64_t passes = record->job.counters.passes;
    jobs_.GoOnFrom(job_id, std::move(record->job), record->running);
    jobs_.AddEvent(job_id, absl::StrCat("goes on from its checkpoint after ", passes, " passes"),
                   Now());
    spdlog::info("job {} goes on from its checkpoint after {} passes", job_id, passes);
    return true;
  };
  bool is_restored = false;
  if (state_) {
    const std::vector<std::string> damaged =
        state_->checkpoints().Read(job_id, [&](const Checkpoint& checkpoint) {
          is_restored = use(checkpoint);
          return is_restored;
        });
    for (const std::string& file : damaged)
      note(absl::StrCat("the checkpoint ", file));
  }
  if (is_restored) return;
  // A job that had ended and was given a new end begins anew: what it had counted comes again.
  if (job->counters.photons == 0 && (job->bake || job->workers.empty())) return;
  Duration ran{};
  if (job->bake) {
    ran = job->bake->rounds.back().ran_before;
    job->ClearRound();
  } else {
    job->ClearProgress();
  }
  jobs_.GoOnFrom(job_id, *std::move(job), ran);
  note("there is no checkpoint of it that can be used: it begins anew");
}

Status Coordinator::KeepCheckpoint(const std::string& job_id, std::vector<std::string_view> sums,
                                   std::int64_t passes, const BatchTally& tally) {
  std::optional<JobTable::ImageSource> run = jobs_.DescribeRun(job_id, Now());
  if (!run) return absl::OkStatus();
  // What came of rounds that are still open is not in the sums and will come again.
  run->job.counters.passes = passes;
  run->job.counters.photons = tally.photons;
  run->job.counters.tally = tally;
  run->job.counters.coordinator_cpu = run->cpu;
  const SteadyTime began_at = clock_.Steady();
  const CheckpointPieces checkpoint = {options_.numeric_profile,
                                       EncodeRecord(run->job, std::nullopt, run->running),
                                       std::move(sums)};
  const std::uint64_t size = CheckpointFiles::SizeAsFile(checkpoint);
  const std::string& id = run->job.id;
  Status written = state_->checkpoints().Write(id, checkpoint);
  if (IsOverDiskLimit(written)) {
    bool has_room = false;
    {
      const MutexLock lock(files_mutex_);
      has_room = MakeDiskRoom(size, {});
    }
    if (has_room) written = state_->checkpoints().Write(id, checkpoint);
  }
  LUCERNA_RETURN_IF_ERROR(written);
  jobs_.OnCheckpoint(job_id);
  spdlog::debug("job {}: a checkpoint of {} bytes after {} passes was written in {:.3f} s", job_id,
                size, passes, Seconds(clock_.Steady() - began_at));
  return absl::OkStatus();
}

Status Coordinator::KeepForJob(const std::string& job_id, std::vector<Blob> files,
                               const std::function<bool(const std::vector<Digest>&)>& note) {
  std::vector<Digest> digests;
  for (const Blob& file : files) {
    if (state_) digests.push_back(Sha256(*file));
  }
  const std::set<Digest> needed(digests.begin(), digests.end());
  bool has_waited = false;
  while (true) {
    Status kept;
    {
      // Until the job's row names them, nothing says that the files are needed.
      const MutexLock lock(files_mutex_);
      for (std::size_t i = 0; i < digests.size() && kept.ok(); ++i)
        kept = PutFile(digests[i], *files[i], needed);
      if (kept.ok()) {
        if (!note(digests)) return absl::CancelledError("the job has ended");
        if (has_waited) jobs_.SetCondition(job_id, PauseCause::kDisk, "", Now());
        return absl::OkStatus();
      }
    }
    has_waited = true;
    const std::string condition = state_->PauseCondition(kept);
    spdlog::warn("job {} {}", job_id, condition);
    jobs_.SetCondition(job_id, PauseCause::kDisk, condition, Now());
    for (int i = 0; i < kPausesBeforeRetry; ++i) {
      LUCERNA_RETURN_IF_ERROR(jobs_.CheckStillNeeded(job_id));
      std::this_thread::sleep_for(kRetryPause);
    }
  }
}

Status Coordinator::EndWell(const std::string& job_id, StopReason reason, const Blob& image) {
  return KeepForJob(job_id, {image}, [&](const std::vector<Digest>& digests) {
    return jobs_.Succeed(job_id, reason, image, Now(),
                         digests.empty() ? std::nullopt : std::optional(digests.front()));
  });
}

std::shared_ptr<JobRunner> Coordinator::MakeRunner(const JobTable::Turn& turn, MemoryClaim memory) {
  const std::string id = turn.run_id;
  return std::make_shared<JobRunner>(
      id, turn.settings, options_.threads,
      RunnerHooks{
          .blobs = blobs_,
          .scheduler = scheduler_,
          .passes = passes_,
          .rounds = rounds_,
          .clock = clock_,
          .memory = std::make_shared<MemoryClaim>(std::move(memory)),
          .claim_memory =
              [this](std::uint64_t bytes) { return budget_.Claim(MemoryUse::kJobs, bytes); },
          .always_splits = options_.batch_photons > 0,
          .on_running =
              [this, id] {
                jobs_.OnRunning(id, Now());
                UpdateClaim(id);
              },
          .on_warning =
              [this, id, warns = turn.warns](std::string warning) {
                if (warns) jobs_.OnWarning(id, std::move(warning));
              },
          .on_photon_steps = [this,
                              id](PhotonSteps steps) { jobs_.OnPhotonSteps(id, std::move(steps)); },
          .on_guides = [this, id](GuideSteps guides) { jobs_.OnGuides(id, std::move(guides)); },
          .on_work_opened = [this] { AnswerParked(); },
          .on_progress = [this, id](std::int64_t passes) { jobs_.OnProgress(id, passes); },
          .on_round_merged = [this, id](
                                 const BatchTally& tally,
                                 std::int64_t passes) { jobs_.OnRoundMerged(id, tally, passes); },
          .on_tail = [this, id](const BatchTally& tally,
                                std::int64_t passes) { jobs_.OnTail(id, tally, passes); },
          .on_error_estimate =
              [this, id](const ErrorCheckpoint& checkpoint) {
                ErrorSample sample;
                sample.passes = checkpoint.passes;
                sample.photons = checkpoint.photons;
                sample.estimate = checkpoint.estimate;
                sample.truth = checkpoint.truth;
                sample.missing_relative = checkpoint.missing.relative;
                sample.nothing_found = checkpoint.missing.nothing_found;
                jobs_.OnErrorEstimate(id, std::move(sample), checkpoint.missing.lights, Now());
              },
          .on_denoised = [this,
                          id](const DenoisedSample& denoised) { jobs_.OnDenoised(id, denoised); },
          .on_checkpoint =
              state_ ? [this, id](
                           std::vector<std::string_view> sums, std::int64_t passes,
                           const BatchTally&
                               tally) { return KeepCheckpoint(id, std::move(sums), passes, tally); }
                     : std::function<Status(std::vector<std::string_view>, std::int64_t,
                                            const BatchTally&)>(),
          .checkpoint_share = options_.checkpoint_share,
          .on_timed =
              [this, id](std::string_view row, SteadyTime from,
                         const std::function<std::string()>& what) {
                TraceOwn(id, row, from, what);
              },
          .on_pause =
              [this, id](const Status& why) {
                const std::string condition = why.ok() ? "" : state_->PauseCondition(why);
                spdlog::warn("job {} {}", id, why.ok() ? "goes on" : condition);
                jobs_.SetCondition(id, PauseCause::kDisk, condition, Now());
              },
          .running = [this, id] { return jobs_.RunningOf(id, clock_.Steady()); },
          .when_it_has_run = [this, id](Duration time) { return jobs_.WhenItHasRun(id, time); },
      });
}

void Coordinator::Conclude(const std::string& job_id, StatusOr<RenderResult> result) {
  Status failure = result.status();
  if (result.ok()) {
    const StopReason reason = result->reason;
    const std::int64_t passes = result->passes;
    const std::optional<JobTable::ImageSource> source = jobs_.DescribeRun(job_id, Now());
    if (!source) return;
    const SteadyTime began_at = clock_.Steady();
    StatusOr<Blob> image = Encode(*source, *std::move(result));
    TraceOwn(job_id, "image", began_at,
             [&] { return absl::StrCat("image of ", passes, " passes"); });
    failure = image.ok() ? EndWell(job_id, reason, Claimed(*image)) : image.status();
    if (failure.ok()) {
      spdlog::info("job {} succeeded after {} passes and {:.1f} s", job_id, passes,
                   Seconds(source->running));
      FailPoint("job.ended");
      RemoveUnneeded();
      return;
    }
  }
  ConcludeFailed(job_id, failure);
}

void Coordinator::ConcludeFailed(const std::string& job_id, const Status& failure) {
  if (jobs_.BeginsAgain(job_id)) return;
  if (state_ && is_closing_) {
    spdlog::info("job {} goes on when the coordinator is started again", job_id);
    return;
  }
  jobs_.Fail(job_id, failure, Now());
  spdlog::info("job {} ended: {}", job_id, Escaped(std::string(failure.message())));
  RemoveUnneeded();
}

}  // namespace lucerna
