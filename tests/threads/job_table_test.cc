// Whatever comes to a job in whatever order, its thread never waits for a runner that nobody stops.
//
// The table with runners that render nothing. The orders of a cancel and a runner are tried one by
// one, then many threads ask for everything at once.
#include "server/job_table.h"

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "gtest/gtest.h"

#include "render/math/rng.h"

namespace lucerna {
namespace {

Moment MomentAt(int s) {
  return {SteadyTime(std::chrono::seconds(s)), std::chrono::seconds(s)};
}

// Runs until it is stopped, finished, or has an end of 0 passes.
class FakeRunner final : public RunningJob {
 public:
  StatusOr<RenderResult> Run() {
    const MutexLock lock(mutex_);
    while (!why_stopped_ && !is_finished_ && !gives_up_turn_ && passes_ > 1)
      changed_.Wait(mutex_);
    if (why_stopped_) return *why_stopped_;
    RenderResult result;
    result.gave_up_turn = gives_up_turn_;
    result.reason = is_finished_ ? StopReason::kUser : StopReason::kPasses;
    return result;
  }
  StatusOr<RenderResult> Resume() override { return Run(); }
  void SetEnd(const RenderSettings& settings) override {
    const MutexLock lock(mutex_);
    passes_ = settings.passes;
    changed_.NotifyAll();
  }
  void Reopen(const RenderSettings& settings) override {
    const MutexLock lock(mutex_);
    is_finished_ = false;
    passes_ = settings.passes;
  }
  void Finish() override {
    const MutexLock lock(mutex_);
    is_finished_ = true;
    changed_.NotifyAll();
  }
  void Stop(Status why) override {
    const MutexLock lock(mutex_);
    if (!why_stopped_) why_stopped_ = std::move(why);
    changed_.NotifyAll();
  }
  [[nodiscard]] Status CheckEmission(const BatchTally& /*tally*/) const override {
    return absl::OkStatus();
  }
  void SetGivesUpTurn(bool gives_up_turn) override {
    const MutexLock lock(mutex_);
    gives_up_turn_ = gives_up_turn;
    changed_.NotifyAll();
  }
  void Wake() override {}
  std::optional<WorkBlobs> BlobsOf(std::uint64_t) const override { return WorkBlobs{}; }
  std::optional<std::size_t> HitpointsIn(const Digest&) const override { return 0; }
  StatusOr<RenderResult> ImageSoFar() const override { return RenderResult{}; }

  [[nodiscard]] bool gives_up_turn() const {
    const MutexLock lock(mutex_);
    return gives_up_turn_;
  }
  [[nodiscard]] bool is_stopped() const {
    const MutexLock lock(mutex_);
    return why_stopped_.has_value();
  }

 private:
  mutable Mutex mutex_;
  Condition changed_;
  std::int64_t passes_ = 0;
  bool is_finished_ = false;
  bool gives_up_turn_ = false;
  std::optional<Status> why_stopped_;
};

CheckedJob JobOf(const std::string& request_id, std::int64_t passes = 1000) {
  CheckedJob job;
  job.submission.request_id = request_id;
  job.submission.manifest.main_path = "scene.pbrt";
  job.settings.passes = passes;
  job.settings.width = job.settings.height = job.settings.crop_x1 = job.settings.crop_y1 = 8;
  return job;
}

JobTable::Options SmallTable() {
  return {.instance = "t", .max_waiting = 4, .retention = {}};
}

std::string Added(JobTable& table, const std::string& request_id) {
  const auto submitted = table.Add(JobOf(request_id), WallTime(), MomentAt(0));
  EXPECT_TRUE(submitted.ok()) << submitted.status();
  return submitted.ok() ? submitted->job_id : std::string();
}

JobState StateOf(const JobTable& table, const std::string& job) {
  return table.Find(job)->life.state();
}

// The thread of jobs, as the coordinator has it.
void RunTurns(JobTable& table) {
  while (auto turn = table.WaitForTurn()) {
    StatusOr<RenderResult> result = absl::CancelledError("the job has ended");
    if (turn->runner) {
      table.OnRunning(turn->job_id, MomentAt(1));
      result = turn->runner->Resume();
    } else {
      const auto runner = std::make_shared<FakeRunner>();
      if (table.Attach(turn->job_id, runner)) {
        table.OnRunning(turn->job_id, MomentAt(1));
        result = runner->Run();
      }
    }
    if (result.ok() && result->gave_up_turn) {
      table.GiveUpTurn(turn->job_id, MomentAt(2));
    } else if (result.ok()) {
      const Blob image = std::make_shared<const std::string>("image");
      table.Succeed(turn->job_id, result->reason, image, MomentAt(2));
    } else {
      table.Fail(turn->job_id, result.status(), MomentAt(2));
    }
  }
}

TEST(JobTableTest, FindsAJobByItsOwnIdOnly) {
  JobTable table(SmallTable());
  ASSERT_EQ(Added(table, "a"), "t-1");
  EXPECT_TRUE(table.Find("t-1"));
  for (const char* other : {"", "t", "t-", "t-0", "t-2", "t-01", "t-1x", "t--1", "u-1", "t-1-1",
                            "t-18446744073709551617"}) {
    EXPECT_FALSE(table.Find(other)) << other;
  }
}

TEST(JobTableTest, AnIdHasARandomPartAndEachOwnerHasRequestIdsOfTheirOwn) {
  JobTable::Options options = SmallTable();
  int random = 0;
  options.random_part = [&random] { return "r" + std::to_string(++random); };
  options.max_waiting = 10;
  options.max_waiting_of_owner = 2;
  JobTable table(options);
  const auto add = [&table](const std::string& request_id, const std::string& owner) {
    CheckedJob job = JobOf(request_id);
    job.submission.owner = owner;
    return table.Add(std::move(job), WallTime(), MomentAt(0));
  };
  ASSERT_EQ(add("a", "alice")->job_id, "t-1-r1");
  EXPECT_TRUE(table.Find("t-1-r1"));
  for (const char* other : {"t-1", "t-1-", "t-1-r2", "t-1-r1-", "t-1-r", "t-2-r1"})
    EXPECT_FALSE(table.Find(other)) << other;
  EXPECT_EQ(add("a", "alice")->job_id, "t-1-r1") << "the same request";
  EXPECT_EQ(add("a", "bob")->job_id, "t-2-r2");
  EXPECT_EQ(add("a", "")->job_id, "t-3-r3");
  EXPECT_EQ(*table.OwnerOf("t-2-r2"), "bob");
  EXPECT_TRUE(absl::IsNotFound(table.OwnerOf("t-2").status()));
  EXPECT_EQ(table.FindRequest("a", "bob")->job_id, "t-2-r2");
  EXPECT_FALSE(table.FindRequest("a", "carol"));

  ASSERT_TRUE(add("b", "alice").ok());
  EXPECT_TRUE(absl::IsResourceExhausted(add("c", "alice").status())) << "two have not ended";
  EXPECT_TRUE(add("c", "bob").ok()) << "others are not held up";
  ASSERT_TRUE(table.Cancel("t-1-r1", MomentAt(1)).ok());
  EXPECT_TRUE(add("c", "alice").ok());
}

TEST(JobTableTest, ACancelBeforeTheRunnerKeepsItFromRunning) {
  JobTable table(SmallTable());
  const std::string job = Added(table, "a");
  ASSERT_TRUE(table.WaitForTurn());
  EXPECT_EQ(table.Cancel(job, MomentAt(1))->job.life.state(), JobState::kCancelled);
  EXPECT_TRUE(absl::IsCancelled(table.CheckStillNeeded(job)));
  EXPECT_FALSE(table.Attach(job, std::make_shared<FakeRunner>()));
}

// Between the runner and its first step: the stop has to reach it all the same.
TEST(JobTableTest, ACancelAfterTheRunnerStopsItAlsoBeforeItRuns) {
  JobTable table(SmallTable());
  const std::string job = Added(table, "a");
  ASSERT_TRUE(table.WaitForTurn());
  const auto runner = std::make_shared<FakeRunner>();
  ASSERT_TRUE(table.Attach(job, runner));
  EXPECT_EQ(StateOf(table, job), JobState::kPreparing);
  EXPECT_TRUE(table.Cancel(job, MomentAt(1)).ok());
  EXPECT_TRUE(runner->is_stopped());
  EXPECT_EQ(runner.use_count(), 1) << "the table lets go of it";
}

TEST(JobTableTest, ClosingStopsTheRunnerAndGivesNoOther) {
  JobTable table(SmallTable());
  const std::string job = Added(table, "a");
  const std::string next = Added(table, "b");
  const auto turn = table.WaitForTurn();
  ASSERT_TRUE(turn);
  const auto runner = std::make_shared<FakeRunner>();
  ASSERT_TRUE(table.Attach(job, runner));
  table.Close(absl::UnavailableError("closing"));
  EXPECT_TRUE(runner->is_stopped());
  EXPECT_FALSE(table.WaitForTurn());
  EXPECT_FALSE(table.Attach(next, std::make_shared<FakeRunner>()));
  EXPECT_TRUE(absl::IsUnavailable(table.Add(JobOf("c"), WallTime(), MomentAt(0)).status()));
}

TEST(JobTableTest, JobsTakeTurnsInOrderAndTooManyAreRefused) {
  JobTable table(SmallTable());
  const std::vector<std::string> jobs = {Added(table, "a"), Added(table, "b"), Added(table, "c"),
                                         Added(table, "d")};
  EXPECT_TRUE(absl::IsResourceExhausted(table.Add(JobOf("e"), WallTime(), MomentAt(0)).status()));
  EXPECT_EQ(table.Add(JobOf("b"), WallTime(), MomentAt(0))->job_id, jobs[1]) << "the same request";
  EXPECT_TRUE(table.Cancel(jobs[1], MomentAt(0)).ok());
  {
    const auto first = table.WaitForTurn();
    EXPECT_EQ(first->job_id, jobs[0]);
    EXPECT_TRUE(first->scene.has_value()) << "read already when it came";
  }
  const auto second = table.WaitForTurn();
  EXPECT_EQ(second->job_id, jobs[2]);
  EXPECT_FALSE(second->scene.has_value());
}

TEST(JobTableTest, GivesFilesBackWhenAJobCannotNeedThemAnyMore) {
  BlobStore blobs(4);
  const Digest file = Sha256("file");
  ASSERT_TRUE(blobs.Put(file, "file").ok());
  const auto is_pinned = [&] { return !blobs.Put(Sha256("mine"), "mine").ok(); };
  {
    JobTable table(SmallTable());
    CheckedJob job = JobOf("a");
    job.pinned.push_back(*blobs.Pin(file));
    const std::string id = table.Add(std::move(job), WallTime(), MomentAt(0))->job_id;
    auto turn = table.WaitForTurn();
    ASSERT_TRUE(turn);
    EXPECT_TRUE(table.Cancel(id, MomentAt(1)).ok());
    EXPECT_TRUE(is_pinned()) << "its thread may still read";
    turn.reset();
    EXPECT_FALSE(is_pinned());
  }
}

// Remembers what a disk would, and may be full.
class FakeJournal final : public JobJournal {
 public:
  Written BeginSave(const JournalEntry& entry, Duration /*running*/) override {
    return [this, entry]() -> Status {
      if (const auto call = at_write) call();  // a copy: it may be replaced meanwhile
      if (is_full) return absl::ResourceExhaustedError("no room");
      rows[entry.serial] = entry;
      return absl::OkStatus();
    };
  }
  Written BeginRemove(std::uint64_t serial) override {
    return [this, serial]() -> Status {
      if (const auto call = at_write) call();  // a copy: it may be replaced meanwhile
      if (is_full) return absl::ResourceExhaustedError("no room");
      rows.erase(serial);
      return absl::OkStatus();
    };
  }
  [[nodiscard]] std::vector<JournalEntry> AtTheNextStart() const {
    std::vector<JournalEntry> jobs;
    for (const auto& [serial, row] : rows) {
      JournalEntry job = row;
      job.job.life = JobLife({.state = row.job.life.state()});
      jobs.push_back(job);
    }
    return jobs;
  }

  bool is_full = false;
  std::function<void()> at_write;  // while the disk is written
  std::map<std::uint64_t, JournalEntry> rows;
};

JobTable::Options TableWith(FakeJournal& journal) {
  return {.instance = "t", .max_waiting = 4, .retention = {}, .journal = &journal};
}

TEST(JobTableTest, AJobThatCannotBeWrittenDownIsRefusedAndLeavesNoTrace) {
  FakeJournal journal;
  JobTable table(TableWith(journal));
  journal.is_full = true;
  EXPECT_TRUE(absl::IsResourceExhausted(table.Add(JobOf("a"), WallTime(), MomentAt(0)).status()));
  EXPECT_FALSE(table.FindRequest("a"));
  EXPECT_TRUE(table.List({}, 10, 0, MomentAt(0)).first.empty());
  journal.is_full = false;
  EXPECT_EQ(Added(table, "a"), "t-1") << "no number is lost";
}

TEST(JobTableTest, NobodySeesAJobBeforeItIsOnTheDiskAndNobodyWaitsForTheDiskOfAnother) {
  FakeJournal journal;
  JobTable table(TableWith(journal));
  const std::string first = Added(table, "first");
  int writes = 0;
  journal.at_write = [&] {
    ++writes;
    // These would wait for ever if the table were locked.
    EXPECT_FALSE(table.FindRequest("new"));
    EXPECT_EQ(table.List({}, 10, 0, MomentAt(0)).first.size(), 1U);
    EXPECT_TRUE(table.ReportOf(first, MomentAt(0)).ok());
  };
  const std::string job = Added(table, "new");
  EXPECT_EQ(writes, 1);
  journal.at_write = [&] {
    ++writes;
    EXPECT_TRUE(table.ReportOf(first, MomentAt(0)).ok());
  };
  EXPECT_TRUE(table.SetPriority(job, 1, MomentAt(0)).ok());
  EXPECT_TRUE(table.Pause(job, PauseCause::kUser, "paused", MomentAt(0)).ok());
  EXPECT_TRUE(table.Resume(job, MomentAt(0)).ok());
  EXPECT_TRUE(table.Cancel(job, MomentAt(0)).ok());
  EXPECT_TRUE(table.Delete(job, MomentAt(0)).ok());
  EXPECT_EQ(writes, 6);
  EXPECT_FALSE(journal.rows.contains(2));
}

TEST(JobTableTest, ARequestThatComesTwiceWaitsForTheDiskAndIsOneJob) {
  FakeJournal journal;
  JobTable table(TableWith(journal));
  std::atomic<bool> has_come = false;
  std::string second;
  std::thread other;
  journal.at_write = [&] {
    journal.at_write = nullptr;
    other = std::thread([&] {
      has_come = true;
      second = Added(table, "a");
    });
    while (!has_come)
      std::this_thread::yield();
  };
  const std::string first = Added(table, "a");
  other.join();
  EXPECT_EQ(second, first);
  EXPECT_EQ(journal.rows.size(), 1U);
}

TEST(JobTableTest, AJobThatIsBeingDeletedIsNotExtendedNorWrittenAgain) {
  FakeJournal journal;
  JobTable table(TableWith(journal));
  const std::string job = Added(table, "a");
  table.NoteContributor(job, "w", "worker");
  ASSERT_TRUE(table.Cancel(job, MomentAt(0)).ok());
  journal.at_write = [&] {
    journal.at_write = nullptr;
    RenderOverrides until;
    until.passes = 2000;
    EXPECT_TRUE(absl::IsNotFound(table.Extend(job, until, MomentAt(1)).status()));
    table.TakeOut("w", MomentAt(1));
    EXPECT_TRUE(table.Find(job));
  };
  EXPECT_TRUE(table.Delete(job, MomentAt(1)).ok());
  EXPECT_TRUE(journal.rows.empty());
  table.SaveUnsaved(MomentAt(1));
  EXPECT_TRUE(journal.rows.empty());
}

TEST(JobTableTest, ALaterTableHasTheSameJobsInTheSameOrder) {
  FakeJournal journal;
  const Digest image = Sha256("image");
  {
    JobTable table(TableWith(journal));
    Added(table, "done");
    Added(table, "running");
    Added(table, "cancelled");
    Added(table, "waiting");
    ASSERT_EQ(table.WaitForTurn()->job_id, "t-1");
    table.OnRunning("t-1", MomentAt(1));
    ASSERT_TRUE(table.Succeed("t-1", StopReason::kPasses, nullptr, MomentAt(2), image));
    ASSERT_EQ(table.WaitForTurn()->job_id, "t-2");
    ASSERT_TRUE(table.Cancel("t-3", MomentAt(2)).ok());
  }
  JobTable table(TableWith(journal));
  table.Restore(journal.AtTheNextStart(), 9, MomentAt(3));
  EXPECT_EQ(StateOf(table, "t-1"), JobState::kSucceeded);
  EXPECT_EQ(table.FindImage("t-1", MomentAt(3))->image_digest, image);
  EXPECT_EQ(StateOf(table, "t-2"), JobState::kQueued);
  EXPECT_EQ(StateOf(table, "t-3"), JobState::kCancelled);
  EXPECT_EQ(Added(table, "done"), "t-1") << "the same request";
  EXPECT_EQ(Added(table, "new"), "t-9");
  EXPECT_EQ(table.WaitForTurn()->job_id, "t-2");
  EXPECT_EQ(table.WaitForTurn()->job_id, "t-4");
  EXPECT_EQ(table.WaitForTurn()->job_id, "t-9");
}

TEST(JobTableTest, AJobWithANewEndWaitsBehindTheOthersAlsoInALaterTable) {
  FakeJournal journal;
  {
    JobTable table(TableWith(journal));
    Added(table, "a");
    Added(table, "b");
    ASSERT_TRUE(table.WaitForTurn());
    const auto runner = std::make_shared<FakeRunner>();
    ASSERT_TRUE(table.Attach("t-1", runner));
    table.OnRunning("t-1", MomentAt(1));
    ASSERT_TRUE(table.Succeed("t-1", StopReason::kPasses, nullptr, MomentAt(2), Sha256("image")));
    RenderOverrides until;
    until.passes = 2000;
    ASSERT_TRUE(table.Extend("t-1", until, MomentAt(3)).ok());
    EXPECT_FALSE(journal.rows.at(1).image_digest) << "its image grows from now on";
  }
  JobTable table(TableWith(journal));
  table.Restore(journal.AtTheNextStart(), 3, MomentAt(3));
  EXPECT_EQ(table.WaitForTurn()->job_id, "t-2");
  const auto turn = table.WaitForTurn();
  EXPECT_EQ(turn->job_id, "t-1");
  EXPECT_EQ(turn->settings.passes, 2000);
}

TEST(JobTableTest, WhatCouldNotBeWrittenIsWrittenLater) {
  FakeJournal journal;
  JobTable table(TableWith(journal));
  const std::string job = Added(table, "a");
  journal.is_full = true;
  EXPECT_TRUE(table.Cancel(job, MomentAt(1)).ok());
  EXPECT_EQ(StateOf(table, job), JobState::kCancelled);
  table.SaveUnsaved(MomentAt(1));
  EXPECT_EQ(journal.rows.at(1).job.life.state(), JobState::kQueued);
  journal.is_full = false;
  table.SaveUnsaved(MomentAt(1));
  EXPECT_EQ(journal.rows.at(1).job.life.state(), JobState::kCancelled);
}

TEST(JobTableTest, ForgetsAJobOnRequestWhenItHasEndedAndSaysWhichFilesAreNeeded) {
  FakeJournal journal;
  JobTable table(TableWith(journal));
  CheckedJob checked = JobOf("a");
  checked.submission.manifest.entries["scene.pbrt"] = {Sha256("scene"), 5};
  const std::string job = table.Add(std::move(checked), WallTime(), MomentAt(0))->job_id;
  EXPECT_TRUE(absl::IsNotFound(table.Delete("t-2", MomentAt(0))));
  EXPECT_TRUE(absl::IsFailedPrecondition(table.Delete(job, MomentAt(0))));
  EXPECT_EQ(table.Needed().blobs, std::set<Digest>{Sha256("scene")});
  EXPECT_EQ(table.Needed().checkpoints, std::set<std::string>{job});
  EXPECT_TRUE(table.Cancel(job, MomentAt(1)).ok());
  EXPECT_TRUE(table.Needed().checkpoints.empty());
  table.OnCheckpoint(job);
  EXPECT_TRUE(table.Needed().checkpoints.empty()) << "written while the cancel came";
  journal.is_full = true;
  EXPECT_TRUE(absl::IsResourceExhausted(table.Delete(job, MomentAt(1))));
  EXPECT_TRUE(table.Find(job));
  journal.is_full = false;
  EXPECT_TRUE(table.Delete(job, MomentAt(1)).ok());
  EXPECT_FALSE(table.Find(job));
  EXPECT_TRUE(journal.rows.empty());
  EXPECT_TRUE(table.Needed().blobs.empty());
}

TEST(JobTableTest, OldJobsAreDroppedFromTheJournalTooAndLaterWhenItIsFull) {
  FakeJournal journal;
  JobTable::Options options = TableWith(journal);
  options.retention.jobs = 1;
  JobTable table(options);
  for (const char* request : {"a", "b", "c"}) {
    const std::string job = Added(table, request);
    journal.is_full = std::string(request) == "c";
    EXPECT_TRUE(table.Cancel(job, MomentAt(1)).ok() || journal.is_full);
    if (std::string(request) == "b") {
      EXPECT_EQ(journal.rows.size(), 1U);
    }
  }
  EXPECT_EQ(journal.rows.size(), 2U);
  journal.is_full = false;
  table.SaveUnsaved(MomentAt(1));
  ASSERT_EQ(journal.rows.size(), 1U);
  EXPECT_EQ(journal.rows.at(3).job.life.state(), JobState::kCancelled);
}

// Time that a job is paused is not time that it runs.
TEST(JobTableTest, TimeStandsStillWhileAJobIsPausedAndItsEventsSayWhy) {
  JobTable table(SmallTable());
  const std::string job = Added(table, "a");
  ASSERT_TRUE(table.WaitForTurn());
  table.OnRunning(job, MomentAt(10));
  table.SetCondition(job, PauseCause::kDisk, "paused: no room", MomentAt(13));
  table.SetCondition(job, PauseCause::kDisk, "paused: no room", MomentAt(15));
  EXPECT_EQ(table.ReportOf(job, MomentAt(20))->running, std::chrono::seconds(3));
  EXPECT_EQ(table.ReportOf(job, MomentAt(20))->job.condition, "paused: no room");
  table.SetCondition(job, PauseCause::kDisk, "", MomentAt(20));
  EXPECT_EQ(table.ReportOf(job, MomentAt(24))->running, std::chrono::seconds(7));
  const std::vector<JobEvent> events = table.Find(job)->events;
  ASSERT_EQ(events.size(), 2U);
  EXPECT_EQ(events[0].what, "paused: no room");
  EXPECT_EQ(events[1].what, "went on");
}

// The disk's cause is reported once, a dispute at each tick.
TEST(JobTableTest, ADisputeAndAFullDiskDoNotEndEachOther) {
  JobTable table(SmallTable());
  const std::string job = Added(table, "a");
  ASSERT_TRUE(table.WaitForTurn());
  table.OnRunning(job, MomentAt(0));
  table.SetCondition(job, PauseCause::kDispute, "waits for another worker", MomentAt(1));
  EXPECT_EQ(table.Find(job)->pause_cause, PauseCause::kDispute);
  EXPECT_EQ(table.Find(job)->life.state(), JobState::kPaused);
  table.SetCondition(job, PauseCause::kDisk, "", MomentAt(2));
  EXPECT_EQ(table.Find(job)->pause_cause, PauseCause::kDispute);
  table.SetCondition(job, PauseCause::kDisk, "paused: no room", MomentAt(3));
  table.SetCondition(job, PauseCause::kDispute, "waits for another worker", MomentAt(4));
  table.SetCondition(job, PauseCause::kDispute, "", MomentAt(5));
  EXPECT_EQ(table.Find(job)->pause_cause, PauseCause::kDisk);
  EXPECT_EQ(table.Find(job)->condition, "paused: no room");
  table.SetCondition(job, PauseCause::kDisk, "", MomentAt(6));
  EXPECT_EQ(table.Find(job)->pause_cause, PauseCause::kNone);
  table.SetCondition(job, PauseCause::kDispute, "waits for another worker", MomentAt(7));
  table.SetCondition(job, PauseCause::kDispute, "", MomentAt(8));
  EXPECT_EQ(table.Find(job)->life.state(), JobState::kRunning);
  EXPECT_EQ(table.Find(job)->condition, "");
}

JobTable::Options TwoAtOnce() {
  return {.instance = "t", .max_waiting = 8, .max_at_once = 2, .retention = {}};
}

TEST(JobTableTest, APausedJobLetsAnotherHaveItsPlaceAndGoesOnWithItsRunner) {
  JobTable table(SmallTable());
  const std::string job = Added(table, "a");
  const std::string next = Added(table, "b");
  const auto runner = std::make_shared<FakeRunner>();
  {
    const auto turn = table.WaitForTurn();
    ASSERT_TRUE(table.Attach(job, runner));
    table.OnRunning(job, MomentAt(1));
    const auto paused = table.Pause(job, PauseCause::kUser, "paused by its user", MomentAt(3));
    EXPECT_EQ(paused->job.life.state(), JobState::kPaused);
    EXPECT_EQ(paused->job.condition, "paused by its user");
    // Before its own turn has ended.
    const auto other = table.WaitForTurn();
    EXPECT_EQ(other->job_id, next);
    EXPECT_TRUE(runner->Run()->gave_up_turn);
    table.GiveUpTurn(job, MomentAt(4));
    EXPECT_EQ(StateOf(table, job), JobState::kPaused);
    EXPECT_TRUE(table.Cancel(next, MomentAt(5)).ok());
  }
  EXPECT_EQ(table.ReportOf(job, MomentAt(9))->running, std::chrono::seconds(2));
  EXPECT_EQ(table.Resume(job, MomentAt(9))->job.life.state(), JobState::kQueued);
  EXPECT_EQ(table.Find(job)->condition, "");
  const auto turn = table.WaitForTurn();
  EXPECT_EQ(turn->job_id, job);
  EXPECT_EQ(turn->runner, runner);
  table.OnRunning(job, MomentAt(10));
  EXPECT_EQ(table.ReportOf(job, MomentAt(13))->running, std::chrono::seconds(5));
}

TEST(JobTableTest, AJobThatIsResumedBeforeItsTurnHasEndedWaitsForThat) {
  JobTable table(TwoAtOnce());
  const std::string job = Added(table, "a");
  auto turn = table.WaitForTurn();
  ASSERT_TRUE(table.Pause(job, PauseCause::kUser, "paused", MomentAt(1)).ok());
  ASSERT_TRUE(table.Resume(job, MomentAt(1)).ok());
  const auto runner = std::make_shared<FakeRunner>();
  ASSERT_TRUE(table.Attach(job, runner)) << "the turn was still preparing";
  EXPECT_TRUE(runner->Run()->gave_up_turn);
  const std::string other = Added(table, "b");
  EXPECT_EQ(table.WaitForTurn()->job_id, other);
  table.GiveUpTurn(job, MomentAt(2));
  turn.reset();
  const auto again = table.WaitForTurn();
  EXPECT_EQ(again->job_id, job);
  EXPECT_EQ(again->runner, runner);
}

TEST(JobTableTest, AStopOfAPausedJobEndsItBeforeOthersRun) {
  JobTable table(SmallTable());
  const std::string job = Added(table, "a");
  const auto runner = std::make_shared<FakeRunner>();
  {
    const auto turn = table.WaitForTurn();
    ASSERT_TRUE(table.Attach(job, runner));
    table.OnRunning(job, MomentAt(1));
    ASSERT_TRUE(table.Pause(job, PauseCause::kUser, "paused", MomentAt(2)).ok());
  }
  Added(table, "b");
  ASSERT_TRUE(table.SetPriority("t-2", 100, MomentAt(2)).ok());
  EXPECT_EQ(table.Stop(job, MomentAt(3))->job.life.state(), JobState::kQueued);
  const auto turn = table.WaitForTurn();
  EXPECT_EQ(turn->job_id, job);
  EXPECT_EQ(turn->runner->Resume()->reason, StopReason::kUser);
}

TEST(JobTableTest, PausesAndPrioritiesAreInALaterTableToo) {
  FakeJournal journal;
  {
    JobTable table(TableWith(journal));
    for (const char* request : {"a", "b", "c"})
      Added(table, request);
    ASSERT_TRUE(table.Pause("t-1", PauseCause::kUser, "paused by its user", MomentAt(1)).ok());
    ASSERT_TRUE(table.SetPriority("t-3", 5, MomentAt(1)).ok());
    EXPECT_TRUE(absl::IsInvalidArgument(table.SetPriority("t-3", 101, MomentAt(1)).status()));
  }
  JobTable table(TableWith(journal));
  table.Restore(journal.AtTheNextStart(), 4, MomentAt(3));
  EXPECT_EQ(StateOf(table, "t-1"), JobState::kPaused);
  EXPECT_EQ(table.Find("t-1")->condition, "paused by its user");
  EXPECT_EQ(table.WaitForTurn()->job_id, "t-3");
  EXPECT_EQ(table.WaitForTurn()->job_id, "t-2");
  ASSERT_TRUE(table.Resume("t-1", MomentAt(4)).ok());
  EXPECT_EQ(table.WaitForTurn()->job_id, "t-1");
}

// Time stands still; after a few seconds others are prepared, as if the jobs without workers were
// paused.
TEST(JobTableTest, JobsWithoutWorkersDoNotBlockOthersAndTheirTimeStandsStill) {
  JobTable table(SmallTable());
  table.SetLiveWorkers(1, MomentAt(0));
  const std::string job = Added(table, "a");
  const std::string next = Added(table, "b");
  const auto turn = table.WaitForTurn();
  const auto runner = std::make_shared<FakeRunner>();
  ASSERT_TRUE(table.Attach(job, runner));
  table.OnRunning(job, MomentAt(1));
  table.SetLiveWorkers(0, MomentAt(4));
  EXPECT_EQ(table.ReportOf(job, MomentAt(9))->running, std::chrono::seconds(3));
  EXPECT_FALSE(table.WhenItHasRun(job, std::chrono::seconds(5)));
  table.SetLiveWorkers(0, MomentAt(9));
  const auto other = table.WaitForTurn();
  EXPECT_EQ(other->job_id, next);
  ASSERT_TRUE(table.Attach(next, std::make_shared<FakeRunner>()));
  table.OnRunning(next, MomentAt(9));
  table.SetLiveWorkers(1, MomentAt(10));
  EXPECT_EQ(table.WhenItHasRun(job, std::chrono::seconds(5)), MomentAt(12).now);
  EXPECT_FALSE(runner->gives_up_turn());
  EXPECT_TRUE(
      dynamic_cast<FakeRunner&>(*table.DescribeRun(next, MomentAt(10))->runner).gives_up_turn())
      << "two have a turn and one may";
}

// The processor time of the process is that of all that ran.
TEST(JobTableTest, JobsThatRunAtTheSameTimeShareTheProcessorTime) {
  JobTable table(TwoAtOnce());
  const std::string a = Added(table, "a");
  const std::string b = Added(table, "b");
  const auto turn_of_a = table.WaitForTurn();
  const auto turn_of_b = table.WaitForTurn();
  table.OnRunning(a, MomentAt(10));
  table.OnRunning(b, MomentAt(14));
  EXPECT_EQ(table.ReportOf(a, MomentAt(20))->job.counters.coordinator_cpu, std::chrono::seconds(7));
  EXPECT_EQ(table.ReportOf(b, MomentAt(20))->job.counters.coordinator_cpu, std::chrono::seconds(3));
  ASSERT_TRUE(table.Pause(b, PauseCause::kUser, "paused", MomentAt(20)).ok());
  EXPECT_EQ(table.ReportOf(a, MomentAt(24))->job.counters.coordinator_cpu,
            std::chrono::seconds(11));
  EXPECT_EQ(table.ReportOf(b, MomentAt(24))->job.counters.coordinator_cpu, std::chrono::seconds(3));
}

TEST(JobTableTest, ListsTheJobsThatAFilterLetsPass) {
  JobTable table(SmallTable());
  for (const char* name : {"kitchen", "bath", "kitchen sink"}) {
    CheckedJob job = JobOf(name);
    job.submission.name = name;
    ASSERT_TRUE(table.Add(std::move(job), WallTime(), MomentAt(0)).ok());
  }
  ASSERT_TRUE(table.Pause("t-1", PauseCause::kUser, "paused", MomentAt(0)).ok());
  const auto ids = [&](const JobFilter& filter, std::size_t count = 10) {
    std::string all;
    for (const JobReport& report : table.List(filter, count, 0, MomentAt(1)).first)
      all += report.job.id + " ";
    return all;
  };
  EXPECT_EQ(ids({}), "t-3 t-2 t-1 ");
  EXPECT_EQ(ids({.name_contains = "kitchen"}), "t-3 t-1 ");
  EXPECT_EQ(ids({.name_contains = "kitchen"}, 1), "t-3 ");
  EXPECT_EQ(ids({.states = {JobState::kPaused}}), "t-1 ");
  EXPECT_EQ(ids({.states = {JobState::kPaused}, .name_contains = "bath"}), "");
  EXPECT_EQ(ids({.owner = "somebody"}), "");
}

// Threads ask for everything, of all jobs and in an order of their own; the jobs that are left end
// when they are cancelled, and the threads of jobs come back.
TEST(JobTableTest, RequestsInAnyOrderLeaveNoThreadWaiting) {
  for (std::uint64_t key = 0; key < 12; ++key) {
    JobTable table({.instance = "t",
                    .max_waiting = 16,
                    .max_at_once = 1 + key % 2,
                    .retention = {.jobs = 20, .pixels = 640}});
    std::vector<std::thread> turns;
    for (int t = 0; t < 4; ++t)
      turns.emplace_back([&] { RunTurns(table); });
    std::vector<std::thread> callers;
    for (std::uint64_t c = 0; c < 4; ++c) {
      callers.emplace_back([&table, key, c] {
        KeyedRng rng(CombineKeys(key, c));
        for (int i = 0; i < 400; ++i) {
          const std::string job = absl::StrCat("t-", 1 + rng.Bits() % 60);
          RenderOverrides until;
          until.passes = 1 + static_cast<std::int64_t>(rng.Bits() % 2) * 1000;
          const std::string request = absl::StrCat(c, " ", i);
          Delivery delivery;
          delivery.pass.job_id = job;
          switch (rng.Bits() % 12) {
            case 0:
              (void)table.Add(JobOf(request, *until.passes), WallTime(), MomentAt(0));
              break;
            case 1:
            case 2:
              (void)table.Cancel(job, MomentAt(1));
              break;
            case 3:
              (void)table.Stop(job, MomentAt(1));
              break;
            case 4:
              (void)table.Extend(job, until, MomentAt(1));
              break;
            case 5:
              (void)table.FindImage(job, MomentAt(1));
              break;
            case 6:
              (void)table.List({}, 10, 0, MomentAt(1));
              (void)table.MakeLoan({}, 1);
              break;
            case 7:
              (void)table.Pause(job, PauseCause::kUser, "paused", MomentAt(1));
              break;
            case 8:
              (void)table.Resume(job, MomentAt(1));
              break;
            case 9:
              (void)table.SetPriority(job, static_cast<int>(rng.Bits() % 3), MomentAt(1));
              break;
            case 10:
              table.SetCondition(job, PauseCause::kDisk,
                                 rng.Bits() % 2 == 0 ? "" : "paused: no room", MomentAt(1));
              table.SetLiveWorkers(static_cast<int>(rng.Bits() % 2), MomentAt(static_cast<int>(i)));
              break;
            default:
              table.CountMerged(delivery, DeliveredCounts(), "w", MomentAt(1).now);
              table.CountFetched(Digest(), 1);
          }
        }
      });
    }
    for (std::thread& caller : callers)
      caller.join();
    const auto [reports, next] = table.List({}, 1000, 0, MomentAt(3));
    for (const JobReport& report : reports)
      (void)table.Cancel(report.job.id, MomentAt(3));
    // Its turn comes and it runs to its end: the thread of jobs is not stuck with one before it.
    const std::string last = table.Add(JobOf("last", 1), WallTime(), MomentAt(4))->job_id;
    while (StateOf(table, last) != JobState::kSucceeded)
      std::this_thread::yield();
    table.Close(absl::UnavailableError("closing"));
    for (std::thread& thread : turns)
      thread.join();
  }
}

// Bakes ------------------------------------------------------------------------------------------

BakeRoundRecord RoundOf(const std::string& name) {
  BakeRoundRecord round;
  round.name = name;
  round.sensors = {Sha256(name), 1};
  return round;
}

// A bake with a turn and a runner in its first round.
class BakeTableTest : public testing::Test {
 protected:
  BakeTableTest() {
    CheckedJob job = JobOf("bake");
    job.submission.bake = BakeSettings();
    EXPECT_EQ(table_.Add(std::move(job), WallTime(), MomentAt(0))->job_id, kJob);
    turn_ = table_.WaitForTurn();
    EXPECT_TRUE(turn_->is_bake);
    Begin("survey");
    table_.OnRunning(kJob, MomentAt(1));
  }
  void Begin(const std::string& name, int seconds = 1) {
    ASSERT_TRUE(table_.BeginRound(kJob, RoundOf(name), JobOf("", 16), MomentAt(seconds)));
    runner_ = std::make_shared<FakeRunner>();
    ASSERT_TRUE(table_.Attach(kJob, runner_));
  }
  void CountPhotons(const std::string& run_id, std::uint64_t photons) {
    DeliveredCounts counts;
    counts.tally.photons = photons;
    Delivery delivery;
    delivery.worker = "w";
    delivery.pass = {run_id, 0};
    table_.CountMerged(delivery, counts, "host", MomentAt(2).now);
  }
  [[nodiscard]] const Job Now() const { return *table_.Find(kJob); }

  static constexpr const char* kJob = "t-1";
  JobTable table_{SmallTable()};
  std::optional<JobTable::Turn> turn_;
  std::shared_ptr<FakeRunner> runner_;
};

TEST_F(BakeTableTest, WhatComesOfAnEarlierRoundFindsNoJob) {
  const std::string survey = RunIdOf(Now());
  EXPECT_NE(survey, kJob);
  EXPECT_TRUE(table_.Find(survey));
  EXPECT_EQ(table_.ShareOf(kJob)->run_id, survey);
  ASSERT_TRUE(table_.EndRound(kJob, std::nullopt, 3, StopReason::kError, MomentAt(3)));
  Begin("round 1");
  EXPECT_FALSE(table_.Find(survey));
  EXPECT_TRUE(table_.HasEnded(survey));
  const std::string round = RunIdOf(Now());
  EXPECT_NE(round, survey);
  CountPhotons(survey, 5);
  EXPECT_EQ(Now().counters.photons, 0U);
  CountPhotons(round, 7);
  EXPECT_EQ(Now().counters.photons, 7U);
}

TEST_F(BakeTableTest, ARoundKeepsWhatItCounted) {
  CountPhotons(kJob, 7);
  // What is merged of an open round besides is not in the image.
  table_.OnProgress(kJob, 5);
  ASSERT_TRUE(table_.EndRound(kJob, Sha256("image"), 3, StopReason::kError, MomentAt(3)));
  Begin("round 1", 3);
  ASSERT_EQ(Now().bake->rounds.size(), 2U);
  const BakeRoundRecord& survey = Now().bake->rounds[0];
  EXPECT_TRUE(survey.has_ended);
  EXPECT_EQ(survey.passes, 3);
  EXPECT_EQ(survey.reason, StopReason::kError);
  EXPECT_EQ(survey.photons, 7U);
  EXPECT_EQ(survey.image, Sha256("image"));
  EXPECT_EQ(Now().counters.passes, 0);
  EXPECT_EQ(Now().workers.size(), 1U) << "who had a part in it has one in the mesh";
  // A round's time is its own.
  EXPECT_EQ(table_.RunningOf(kJob, MomentAt(7).now), std::chrono::seconds(4));
  EXPECT_EQ(table_.WhenItHasRun(kJob, std::chrono::seconds(10)), MomentAt(13).now);
  // The files of a round are those of the scene, and its sensors.
  EXPECT_EQ(ManifestOf(Now()).main_path, kSensorsPath);
  EXPECT_EQ(ManifestOf(Now()).entries.at(kSensorsPath).digest, Sha256("round 1"));
  EXPECT_EQ(Now().manifest.main_path, "scene.pbrt");
}

TEST_F(BakeTableTest, ARoundThatIsBegunAgainGoesOn) {
  const std::string run = RunIdOf(Now());
  CountPhotons(kJob, 7);
  Begin("survey");
  EXPECT_EQ(RunIdOf(Now()), run);
  EXPECT_EQ(Now().counters.photons, 7U);
  // Other sensors take its place.
  Begin("other");
  EXPECT_EQ(Now().bake->rounds.size(), 1U);
  EXPECT_NE(RunIdOf(Now()), run);
  EXPECT_EQ(Now().counters.photons, 0U);
}

TEST_F(BakeTableTest, AnotherEndBeginsAnewUnderAnotherName) {
  ASSERT_TRUE(table_.EndRound(kJob, std::nullopt, 3, StopReason::kError, MomentAt(2)));
  Begin("round 1");
  const std::string run = RunIdOf(Now());
  RenderOverrides until;
  until.passes = 2000;
  ASSERT_TRUE(table_.Extend(kJob, until, MomentAt(3)).ok());
  EXPECT_TRUE(runner_->is_stopped());
  EXPECT_EQ(Now().bake->overrides.passes, 2000);
  EXPECT_EQ(Now().settings.passes, 16) << "those of the round, until there is another";
  // Whoever reads its row now knows that its rounds do not count.
  EXPECT_TRUE(Now().bake->begins_again);
  EXPECT_FALSE(table_.EndRound(kJob, std::nullopt, 3, StopReason::kError, MomentAt(3)));
  EXPECT_FALSE(table_.BeginRound(kJob, RoundOf("round 2"), JobOf(""), MomentAt(3)));
  EXPECT_TRUE(table_.TakeBeginsAgain(kJob));
  EXPECT_TRUE(Now().bake->rounds.empty());
  EXPECT_FALSE(Now().bake->begins_again);
  Begin("survey");
  Begin("round 1");
  EXPECT_NE(RunIdOf(Now()), run) << "workers know the old name with its files";
}

TEST_F(BakeTableTest, TheWorkOfAWrongWorkerGoesWithAllRounds) {
  table_.NoteContributor(kJob, "record", "host");
  ASSERT_TRUE(table_.EndRound(kJob, std::nullopt, 3, StopReason::kError, MomentAt(2)));
  Begin("round 1");
  table_.TakeOut("record", MomentAt(3));
  EXPECT_TRUE(runner_->is_stopped());
  EXPECT_FALSE(table_.Succeed(kJob, StopReason::kPasses, nullptr, MomentAt(3)));
  EXPECT_TRUE(table_.TakeBeginsAgain(kJob));
  EXPECT_TRUE(Now().bake->rounds.empty());
  // One that waits for its turn has no thread that does it.
  Begin("survey");
  table_.NoteContributor(kJob, "record", "host");
  ASSERT_TRUE(table_.Pause(kJob, PauseCause::kUser, "paused", MomentAt(4)).ok());
  turn_.reset();
  table_.TakeOut("record", MomentAt(5));
  EXPECT_TRUE(Now().bake->rounds.empty());
  EXPECT_FALSE(table_.BeginsAgain(kJob));
}

TEST_F(BakeTableTest, OneThatHasEndedCanBeGivenAnotherEnd) {
  ASSERT_TRUE(table_.EndRound(kJob, std::nullopt, 3, StopReason::kError, MomentAt(2)));
  BakeResult result;
  result.figures = {{.name = "floor"}};
  table_.SetBakeResult(kJob, result, std::make_shared<const std::string>("uv"), std::nullopt);
  ASSERT_TRUE(table_.Succeed(kJob, StopReason::kPasses, std::make_shared<const std::string>("glb"),
                             MomentAt(3)));
  turn_.reset();
  EXPECT_EQ(*table_.FindImage(kJob, MomentAt(3))->image, "glb");
  EXPECT_EQ(*table_.FindImage(kJob, MomentAt(3))->uv_mesh, "uv");
  EXPECT_EQ(Now().bake->figures.size(), 1U);
  RenderOverrides until;
  until.passes = 2000;
  // Its files are nowhere, since it has no pins here.
  EXPECT_TRUE(absl::IsFailedPrecondition(table_.Extend(kJob, until, MomentAt(4)).status()));
}

TEST_F(BakeTableTest, AStopBetweenTwoRoundsCountsForAllThatFollow) {
  ASSERT_TRUE(table_.EndRound(kJob, std::nullopt, 3, StopReason::kPasses, MomentAt(2)));
  ASSERT_TRUE(table_.Stop(kJob, MomentAt(2)).ok()) << "though nothing runs at the moment";
  Begin("round 1");
  EXPECT_TRUE(runner_->Run().ok()) << "it ends at once";
  EXPECT_TRUE(table_.IsFinishing(kJob));
  // Also in a later process.
  EXPECT_TRUE(Now().bake->is_stopped);
  // Another end is one.
  RenderOverrides until;
  until.passes = 2000;
  ASSERT_TRUE(table_.Extend(kJob, until, MomentAt(3)).ok());
  EXPECT_FALSE(table_.IsFinishing(kJob));
}

TEST_F(BakeTableTest, AnotherEndBetweenTwoRoundsIsHeardBeforeTheNextRuns) {
  ASSERT_TRUE(table_.EndRound(kJob, std::nullopt, 3, StopReason::kPasses, MomentAt(2)));
  ASSERT_TRUE(table_.BeginRound(kJob, RoundOf("round 1"), JobOf("", 16), MomentAt(2)));
  RenderOverrides until;
  until.passes = 2000;
  ASSERT_TRUE(table_.Extend(kJob, until, MomentAt(3)).ok());
  EXPECT_FALSE(table_.Attach(kJob, std::make_shared<FakeRunner>()));
  EXPECT_TRUE(table_.TakeBeginsAgain(kJob));
  Begin("survey");
}

TEST_F(BakeTableTest, WhatARoundWaitedForEndsWithIt) {
  table_.SetCondition(kJob, PauseCause::kDispute, "workers disagree", MomentAt(2));
  EXPECT_EQ(StateOf(table_, kJob), JobState::kPaused);
  RenderOverrides until;
  until.passes = 2000;
  ASSERT_TRUE(table_.Extend(kJob, until, MomentAt(3)).ok());
  EXPECT_TRUE(table_.TakeBeginsAgain(kJob));
  Begin("survey", 3);
  EXPECT_EQ(StateOf(table_, kJob), JobState::kRunning);
  EXPECT_EQ(Now().condition, "");
}

TEST_F(BakeTableTest, HasNothingToShowBeforeItsEnd) {
  EXPECT_TRUE(absl::IsFailedPrecondition(table_.FindImage(kJob, MomentAt(1)).status()));
  ASSERT_TRUE(table_.Stop(kJob, MomentAt(2)).ok());
  EXPECT_TRUE(table_.IsFinishing(kJob));
  ASSERT_TRUE(table_.EndRound(kJob, std::nullopt, 3, StopReason::kError, MomentAt(2)));
  Begin("round 1");
  EXPECT_TRUE(runner_->Run().ok()) << "it ends at once, as the one before";
}

}  // namespace
}  // namespace lucerna
