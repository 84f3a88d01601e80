#include "server/job.h"

#include <algorithm>

namespace lucerna {

const char* NameOf(JobState state) {
  switch (state) {
    case JobState::kQueued:
      return "queued";
    case JobState::kPreparing:
      return "preparing";
    case JobState::kRunning:
      return "running";
    case JobState::kPaused:
      return "paused";
    case JobState::kSucceeded:
      return "succeeded";
    case JobState::kCancelled:
      return "cancelled";
    case JobState::kFailed:
      return "failed";
  }
  return "";
}

JobLife::JobLife(Past past)
    : state_(past.state >= JobState::kPaused ? past.state : JobState::kQueued),
      stop_reason_(past.stop_reason),
      failure_(std::move(past.failure)),
      submitted_at_(past.submitted_at),
      ran_before_(past.ran) {}

bool JobLife::GoTo(JobState state, SteadyTime now) {
  state_ = state;
  SetClock(now);
  return true;
}

void JobLife::SetClock(SteadyTime now) {
  const bool counts = state_ == JobState::kRunning && has_workers_;
  if (counts == started_at_.has_value()) return;
  if (counts) {
    started_at_ = now;
  } else {
    ran_before_ += now - *started_at_;
    started_at_.reset();
  }
}

bool JobLife::Prepare() {
  if (state_ != JobState::kQueued) return false;
  state_ = JobState::kPreparing;
  return true;
}

bool JobLife::Run(SteadyTime now) {
  if (state_ != JobState::kPreparing && state_ != JobState::kPaused) return false;
  has_run_ = true;
  return GoTo(JobState::kRunning, now);
}

bool JobLife::GiveUpTurn(SteadyTime now) {
  if (state_ != JobState::kPreparing && state_ != JobState::kRunning) return false;
  return GoTo(JobState::kQueued, now);
}

bool JobLife::Pause(SteadyTime now) {
  if (has_ended() || state_ == JobState::kPaused) return false;
  return GoTo(JobState::kPaused, now);
}

bool JobLife::Resume() {
  if (state_ != JobState::kPaused) return false;
  state_ = JobState::kQueued;
  return true;
}

bool JobLife::End(JobState state, SteadyTime now) {
  if (has_ended()) return false;
  return GoTo(state, now);
}

bool JobLife::Succeed(StopReason reason, SteadyTime now) {
  if (!has_run_ || !End(JobState::kSucceeded, now)) return false;
  stop_reason_ = reason;
  return true;
}

bool JobLife::Extend() {
  if (state_ != JobState::kSucceeded) return false;
  stop_reason_ = StopReason::kNone;
  state_ = JobState::kQueued;
  return true;
}

bool JobLife::Cancel(SteadyTime now) {
  return End(JobState::kCancelled, now);
}

bool JobLife::Fail(std::string failure, SteadyTime now) {
  if (!End(JobState::kFailed, now)) return false;
  failure_ = std::move(failure);
  return true;
}

void JobLife::SetHasWorkers(bool has_workers, SteadyTime now) {
  has_workers_ = has_workers;
  SetClock(now);
}

Duration JobLife::Running(SteadyTime now) const {
  return started_at_ ? ran_before_ + (now - *started_at_) : ran_before_;
}

std::optional<SteadyTime> JobLife::WhenItHasRun(Duration time) const {
  if (!started_at_) return std::nullopt;
  return *started_at_ + (time - ran_before_);
}

Job SummaryOf(const Job& job) {
  Job summary;
  summary.id = job.id;
  summary.name = job.name;
  summary.scene_digest = job.scene_digest;
  summary.settings = job.settings;
  summary.submitted_at = job.submitted_at;
  summary.life = job.life;
  summary.counters = job.counters;
  // The share that is done follows from them.
  summary.photon_steps = job.photon_steps;
  summary.reference = job.reference;
  summary.ended_at = job.ended_at;
  summary.owner = job.owner;
  summary.priority = job.priority;
  summary.pause_cause = job.pause_cause;
  summary.condition = job.condition;
  if (job.bake) {
    // What it is and how far it has come.
    summary.bake = BakeRecord();
    summary.bake->settings = job.bake->settings;
    summary.bake->overrides = job.bake->overrides;
    summary.bake->rounds = job.bake->rounds;
    for (BakeRoundRecord& round : summary.bake->rounds) {
      round.error.reset();
      round.lights.clear();
    }
  }
  return summary;
}

std::string RunIdOf(const Job& job) {
  if (!job.bake || job.bake->rounds.empty()) return job.id;
  return absl::StrCat(job.id, ".", job.bake->rounds.back().run);
}

SceneManifest ManifestOf(const Job& job) {
  SceneManifest manifest = job.manifest;
  if (!job.bake || job.bake->rounds.empty()) return manifest;
  manifest.entries[kSensorsPath] = job.bake->rounds.back().sensors;
  manifest.main_path = kSensorsPath;
  return manifest;
}

const BakeRoundRecord* EvenRoundOf(const BakeRecord& bake) {
  const auto found = std::ranges::find_if(
      bake.rounds, [](const BakeRoundRecord& round) { return round.name == kEvenRoundName; });
  return found == bake.rounds.end() ? nullptr : &*found;
}

void Job::AddEvent(WallTime at, std::string what) {
  events.push_back({at, std::move(what)});
  if (events.size() > kMostEvents) events.erase(events.begin());
}

void Job::ClearProgress() {
  counters = JobCounters();
  convergence.clear();
  lights.clear();
  pass_record = PassRecord();
  tail = PassTally();
  photon_steps.clear();
  guides.clear();
  workers.clear();
}

void Job::ClearRound() {
  const JobCounters before = std::move(counters);
  std::map<std::string, WorkerShare> shares = std::move(workers);
  ClearProgress();
  counters.coordinator_cpu = before.coordinator_cpu;
  counters.worker_cpu = before.worker_cpu;
  counters.to_first_photons = before.to_first_photons;
  counters.audits = before.audits;
  workers = std::move(shares);
}

PassRecord::PassRecord(std::vector<PassTally> tallies) : tallies_(std::move(tallies)) {
  // The first ones are of the passes before rounds were longer than one.
  if (!tallies_.empty()) passes_each_ = std::max<std::int64_t>(1, tallies_.front().passes);
}

void PassRecord::Add(const BatchTally& tally, std::int64_t passes) {
  if (!tallies_.empty() && tallies_.back().passes < passes_each_) {
    tallies_.back().passes += passes;
    tallies_.back().tally += tally;
    return;
  }
  if (tallies_.size() == kMostTallies) {
    for (std::size_t i = 0; i < kMostTallies / 2; ++i) {
      PassTally joined = tallies_[2 * i];
      joined.passes += tallies_[2 * i + 1].passes;
      joined.tally += tallies_[2 * i + 1].tally;
      tallies_[i] = joined;
    }
    tallies_.resize(kMostTallies / 2);
    passes_each_ *= 2;
  }
  const std::int64_t first =
      tallies_.empty() ? 0 : tallies_.back().first_pass + tallies_.back().passes;
  tallies_.push_back({.first_pass = first, .passes = passes, .tally = tally});
}

void JobCounters::NameDropped(const std::vector<PhotonKey>& named) {
  for (const PhotonKey& key : named) {
    // Traced again after a restart.
    if (std::ranges::binary_search(dropped_photons, key)) continue;
    dropped_photons.insert(std::ranges::upper_bound(dropped_photons, key), key);
    if (dropped_photons.size() > kDroppedNamed) dropped_photons.pop_back();
  }
}

void SlidingRate::Add(std::uint64_t events, SteadyTime now) {
  const auto second_of = [](SteadyTime when) {
    return std::chrono::floor<std::chrono::seconds>(when.time_since_epoch());
  };
  if (!arrivals_.empty() && second_of(arrivals_.back().first) == second_of(now)) {
    arrivals_.back().first = now;
    arrivals_.back().second += events;
  } else {
    arrivals_.emplace_back(now, events);
  }
  while (FirstCounted(now) > 1)
    arrivals_.pop_front();
}

std::size_t SlidingRate::FirstCounted(SteadyTime now) const {
  const auto is_before = [&](const auto& arrival) { return arrival.first + window_ < now; };
  const auto before_window = static_cast<std::size_t>(
      std::ranges::partition_point(arrivals_, is_before) - arrivals_.begin());
  return std::min(before_window, arrivals_.size() - std::min(arrivals_.size(), kFewestArrivals));
}

double SlidingRate::PerSecond(SteadyTime since, SteadyTime now) const {
  const std::size_t first = FirstCounted(now);
  // From one arrival to the next: what the first brings came about before it.
  const SteadyTime begin = first == 0 ? since : std::max(since, arrivals_[first - 1].first);
  const Duration span = now - begin;
  if (span <= Duration::zero()) return 0;
  std::uint64_t sum = 0;
  for (std::size_t i = first; i < arrivals_.size(); ++i)
    sum += arrivals_[i].second;
  return static_cast<double>(sum) / Seconds(span);
}

}  // namespace lucerna
