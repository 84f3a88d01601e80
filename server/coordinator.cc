#include "server/coordinator.h"

#include <algorithm>
#include <ctime>
#include <utility>

#include "absl/strings/str_format.h"
#include <spdlog/spdlog.h>

#include "render/base/memory.h"
#include "render/formats/read_scene.h"
#include "render/image/exr_file.h"
#include "server/memory_need.h"
#include "server/reference_image.h"

namespace lucerna {
namespace {

constexpr std::size_t kMostWaitingJobs = 256;
constexpr std::size_t kJobsRemembered = 1000;  // ended ones
// Of ended jobs whose photons are kept, so that they can go on; the newest counts as none. At some
// 700 bytes a pixel.
constexpr std::int64_t kPixelsRemembered = std::int64_t{1} << 21;
constexpr std::size_t kImagesRemembered = 64;
constexpr std::size_t kImageBytesRemembered = std::size_t{2} << 30;  // the newest counts as none
constexpr Duration kLongestSync = std::chrono::seconds(5);

std::string UtcText(WallTime time) {
  const std::time_t seconds = std::chrono::system_clock::to_time_t(
      std::chrono::time_point_cast<std::chrono::system_clock::duration>(time));
  std::tm parts{};
  gmtime_r(&seconds, &parts);
  return absl::StrFormat("%04d-%02d-%02dT%02d:%02d:%02dZ", parts.tm_year + 1900, parts.tm_mon + 1,
                         parts.tm_mday, parts.tm_hour, parts.tm_min, parts.tm_sec);
}

// Different for every start of a coordinator on one machine.
std::string InstanceName(const Clock& clock) {
  const auto micros =
      std::chrono::duration_cast<std::chrono::microseconds>(clock.Wall().time_since_epoch());
  return absl::StrCat(absl::Hex(micros.count()));
}

Coordinator::Options WithMemory(Coordinator::Options options) {
  if (options.max_job_bytes == 0) options.max_job_bytes = AvailableMemory();
  return options;
}

SchedulerOptions OptionsFor(const Coordinator::Options& options, const std::string& instance) {
  SchedulerOptions scheduler;
  scheduler.instance = absl::StrCat("w", instance);
  scheduler.fixed_batch = options.batch_photons;
  return scheduler;
}

}  // namespace

Coordinator::Coordinator(Options options, const Clock& clock)
    : options_(WithMemory(std::move(options))),
      clock_(clock),
      instance_(InstanceName(clock)),
      blobs_(options_.max_store_bytes),
      scheduler_(OptionsFor(options_, instance_)),
      job_thread_([this] { RunJobs(); }) {}

Coordinator::~Coordinator() {
  Close();
  job_thread_.join();
}

void Coordinator::Close() {
  std::shared_ptr<JobRunner> runner;
  {
    const MutexLock lock(mutex_);
    is_closed_ = true;
    if (current_) runner = current_->runner;
    job_waits_.NotifyAll();
  }
  const Status why = absl::UnavailableError("the coordinator is shutting down");
  if (runner) runner->Stop(why);
  std::map<std::uint64_t, WaitingSync> waiting;
  {
    const MutexLock lock(waiting_mutex_);
    syncs_closed_ = true;
    waiting.swap(waiting_);
  }
  for (auto& [ticket, sync] : waiting)
    sync.answer(why);
}

// Jobs
// ---------------------------------------------------------------------------------------------

StatusOr<std::pair<Scene, std::vector<std::string>>> Coordinator::ReadScene(
    const SceneManifest& manifest) {
  ManifestFiles files(manifest, [this](const Digest& digest) -> StatusOr<std::string> {
    LUCERNA_ASSIGN_OR_RETURN(const Blob blob, blobs_.Get(digest));
    return *blob;
  });
  ParsedScene parsed = lucerna::ReadScene(files, manifest.main_path);
  LUCERNA_RETURN_IF_ERROR(parsed.ToStatus());
  std::vector<std::string> warnings;
  for (const Diagnostic& diagnostic : parsed.diagnostics)
    warnings.push_back(diagnostic.ToString());
  return std::pair(std::move(parsed.scene), std::move(warnings));
}

StatusOr<Coordinator::Submitted> Coordinator::Submit(const Submission& submission) {
  if (submission.request_id.empty() || submission.request_id.size() > 128) {
    return absl::InvalidArgumentError("a request id has 1 to 128 characters");
  }
  const auto find_earlier = [&]() LUCERNA_REQUIRES(mutex_) -> std::optional<Submitted> {
    for (const auto& [serial, entry] : jobs_) {
      if (entry->request_id == submission.request_id) {
        return Submitted{entry->job.id, entry->job.warnings};
      }
    }
    return std::nullopt;
  };
  if (!submission.validate_only) {
    const MutexLock lock(mutex_);
    if (auto earlier = find_earlier()) return *std::move(earlier);
  }

  // Pinned before the scene is read, so that nothing vanishes until the job has ended.
  std::vector<Digest> pinned;
  const auto unpin = [&] {
    for (const Digest& digest : pinned)
      blobs_.Unpin(digest);
  };
  std::size_t missing = 0;
  for (const auto& [path, file] : submission.manifest.entries) {
    if (blobs_.Pin(file.digest).ok()) {
      pinned.push_back(file.digest);
    } else {
      ++missing;
    }
  }
  if (missing > 0) {
    unpin();
    return absl::FailedPreconditionError(
        absl::StrCat(missing, " of the scene's ", submission.manifest.entries.size(),
                     " files are not here yet; upload them and submit again"));
  }
  auto read = ReadScene(submission.manifest);
  if (!read.ok()) {
    unpin();
    return read.status();
  }
  auto& [scene, warnings] = *read;
  const StatusOr<RenderSettings> settings = ResolveSettings(submission.overrides, scene);
  if (!settings.ok()) {
    unpin();
    return settings.status();
  }
  const SceneNeeds needs = NeedsOf(scene, *settings);
  if (Status fits = CheckMemory(needs, *settings, options_.max_job_bytes); !fits.ok()) {
    unpin();
    return fits;
  }
  if (submission.reference) {
    if (!blobs_.Pin(*submission.reference).ok()) {
      unpin();
      return absl::FailedPreconditionError(
          "the reference image is not here yet; upload it and submit again");
    }
    pinned.push_back(*submission.reference);
    const StatusOr<Blob> bytes = blobs_.Get(*submission.reference);
    const auto reference = bytes.ok() ? ReadReference(**bytes, *settings) : bytes.status();
    if (!reference.ok()) {
      unpin();
      return reference.status();
    }
  }
  Submitted submitted;
  submitted.warnings = warnings;
  if (submission.validate_only) {
    unpin();
    return submitted;
  }

  const MutexLock lock(mutex_);
  // The same request may have come twice at once.
  if (auto earlier = find_earlier()) {
    unpin();
    return *std::move(earlier);
  }
  if (is_closed_ || queue_.size() >= kMostWaitingJobs) {
    unpin();
    if (is_closed_) return absl::UnavailableError("the coordinator is shutting down");
    return absl::ResourceExhaustedError(
        absl::StrCat(queue_.size(), " jobs are waiting already; try again later"));
  }
  const std::uint64_t serial = next_serial_++;
  // Until Unpin.
  auto entry = std::make_shared<JobEntry>();
  entry->serial = serial;
  entry->request_id = submission.request_id;
  entry->pinned = std::move(pinned);
  Job& job = entry->job;
  job.id = absl::StrCat(instance_, "-", serial);
  job.name = submission.name.empty() ? submission.manifest.main_path : submission.name;
  job.manifest = submission.manifest;
  job.scene_digest = submission.manifest.SceneDigest();
  job.settings = *settings;
  job.warnings = std::move(warnings);
  job.needs = needs;
  job.submitted_at = clock_.Wall();
  job.life = JobLife(clock_.Steady());
  job.reference = submission.reference;
  // A job that must wait is read again later, so that waiting jobs cost no memory.
  if (queue_.empty() && !current_) entry->scene = std::move(scene);
  submitted.job_id = entry->job.id;
  jobs_.emplace(serial, entry);
  queue_.push_back(std::move(entry));
  job_waits_.NotifyAll();
  spdlog::info("job {} submitted: {}", submitted.job_id, submission.manifest.main_path);
  return submitted;
}

std::shared_ptr<Coordinator::JobEntry> Coordinator::Find(const std::string& job_id) const {
  for (const auto& [serial, entry] : jobs_) {
    if (entry->job.id == job_id) return entry;
  }
  return nullptr;
}

namespace {

Status UnknownJob(const std::string& job_id) {
  return absl::NotFoundError(absl::StrCat("there is no job ", job_id));
}

}  // namespace

Coordinator::Report Coordinator::MakeReport(const JobEntry& entry) const {
  Report report;
  report.job = entry.job;
  report.version = entry.version;
  report.workers = scheduler_.LiveWorkers();
  const SteadyTime now = clock_.Steady();
  const JobLife& life = entry.job.life;
  report.running = life.Running(now);
  if (life.state() == JobState::kRunning) {
    report.photons_per_second = entry.job.books.rate.PerSecond(now - report.running, now);
    report.job.books.coordinator_cpu = ProcessCpuTime() - entry.cpu_at_start;
  } else if (life.has_ended() && report.running > Duration::zero()) {
    report.photons_per_second =
        static_cast<double>(entry.job.books.photons) / Seconds(report.running);
  }
  return report;
}

StatusOr<Coordinator::Report> Coordinator::ReportOf(const std::string& job_id) const {
  const MutexLock lock(mutex_);
  const auto entry = Find(job_id);
  if (!entry) return UnknownJob(job_id);
  return MakeReport(*entry);
}

std::pair<std::vector<Coordinator::Report>, std::uint64_t> Coordinator::List(
    std::size_t count, std::uint64_t before) const {
  const MutexLock lock(mutex_);
  std::pair<std::vector<Report>, std::uint64_t> page;
  auto end = before == 0 ? jobs_.end() : jobs_.lower_bound(before);
  while (end != jobs_.begin() && page.first.size() < count) {
    --end;
    page.first.push_back(MakeReport(*end->second));
  }
  page.second = end == jobs_.begin() ? 0 : end->first;
  return page;
}

StatusOr<Coordinator::Report> Coordinator::Cancel(const std::string& job_id) {
  std::shared_ptr<JobRunner> runner;
  std::shared_ptr<JobEntry> entry;
  {
    const MutexLock lock(mutex_);
    entry = Find(job_id);
    if (!entry) return UnknownJob(job_id);
    if (!entry->job.life.has_ended()) runner = entry->runner;
  }
  const Status why = absl::CancelledError("the user cancelled the job");
  if (runner) runner->Stop(why);
  EndJob(entry, why);
  const MutexLock lock(mutex_);
  return MakeReport(*entry);
}

StatusOr<Coordinator::Report> Coordinator::Stop(const std::string& job_id) {
  const MutexLock lock(mutex_);
  const auto entry = Find(job_id);
  if (!entry) return UnknownJob(job_id);
  if (!entry->job.life.has_ended()) {
    if (!entry->runner) {
      return absl::FailedPreconditionError(absl::StrCat(
          "job ", job_id, " has not begun to run and has no image; cancel it instead"));
    }
    entry->runner->Finish();
  }
  return MakeReport(*entry);
}

StatusOr<Coordinator::Report> Coordinator::Extend(const std::string& job_id,
                                                  const RenderOverrides& until) {
  const MutexLock lock(mutex_);
  const auto entry = Find(job_id);
  if (!entry) return UnknownJob(job_id);
  Job& job = entry->job;
  RenderSettings settings = job.settings;
  LUCERNA_RETURN_IF_ERROR(SetStopCriteria(until, settings));
  if (job.life.has_ended()) {
    if (job.life.state() != JobState::kSucceeded) {
      return absl::FailedPreconditionError(
          absl::StrCat("job ", job_id, " was cancelled or failed; submit it again"));
    }
    if (!entry->runner || is_closed_) {
      return absl::FailedPreconditionError(absl::StrCat(
          "job ", job_id,
          " ended so long ago that its photons are not kept any more; submit it again"));
    }
    job.life.Extend();
    // The image grows from now on.
    entry->image = nullptr;
    queue_.push_back(entry);
    job_waits_.NotifyAll();
  }
  job.settings = settings;
  if (entry->runner) entry->runner->SetEnd(settings);
  ++entry->version;
  spdlog::info("job {} has a new end", job_id);
  return MakeReport(*entry);
}

StatusOr<Blob> Coordinator::ImageOf(const std::string& job_id) {
  std::shared_ptr<JobRunner> runner;
  std::optional<Job> job;
  Duration running{};
  Duration cpu{};
  {
    const MutexLock lock(mutex_);
    const auto entry = Find(job_id);
    if (!entry) return UnknownJob(job_id);
    if (entry->image) return entry->image;
    if (entry->job.life.has_ended()) {
      return absl::FailedPreconditionError(absl::StrCat(
          "job ", job_id,
          entry->job.life.state() == JobState::kSucceeded
              ? " ended so long ago that its image is not kept any more; submit it again"
              : " was cancelled or failed and has no image"));
    }
    runner = entry->runner;
    job = entry->job;
    running = entry->job.life.Running(clock_.Steady());
    cpu = ProcessCpuTime() - entry->cpu_at_start;
  }
  if (!runner) {
    return absl::FailedPreconditionError(
        absl::StrCat("job ", job_id, " has not begun to run; ask again later"));
  }
  LUCERNA_ASSIGN_OR_RETURN(JobRunner::Result result, runner->ImageSoFar());
  return Encode(*job, std::move(result), running, cpu);
}

StatusOr<Blob> Coordinator::Encode(const Job& job, JobRunner::Result result, Duration running,
                                   Duration coordinator_cpu) const {
  std::map<std::string, std::string>& metadata = result.image.metadata;
  metadata["lucerna.scene_digest"] = job.scene_digest.Hex();
  metadata["lucerna.settings"] = SettingsText(job.settings);
  metadata["lucerna.seed"] = absl::StrCat(job.settings.seed);
  metadata["lucerna.passes"] = absl::StrCat(result.passes);
  metadata["lucerna.photons"] = absl::StrCat(result.photons);
  metadata["lucerna.numeric_profile"] = options_.numeric_profile;
  metadata["lucerna.run.seconds"] = absl::StrFormat("%.3f", Seconds(running));
  metadata["lucerna.run.cpu_seconds"] =
      absl::StrFormat("%.3f", Seconds(coordinator_cpu + job.books.worker_cpu));
  metadata["lucerna.run.workers"] = absl::StrCat(job.most_workers);
  metadata["lucerna.run.finished_at"] = UtcText(clock_.Wall());
  LUCERNA_ASSIGN_OR_RETURN(std::string bytes, EncodeExr(result.image));
  return std::make_shared<const std::string>(std::move(bytes));
}

void Coordinator::RunJobs() {
  while (true) {
    std::shared_ptr<JobEntry> entry;
    {
      const MutexLock lock(mutex_);
      current_ = nullptr;
      while (queue_.empty() && !is_closed_)
        job_waits_.Wait(mutex_);
      if (is_closed_) return;
      entry = queue_.front();
      queue_.pop_front();
      // Cancelled while it waited.
      if (!entry->job.life.Prepare()) continue;
      current_ = entry;
      ++entry->version;
    }
    RunJob(entry);
    const MutexLock lock(mutex_);
    if (!entry->runner) Unpin(*entry);
  }
}

void Coordinator::RunJob(const std::shared_ptr<JobEntry>& entry) {
  std::optional<Scene> scene;
  RenderSettings settings;
  std::optional<Digest> reference_digest;
  std::shared_ptr<JobRunner> runner;
  {
    const MutexLock lock(mutex_);
    scene = std::exchange(entry->scene, std::nullopt);
    settings = entry->job.settings;
    reference_digest = entry->job.reference;
    runner = entry->runner;
  }
  if (runner) return Conclude(entry, runner->Resume());
  ReferenceImage reference;
  if (reference_digest) {
    const StatusOr<Blob> bytes = blobs_.Get(*reference_digest);
    auto read = bytes.ok() ? ReadReference(**bytes, settings) : bytes.status();
    if (!read.ok()) return EndJob(entry, read.status());
    reference = *std::move(read);
  }
  if (!scene) {
    auto read = ReadScene(entry->job.manifest);
    if (!read.ok()) return EndJob(entry, read.status());
    scene = std::move(read->first);
  }
  runner = std::make_shared<JobRunner>(
      entry->job.id, settings, options_.threads,
      JobRunner::Surroundings{
          .blobs = blobs_,
          .scheduler = scheduler_,
          .merger = merger_,
          .clock = clock_,
          .when_running =
              [this, entry] {
                const MutexLock lock(mutex_);
                entry->job.life.Run(clock_.Steady());
                entry->cpu_at_start = ProcessCpuTime() - entry->job.books.coordinator_cpu;
                ++entry->version;
              },
          .when_warned =
              [this, entry](std::string warning) {
                const MutexLock lock(mutex_);
                entry->job.warnings.push_back(std::move(warning));
                ++entry->version;
              },
          .when_pass_opened = [this] { AnswerWaiting(); },
          .when_pass_merged =
              [this, entry](std::int64_t passes, const BatchTally& of_pass) {
                const MutexLock lock(mutex_);
                entry->job.books.passes = passes;
                entry->job.pass_record.Add(of_pass);
                ++entry->version;
              },
          .when_looked =
              [this, entry](const JobRunner::Look& look) {
                const MutexLock lock(mutex_);
                const JobBooks& books = entry->job.books;
                entry->job.convergence.push_back(
                    {look.passes, look.photons, entry->job.life.Running(clock_.Steady()),
                     ProcessCpuTime() - entry->cpu_at_start + books.worker_cpu, look.estimate,
                     look.truth, look.missing.relative, look.missing.nothing_found});
                entry->job.lights = look.missing.lights;
                ++entry->version;
              },
      });
  {
    const MutexLock lock(mutex_);
    // A cancel or the end of the coordinator may have come before there was a runner to tell.
    if (entry->job.life.has_ended() || is_closed_) return;
    // The end may have been changed since the settings were read.
    runner->SetEnd(entry->job.settings);
    entry->runner = runner;
  }
  Conclude(entry, runner->Run(*std::move(scene), entry->job.needs, std::move(reference)));
}

void Coordinator::Conclude(const std::shared_ptr<JobEntry>& entry,
                           StatusOr<JobRunner::Result> result) {
  if (!result.ok()) return EndJob(entry, result.status());

  const StopReason reason = result->reason;
  std::optional<Job> job;
  Duration running{};
  Duration cpu{};
  {
    const MutexLock lock(mutex_);
    job = entry->job;
    running = entry->job.life.Running(clock_.Steady());
    cpu = ProcessCpuTime() - entry->cpu_at_start;
  }
  StatusOr<Blob> image = Encode(*job, *std::move(result), running, cpu);
  if (!image.ok()) return EndJob(entry, image.status());
  const MutexLock lock(mutex_);
  if (!entry->job.life.Succeed(reason, clock_.Steady())) return;
  entry->job.books.coordinator_cpu = ProcessCpuTime() - entry->cpu_at_start;
  entry->image = *std::move(image);
  ++entry->version;
  ForgetOldJobs();
  spdlog::info("job {} succeeded after {} passes and {:.1f} s", entry->job.id,
               entry->job.books.passes, Seconds(running));
}

void Coordinator::EndJob(const std::shared_ptr<JobEntry>& entry, const Status& failure) {
  {
    const MutexLock lock(mutex_);
    const bool was_waiting = entry->job.life.state() == JobState::kQueued;
    const bool was_running = entry->job.life.state() == JobState::kRunning;
    const bool has_ended =
        absl::IsCancelled(failure)
            ? entry->job.life.Cancel(clock_.Steady())
            : entry->job.life.Fail(std::string(failure.message()), clock_.Steady());
    if (!has_ended) return;
    if (was_running) entry->job.books.coordinator_cpu = ProcessCpuTime() - entry->cpu_at_start;
    entry->scene = std::nullopt;
    entry->runner = nullptr;
    ++entry->version;
    // One that was being rendered gives its files back when its thread is done with them.
    if (was_waiting) {
      std::erase(queue_, entry);
      Unpin(*entry);
    }
    ForgetOldJobs();
  }
  spdlog::info("job {} ended: {}", entry->job.id, std::string(failure.message()));
}

void Coordinator::Unpin(JobEntry& entry) {
  for (const Digest& digest : std::exchange(entry.pinned, {}))
    blobs_.Unpin(digest);
}

void Coordinator::ForgetOldJobs() {
  std::size_t ended = 0;
  std::size_t runners = 0;
  std::int64_t pixels = 0;
  std::size_t images = 0;
  std::size_t image_bytes = 0;
  std::vector<std::uint64_t> forgotten;
  for (auto entry = jobs_.rbegin(); entry != jobs_.rend(); ++entry) {
    if (!entry->second->job.life.has_ended()) continue;
    if (++ended > kJobsRemembered) forgotten.push_back(entry->first);
    if (entry->second->runner) {
      const RenderSettings& settings = entry->second->job.settings;
      if (++runners > 1) {
        pixels += std::int64_t{settings.crop_width()} * std::int64_t{settings.crop_height()};
      }
      // The one that has just ended is still in use by its thread, which then gives its files back.
      if (pixels > kPixelsRemembered || ended > kJobsRemembered) {
        entry->second->runner = nullptr;
        if (entry->second != current_) Unpin(*entry->second);
      }
    }
    if (!entry->second->image) continue;
    if (++images > 1) image_bytes += entry->second->image->size();
    if (images > kImagesRemembered || image_bytes > kImageBytesRemembered) {
      entry->second->image = nullptr;
    }
  }
  for (const std::uint64_t serial : forgotten)
    jobs_.erase(serial);
}

// Workers
// ------------------------------------------------------------------------------------------

StatusOr<std::string> Coordinator::Register(const std::string& name, int threads,
                                            const std::string& numeric_profile) {
  if (name.size() > 256) return absl::InvalidArgumentError("a worker's name is too long");
  if (numeric_profile != options_.numeric_profile) {
    return absl::FailedPreconditionError(absl::StrCat(
        "worker ", name, " has the numeric profile \"", numeric_profile.substr(0, 1024),
        "\" and this coordinator \"", options_.numeric_profile,
        "\"; their bits would differ, run the same build on both"));
  }
  std::string id = scheduler_.AddWorker(name, clock_.Steady());
  spdlog::info("worker {} joined: {} with {} threads", id, name, threads);
  return id;
}

std::optional<StatusOr<Coordinator::SyncAnswer>> Coordinator::TryAnswer(
    const std::string& worker, const Scheduler::Report& report) {
  StatusOr<Scheduler::Answer> told = scheduler_.Tell(worker, report, clock_.Steady());
  if (!told.ok()) return told.status();
  if (told->empty()) return std::nullopt;
  SyncAnswer answer;
  answer.revoked = std::move(told->revoked);
  if (told->lease) {
    const MutexLock lock(mutex_);
    const auto entry = Find(told->lease->pass.job_id);
    const auto blobs =
        entry && entry->runner ? entry->runner->BlobsOf(told->lease->pass.pass) : std::nullopt;
    if (blobs) {
      entry->job.most_workers = std::max(entry->job.most_workers, scheduler_.LiveWorkers());
      answer.loan = {*std::move(told->lease), entry->job.manifest, entry->job.settings,
                     entry->job.needs, *blobs};
    }
    // Else the pass ended this moment, and its lease with it.
  }
  if (!answer.loan && answer.revoked.empty()) return std::nullopt;
  return answer;
}

std::uint64_t Coordinator::Sync(const std::string& worker, Scheduler::Report report, Duration wait,
                                AnswerSync answer) {
  const SteadyTime now = clock_.Steady();
  if (const Status heard = scheduler_.Hear(worker, report, now); !heard.ok()) {
    answer(heard);
    return 0;
  }
  StopPoisonedJobs();
  // What came back with this report may be what others wait for.
  if (report.wants_lease || !report.failures.empty()) AnswerWaiting();
  report.failures.clear();
  if (auto ready = TryAnswer(worker, report)) {
    answer(*std::move(ready));
    return 0;
  }
  if (wait <= Duration::zero()) {
    answer(SyncAnswer{});
    return 0;
  }
  std::uint64_t ticket = 0;
  {
    const MutexLock lock(waiting_mutex_);
    if (!syncs_closed_) {
      ticket = next_ticket_++;
      waiting_.emplace(ticket, WaitingSync{worker, std::move(report),
                                           now + std::min(wait, kLongestSync), answer});
    }
  }
  if (ticket == 0) answer(absl::UnavailableError("the coordinator is shutting down"));
  // A change between the try and the wait is found by the next tick.
  return ticket;
}

void Coordinator::SyncBroke(std::uint64_t ticket) {
  std::optional<WaitingSync> broken;
  {
    const MutexLock lock(waiting_mutex_);
    const auto found = waiting_.find(ticket);
    if (found == waiting_.end()) return;
    if (found->second.is_being_tried) {
      found->second.is_broken = true;
      return;
    }
    broken = std::move(found->second);
    waiting_.erase(found);
  }
  EndBroken(*broken);
  AnswerWaiting();
}

void Coordinator::EndBroken(const WaitingSync& broken) {
  spdlog::info("worker {} vanished", broken.worker);
  scheduler_.LoseWorker(broken.worker);
  broken.answer(absl::CancelledError("the connection broke"));
  StopPoisonedJobs();
}

void Coordinator::AnswerWaiting() {
  std::vector<std::uint64_t> tickets;
  {
    const MutexLock lock(waiting_mutex_);
    for (const auto& [ticket, sync] : waiting_)
      tickets.push_back(ticket);
  }
  for (const std::uint64_t ticket : tickets) {
    std::string worker;
    Scheduler::Report report;
    {
      const MutexLock lock(waiting_mutex_);
      const auto found = waiting_.find(ticket);
      if (found == waiting_.end() || found->second.is_being_tried) continue;
      found->second.is_being_tried = true;
      worker = found->second.worker;
      report = found->second.report;
    }
    auto ready = TryAnswer(worker, report);
    std::optional<WaitingSync> ended;
    {
      const MutexLock lock(waiting_mutex_);
      const auto found = waiting_.find(ticket);
      // Close has answered it.
      if (found == waiting_.end()) continue;
      found->second.is_being_tried = false;
      if (ready || found->second.is_broken || found->second.until <= clock_.Steady()) {
        ended = std::move(found->second);
        waiting_.erase(found);
      }
    }
    if (!ended) continue;
    if (ended->is_broken) {
      EndBroken(*ended);
    } else {
      ended->answer(ready ? *std::move(ready) : SyncAnswer{});
    }
  }
}

StatusOr<Blob> Coordinator::Fetch(const Digest& digest) {
  LUCERNA_ASSIGN_OR_RETURN(Blob blob, blobs_.Get(digest));
  const MutexLock lock(mutex_);
  if (!current_ || !current_->runner) return blob;
  if (const auto hitpoints = current_->runner->HitpointsIn(digest)) {
    current_->job.books.bytes_sent += blob->size();
    current_->job.books.hitpoints_sent += *hitpoints;
  }
  return blob;
}

StatusOr<PassMerger::Outcome> Coordinator::Commit(const Delivery& delivery,
                                                  const Accumulation& accumulation) {
  LUCERNA_ASSIGN_OR_RETURN(const PassMerger::Outcome outcome,
                           merger_.Merge(delivery.pass, delivery.range, accumulation));
  if (outcome != PassMerger::Outcome::kAccepted) return outcome;
  scheduler_.Commit(delivery.pass, delivery.range, clock_.Steady());
  std::shared_ptr<JobRunner> runner;
  {
    const MutexLock lock(mutex_);
    if (const auto entry = Find(delivery.pass.job_id)) {
      const SteadyTime now = clock_.Steady();
      JobBooks& books = entry->job.books;
      if (!books.to_first_photons) books.to_first_photons = now - entry->job.life.submitted_at();
      books.photons += accumulation.tally.photons;
      books.tally += accumulation.tally;
      books.NameDropped(delivery.pass.pass, accumulation.dropped_photons);
      books.worker_cpu = SaturatingSum(books.worker_cpu, delivery.cpu);
      books.bytes_received += delivery.size_bytes;
      books.hitpoints_returned += accumulation.size();
      books.rate.Add(accumulation.tally.photons, now);
      WorkerShare& share = entry->job.workers[delivery.worker];
      if (share.name.empty()) share.name = scheduler_.NameOf(delivery.worker);
      share.photons += accumulation.tally.photons;
      share.batches += 1;
      share.cpu = SaturatingSum(share.cpu, delivery.cpu);
      ++entry->version;
      runner = entry->runner;
      const BatchTally& tally = accumulation.tally;
      if (tally.dropped > 0 || tally.excess > 0) {
        spdlog::warn(
            "job {}, pass {}: {} photons that were not finite and {} contributions that were too "
            "bright are left out",
            entry->job.id, delivery.pass.pass, tally.dropped, tally.excess);
      }
    }
  }
  if (runner) runner->Wake();
  return outcome;
}

StatusOr<Coordinator::Description> Coordinator::Describe(const std::string& job_id) const {
  const MutexLock lock(mutex_);
  const auto entry = Find(job_id);
  if (!entry) return UnknownJob(job_id);
  return Description{entry->job.manifest, entry->job.settings, entry->job.needs,
                     options_.numeric_profile};
}

void Coordinator::Goodbye(const std::string& worker) {
  spdlog::info("worker {} left", worker);
  scheduler_.RemoveWorker(worker);
  AnswerWaiting();
}

void Coordinator::StopPoisonedJobs() {
  for (const Scheduler::Poisoned& poisoned : scheduler_.TakePoisoned()) {
    std::shared_ptr<JobRunner> runner;
    {
      const MutexLock lock(mutex_);
      if (const auto entry = Find(poisoned.pass.job_id)) runner = entry->runner;
    }
    if (runner) runner->Stop(absl::AbortedError(poisoned.message));
  }
}

void Coordinator::Tick() {
  scheduler_.Expire(clock_.Steady());
  StopPoisonedJobs();
  AnswerWaiting();
}

}  // namespace lucerna
