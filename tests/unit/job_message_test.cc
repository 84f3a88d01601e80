// A record read by a later process says all that clients see of the job.
#include "server/job_message.h"

#include <algorithm>
#include <limits>
#include <set>
#include <string>

#include "gtest/gtest.h"

#include "render/report/progress_view.h"
#include "render/scene/setting_table.h"
#include "server/state/durable_state.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace {

const Moment kNow = {SteadyTime(std::chrono::hours(5)), Duration::zero(),
                     WallTime(std::chrono::hours(400'000))};

// With something in every field that clients see.
Job FullJob() {
  Job job;
  job.id = "i-7";
  job.name = "a name";
  job.manifest.main_path = "scene.pbrt";
  job.manifest.entries["scene.pbrt"] = {Sha256("scene"), 5};
  job.scene_digest = job.manifest.SceneDigest();
  RenderOverrides overrides;
  overrides.width = overrides.height = 8;
  overrides.alpha = 0.1 + 0.2;
  job.settings = ResolveSettings(overrides, Scene()).value();
  job.warnings = {"scene.pbrt:1:2: a warning"};
  job.needs = SceneNeeds(5, 3, {});
  job.scene_memory = 123'456'789'000;
  for (const Part part : AllParts())
    job.needs.GiveReason(part, absl::StrCat("reason ", std::string(NameOf(part))));
  job.submitted_at = kNow.wall - std::chrono::minutes(10);
  job.life = JobLife({.state = JobState::kSucceeded,
                      .stop_reason = StopReason::kError,
                      .failure = "",
                      .submitted_at = kNow.now - std::chrono::minutes(10),
                      .ran = std::chrono::nanoseconds(123'456'789)});
  job.counters.passes = 12;
  job.counters.photons = 34;
  job.counters.to_first_photons = std::chrono::milliseconds(5);
  job.counters.coordinator_cpu = std::chrono::milliseconds(6);
  job.counters.worker_cpu = std::chrono::milliseconds(7);
  job.counters.tally.photons = 34;
  job.counters.tally.energy.emitted = 4096;
  job.counters.tally.energy.escaped = 4096;
  job.counters.tally.lights = {{.sent = 34, .in_view = {1, 2}}};
  job.counters.dropped_photons = {{1, 2}, {3, 4}};
  job.counters.bytes_sent = 1;
  job.counters.bytes_received = 2;
  job.counters.hitpoints_sent = 3;
  job.counters.hitpoints_returned = 4;
  job.reference = Sha256("reference");
  ErrorSample sample;
  sample.passes = 4;
  sample.photons = 8;
  sample.running = std::chrono::seconds(1);
  sample.cpu = std::chrono::seconds(2);
  sample.estimate.relative = {0.1, 0.2, 0.3, std::numeric_limits<double>::infinity()};
  sample.estimate.absolute = {1, 2, 3, 4};
  sample.estimate.untrimmed = 0.7;
  sample.estimate.left_out_pixels = 9;
  sample.truth.emplace();
  sample.truth->relative = 0.5;
  sample.truth->absolute = 0.6;
  sample.truth->untrimmed = 0.8;
  sample.missing_relative = 0.25;
  sample.nothing_found = true;
  job.convergence = {sample, sample};
  job.convergence.back().denoised =
      DenoisedSample{.estimate = {.relative = {0.01, 0.02, 0.015, 0.05}, .untrimmed = 0.04},
                     .truth = TrueError{.relative = 0.03, .untrimmed = 0.06}};
  job.lights = {{.name = "light 1",
                 .power_share = 0.5,
                 .photons = {.sent = 3, .in_view = {1, 1}},
                 .missing_share = 0.1}};
  BatchTally tally;
  tally.energy.emitted = 7;
  tally.energy.escaped = 7;
  job.pass_record.Add(tally, 2);
  job.pass_record.Add(tally, 4);
  job.photon_steps = {{0, 100}, {8, 200}};
  job.workers["w-1"] = {
      .name = "host", .photons = 34, .batches = 2, .cpu = std::chrono::seconds(3)};
  job.ended_at = kNow.wall;
  job.condition = "paused: no room";
  job.events = {{kNow.wall, "went on"}};
  job.priority = -7;
  return job;
}

Job FullBake() {
  Job job = FullJob();
  BakeRecord bake;
  bake.settings = {.estimator = BakeEstimator::kNearest,
                   .sides = MeasuredSides::kBack,
                   .materials = {"floor", "wall"},
                   .spacing = 0.1,
                   .elements = MeshElements::kQuadratic,
                   .tolerance = 0.3,
                   .decimates = false,
                   .indirect_only = true,
                   .is_light_map = true};
  bake.overrides.error = 0.25;
  BakeRoundRecord survey;
  survey.name = "survey";
  survey.run = 3;
  survey.points = 5;
  survey.sensors = {Sha256("sensors"), 17};
  survey.ran_before = std::chrono::milliseconds(1);
  survey.has_ended = true;
  survey.reason = StopReason::kTime;
  survey.image = Sha256("survey's image");
  survey.passes = 16;
  survey.photons = 99;
  survey.cpu = std::chrono::milliseconds(2);
  survey.error = job.convergence[0];
  survey.lights = job.lights;
  BakeRoundRecord round;
  round.name = "round 1";
  round.run = 4;
  round.sensors = {Sha256("other sensors"), 18};
  bake.rounds = {survey, round};
  bake.runs = 4;
  bake.figures = {
      {.name = "0 floor", .triangles = 2, .area = 3, .lowest = 4, .highest = 5, .mean = 6}};
  bake.interpolation_error = 0.125;
  bake.uv_mesh = Sha256("mesh");
  job.bake = bake;
  return job;
}

std::string Seen(const Job& job, Duration running) {
  JobReport report;
  report.job = job;
  report.running = running;
  return ToProto(report).DebugString();
}

// What the user paused, or a batch that failed, stays so; what waited for the disk, or for
// a worker that decides, tries again.
TEST(JobMessageTest, ARecordOfAPausedJobSaysWhoPausedIt) {
  for (const PauseCause cause :
       {PauseCause::kUser, PauseCause::kFailedBatch, PauseCause::kDisk, PauseCause::kDispute}) {
    Job job = FullJob();
    job.life = JobLife({.state = JobState::kPaused});
    job.pause_cause = cause;
    job.condition = "paused: why";
    const auto read = DecodeRecord(EncodeRecord(job, std::nullopt, Duration::zero()), kNow);
    ASSERT_TRUE(read.ok()) << read.status();
    const bool goes_on = cause == PauseCause::kDisk || cause == PauseCause::kDispute;
    EXPECT_EQ(read->job.life.state(), goes_on ? JobState::kQueued : JobState::kPaused);
    EXPECT_EQ(read->job.pause_cause, goes_on ? PauseCause::kNone : cause);
    EXPECT_EQ(read->job.condition, goes_on ? "" : "paused: why");
  }
}

TEST(JobMessageTest, ASummaryLacksOnlyWhatGrowsWithTheJob) {
  JobReport report;
  report.job = FullJob();
  v1::Job whole = ToProto(report);
  report.job = SummaryOf(report.job);
  whole.clear_warnings();
  whole.clear_parts();
  whole.clear_convergence();
  whole.clear_lights();
  whole.clear_worker_shares();
  whole.clear_energy_of_passes();
  whole.clear_events();
  whole.clear_dropped_photons();
  EXPECT_EQ(SummaryToProto(report).DebugString(), whole.DebugString());
}

TEST(JobMessageTest, ASummaryOfABakeSaysHowFarItHasCome) {
  const Job summary = SummaryOf(FullBake());
  ASSERT_EQ(summary.bake->rounds.size(), 2U);
  EXPECT_EQ(summary.bake->rounds[0].passes, 16);
  EXPECT_FALSE(summary.bake->rounds[0].error);
  EXPECT_TRUE(summary.bake->rounds[0].lights.empty());
  EXPECT_TRUE(summary.bake->figures.empty());
}

// Later passes may have more photons: without their numbers a list would show more than is done.
TEST(JobMessageTest, ASummarySaysHowMuchIsDone) {
  JobReport report;
  report.job = FullJob();
  report.job.life = JobLife(kNow.now);
  ASSERT_TRUE(report.job.life.Prepare());
  ASSERT_TRUE(report.job.life.Run(kNow.now));
  report.job.settings.passes = 16;
  report.job.settings.photons_per_pass = 100;
  report.job.counters.passes = 12;
  report.job.counters.photons = 8 * 100 + 4 * 200;
  const std::optional<double> done = ShareDone(ToProto(report));
  ASSERT_TRUE(done);
  EXPECT_DOUBLE_EQ(*done, 1600.0 / 2400);
  report.job = SummaryOf(report.job);
  EXPECT_EQ(ShareDone(SummaryToProto(report)), done);
}

TEST(JobMessageTest, ARecordHoldsAllThatClientsSee) {
  const Job job = FullJob();
  const Duration running = job.life.Running(kNow.now);
  const auto read = DecodeRecord(EncodeRecord(job, Sha256("image"), running), kNow);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(Seen(read->job, read->running), Seen(job, running));
  EXPECT_EQ(read->running, running);
  EXPECT_EQ(read->image, Sha256("image"));
  EXPECT_EQ(read->job.manifest, job.manifest);
  EXPECT_EQ(read->job.settings, job.settings) << "to the bit";
  EXPECT_EQ(read->job.needs, job.needs);
  EXPECT_EQ(read->job.scene_memory, job.scene_memory);
  EXPECT_EQ(read->job.reference, job.reference);
  EXPECT_EQ(read->job.life.submitted_at(), job.life.submitted_at());
  EXPECT_EQ(read->job.life.state(), JobState::kSucceeded);
  EXPECT_EQ(read->job.life.failure(), "");
  EXPECT_EQ(read->job.life.Running(kNow.now + std::chrono::hours(1)), running)
      << "time stands still when a job has ended";
}

TEST(JobMessageTest, ARecordHoldsAllOfABake) {
  const Job job = FullBake();
  const auto read = DecodeRecord(EncodeRecord(job, std::nullopt, Duration::zero()), kNow);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(Seen(read->job, Duration::zero()), Seen(job, Duration::zero()));
  ASSERT_TRUE(read->job.bake);
  const BakeRecord& bake = *read->job.bake;
  EXPECT_EQ(bake.settings, job.bake->settings);
  EXPECT_EQ(bake.overrides, job.bake->overrides);
  EXPECT_EQ(bake.runs, 4);
  EXPECT_EQ(bake.uv_mesh, job.bake->uv_mesh);
  EXPECT_EQ(bake.interpolation_error, 0.125);
  ASSERT_EQ(bake.figures.size(), 1U);
  EXPECT_EQ(bake.figures[0].highest, 5);
  ASSERT_EQ(bake.rounds.size(), 2U);
  const BakeRoundRecord& survey = bake.rounds[0];
  EXPECT_EQ(survey.run, 3);
  EXPECT_EQ(survey.points, 5U);
  EXPECT_EQ(survey.sensors, job.bake->rounds[0].sensors);
  EXPECT_EQ(survey.image, job.bake->rounds[0].image);
  EXPECT_EQ(survey.ran_before, std::chrono::milliseconds(1));
  EXPECT_EQ(survey.cpu, std::chrono::milliseconds(2));
  EXPECT_TRUE(survey.has_ended);
  EXPECT_EQ(survey.reason, StopReason::kTime);
  EXPECT_EQ(survey.lights.size(), 1U);
  EXPECT_FALSE(bake.rounds[1].has_ended);
  EXPECT_FALSE(bake.rounds[1].image);
  EXPECT_FALSE(bake.rounds[1].error);
  EXPECT_EQ(RunIdOf(read->job), "i-7.4");
  EXPECT_EQ(ManifestOf(read->job), ManifestOf(job));
}

TEST(JobMessageTest, ABakeThatBeginsAgainHasNoRoundsInALaterProcess) {
  Job job = FullBake();
  job.bake->begins_again = true;
  job.bake->is_stopped = true;
  const auto read = DecodeRecord(EncodeRecord(job, std::nullopt, Duration::zero()), kNow);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_TRUE(read->job.bake->rounds.empty());
  EXPECT_TRUE(read->job.bake->is_stopped);
  EXPECT_EQ(read->job.bake->runs, 4) << "no name is used again";
}

TEST(JobMessageTest, ARecordWhoseRoundsDoNotAgreeIsMalformed) {
  v1::JobRecord record;
  ASSERT_TRUE(record.ParseFromString(EncodeRecord(FullBake(), std::nullopt, Duration::zero())));
  record.mutable_bake_rounds()->RemoveLast();
  EXPECT_FALSE(DecodeRecord(record.SerializeAsString(), kNow).ok());
}

TEST(JobMessageTest, AJobThatHasNotEndedWaitsAgain) {
  Job job = FullJob();
  job.life = JobLife(kNow.now);
  ASSERT_TRUE(job.life.Prepare());
  ASSERT_TRUE(job.life.Run(kNow.now));
  const auto read = DecodeRecord(EncodeRecord(job, std::nullopt, std::chrono::seconds(3)), kNow);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->job.life.state(), JobState::kQueued) << read->job.life.failure();
  EXPECT_EQ(read->job.life.Running(kNow.now), std::chrono::seconds(3));
  EXPECT_FALSE(read->image);
}

// `record` without the settings of these names.
std::string WithoutSettings(v1::JobRecord record, const std::set<std::string>& names) {
  auto& settings = *record.mutable_job()->mutable_settings()->mutable_settings();
  const auto is_named = [&](const v1::Setting& item) { return names.contains(item.name()); };
  settings.erase(std::remove_if(settings.begin(), settings.end(), is_named), settings.end());
  return record.SerializeAsString();
}

TEST(JobMessageTest, SettingsOfAnotherVersionFailAJobThatWaitsAndShowOneThatEnded) {
  v1::JobRecord record;
  ASSERT_TRUE(record.ParseFromString(EncodeRecord(FullJob(), std::nullopt, Duration::zero())));
  const auto ended = DecodeRecord(WithoutSettings(record, {"alpha"}), kNow);
  ASSERT_TRUE(ended.ok()) << ended.status();
  EXPECT_EQ(ended->job.life.state(), JobState::kSucceeded);
  record.mutable_job()->set_state(v1::JOB_STATE_RUNNING);
  const auto waits = DecodeRecord(WithoutSettings(record, {"alpha"}), kNow);
  ASSERT_TRUE(waits.ok()) << waits.status();
  EXPECT_EQ(waits->job.life.state(), JobState::kFailed);
  EXPECT_NE(waits->job.life.failure().find("another version"), std::string::npos);
}

// The first build that kept jobs had these settings. A coordinator that takes its place goes on
// with the jobs, which render as they did then: whatever was added since must say how.
TEST(JobMessageTest, AJobOfTheOldestRecordsGoesOnAsItWas) {
  const std::set<std::string> of_oldest = {"size",
                                           "passes",
                                           "time_s",
                                           "error",
                                           "photons",
                                           "photons_per_pass",
                                           "seed",
                                           "kernel",
                                           "initial_radius",
                                           "max_depth",
                                           "adaptive_photons",
                                           "radius_controller",
                                           "alpha",
                                           "bias",
                                           "use_everything",
                                           "frequency_share"};
  std::set<std::string> later;
  for (const Setting& setting : AllSettings()) {
    if (!of_oldest.contains(std::string(setting.name))) later.insert(std::string(setting.name));
  }
  ASSERT_GE(later.size(), 4U);
  Job job = FullJob();
  job.life = JobLife(kNow.now);
  job.settings.crop_x0 = 1;
  // What they had before there was a choice.
  job.settings.unguided = true;
  job.settings.spectral = false;
  job.settings.coverage = false;
  job.settings.denoise = false;
  v1::JobRecord record;
  ASSERT_TRUE(record.ParseFromString(EncodeRecord(job, std::nullopt, Duration::zero())));
  const auto read = DecodeRecord(WithoutSettings(record, later), kNow);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->job.life.state(), JobState::kQueued) << read->job.life.failure();
  EXPECT_EQ(read->job.settings, job.settings);
}

TEST(JobMessageTest, RefusesOtherBytes) {
  EXPECT_FALSE(DecodeRecord("", kNow).ok());
  EXPECT_FALSE(DecodeRecord("not a record", kNow).ok());
}

TEST(DurableStateTest, PutsADamagedRowAsideAndSaysSo) {
  const TemporaryFolder folder;
  JournalEntry entry;
  {
    const auto state = DurableState::Open(folder.At("state"), "i", kNow).value();
    for (const std::uint64_t serial : {7U, 8U}) {
      entry.serial = serial;
      entry.request_id = absl::StrCat("request ", serial);
      entry.job = FullJob();
      entry.job.id = absl::StrCat("i-", serial);
      ASSERT_TRUE(state->BeginSave(entry, Duration::zero())().ok());
    }
  }
  {
    const auto store = StateStore::Open(folder.At("state/lucerna.db"), "i").value();
    StoredJob row = store->Load()->front();
    row.record[row.record.size() / 2] = static_cast<char>(row.record[row.record.size() / 2] ^ 1);
    ASSERT_TRUE(store->Save(row).ok());
  }
  const auto state = DurableState::Open(folder.At("state"), "j", kNow).value();
  EXPECT_EQ(state->instance(), "i");
  EXPECT_EQ(state->next_serial(), 9U);
  ASSERT_EQ(state->problems().size(), 1U);
  EXPECT_NE(state->problems()[0].find("job i-7"), std::string::npos);
  const std::vector<JournalEntry> jobs = state->TakeJobs();
  ASSERT_EQ(jobs.size(), 1U);
  EXPECT_EQ(jobs[0].job.id, "i-8");
  EXPECT_EQ(jobs[0].request_id, "request 8");
}

}  // namespace
}  // namespace lucerna
