#include "server/job_message.h"

#include <algorithm>
#include <string_view>
#include <utility>
#include <vector>

#include "render/wire/messages.h"

namespace lucerna {
namespace {

constexpr std::size_t kMostShares = 1000;

v1::JobState StateToProto(JobState state) {
  switch (state) {
    case JobState::kQueued:
      return v1::JOB_STATE_QUEUED;
    case JobState::kPreparing:
      return v1::JOB_STATE_PREPARING;
    case JobState::kRunning:
      return v1::JOB_STATE_RUNNING;
    case JobState::kPaused:
      return v1::JOB_STATE_PAUSED;
    case JobState::kSucceeded:
      return v1::JOB_STATE_SUCCEEDED;
    case JobState::kCancelled:
      return v1::JOB_STATE_CANCELLED;
    case JobState::kFailed:
      return v1::JOB_STATE_FAILED;
  }
  return v1::JOB_STATE_UNSPECIFIED;
}

v1::PauseCause CauseToProto(PauseCause cause) {
  switch (cause) {
    case PauseCause::kNone:
      return v1::PAUSE_CAUSE_UNSPECIFIED;
    case PauseCause::kUser:
      return v1::PAUSE_CAUSE_USER;
    case PauseCause::kDisk:
      return v1::PAUSE_CAUSE_DISK;
    case PauseCause::kFailedBatch:
      return v1::PAUSE_CAUSE_FAILED_BATCH;
    case PauseCause::kDispute:
      return v1::PAUSE_CAUSE_DISPUTE;
  }
  return v1::PAUSE_CAUSE_UNSPECIFIED;
}

v1::StopReason ReasonToProto(StopReason reason) {
  switch (reason) {
    case StopReason::kNone:
      return v1::STOP_REASON_UNSPECIFIED;
    case StopReason::kPasses:
      return v1::STOP_REASON_PASSES;
    case StopReason::kTime:
      return v1::STOP_REASON_TIME;
    case StopReason::kError:
      return v1::STOP_REASON_ERROR;
    case StopReason::kPhotons:
      return v1::STOP_REASON_PHOTONS;
    case StopReason::kUser:
      return v1::STOP_REASON_USER;
  }
  return v1::STOP_REASON_UNSPECIFIED;
}

v1::Progress ProgressToProto(const JobReport& report) {
  const JobCounters& counters = report.job.counters;
  v1::Progress message;
  message.set_passes(counters.passes);
  message.set_photons(counters.photons);
  *message.mutable_running() = ToProto(report.running);
  if (counters.to_first_photons) {
    *message.mutable_to_first_photons() = ToProto(*counters.to_first_photons);
  }
  *message.mutable_coordinator_cpu() = ToProto(counters.coordinator_cpu);
  *message.mutable_worker_cpu() = ToProto(counters.worker_cpu);
  message.set_photons_per_second(report.photons_per_second);
  message.set_workers(report.workers);
  *message.mutable_tally() = ToProto(counters.tally);
  message.set_bytes_sent(counters.bytes_sent);
  message.set_bytes_received(counters.bytes_received);
  message.set_hitpoints_sent(counters.hitpoints_sent);
  message.set_hitpoints_returned(counters.hitpoints_returned);
  message.set_audits_agreed(counters.audits.agreed);
  message.set_not_audited(counters.audits.not_audited);
  message.set_audits_disputed(counters.audits.disputed);
  return message;
}

v1::SquaredError ErrorToProto(const SquaredError& error) {
  v1::SquaredError message;
  message.set_noise(error.noise);
  message.set_bias(error.bias);
  message.set_low(error.low);
  message.set_high(error.high);
  return message;
}

v1::ErrorSample SampleToProto(const ErrorSample& sample) {
  v1::ErrorSample message;
  message.set_passes(sample.passes);
  message.set_photons(sample.photons);
  *message.mutable_running() = ToProto(sample.running);
  *message.mutable_cpu() = ToProto(sample.cpu);
  *message.mutable_relative() = ErrorToProto(sample.estimate.relative);
  *message.mutable_absolute() = ErrorToProto(sample.estimate.absolute);
  message.set_relative_untrimmed(sample.estimate.untrimmed);
  message.set_left_out_pixels(sample.estimate.left_out_pixels);
  if (sample.truth) {
    message.set_true_relative(sample.truth->relative);
    message.set_true_absolute(sample.truth->absolute);
    message.set_true_relative_untrimmed(sample.truth->untrimmed);
  }
  message.set_missing_relative(sample.missing_relative);
  message.set_nothing_found(sample.nothing_found);
  if (sample.denoised) {
    v1::DenoisedError& denoised = *message.mutable_denoised();
    *denoised.mutable_relative() = ErrorToProto(sample.denoised->estimate.relative);
    denoised.set_relative_untrimmed(sample.denoised->estimate.untrimmed);
    if (const std::optional<TrueError>& truth = sample.denoised->truth) {
      denoised.set_true_relative(truth->relative);
      denoised.set_true_relative_untrimmed(truth->untrimmed);
    }
  }
  return message;
}

// The busiest first.
void AddShares(const std::map<std::string, WorkerShare>& workers, v1::Job& message) {
  std::vector<std::pair<std::string, WorkerShare>> shares(workers.begin(), workers.end());
  std::stable_sort(shares.begin(), shares.end(), [](const auto& a, const auto& b) {
    return a.second.photons > b.second.photons;
  });
  for (std::size_t i = 0; i < std::min(shares.size(), kMostShares); ++i) {
    const auto& [id, share] = shares[i];
    v1::WorkerShare& item = *message.add_worker_shares();
    item.set_worker_id(id);
    item.set_name(share.name);
    item.set_photons(share.photons);
    item.set_batches(share.batches);
    *item.mutable_cpu() = ToProto(share.cpu);
  }
}

v1::LightFinding LightToProto(const LightFinding& light) {
  v1::LightFinding message;
  message.set_name(light.name);
  message.set_power_share(light.power_share);
  message.set_photons_sent(light.photons.sent);
  message.set_in_view_caustic(light.photons.InView(PathClass::kCaustic));
  message.set_in_view_other(light.photons.InView(PathClass::kOther));
  message.set_missing_share(light.missing_share);
  return message;
}

v1::Bake BakeToProto(const BakeRecord& bake) {
  v1::Bake message;
  *message.mutable_settings() = ToProto(bake.settings);
  *message.mutable_overrides() = ToProto(bake.overrides);
  for (const BakeRoundRecord& round : bake.rounds) {
    v1::BakeRound& item = *message.add_rounds();
    item.set_name(round.name);
    item.set_points(static_cast<std::int64_t>(round.points));
    item.set_passes(round.passes);
    item.set_photons(round.photons);
    *item.mutable_cpu() = ToProto(round.cpu);
    if (round.error) *item.mutable_error() = SampleToProto(*round.error);
  }
  for (const SurfaceFigures& figures : bake.figures)
    *message.add_surfaces() = ToProto(figures);
  if (bake.interpolation_error) message.set_interpolation_error(*bake.interpolation_error);
  return message;
}

// What only the coordinator keeps of its rounds.
void AddRoundsOf(const BakeRecord& bake, v1::JobRecord& record) {
  for (const BakeRoundRecord& round : bake.rounds) {
    v1::BakeRoundRecord& item = *record.add_bake_rounds();
    item.set_sensors_digest(std::string(round.sensors.digest.Bytes()));
    item.set_sensors_bytes(round.sensors.size_bytes);
    if (round.image) item.set_image_digest(std::string(round.image->Bytes()));
    item.set_has_ended(round.has_ended);
    item.set_run(round.run);
    item.set_stop_reason(ReasonToProto(round.reason));
    *item.mutable_ran_before() = ToProto(round.ran_before);
    for (const LightFinding& light : round.lights)
      *item.add_lights() = LightToProto(light);
  }
  record.set_bake_runs(bake.runs);
  record.set_bake_begins_again(bake.begins_again);
  record.set_bake_is_stopped(bake.is_stopped);
  if (bake.uv_mesh) record.set_uv_mesh_digest(std::string(bake.uv_mesh->Bytes()));
}

}  // namespace

std::optional<JobState> FromProto(v1::JobState state) {
  for (const JobState known :
       {JobState::kQueued, JobState::kPreparing, JobState::kRunning, JobState::kPaused,
        JobState::kSucceeded, JobState::kCancelled, JobState::kFailed}) {
    if (StateToProto(known) == state) return known;
  }
  return std::nullopt;
}

v1::Job SummaryToProto(const JobReport& report) {
  const Job& job = report.job;
  const JobState state = job.life.state();
  v1::Job message;
  message.set_job_id(job.id);
  message.set_name(job.name);
  message.set_state(StateToProto(state));
  message.set_stop_reason(ReasonToProto(job.life.stop_reason()));
  message.set_failure(job.life.failure());
  *message.mutable_settings() = ToProto(job.settings);
  message.set_scene_digest(std::string(job.scene_digest.Bytes()));
  *message.mutable_progress() = ProgressToProto(report);
  *message.mutable_submitted_at() = ToProto(job.submitted_at);
  message.set_no_workers(state == JobState::kRunning && report.workers == 0);
  message.set_has_reference(job.reference.has_value());
  message.set_condition(job.condition);
  if (job.ended_at) *message.mutable_ended_at() = ToProto(*job.ended_at);
  message.set_owner(job.owner);
  message.set_priority(job.priority);
  message.set_pause_cause(CauseToProto(job.pause_cause));
  for (const PhotonStep& step : job.photon_steps)
    *message.add_photon_steps() = ToProto(step);
  if (job.bake) *message.mutable_bake() = BakeToProto(*job.bake);
  return message;
}

v1::Job ToProto(const JobReport& report) {
  const Job& job = report.job;
  v1::Job message = SummaryToProto(report);
  for (std::size_t i = 0; i < std::min(job.warnings.size(), kMostWarnings); ++i) {
    message.add_warnings(job.warnings[i]);
  }
  for (const Part part : AllParts()) {
    v1::PartUse& use = *message.add_parts();
    use.set_part(std::string(NameOf(part)));
    use.set_is_used(job.needs.Uses(part));
    use.set_reason(job.needs.ReasonOf(part));
  }
  for (const ErrorSample& sample : job.convergence)
    *message.add_convergence() = SampleToProto(sample);
  for (const LightFinding& light : job.lights)
    *message.add_lights() = LightToProto(light);
  AddShares(job.workers, message);
  std::vector<PassTally> parts = job.pass_record.tallies();
  if (job.tail.passes > 0) parts.push_back(job.tail);
  for (const PassTally& part : parts) {
    v1::PassEnergy& item = *message.add_energy_of_passes();
    item.set_first_pass(part.first_pass);
    item.set_passes(part.passes);
    *item.mutable_energy() = ToProto(part.tally).energy();
  }
  for (const JobEvent& event : job.events) {
    v1::JobEvent& item = *message.add_events();
    *item.mutable_at() = ToProto(event.at);
    item.set_what(event.what);
  }
  for (const PhotonKey& key : job.counters.dropped_photons) {
    v1::PhotonKey& item = *message.add_dropped_photons();
    item.set_pass(key.pass);
    item.set_index(key.index);
  }
  return message;
}

namespace {

WallTime TimeOf(const google::protobuf::Timestamp& message) {
  return WallTime(std::chrono::seconds(message.seconds()) +
                  std::chrono::nanoseconds(message.nanos()));
}

PauseCause CauseOf(const v1::Job& job) {
  switch (job.pause_cause()) {
    case v1::PAUSE_CAUSE_USER:
      return PauseCause::kUser;
    case v1::PAUSE_CAUSE_DISK:
      return PauseCause::kDisk;
    case v1::PAUSE_CAUSE_FAILED_BATCH:
      return PauseCause::kFailedBatch;
    case v1::PAUSE_CAUSE_DISPUTE:
      return PauseCause::kDispute;
    default:
      return PauseCause::kNone;
  }
}

// Of a job that goes on by itself: it waits for a turn in the next process.
JobState StateOf(const v1::Job& job) {
  switch (job.state()) {
    case v1::JOB_STATE_PAUSED:
      return GoesOnByItself(CauseOf(job)) ? JobState::kQueued : JobState::kPaused;
    case v1::JOB_STATE_SUCCEEDED:
      return JobState::kSucceeded;
    case v1::JOB_STATE_CANCELLED:
      return JobState::kCancelled;
    case v1::JOB_STATE_FAILED:
      return JobState::kFailed;
    default:
      return JobState::kQueued;
  }
}

StopReason ReasonOf(v1::StopReason reason) {
  switch (reason) {
    case v1::STOP_REASON_PASSES:
      return StopReason::kPasses;
    case v1::STOP_REASON_TIME:
      return StopReason::kTime;
    case v1::STOP_REASON_ERROR:
      return StopReason::kError;
    case v1::STOP_REASON_PHOTONS:
      return StopReason::kPhotons;
    case v1::STOP_REASON_USER:
      return StopReason::kUser;
    default:
      return StopReason::kNone;
  }
}

SquaredError ErrorOf(const v1::SquaredError& message) {
  return {.noise = message.noise(),
          .bias = message.bias(),
          .low = message.low(),
          .high = message.high()};
}

ErrorSample SampleOf(const v1::ErrorSample& message) {
  ErrorSample sample;
  sample.passes = message.passes();
  sample.photons = message.photons();
  sample.running = FromProto(message.running());
  sample.cpu = FromProto(message.cpu());
  sample.estimate.relative = ErrorOf(message.relative());
  sample.estimate.absolute = ErrorOf(message.absolute());
  sample.estimate.untrimmed = message.relative_untrimmed();
  sample.estimate.left_out_pixels = message.left_out_pixels();
  if (message.has_true_relative()) {
    sample.truth.emplace();
    sample.truth->relative = message.true_relative();
    sample.truth->absolute = message.true_absolute();
    sample.truth->untrimmed = message.true_relative_untrimmed();
  }
  sample.missing_relative = message.missing_relative();
  sample.nothing_found = message.nothing_found();
  if (message.has_denoised()) {
    const v1::DenoisedError& denoised = message.denoised();
    sample.denoised.emplace();
    sample.denoised->estimate = {.relative = ErrorOf(denoised.relative()),
                                 .untrimmed = denoised.relative_untrimmed()};
    if (denoised.has_true_relative()) {
      sample.denoised->truth = {.relative = denoised.true_relative(),
                                .untrimmed = denoised.true_relative_untrimmed()};
    }
  }
  return sample;
}

LightFinding LightOf(const v1::LightFinding& message) {
  LightFinding light;
  light.name = message.name();
  light.power_share = message.power_share();
  light.photons.sent = message.photons_sent();
  light.photons.in_view = {message.in_view_caustic(), message.in_view_other()};
  light.missing_share = message.missing_share();
  return light;
}

JobCounters CountersOf(const v1::Job& message) {
  const v1::Progress& progress = message.progress();
  JobCounters counters;
  counters.passes = progress.passes();
  counters.photons = progress.photons();
  if (progress.has_to_first_photons()) {
    counters.to_first_photons = FromProto(progress.to_first_photons());
  }
  counters.coordinator_cpu = FromProto(progress.coordinator_cpu());
  counters.worker_cpu = FromProto(progress.worker_cpu());
  counters.tally = FromProto(progress.tally());
  counters.bytes_sent = progress.bytes_sent();
  counters.bytes_received = progress.bytes_received();
  counters.hitpoints_sent = progress.hitpoints_sent();
  counters.hitpoints_returned = progress.hitpoints_returned();
  counters.audits = {.agreed = progress.audits_agreed(),
                     .not_audited = progress.not_audited(),
                     .disputed = progress.audits_disputed()};
  for (const v1::PhotonKey& key : message.dropped_photons())
    counters.dropped_photons.push_back({key.pass(), key.index()});
  return counters;
}

StatusOr<BakeRecord> BakeOf(const v1::JobRecord& record) {
  const v1::Bake& message = record.job().bake();
  BakeRecord bake;
  LUCERNA_ASSIGN_OR_RETURN(bake.settings, FromProto(message.settings()));
  LUCERNA_ASSIGN_OR_RETURN(bake.overrides, FromProto(message.overrides()));
  if (message.rounds_size() != record.bake_rounds_size()) {
    return absl::InvalidArgumentError("malformed record of a bake");
  }
  bake.is_stopped = record.bake_is_stopped();
  const int rounds = record.bake_begins_again() ? 0 : message.rounds_size();
  for (int i = 0; i < rounds; ++i) {
    const v1::BakeRound& shown = message.rounds(i);
    const v1::BakeRoundRecord& kept = record.bake_rounds(i);
    BakeRoundRecord& round = bake.rounds.emplace_back();
    round.name = shown.name();
    round.points = static_cast<std::uint64_t>(shown.points());
    LUCERNA_ASSIGN_OR_RETURN(round.sensors.digest, Digest::FromBytes(kept.sensors_digest()));
    round.sensors.size_bytes = kept.sensors_bytes();
    round.ran_before = FromProto(kept.ran_before());
    round.has_ended = kept.has_ended();
    round.run = kept.run();
    round.reason = ReasonOf(kept.stop_reason());
    if (!kept.image_digest().empty()) {
      LUCERNA_ASSIGN_OR_RETURN(round.image, Digest::FromBytes(kept.image_digest()));
    }
    round.passes = shown.passes();
    round.photons = shown.photons();
    round.cpu = FromProto(shown.cpu());
    if (shown.has_error()) round.error = SampleOf(shown.error());
    for (const v1::LightFinding& light : kept.lights())
      round.lights.push_back(LightOf(light));
  }
  bake.runs = record.bake_runs();
  for (const v1::SurfaceFigures& figures : message.surfaces())
    bake.figures.push_back(FromProto(figures));
  if (message.has_interpolation_error()) bake.interpolation_error = message.interpolation_error();
  if (!record.uv_mesh_digest().empty()) {
    LUCERNA_ASSIGN_OR_RETURN(bake.uv_mesh, Digest::FromBytes(record.uv_mesh_digest()));
  }
  return bake;
}

}  // namespace

std::string EncodeRecord(const Job& job, const std::optional<Digest>& image, Duration running) {
  JobReport report;
  report.job = job;
  report.running = running;
  v1::JobRecord record;
  *record.mutable_job() = ToProto(report);
  *record.mutable_scene() = ToProto(job.manifest);
  if (job.bake) AddRoundsOf(*job.bake, record);
  *record.mutable_needs() = ToProto(job.needs);
  record.set_scene_memory_bytes(job.scene_memory);
  if (job.reference) record.set_reference_digest(std::string(job.reference->Bytes()));
  if (image) record.set_image_digest(std::string(image->Bytes()));
  for (const std::string& worker : job.distrusted)
    record.add_distrusted_worker_ids(worker);
  for (const GuideStep& step : job.guides)
    *record.add_guides() = ToProto(step);
  return record.SerializeAsString();
}

StatusOr<DecodedRecord> DecodeRecord(const std::string& bytes, const Moment& moment) {
  v1::JobRecord record;
  if (!record.ParseFromString(bytes)) {
    return absl::InvalidArgumentError("malformed record of a job");
  }
  const v1::Job& message = record.job();
  DecodedRecord result;
  Job& job = result.job;
  job.id = message.job_id();
  job.name = message.name();
  LUCERNA_ASSIGN_OR_RETURN(job.manifest, FromProto(record.scene()));
  LUCERNA_ASSIGN_OR_RETURN(job.scene_digest, Digest::FromBytes(message.scene_digest()));
  JobState state = StateOf(message);
  std::string failure = message.failure();
  AddLaterSettings(*record.mutable_job()->mutable_settings());
  if (StatusOr<RenderSettings> settings = FromProto(message.settings()); settings.ok()) {
    job.settings = *std::move(settings);
  } else {
    // Another version of Lucerna has other settings: enough to show what has ended.
    job.settings = SettingsOf(message);
    if (state == JobState::kQueued || state == JobState::kPaused) {
      state = JobState::kFailed;
      failure = absl::StrCat("the job was submitted to another version of Lucerna (",
                             std::string(settings.status().message()), "); submit it again");
    }
  }
  job.warnings.assign(message.warnings().begin(), message.warnings().end());
  LUCERNA_ASSIGN_OR_RETURN(job.needs, FromProto(record.needs()));
  job.scene_memory = record.scene_memory_bytes();
  for (const v1::PartUse& use : message.parts()) {
    for (const Part part : AllParts()) {
      if (NameOf(part) == std::string_view(use.part())) job.needs.GiveReason(part, use.reason());
    }
  }
  job.submitted_at = TimeOf(message.submitted_at());
  result.running = FromProto(message.progress().running());
  job.life = JobLife({.state = state,
                      .stop_reason = ReasonOf(message.stop_reason()),
                      .failure = std::move(failure),
                      .submitted_at = moment.now - (moment.wall - job.submitted_at),
                      .ran = result.running});
  job.counters = CountersOf(message);
  if (!record.reference_digest().empty()) {
    LUCERNA_ASSIGN_OR_RETURN(job.reference, Digest::FromBytes(record.reference_digest()));
  }
  if (!record.image_digest().empty()) {
    LUCERNA_ASSIGN_OR_RETURN(result.image, Digest::FromBytes(record.image_digest()));
  }
  for (const v1::ErrorSample& sample : message.convergence())
    job.convergence.push_back(SampleOf(sample));
  for (const v1::LightFinding& light : message.lights())
    job.lights.push_back(LightOf(light));
  std::vector<PassTally> tallies;
  for (const v1::PassEnergy& part : message.energy_of_passes()) {
    PassTally& tally = tallies.emplace_back();
    tally.first_pass = part.first_pass();
    tally.passes = part.passes();
    tally.tally.energy = FromProto(part.energy());
  }
  job.pass_record = PassRecord(std::move(tallies));
  for (const v1::PhotonStep& step : message.photon_steps())
    job.photon_steps.push_back({step.first_pass(), step.photons_per_pass()});
  for (const v1::WorkerShare& share : message.worker_shares()) {
    job.workers[share.worker_id()] = {.name = share.name(),
                                      .photons = share.photons(),
                                      .batches = share.batches(),
                                      .cpu = FromProto(share.cpu())};
  }
  LUCERNA_ASSIGN_OR_RETURN(job.guides, FromProto(record.guides()));
  if (message.has_bake()) {
    LUCERNA_ASSIGN_OR_RETURN(job.bake, BakeOf(record));
  }
  job.distrusted.insert(record.distrusted_worker_ids().begin(),
                        record.distrusted_worker_ids().end());
  if (message.has_ended_at()) job.ended_at = TimeOf(message.ended_at());
  job.owner = message.owner();
  job.priority = message.priority();
  if (!GoesOnByItself(CauseOf(message))) {
    job.pause_cause = CauseOf(message);
    job.condition = message.condition();
  }
  for (const v1::JobEvent& event : message.events())
    job.events.push_back({TimeOf(event.at()), event.what()});
  return result;
}

}  // namespace lucerna
