#include "server/job_table.h"

#include <algorithm>
#include <charconv>
#include <utility>

#include "server/memory_need.h"

namespace lucerna {
namespace {

bool IsNamed(const Job& job, const std::string& id) {
  return job.id == id || (job.bake && RunIdOf(job) == id);
}

// How long the job had run when what is measured now began.
Duration RanBefore(const Job& job) {
  return job.bake && !job.bake->rounds.empty() ? job.bake->rounds.back().ran_before
                                               : Duration::zero();
}

void SetEnd(const RenderOverrides& until, RenderOverrides& overrides) {
  overrides.passes = until.passes;
  overrides.photons = until.photons;
  overrides.time_s = until.time_s;
  overrides.error = until.error;
}

// Owners choose their request ids without knowing of each other.
std::string RequestKey(const std::string& request_id, const std::string& owner) {
  if (owner.empty()) return request_id;
  return absl::StrCat(owner.size(), " ", owner, " ", request_id);
}

}  // namespace

Status JobTable::UnknownJob(const std::string& job_id) {
  return absl::NotFoundError(absl::StrCat("there is no job ", job_id));
}

JobTable::JobTable(Options options)
    : options_(std::move(options)), queue_(options_.max_waiting, options_.max_at_once) {}

// In the id that Add gave, which the caller compares as a whole; 0, which is no serial, for a text
// of another form.
std::uint64_t JobTable::SerialOf(std::string_view job_id) const {
  const std::string prefix = absl::StrCat(options_.instance, "-");
  if (!job_id.starts_with(prefix)) return 0;
  job_id.remove_prefix(prefix.size());
  std::uint64_t serial = 0;
  const auto read = std::from_chars(job_id.data(), job_id.data() + job_id.size(), serial);
  return read.ec == std::errc() ? serial : 0;
}

JobTable::Entries::iterator JobTable::FindLocked(const std::string& job_id) {
  const auto found = entries_.find(SerialOf(job_id));
  return found != entries_.end() && IsNamed(found->second.job, job_id) ? found : entries_.end();
}

JobTable::Entries::const_iterator JobTable::FindLocked(const std::string& job_id) const {
  const auto found = entries_.find(SerialOf(job_id));
  return found != entries_.end() && IsNamed(found->second.job, job_id) ? found : entries_.end();
}

std::optional<JobTable::Submitted> JobTable::FindRequestLocked(const std::string& request_id,
                                                               const std::string& owner) const {
  const std::string key = RequestKey(request_id, owner);
  for (const auto& [serial, entry] : entries_) {
    if (entry.request_id == key) return Submitted{entry.job.id, entry.job.warnings};
  }
  return std::nullopt;
}

std::optional<JobTable::Submitted> JobTable::FindRequest(const std::string& request_id,
                                                         const std::string& owner) const {
  const MutexLock lock(mutex_);
  return FindRequestLocked(request_id, owner);
}

StatusOr<JobTable::Submitted> JobTable::Add(CheckedJob checked, WallTime submitted_at,
                                            const Moment& moment) {
  const std::string request_id = checked.submission.request_id;
  const std::string owner = checked.submission.owner;
  const std::string key = RequestKey(request_id, owner);
  Entry entry;
  JobJournal::Written written;
  {
    const MutexLock lock(mutex_);
    // The same request may have come twice at once: the other one decides whether there is a job.
    while (being_added_.contains(key))
      added_.Wait(mutex_);
    if (auto earlier = FindRequestLocked(request_id, owner)) return *std::move(earlier);
    LUCERNA_RETURN_IF_ERROR(CheckMayAdd(owner));
    entry = MakeEntry(std::move(checked), submitted_at, moment);
    if (options_.journal != nullptr) {
      written = options_.journal->BeginSave(entry, Duration::zero());
    }
    being_added_[key] = owner;
    ++next_serial_;
    ++next_turn_;
  }
  // Before anybody can see it.
  const Status saved = written ? written() : absl::OkStatus();
  const MutexLock lock(mutex_);
  being_added_.erase(key);
  added_.NotifyAll();
  const std::uint64_t serial = entry.serial;
  if (!saved.ok()) {
    if (next_serial_ == serial + 1) next_serial_ = serial;
    return saved;
  }
  // It may have changed meanwhile.
  entry.job.life.SetHasWorkers(has_workers_, moment.now);
  Entry& added = entries_[serial] = std::move(entry);
  PushLocked(serial, added);
  return Submitted{added.job.id, added.job.warnings};
}

Status JobTable::CheckMayAdd(const std::string& owner) const {
  if (is_closed_) return absl::UnavailableError("the coordinator is shutting down");
  const std::size_t waiting = queue_.size() + being_added_.size();
  if (waiting >= options_.max_waiting) {
    return absl::ResourceExhaustedError(
        absl::StrCat(waiting, " jobs are waiting already; try again later"));
  }
  const auto of_owner = static_cast<std::size_t>(
      std::ranges::count_if(entries_,
                            [&](const auto& e) {
                              return e.second.job.owner == owner && !e.second.job.life.has_ended();
                            }) +
      std::ranges::count_if(being_added_, [&](const auto& item) { return item.second == owner; }));
  if (!owner.empty() && of_owner >= options_.max_waiting_of_owner) {
    return absl::ResourceExhaustedError(absl::StrCat(
        of_owner, " jobs of ", owner, " have not ended; wait for some, or cancel them"));
  }
  return absl::OkStatus();
}

JobTable::Entry JobTable::MakeEntry(CheckedJob checked, WallTime submitted_at,
                                    const Moment& moment) const {
  const std::uint64_t serial = next_serial_;
  Entry entry;
  entry.serial = serial;
  entry.turn = next_turn_;
  entry.request_id = RequestKey(checked.submission.request_id, checked.submission.owner);
  entry.pinned = std::move(checked.pinned);
  Job& job = entry.job;
  job.id = absl::StrCat(options_.instance, "-", serial);
  if (options_.random_part) absl::StrAppend(&job.id, "-", options_.random_part());
  job.owner = std::move(checked.submission.owner);
  job.manifest = std::move(checked.submission.manifest);
  job.name = checked.submission.name.empty() ? job.manifest.main_path : checked.submission.name;
  job.scene_digest = job.manifest.SceneDigest();
  job.settings = std::move(checked.settings);
  job.warnings = std::move(checked.warnings);
  job.needs = std::move(checked.needs);
  job.scene_memory = HeldOfScene(checked.scene_memory);
  job.submitted_at = submitted_at;
  job.life = JobLife(moment.now);
  job.life.SetHasWorkers(has_workers_, moment.now);
  job.priority = checked.submission.priority;
  job.reference = checked.submission.reference;
  if (checked.submission.bake) {
    job.bake = BakeRecord();
    job.bake->settings = *checked.submission.bake;
    job.bake->overrides = checked.submission.overrides;
  }
  // A job that must wait is read again later, so that waiting jobs cost no memory.
  if (queue_.has_room()) entry.scene = std::move(checked.scene);
  return entry;
}

// The journal
// ---------------------------------------------------------------------------------------------

void JobTable::Save(Entry& entry, SteadyTime now, Writes& writes) {
  if (options_.journal == nullptr) return;
  entry.is_unsaved = entry.is_being_deleted;
  // What is written now would come after the removal.
  if (entry.is_being_deleted) return;
  writes.Add(*this, {.serial = entry.serial,
                     .removes = false,
                     .written = options_.journal->BeginSave(entry, entry.job.life.Running(now))});
}

void JobTable::FinishWrites(const std::vector<Writes::Write>& writes) {
  for (const Writes::Write& write : writes) {
    if (write.written().ok()) continue;
    const MutexLock lock(mutex_);
    const auto found = entries_.find(write.serial);
    if (write.removes) {
      unremoved_.insert(write.serial);
    } else if (found != entries_.end()) {
      found->second.is_unsaved = true;
    }
  }
}

void JobTable::Restore(std::vector<JournalEntry> jobs, std::uint64_t next_serial,
                       const Moment& moment) {
  Dropped dropped;
  const MutexLock lock(mutex_);
  next_serial_ = std::max(next_serial_, next_serial);
  std::map<std::uint64_t, std::uint64_t> waiting;  // serials by turn
  for (JournalEntry& job : jobs) {
    next_turn_ = std::max(next_turn_, job.turn + 1);
    if (job.job.life.state() == JobState::kQueued) waiting[job.turn] = job.serial;
    Entry& entry = entries_[job.serial];
    static_cast<JournalEntry&>(entry) = std::move(job);
    entry.job.life.SetHasWorkers(has_workers_, moment.now);
  }
  for (const auto& [turn, serial] : waiting)
    PushLocked(serial, entries_.at(serial));
  Retain(dropped, moment);
}

std::optional<JobTable::Writes::Write> JobTable::BeginUnsaved(SteadyTime now) {
  const MutexLock lock(mutex_);
  for (auto& [serial, entry] : entries_) {
    if (!entry.is_unsaved || entry.is_being_deleted) continue;
    entry.is_unsaved = false;
    return Writes::Write{serial, false,
                         options_.journal->BeginSave(entry, entry.job.life.Running(now))};
  }
  if (unremoved_.empty()) return std::nullopt;
  const std::uint64_t serial = *unremoved_.begin();
  unremoved_.erase(unremoved_.begin());
  return Writes::Write{serial, true, options_.journal->BeginRemove(serial)};
}

void JobTable::SaveUnsaved(const Moment& moment) {
  while (const std::optional<Writes::Write> write = BeginUnsaved(moment.now)) {
    const Status written = write->written();
    if (written.ok()) continue;
    // The others would fail too.
    FinishWrites({{write->serial, write->removes, [written] { return written; }}});
    return;
  }
}

void JobTable::AddNeeded(const Entry& entry, NeededFiles& needed) {
  for (const auto& [path, file] : entry.job.manifest.entries)
    needed.blobs.insert(file.digest);
  if (entry.job.reference) needed.blobs.insert(*entry.job.reference);
  if (entry.image_digest) needed.blobs.insert(*entry.image_digest);
  if (entry.job.bake) {
    if (entry.job.bake->uv_mesh) needed.blobs.insert(*entry.job.bake->uv_mesh);
    for (const BakeRoundRecord& round : entry.job.bake->rounds) {
      if (entry.job.life.has_ended()) break;
      if (!round.has_ended) needed.blobs.insert(round.sensors.digest);
      if (round.image) needed.blobs.insert(*round.image);
    }
  }
  if (entry.has_checkpoint || !entry.job.life.has_ended()) {
    needed.checkpoints.insert(entry.job.id);
  }
  const RenderSettings& settings = entry.job.settings;
  needed.pixels += static_cast<std::uint64_t>(settings.crop_width()) *
                   static_cast<std::uint64_t>(settings.crop_height());
}

JobTable::NeededFiles JobTable::Needed() const {
  const MutexLock lock(mutex_);
  NeededFiles needed;
  for (const auto& [serial, entry] : entries_)
    AddNeeded(entry, needed);
  return needed;
}

JobTable::NeededFiles JobTable::NeededByOpenJobs() const {
  const MutexLock lock(mutex_);
  NeededFiles needed;
  for (const auto& [serial, entry] : entries_) {
    if (!entry.job.life.has_ended()) AddNeeded(entry, needed);
  }
  return needed;
}

Status JobTable::Delete(const std::string& job_id, const Moment& /*moment*/) {
  Dropped dropped;
  std::uint64_t serial = 0;
  JobJournal::Written written;
  {
    const MutexLock lock(mutex_);
    const auto found = FindLocked(job_id);
    if (found == entries_.end()) return UnknownJob(job_id);
    if (!found->second.job.life.has_ended()) {
      return absl::FailedPreconditionError(
          absl::StrCat("job ", job_id, " has not ended; cancel or stop it first"));
    }
    serial = found->first;
    if (options_.journal != nullptr) {
      // It stays in the table, with its files, until it is gone from the disk.
      found->second.is_being_deleted = true;
      written = options_.journal->BeginRemove(serial);
    }
  }
  const Status removed = written ? written() : absl::OkStatus();
  const MutexLock lock(mutex_);
  const auto found = entries_.find(serial);
  if (found == entries_.end()) return removed;
  if (removed.ok()) {
    dropped.entries.push_back(entries_.extract(found));
  } else {
    found->second.is_being_deleted = false;
  }
  return removed;
}

// Requests
// ---------------------------------------------------------------------------------------------

JobReport JobTable::MakeReport(const Entry& entry, const Moment& moment, bool is_summary) const {
  JobReport report;
  report.job = is_summary ? SummaryOf(entry.job) : entry.job;
  report.version = entry.version;
  const JobLife& life = entry.job.life;
  report.running = life.Running(moment.now);
  if (life.state() == JobState::kRunning) {
    report.photons_per_second = entry.job.counters.rate.PerSecond(
        moment.now - (report.running - RanBefore(entry.job)), moment.now);
    report.job.counters.coordinator_cpu = CpuOf(entry, moment);
  } else if (life.has_ended() && report.running > RanBefore(entry.job)) {
    report.photons_per_second = static_cast<double>(entry.job.counters.photons) /
                                Seconds(report.running - RanBefore(entry.job));
  }
  return report;
}

StatusOr<std::string> JobTable::OwnerOf(const std::string& job_id) const {
  const MutexLock lock(mutex_);
  const auto found = FindLocked(job_id);
  if (found == entries_.end()) return UnknownJob(job_id);
  return found->second.job.owner;
}

StatusOr<JobReport> JobTable::ReportOf(const std::string& job_id, const Moment& moment) const {
  const MutexLock lock(mutex_);
  const auto found = FindLocked(job_id);
  if (found == entries_.end()) return UnknownJob(job_id);
  return MakeReport(found->second, moment);
}

StatusOr<JobTable::News> JobTable::NewsOf(const std::string& job_id) const {
  const MutexLock lock(mutex_);
  const auto found = FindLocked(job_id);
  if (found == entries_.end()) return UnknownJob(job_id);
  return News{found->second.job.life.state(), found->second.version};
}

std::pair<std::vector<JobReport>, std::uint64_t> JobTable::List(const JobFilter& filter,
                                                                std::size_t count,
                                                                std::uint64_t before,
                                                                const Moment& moment) const {
  const auto passes = [&](const Job& job) {
    return (filter.states.empty() || filter.states.contains(job.life.state())) &&
           (filter.owner.empty() || filter.owner == job.owner) &&
           job.name.find(filter.name_contains) != std::string::npos;
  };
  const MutexLock lock(mutex_);
  std::pair<std::vector<JobReport>, std::uint64_t> page;
  auto end = before == 0 ? entries_.end() : entries_.lower_bound(before);
  while (end != entries_.begin() && page.first.size() < count) {
    --end;
    if (!passes(end->second.job)) continue;
    page.first.push_back(MakeReport(end->second, moment, /*is_summary=*/true));
  }
  page.second = end == entries_.begin() ? 0 : end->first;
  return page;
}

void JobTable::End(std::uint64_t serial, Entry& entry, const Status& why, const Moment& moment,
                   Dropped& dropped) {
  const bool has_changed = ChangeLife(serial, entry, moment, [&](JobLife& life) {
    return absl::IsCancelled(why) ? life.Cancel(moment.now)
                                  : life.Fail(std::string(why.message()), moment.now);
  });
  if (!has_changed) return;
  entry.job.ended_at = moment.wall;
  entry.job.pause_cause = PauseCause::kNone;
  entry.job.condition.clear();
  entry.has_checkpoint = false;
  Save(entry, moment.now, dropped.writes);
  dropped.scenes.push_back(std::exchange(entry.scene, std::nullopt));
  dropped.bakes.push_back(std::exchange(entry.bake_work, nullptr));
  if (entry.runner) {
    entry.runner->Stop(why);
    dropped.runners.push_back(std::exchange(entry.runner, nullptr));
  }
  // One whose turn it is keeps its files until the turn has ended.
  queue_.Remove(serial);
  LeavePlace(serial);
  if (!queue_.HasTurn(serial)) dropped.pinned.push_back(std::exchange(entry.pinned, {}));
}

StatusOr<JobReport> JobTable::Cancel(const std::string& job_id, const Moment& moment) {
  Dropped dropped;
  const MutexLock lock(mutex_);
  const auto found = FindLocked(job_id);
  if (found == entries_.end()) return UnknownJob(job_id);
  End(found->first, found->second, absl::CancelledError("the user cancelled the job"), moment,
      dropped);
  JobReport report = MakeReport(found->second, moment);
  Retain(dropped, moment);
  return report;
}

void JobTable::Fail(const std::string& job_id, const Status& why, const Moment& moment) {
  Dropped dropped;
  const MutexLock lock(mutex_);
  const auto found = FindLocked(job_id);
  if (found == entries_.end()) return;
  End(found->first, found->second, why, moment, dropped);
  Retain(dropped, moment);
}

StatusOr<JobReport> JobTable::Stop(const std::string& job_id, const Moment& moment) {
  Writes writes;
  const MutexLock lock(mutex_);
  const auto found = FindLocked(job_id);
  if (found == entries_.end()) return UnknownJob(job_id);
  Entry& entry = found->second;
  if (!entry.job.life.has_ended()) {
    // Between two rounds of a bake there is none.
    const bool is_measured = entry.job.bake && !entry.job.bake->rounds.empty();
    if (!entry.runner && !is_measured) {
      return absl::FailedPreconditionError(absl::StrCat(
          "job ", job_id, " has not begun to run",
          entry.has_checkpoint ? " again; resume it, or wait for its turn, and stop it then"
                               : " and has no image; cancel it instead"));
    }
    if (entry.runner) entry.runner->Finish();
    entry.is_finishing = true;
    if (entry.job.bake) {
      entry.job.bake->is_stopped = true;
      Save(entry, moment.now, writes);
    }
    queue_.SetPriority(found->first, ClaimOf(entry).priority);
    UpdateTurns();
    ResumeLocked(found->first, entry);
  }
  return MakeReport(entry, moment);
}

StatusOr<JobReport> JobTable::Extend(const std::string& job_id, const RenderOverrides& until,
                                     const Moment& moment) {
  Dropped dropped;
  const MutexLock lock(mutex_);
  const auto found = FindLocked(job_id);
  if (found == entries_.end()) return UnknownJob(job_id);
  Entry& entry = found->second;
  Job& job = entry.job;
  RenderSettings settings = job.settings;
  LUCERNA_RETURN_IF_ERROR(SetStopCriteria(until, settings));
  if (entry.is_being_deleted) return UnknownJob(job_id);
  if (job.life.has_ended()) {
    if (job.life.state() != JobState::kSucceeded) {
      return absl::FailedPreconditionError(
          absl::StrCat("job ", job_id, " was cancelled or failed; submit it again"));
    }
    const bool can_go_on = job.bake ? options_.journal != nullptr || !entry.pinned.empty()
                                    : entry.runner || entry.has_checkpoint;
    if (!can_go_on || is_closed_) {
      return absl::FailedPreconditionError(absl::StrCat(
          "job ", job_id,
          job.bake ? " ended so long ago that its files are not kept any more; submit it again"
                   : " ended so long ago that its photons are not kept any more; submit it again"));
    }
    job.life.Extend();
    if (job.bake) {
      ForgetRoundsLocked(entry, dropped);
    } else if (entry.runner) {
      entry.runner->Reopen(settings);
    }
    // The image grows from now on.
    dropped.images.push_back(std::exchange(entry.image, nullptr));
    dropped.images.push_back(std::exchange(entry.uv_mesh, nullptr));
    entry.image_digest.reset();
    job.ended_at.reset();
    entry.turn = next_turn_++;
    PushLocked(found->first, entry);
  } else if (job.bake) {
    BeginBakeAgain(found->first, entry, dropped);
  } else if (entry.runner) {
    entry.runner->SetEnd(settings);
  }
  if (job.bake) {
    SetEnd(until, job.bake->overrides);
    job.bake->is_stopped = false;
    entry.is_finishing = false;
  } else {
    job.settings = std::move(settings);
  }
  ++entry.version;
  Save(entry, moment.now, dropped.writes);
  return MakeReport(entry, moment);
}

JobTable::ImageSource JobTable::MakeImageSource(const Entry& entry, const Moment& moment) const {
  return {entry.image,         entry.uv_mesh, entry.image_digest,
          entry.runner,        entry.job,     entry.job.life.Running(moment.now),
          CpuOf(entry, moment)};
}

StatusOr<JobTable::ImageSource> JobTable::FindImage(const std::string& job_id,
                                                    const Moment& moment) const {
  const MutexLock lock(mutex_);
  const auto found = FindLocked(job_id);
  if (found == entries_.end()) return UnknownJob(job_id);
  const Entry& entry = found->second;
  const bool has_image = entry.image || entry.image_digest;
  if (!has_image && entry.job.life.has_ended()) {
    return absl::FailedPreconditionError(
        absl::StrCat("job ", job_id,
                     entry.job.life.state() == JobState::kSucceeded
                         ? " ended so long ago that its image is not kept any more; submit it again"
                         : " was cancelled or failed and has no image"));
  }
  if (!has_image && entry.job.bake) {
    return absl::FailedPreconditionError(
        absl::StrCat("job ", job_id, " has not ended, and a bake has nothing to show before"));
  }
  // Of one that begins again, the image so far has the work of a wrong worker.
  if (!has_image && (!entry.runner || entry.begins_again)) {
    return absl::FailedPreconditionError(
        absl::StrCat("job ", job_id, " has not begun to run; try again later"));
  }
  return MakeImageSource(entry, moment);
}

std::optional<Job> JobTable::Find(const std::string& job_id) const {
  const MutexLock lock(mutex_);
  const auto found = FindLocked(job_id);
  if (found == entries_.end()) return std::nullopt;
  return found->second.job;
}

// Workers
// ---------------------------------------------------------------------------------------------

std::optional<Loan> JobTable::MakeLoan(BatchLease lease, int workers) {
  const MutexLock lock(mutex_);
  const auto found = FindLocked(lease.pass.job_id);
  if (found == entries_.end() || !found->second.runner) return std::nullopt;
  const auto blobs = found->second.runner->BlobsOf(lease.pass.pass);
  if (!blobs) return std::nullopt;
  Job& job = found->second.job;
  job.most_workers = std::max(job.most_workers, workers);
  return Loan{std::move(lease), *blobs};
}

void JobTable::NoteContributor(const std::string& job_id, const std::string& record,
                               const std::string& worker_name) {
  const MutexLock lock(mutex_);
  const auto found = FindLocked(job_id);
  if (found != entries_.end()) found->second.job.workers[record].name = worker_name;
}

Status JobTable::CheckEmission(const std::string& job_id, const BatchTally& tally) const {
  std::shared_ptr<RunningJob> runner;
  {
    const MutexLock lock(mutex_);
    const auto found = FindLocked(job_id);
    if (found != entries_.end()) runner = found->second.runner;
  }
  return runner ? runner->CheckEmission(tally) : absl::OkStatus();
}

void JobTable::CountAudit(const std::string& job_id, AuditOutcome outcome) {
  const MutexLock lock(mutex_);
  const auto found = FindLocked(job_id);
  if (found == entries_.end()) return;
  AuditCounts& audits = found->second.job.counters.audits;
  switch (outcome) {
    case AuditOutcome::kNone:
      return;
    case AuditOutcome::kAgreed:
      ++audits.agreed;
      return;
    case AuditOutcome::kNotAudited:
      ++audits.not_audited;
      return;
    case AuditOutcome::kDisputed:
      ++audits.disputed;
      return;
  }
}

void JobTable::TakeOut(const std::string& record, const Moment& moment) {
  Dropped dropped;
  const MutexLock lock(mutex_);
  for (auto& [serial, entry] : entries_) {
    Job& job = entry.job;
    const auto share = job.workers.find(record);
    // Also when it was found before: where its work is named, it has been lent work again since.
    if (share == job.workers.end()) continue;
    const std::string worker = absl::StrCat("worker ", record, " (", share->second.name,
                                            "), of which a result was found to be wrong");
    job.distrusted.insert(record);
    if (!job.life.has_ended()) {
      job.AddEvent(moment.wall, absl::StrCat("goes on without the work of ", worker));
      if (job.bake) {
        BeginBakeAgain(serial, entry, dropped);
      } else if (entry.runner) {
        entry.begins_again = true;
        entry.runner->Stop(absl::AbortedError("the work of a worker is taken out"));
      }
    } else if (job.life.state() == JobState::kSucceeded) {
      job.AddEvent(moment.wall, absl::StrCat("the image has a part by ", worker,
                                             " after the job had ended; submit it again"));
      dropped.runners.push_back(std::exchange(entry.runner, nullptr));
      entry.has_checkpoint = false;
    }
    ++entry.version;
    Save(entry, moment.now, dropped.writes);
  }
}

bool JobTable::BeginsAgain(const std::string& job_id) const {
  const MutexLock lock(mutex_);
  const auto found = FindLocked(job_id);
  return found != entries_.end() && found->second.begins_again;
}

bool JobTable::TakeBeginsAgain(const std::string& job_id) {
  Dropped dropped;
  const MutexLock lock(mutex_);
  const auto found = FindLocked(job_id);
  if (found == entries_.end() || !std::exchange(found->second.begins_again, false)) return false;
  dropped.runners.push_back(std::exchange(found->second.runner, nullptr));
  // What a round measured decides what the next ones do.
  if (found->second.job.bake) ForgetRoundsLocked(found->second, dropped);
  return !is_closed_ && !found->second.job.life.has_ended();
}

void JobTable::CountMerged(const Delivery& delivery, const DeliveredCounts& counts,
                           const std::string& worker_name, SteadyTime now) {
  const MutexLock lock(mutex_);
  const auto found = FindLocked(delivery.pass.job_id);
  if (found == entries_.end()) return;
  CountCommit(found->second.job, delivery, counts, worker_name, now);
  ++found->second.version;
  if (found->second.runner) found->second.runner->Wake();
}

void JobTable::CountFetched(const Digest& digest, std::uint64_t size_bytes) {
  const MutexLock lock(mutex_);
  for (const std::uint64_t serial : running_) {
    Entry& entry = entries_.at(serial);
    if (!entry.runner) continue;
    if (const auto hitpoints = entry.runner->HitpointsIn(digest)) {
      CountFetch(entry.job, size_bytes, *hitpoints);
      return;
    }
  }
}

bool JobTable::DropOldestPhotons() {
  Dropped dropped;
  const MutexLock lock(mutex_);
  for (auto& [serial, entry] : entries_) {
    if (!entry.job.life.has_ended() || queue_.HasTurn(serial)) continue;
    const bool has_spare_image = entry.image && entry.image_digest;
    if (!entry.runner && !has_spare_image && !HoldsFilesOfBake(entry)) continue;
    if (entry.runner || HoldsFilesOfBake(entry)) {
      dropped.runners.push_back(std::exchange(entry.runner, nullptr));
      dropped.pinned.push_back(std::exchange(entry.pinned, {}));
    }
    if (has_spare_image) dropped.images.push_back(std::exchange(entry.image, nullptr));
    return true;
  }
  return false;
}

std::optional<std::string> JobTable::DropOldestEnded() {
  Dropped dropped;
  const MutexLock lock(mutex_);
  const auto oldest = std::ranges::find_if(entries_, [&](const auto& item) {
    return item.second.job.life.has_ended() && !queue_.HasTurn(item.first);
  });
  if (oldest == entries_.end()) return std::nullopt;
  std::string job_id = oldest->second.job.id;
  DropLocked(oldest, dropped);
  return job_id;
}

Duration JobTable::RunningOf(const std::string& job_id, SteadyTime now) const {
  const MutexLock lock(mutex_);
  const auto found = FindLocked(job_id);
  if (found == entries_.end()) return Duration::zero();
  return found->second.job.life.Running(now) - RanBefore(found->second.job);
}

std::optional<SteadyTime> JobTable::WhenItHasRun(const std::string& job_id, Duration time) const {
  const MutexLock lock(mutex_);
  const auto found = FindLocked(job_id);
  if (found == entries_.end()) return std::nullopt;
  return found->second.job.life.WhenItHasRun(RanBefore(found->second.job) + time);
}

bool JobTable::HasEnded(const std::string& job_id) const {
  const MutexLock lock(mutex_);
  const auto found = FindLocked(job_id);
  return found == entries_.end() || found->second.job.life.has_ended();
}

std::map<JobState, std::size_t> JobTable::CountByState() const {
  const MutexLock lock(mutex_);
  std::map<JobState, std::size_t> counts;
  for (const auto& [serial, entry] : entries_)
    ++counts[entry.job.life.state()];
  return counts;
}

Status JobTable::CheckStillNeeded(const std::string& job_id) const {
  const MutexLock lock(mutex_);
  const auto found = FindLocked(job_id);
  if (is_closed_ || found == entries_.end() || found->second.job.life.has_ended()) {
    return absl::CancelledError("the job has ended");
  }
  return absl::OkStatus();
}

bool JobTable::Attach(const std::string& job_id, std::shared_ptr<RunningJob> runner) {
  const MutexLock lock(mutex_);
  const auto found = FindLocked(job_id);
  if (is_closed_ || found == entries_.end() || found->second.job.life.has_ended()) return false;
  // A bake that is to begin again while its round was read.
  if (found->second.begins_again) return false;
  // Either may have been changed since the turn began.
  runner->SetEnd(found->second.job.settings);
  runner->SetGivesUpTurn(found->second.gives_up_turn);
  // One that was stopped, and begins again, ends all the same.
  if (IsFinishingLocked(found->second)) runner->Finish();
  found->second.runner = std::move(runner);
  return true;
}

std::optional<JobTable::ImageSource> JobTable::DescribeRun(const std::string& job_id,
                                                           const Moment& moment) const {
  const MutexLock lock(mutex_);
  const auto found = FindLocked(job_id);
  if (found == entries_.end()) return std::nullopt;
  return MakeImageSource(found->second, moment);
}

bool JobTable::IsFinishingLocked(const Entry& entry) {
  return entry.is_finishing || (entry.job.bake && entry.job.bake->is_stopped);
}

bool JobTable::IsFinishing(const std::string& job_id) const {
  const MutexLock lock(mutex_);
  const auto found = FindLocked(job_id);
  return found != entries_.end() && IsFinishingLocked(found->second);
}

bool JobTable::Succeed(const std::string& job_id, StopReason reason, Blob image,
                       const Moment& moment, std::optional<Digest> image_digest) {
  Dropped dropped;
  const MutexLock lock(mutex_);
  const auto found = FindLocked(job_id);
  if (found == entries_.end() || found->second.begins_again) return false;
  Entry& entry = found->second;
  const bool has_changed = ChangeLife(
      found->first, entry, moment, [&](JobLife& life) { return life.Succeed(reason, moment.now); });
  if (!has_changed) return false;
  // One that was paused, or given another turn, when it was done already.
  queue_.Remove(found->first);
  LeavePlace(found->first);
  entry.is_finishing = false;
  entry.job.pause_cause = PauseCause::kNone;
  entry.job.ended_at = moment.wall;
  entry.job.condition.clear();
  entry.image = std::move(image);
  entry.image_digest = image_digest;
  if (entry.job.bake) {
    // Another end begins anew: the photons of its last round are of no use.
    dropped.bakes.push_back(std::exchange(entry.bake_work, nullptr));
    dropped.runners.push_back(std::exchange(entry.runner, nullptr));
    entry.has_checkpoint = false;
  }
  ++entry.version;
  Save(entry, moment.now, dropped.writes);
  Retain(dropped, moment);
  return true;
}

void JobTable::GoOnFrom(const std::string& job_id, Job record, Duration ran) {
  const MutexLock lock(mutex_);
  const auto found = FindLocked(job_id);
  if (found == entries_.end()) return;
  Job& job = found->second.job;
  record.life = job.life;
  // One that begins again has run all the time.
  if (record.life.state() != JobState::kRunning) record.life.SetRanBefore(ran);
  record.settings = job.settings;
  record.submitted_at = job.submitted_at;
  record.owner = job.owner;
  record.priority = job.priority;
  record.pause_cause = job.pause_cause;
  record.events = job.events;
  record.distrusted = job.distrusted;
  record.condition = job.condition;
  record.bake = job.bake;
  record.ended_at.reset();
  job = std::move(record);
  ++found->second.version;
}

void JobTable::SetCondition(const std::string& job_id, PauseCause cause, std::string condition,
                            const Moment& moment) {
  LUCERNA_CHECK(GoesOnByItself(cause));
  const MutexLock lock(mutex_);
  const auto found = FindLocked(job_id);
  if (found == entries_.end()) return;
  const std::uint64_t serial = found->first;
  Entry& entry = found->second;
  Job& job = entry.job;
  const bool goes_on = condition.empty();
  const bool waits = GoesOnByItself(job.pause_cause);
  if (waits && job.pause_cause != cause && (goes_on || cause != PauseCause::kDisk)) return;
  if (job.condition == condition || (goes_on && !waits)) return;
  if (goes_on || !waits) {
    const bool has_changed = ChangeLife(serial, entry, moment, [&](JobLife& life) {
      if (goes_on) return life.Run(moment.now);
      return life.state() == JobState::kRunning && life.Pause(moment.now);
    });
    if (!has_changed) return;
  }
  job.pause_cause = goes_on ? PauseCause::kNone : cause;
  job.AddEvent(moment.wall, goes_on ? "went on" : condition);
  job.condition = std::move(condition);
  ++entry.version;
  queue_.SetHasPlace(serial, goes_on && !entry.gives_up_turn);
  UpdateTurns();
}

void JobTable::AddEvent(const std::string& job_id, std::string what, const Moment& moment) {
  const MutexLock lock(mutex_);
  const auto found = FindLocked(job_id);
  if (found == entries_.end()) return;
  found->second.job.AddEvent(moment.wall, std::move(what));
  ++found->second.version;
}

void JobTable::OnCheckpoint(const std::string& job_id) {
  const MutexLock lock(mutex_);
  const auto found = FindLocked(job_id);
  if (found == entries_.end()) return;
  // One that was cancelled while this was written needs it no more.
  const JobState state = found->second.job.life.state();
  if (state != JobState::kCancelled && state != JobState::kFailed)
    found->second.has_checkpoint = true;
}

void JobTable::OnRunning(const std::string& job_id, const Moment& moment) {
  const MutexLock lock(mutex_);
  const auto found = FindLocked(job_id);
  if (found == entries_.end()) return;
  ChangeLife(found->first, found->second, moment, [&](JobLife& life) {
    return life.state() == JobState::kPreparing && life.Run(moment.now);
  });
}

void JobTable::OnWarning(const std::string& job_id, std::string warning) {
  const MutexLock lock(mutex_);
  const auto found = FindLocked(job_id);
  if (found == entries_.end()) return;
  found->second.job.warnings.push_back(std::move(warning));
  ++found->second.version;
}

void JobTable::OnPhotonSteps(const std::string& job_id, PhotonSteps steps) {
  const MutexLock lock(mutex_);
  const auto found = FindLocked(job_id);
  if (found == entries_.end()) return;
  found->second.job.photon_steps = std::move(steps);
}

void JobTable::OnGuides(const std::string& job_id, GuideSteps guides) {
  const MutexLock lock(mutex_);
  const auto found = FindLocked(job_id);
  if (found == entries_.end()) return;
  found->second.job.guides = std::move(guides);
}

void JobTable::OnProgress(const std::string& job_id, std::int64_t passes) {
  const MutexLock lock(mutex_);
  const auto found = FindLocked(job_id);
  if (found == entries_.end()) return;
  found->second.job.counters.passes = passes;
  ++found->second.version;
}

void JobTable::OnTail(const std::string& job_id, const BatchTally& tally, std::int64_t passes) {
  const MutexLock lock(mutex_);
  const auto found = FindLocked(job_id);
  if (found == entries_.end()) return;
  Job& job = found->second.job;
  const std::vector<PassTally>& whole = job.pass_record.tallies();
  const std::int64_t first = whole.empty() ? 0 : whole.back().first_pass + whole.back().passes;
  job.tail = {.first_pass = first, .passes = passes, .tally = tally};
  ++found->second.version;
}

void JobTable::OnRoundMerged(const std::string& job_id, const BatchTally& tally,
                             std::int64_t passes) {
  const MutexLock lock(mutex_);
  const auto found = FindLocked(job_id);
  if (found == entries_.end()) return;
  found->second.job.pass_record.Add(tally, passes);
  found->second.job.tail = {};
  ++found->second.version;
}

void JobTable::OnErrorEstimate(const std::string& job_id, ErrorSample sample,
                               std::vector<LightFinding> lights, const Moment& moment) {
  const MutexLock lock(mutex_);
  const auto found = FindLocked(job_id);
  if (found == entries_.end()) return;
  Entry& entry = found->second;
  sample.running = entry.job.life.Running(moment.now);
  sample.cpu = CpuOf(entry, moment) + entry.job.counters.worker_cpu;
  entry.job.convergence.push_back(std::move(sample));
  entry.job.lights = std::move(lights);
  ++entry.version;
}

void JobTable::OnDenoised(const std::string& job_id, const DenoisedSample& denoised) {
  const MutexLock lock(mutex_);
  const auto found = FindLocked(job_id);
  if (found == entries_.end() || found->second.job.convergence.empty()) return;
  found->second.job.convergence.back().denoised = denoised;
  ++found->second.version;
}

void JobTable::Close(const Status& why) {
  const MutexLock lock(mutex_);
  is_closed_ = true;
  for (auto& [serial, entry] : entries_) {
    if (entry.runner && queue_.HasTurn(serial)) entry.runner->Stop(why);
  }
  job_waits_.NotifyAll();
}

void JobTable::Retain(Dropped& dropped, const Moment& moment) {
  std::vector<std::uint64_t> serials;
  std::vector<EndedJob> ended;
  for (auto item = entries_.rbegin(); item != entries_.rend(); ++item) {
    const Entry& entry = item->second;
    if (!entry.job.life.has_ended()) continue;
    const RenderSettings& settings = entry.job.settings;
    serials.push_back(item->first);
    ended.push_back(
        {.has_photons = entry.runner != nullptr || entry.has_checkpoint || HoldsFilesOfBake(entry),
         .is_in_memory = entry.runner != nullptr || HoldsFilesOfBake(entry),
         .pixels = std::int64_t{settings.crop_width()} * std::int64_t{settings.crop_height()},
         .has_image = entry.image != nullptr,
         .image_bytes = entry.image ? entry.image->size() : 0,
         .age = entry.job.ended_at ? moment.wall - *entry.job.ended_at : Duration::zero()});
  }
  const std::vector<KeptOfJob> kept = DecideRetention(ended, options_.retention);
  for (std::size_t i = 0; i < kept.size(); ++i) {
    const auto found = entries_.find(serials[i]);
    Entry& entry = found->second;
    if (!kept[i].photons) entry.has_checkpoint = false;
    if (!kept[i].photons || !kept[i].in_memory) {
      dropped.runners.push_back(std::exchange(entry.runner, nullptr));
      // The one that has just ended is still in use by its thread; its files go with its turn.
      if (!queue_.HasTurn(found->first)) {
        dropped.pinned.push_back(std::exchange(entry.pinned, {}));
      }
    }
    if (!kept[i].image) {
      dropped.images.push_back(std::exchange(entry.image, nullptr));
      dropped.images.push_back(std::exchange(entry.uv_mesh, nullptr));
    }
    if (!kept[i].record) DropLocked(found, dropped);
  }
}

void JobTable::DropLocked(Entries::iterator entry, Dropped& dropped) {
  if (options_.journal != nullptr) {
    dropped.writes.Add(*this, {.serial = entry->first,
                               .removes = true,
                               .written = options_.journal->BeginRemove(entry->first)});
  }
  dropped.entries.push_back(entries_.extract(entry));
}

}  // namespace lucerna
