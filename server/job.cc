#include "server/job.h"

#include <algorithm>

namespace lucerna {

JobLife::JobLife(Past past)
    : state_(past.state >= JobState::kSucceeded ? past.state : JobState::kQueued),
      stop_reason_(past.stop_reason),
      failure_(std::move(past.failure)),
      submitted_at_(past.submitted_at),
      ran_before_(past.ran) {}

bool JobLife::Prepare() {
  if (state_ != JobState::kQueued) return false;
  state_ = JobState::kPreparing;
  return true;
}

bool JobLife::Run(SteadyTime now) {
  if (state_ != JobState::kPreparing) return false;
  state_ = JobState::kRunning;
  started_at_ = now;
  return true;
}

bool JobLife::End(JobState state, SteadyTime now) {
  if (has_ended()) return false;
  state_ = state;
  ended_at_ = now;
  return true;
}

bool JobLife::Succeed(StopReason reason, SteadyTime now) {
  if (state_ != JobState::kRunning) return false;
  stop_reason_ = reason;
  return End(JobState::kSucceeded, now);
}

bool JobLife::Extend() {
  if (state_ != JobState::kSucceeded) return false;
  if (ended_at_) ran_before_ = Running(*ended_at_);
  started_at_.reset();
  ended_at_.reset();
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

void JobLife::Pause(SteadyTime now) {
  if (state_ != JobState::kRunning || !started_at_) return;
  ran_before_ += now - *started_at_;
  started_at_.reset();
}

void JobLife::GoOn(SteadyTime now) {
  if (state_ == JobState::kRunning && !started_at_) started_at_ = now;
}

Duration JobLife::Running(SteadyTime now) const {
  if (!started_at_) return ran_before_;
  return ran_before_ + (ended_at_ ? *ended_at_ : now) - *started_at_;
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
  workers.clear();
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
  events_.emplace_back(now, events);
  while (events_.front().first + window_ < now)
    events_.pop_front();
}

double SlidingRate::PerSecond(SteadyTime since, SteadyTime now) const {
  const Duration span = std::min(window_, now - since);
  if (span <= Duration::zero()) return 0;
  std::uint64_t sum = 0;
  for (const auto& [when, events] : events_) {
    if (when + span >= now) sum += events;
  }
  return static_cast<double>(sum) / Seconds(span);
}

}  // namespace lucerna
