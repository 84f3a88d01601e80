// With --max-disk a coordinator's folder stays as small, and no job is lost for it that has not
// ended.
#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <string>
#include <thread>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

#include "tests/fault/coordinator_process.h"
#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;

// Ended jobs of it have two checkpoints of some 0.9 MB each, and such a job needs three and its
// files to be accepted.
constexpr SmallJob kShortJob = {.passes = 8, .photons = 5'000};
constexpr std::uint64_t kLimit = 5'000'000;

std::vector<std::string> KeptIn(const std::string& folder, std::uint64_t max_disk) {
  return {"--state", folder, "--checkpoint-share", "1", "--max-disk", std::to_string(max_disk)};
}

std::uint64_t SizeOfAll(const std::string& folder) {
  std::uint64_t bytes = 0;
  std::error_code error;
  for (const auto& file : std::filesystem::recursive_directory_iterator(folder, error)) {
    const std::uintmax_t size = file.is_regular_file(error) ? file.file_size(error) : 0;
    if (!error) bytes += size;
  }
  return bytes;
}

TEST(DiskLimitTest, AJobThatCannotFitIsRefusedInOneSentence) {
  const TemporaryFolder folder;
  CoordinatorProcess coordinator(KeptIn(folder.path(), 1'000'000));
  const auto refused = coordinator.TrySubmit(kShortJob);
  EXPECT_TRUE(absl::IsResourceExhausted(refused.status())) << refused.status();
  EXPECT_THAT(std::string(refused.status().message()), HasSubstr("--max-disk"));
  EXPECT_TRUE(coordinator.List().empty());
  EXPECT_TRUE(std::filesystem::is_empty(folder.At("blobs")));
}

TEST(DiskLimitTest, ThoseThatEndedFirstMakeRoomForNewOnes) {
  const TemporaryFolder folder;
  CoordinatorProcess coordinator(KeptIn(folder.path(), kLimit));
  const auto worker = coordinator.StartWorker();
  std::vector<std::string> jobs;
  for (int i = 0; i < 5; ++i) {
    SmallJob job = kShortJob;
    job.request_id = std::to_string(i);
    const auto submitted = coordinator.TrySubmit(job);
    ASSERT_TRUE(submitted.ok()) << submitted.status();
    jobs.push_back(*submitted);
    ASSERT_EQ(coordinator.Wait(jobs.back()).state(), v1::JOB_STATE_SUCCEEDED);
    EXPECT_LE(SizeOfAll(folder.path()), kLimit);
  }
  std::vector<std::string> kept;
  for (const v1::Job& job : coordinator.List())
    kept.push_back(job.job_id());
  EXPECT_LT(kept.size(), jobs.size());
  ASSERT_FALSE(kept.empty());
  // The newest ones, newest first, with their images.
  std::ranges::reverse(jobs);
  jobs.resize(kept.size());
  EXPECT_EQ(kept, jobs);
  const Digest quiet = UnfaultedDigest(kShortJob.scene, kShortJob.passes, kShortJob.photons);
  EXPECT_EQ(coordinator.ImageDigest(kept.back()).Hex(), quiet.Hex());
}

TEST(DiskLimitTest, JobsThatHaveNotEndedKeepTheirRoom) {
  const TemporaryFolder folder;
  // No worker, so that the first one waits.
  CoordinatorProcess coordinator(KeptIn(folder.path(), kLimit));
  const std::string first = coordinator.TrySubmit(kShortJob).value();
  SmallJob other = kShortJob;
  other.request_id = "other";
  const auto refused = coordinator.TrySubmit(other);
  EXPECT_TRUE(absl::IsResourceExhausted(refused.status())) << refused.status();
  EXPECT_THAT(std::string(refused.status().message()),
              HasSubstr("no room in " + folder.path() + " within --max-disk (5.0 MB)"));
  const auto worker = coordinator.StartWorker();
  ASSERT_EQ(coordinator.Wait(first).state(), v1::JOB_STATE_SUCCEEDED);
  ASSERT_TRUE(coordinator.TrySubmit(other).ok());
}

TEST(DiskLimitTest, ACheckpointThatDoesNotFitPausesTheJob) {
  const SmallJob job = {.passes = 24, .photons = 20'000};
  const TemporaryFolder folder;
  const std::string address = FreeAddress();
  auto coordinator =
      CoordinatorProcess::Doomed("checkpoint.renamed:3", KeptIn(folder.path(), 0), address);
  const auto worker = coordinator->StartWorker();
  const std::string id = coordinator->TrySubmit(job).value();
  ASSERT_EQ(coordinator->process().WaitForExit(kPatience), 128 + SIGKILL);
  // A limit that is smaller than what is there.
  coordinator = std::make_unique<CoordinatorProcess>(KeptIn(folder.path(), 1'000'000), address);
  for (int i = 0; i < 6000 && coordinator->Get(id).state() != v1::JOB_STATE_PAUSED; ++i)
    std::this_thread::sleep_for(milliseconds(10));
  const v1::Job paused = coordinator->Get(id);
  EXPECT_EQ(paused.state(), v1::JOB_STATE_PAUSED);
  EXPECT_EQ(paused.pause_cause(), v1::PAUSE_CAUSE_DISK);
  EXPECT_EQ(paused.condition(), "paused: no room in " + folder.path() +
                                    " within --max-disk (1.0 MB); it goes on when there is");
  coordinator->process().Signal(SIGTERM);
  ASSERT_EQ(coordinator->process().WaitForExit(kPatience), 0);
  coordinator = std::make_unique<CoordinatorProcess>(KeptIn(folder.path(), kLimit), address);
  EXPECT_EQ(coordinator->Wait(id).state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(coordinator->ImageDigest(id).Hex(),
            UnfaultedDigest(job.scene, job.passes, job.photons).Hex());
}

// Until there is one, or none. Whether it came to that.
bool WaitForCheckpoints(const TemporaryFolder& folder, bool there) {
  for (int i = 0; i < 3000; ++i) {
    std::error_code error;
    if (std::filesystem::is_empty(folder.At("checkpoints"), error) != there && !error) return true;
    std::this_thread::sleep_for(milliseconds(10));
  }
  return false;
}

TEST(DiskLimitTest, WhatAPausedJobKeptIsGoneOnceItIsCancelled) {
  const TemporaryFolder folder;
  const std::string address = FreeAddress();
  auto coordinator = std::make_unique<CoordinatorProcess>(KeptIn(folder.path(), 0), address);
  auto worker = coordinator->StartWorker();
  const std::string id = coordinator->TrySubmit({.passes = 5000, .photons = 20'000}).value();
  ASSERT_TRUE(WaitForCheckpoints(folder, true));
  const auto ask = [&](const std::string& word) {
    const Finished asked = RunProgram({kBin + "/lucerna", word, id, "--server", address});
    EXPECT_EQ(asked.exit_code, 0) << asked.errors;
  };
  ask("pause");
  // A coordinator that is started again has given it no turn.
  coordinator->process().Signal(SIGTERM);
  ASSERT_EQ(coordinator->process().WaitForExit(kPatience), 0);
  coordinator = std::make_unique<CoordinatorProcess>(KeptIn(folder.path(), 0), address);
  ASSERT_EQ(coordinator->Get(id).state(), v1::JOB_STATE_PAUSED);
  ASSERT_TRUE(WaitForCheckpoints(folder, true));
  ask("cancel");
  EXPECT_TRUE(WaitForCheckpoints(folder, false));
}

}  // namespace
}  // namespace lucerna
