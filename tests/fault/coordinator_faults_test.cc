// The coordinator may be killed at every step at which it makes something durable, its disk may be
// full, and its checkpoints may be damaged: after the next start the job goes on, and its image is
// that of a quiet run to the last bit.
//
// Real processes on loopback. A coordinator kills itself at a named step
// (render/base/fail_point.h).
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include <grpcpp/generic/generic_stub.h>
#include <signal.h>
#include <sys/mount.h>
#include <unistd.h>

#include "render/base/files.h"
#include "render/wire/channel.h"
#include "tests/fault/coordinator_process.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::HasSubstr;

// Long enough for some twenty rounds.
const SmallJob kJob = {.passes = 24, .photons = 20'000};

// A checkpoint after every round.
std::vector<std::string> KeptIn(const std::string& folder) {
  return {"--state", folder, "--checkpoint-share", "1"};
}

// More than a second after the passes that tests wait for, so that something can change while the
// job runs.
const SmallJob kLongJob = {.passes = 48, .photons = 50'000};

Digest QuietDigest(const SmallJob& small_job) {
  static std::map<int, Digest> digests;  // by passes
  const auto [found, is_new] = digests.try_emplace(small_job.passes);
  if (is_new) {
    CoordinatorProcess coordinator;
    const auto worker = coordinator.StartWorker();
    const std::string job = coordinator.TrySubmit(small_job).value();
    EXPECT_EQ(coordinator.Wait(job).state(), v1::JOB_STATE_SUCCEEDED);
    found->second = coordinator.ImageDigest(job);
  }
  return found->second;
}

// A job that ended as the quiet one did, each photon counted once.
void ExpectQuietEnd(CoordinatorProcess& coordinator, const v1::Job& job,
                    const SmallJob& small_job = kJob) {
  ASSERT_EQ(job.state(), v1::JOB_STATE_SUCCEEDED) << job.failure();
  EXPECT_EQ(job.progress().passes(), small_job.passes);
  EXPECT_EQ(job.progress().photons(),
            static_cast<std::uint64_t>(small_job.passes * small_job.photons));
  EXPECT_EQ(coordinator.ImageDigest(job.job_id()).Hex(), QuietDigest(small_job).Hex());
}

// Every step at which something becomes durable, and some of them later in a job's life. The second
// blob is the image, the first is the scene; the second row is that of the end.
class KilledCoordinatorTest : public testing::TestWithParam<const char*> {};

TEST_P(KilledCoordinatorTest, GoesOnAfterARestartWithTheSameBits) {
  const TemporaryFolder folder;
  const std::string address = FreeAddress();
  auto coordinator = CoordinatorProcess::Doomed(GetParam(), KeptIn(folder.path()), address);
  const auto worker = coordinator->StartWorker();
  int deaths = 0;
  const auto replace_if_dead = [&] {
    if (!coordinator->process().WaitForExit(milliseconds(0))) return;
    ++deaths;
    EXPECT_EQ(coordinator->process().WaitForExit(milliseconds(0)), 128 + SIGKILL)
        << coordinator->process().Errors();
    coordinator = std::make_unique<CoordinatorProcess>(KeptIn(folder.path()), address);
  };
  // Only a call that the death broke is made again.
  const auto insist = [&](const auto& call) {
    auto result = call();
    for (int i = 0; i < 600 && deaths == 0 && !result.ok(); ++i) {
      std::this_thread::sleep_for(milliseconds(100));
      replace_if_dead();
      if (deaths > 0) result = call();
    }
    return result;
  };
  if (std::string(GetParam()).starts_with("store.")) {
    ASSERT_TRUE(coordinator->process().WaitForExit(kPatience));
    replace_if_dead();
  }
  const auto job = insist([&] { return coordinator->TrySubmit(kJob); });
  ASSERT_TRUE(job.ok()) << job.status();
  const auto ended = insist([&] { return coordinator->TryWait(*job); });
  ASSERT_TRUE(ended.ok()) << ended.status();
  const bool at_the_end = std::string(GetParam()).find("removed") != std::string::npos;
  // The end may have been told before the step that follows it.
  if (!at_the_end && deaths == 0) {
    ASSERT_TRUE(coordinator->process().WaitForExit(kPatience)) << "the step was never reached";
    replace_if_dead();
  }
  ExpectQuietEnd(*coordinator, coordinator->Get(*job));
  EXPECT_EQ(coordinator->List().size(), 1U);
  EXPECT_EQ(coordinator->TrySubmit(kJob).value(), *job) << "the same request is the same job";

  const Status deleted = insist([&] {
    const Status status = coordinator->TryDelete(*job);
    return absl::IsNotFound(status) ? absl::OkStatus() : status;
  });
  EXPECT_TRUE(deleted.ok()) << deleted;
  EXPECT_EQ(deaths, 1);
  EXPECT_TRUE(coordinator->List().empty());
  EXPECT_TRUE(std::filesystem::is_empty(folder.At("blobs")));
  EXPECT_TRUE(std::filesystem::is_empty(folder.At("checkpoints")));
}

INSTANTIATE_TEST_SUITE_P(
    AtEveryDurableStep, KilledCoordinatorTest,
    testing::Values("store.unmade", "store.made", "blob.synced", "blob.renamed", "job.unsaved",
                    "job.saved", "checkpoint.synced:1", "checkpoint.renamed:1",
                    "checkpoint.synced:2", "checkpoint.renamed:2", "checkpoint.synced:9",
                    "checkpoint.renamed:9", "blob.synced:2", "blob.renamed:2", "job.unsaved:2",
                    "job.saved:2", "job.ended", "job.unremoved", "job.removed"),
    [](const auto& step) {
      std::string name = step.param;
      for (char& c : name)
        if (c == '.' || c == ':') c = '_';
      return name;
    });

// Killed after its second checkpoint; then something happens to the files.
class DamagedCheckpointTest : public testing::Test {
 protected:
  void SetUp() override {
    auto coordinator =
        CoordinatorProcess::Doomed("checkpoint.renamed:8", KeptIn(folder_.path()), address_);
    const auto worker = coordinator->StartWorker();
    job_ = coordinator->TrySubmit(kJob).value();
    ASSERT_EQ(coordinator->process().WaitForExit(kPatience), 128 + SIGKILL);
    for (const auto& file : std::filesystem::directory_iterator(folder_.At("checkpoints")))
      files_.push_back(file.path());
    ASSERT_EQ(files_.size(), 2U);
  }

  void ExpectTheSameBitsAndAWord(const std::string& word) {
    CoordinatorProcess coordinator(KeptIn(folder_.path()), address_);
    const auto worker = coordinator.StartWorker();
    const v1::Job job = coordinator.Wait(job_);
    ExpectQuietEnd(coordinator, job);
    EXPECT_THAT(coordinator.process().Errors(), HasSubstr(word));
    EXPECT_THAT(job.DebugString(), HasSubstr(word)) << "in the job's events";
  }

  void Flip(const std::string& file) {
    std::string bytes = ReadFile(file).value();
    bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 4);
    ASSERT_TRUE(WriteFile(file, bytes).ok());
  }

  TemporaryFolder folder_;
  const std::string address_ = FreeAddress();
  std::string job_;
  std::vector<std::string> files_;
};

TEST_F(DamagedCheckpointTest, AFlippedBitInEitherOneFallsBackToTheOther) {
  Flip(files_[0]);
  ExpectTheSameBitsAndAWord("is damaged");
}

TEST_F(DamagedCheckpointTest, AFlippedBitInTheOtherOneToo) {
  Flip(files_[1]);
  ExpectTheSameBitsAndAWord("is damaged");
}

TEST_F(DamagedCheckpointTest, TruncatedOnesAreNotUsedAndTheJobBeginsAnew) {
  for (const std::string& file : files_)
    std::filesystem::resize_file(file, std::filesystem::file_size(file) * 9 / 10);
  ExpectTheSameBitsAndAWord("is damaged");
}

// A stream of gRPC's own health service; its messages are small enough to be read as bytes.
class HealthWatch {
 public:
  explicit HealthWatch(const std::shared_ptr<grpc::Channel>& channel) : stub_(channel) {
    context_.set_deadline(DeadlineIn(kPatience));
    call_ = stub_.PrepareCall(&context_, "/grpc.health.v1.Health/Watch", &queue_);
    call_->StartCall(nullptr);
    EXPECT_TRUE(Wait());
    const grpc::Slice empty;
    call_->WriteLast(grpc::ByteBuffer(&empty, 1), grpc::WriteOptions(), nullptr);
    EXPECT_TRUE(Wait());
  }
  ~HealthWatch() {
    context_.TryCancel();
    grpc::Status status;
    call_->Finish(&status, nullptr);
    Wait();
  }
  HealthWatch(const HealthWatch&) = delete;
  HealthWatch& operator=(const HealthWatch&) = delete;

  // HealthCheckResponse{status}, or nothing when the stream has ended.
  std::string Next() {
    grpc::ByteBuffer answer;
    call_->Read(&answer, nullptr);
    grpc::Slice whole;
    if (!Wait() || !answer.DumpToSingleSlice(&whole).ok()) return "";
    return {reinterpret_cast<const char*>(whole.begin()), whole.size()};
  }

 private:
  bool Wait() {
    void* tag = nullptr;
    bool ok = false;
    return queue_.Next(&tag, &ok) && ok;
  }

  grpc::GenericStub stub_;
  grpc::ClientContext context_;
  grpc::CompletionQueue queue_;
  std::unique_ptr<grpc::GenericClientAsyncReaderWriter> call_;
};

TEST(TerminatedCoordinatorTest, SaysThatItServesNoMore) {
  CoordinatorProcess coordinator;
  HealthWatch health(coordinator.channel());
  EXPECT_EQ(health.Next(), "\x08\x01") << "SERVING";
  coordinator.process().Signal(SIGTERM);
  EXPECT_EQ(health.Next(), "\x08\x02") << "NOT_SERVING";
  EXPECT_EQ(coordinator.process().WaitForExit(kPatience), 0);
}

TEST(TerminatedCoordinatorTest, KeepsACheckpointAndLeavesWellAndTheNextOneGoesOnFromThere) {
  const TemporaryFolder folder;
  const std::string address = FreeAddress();
  // No checkpoint but that at the end.
  const std::vector<std::string> flags = {"--state", folder.path(), "--checkpoint-share", "1e-9"};
  auto coordinator = std::make_unique<CoordinatorProcess>(flags, address);
  const auto worker = coordinator->StartWorker();
  const std::string job = coordinator->TrySubmit(kLongJob).value();
  ASSERT_TRUE(coordinator->WaitForPasses(job, 6)) << "the job is too short";
  coordinator->process().Signal(SIGTERM);
  EXPECT_EQ(coordinator->process().WaitForExit(kPatience), 0) << coordinator->process().Errors();
  EXPECT_THAT(coordinator->process().Errors(), HasSubstr("goes on when"));
  coordinator = std::make_unique<CoordinatorProcess>(flags, address);
  ASSERT_TRUE(coordinator->process().WaitForText("goes on from its checkpoint", kPatience));
  ExpectQuietEnd(*coordinator, coordinator->Wait(job), kLongJob);
}

// Who waits for a job need not know that the coordinator was away for ten seconds.
TEST(RestartedCoordinatorTest, WorkersAndWatchersComeBackByThemselves) {
  const TemporaryFolder folder;
  const std::string address = FreeAddress();
  auto coordinator = std::make_unique<CoordinatorProcess>(KeptIn(folder.path()), address);
  const auto worker = coordinator->StartWorker();
  const std::string job = coordinator->TrySubmit(kLongJob).value();
  ChildProcess client({kBin + "/lucerna", "watch", job, "--server", address});
  ASSERT_TRUE(coordinator->WaitForPasses(job, 4)) << "the job is too short";
  coordinator->process().Signal(SIGKILL);
  ASSERT_TRUE(coordinator->process().WaitForExit(kPatience));
  std::this_thread::sleep_for(seconds(10));
  coordinator = std::make_unique<CoordinatorProcess>(KeptIn(folder.path()), address);
  EXPECT_EQ(client.WaitForExit(5 * kPatience), 0) << client.Errors();
  EXPECT_THAT(client.Output(), HasSubstr("all passes done"));
  ExpectQuietEnd(*coordinator, coordinator->Get(job), kLongJob);
}

TEST(RestartedCoordinatorTest, JobsThatWaitKeepTheirOrderAndEndedOnesTheirImages) {
  const TemporaryFolder folder;
  const std::string address = FreeAddress();
  std::vector<std::string> flags = KeptIn(folder.path());
  flags.insert(flags.end(), {"--jobs-at-once", "1"});
  auto coordinator = std::make_unique<CoordinatorProcess>(flags, address);
  std::vector<std::string> jobs;
  {
    const auto worker = coordinator->StartWorker();
    jobs.push_back(coordinator->TrySubmit(kJob).value());
    ASSERT_EQ(coordinator->Wait(jobs[0]).state(), v1::JOB_STATE_SUCCEEDED);
  }
  // The number of workers is of now, and a lost one is noticed a little later.
  for (int i = 0; i < 6000 && coordinator->Get(jobs[0]).progress().workers() > 0; ++i)
    std::this_thread::sleep_for(milliseconds(10));
  const v1::Job before = coordinator->Get(jobs[0]);
  for (const char* request : {"a", "b", "c"}) {
    SmallJob job = kJob;
    job.request_id = request;
    jobs.push_back(coordinator->TrySubmit(job).value());
  }
  coordinator->process().Signal(SIGKILL);
  ASSERT_TRUE(coordinator->process().WaitForExit(kPatience));
  coordinator = std::make_unique<CoordinatorProcess>(flags, address);
  const v1::Job after = coordinator->Get(jobs[0]);
  EXPECT_EQ(after.state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(after.SerializeAsString(), before.SerializeAsString()) << "nothing of it is lost";
  EXPECT_EQ(coordinator->ImageDigest(jobs[0]).Hex(), QuietDigest(kJob).Hex());
  const auto worker = coordinator->StartWorker();
  for (std::size_t i = 1; i < jobs.size(); ++i) {
    const v1::Job ended = coordinator->Wait(jobs[i]);
    ExpectQuietEnd(*coordinator, ended);
    for (std::size_t later = i + 1; later < jobs.size(); ++later)
      EXPECT_LT(coordinator->Get(jobs[later]).state(), v1::JOB_STATE_SUCCEEDED);
  }
}

TEST(RestartedCoordinatorTest, AFolderIsForOneCoordinatorAtATime) {
  const TemporaryFolder folder;
  CoordinatorProcess coordinator(KeptIn(folder.path()));
  const Finished other = RunProgram(
      {kBin + "/lucerna-server", "--listen", "127.0.0.1:0", "--state", folder.path()}, kPatience);
  EXPECT_EQ(other.exit_code, 1);
  EXPECT_THAT(other.errors, HasSubstr("another coordinator uses it"));
}

// A small disk of its own, for those who may mount one.
class SmallDisk {
 public:
  SmallDisk() { is_mounted_ = ::mount("none", folder_.path().c_str(), "tmpfs", 0, "size=4m") == 0; }
  ~SmallDisk() {
    if (is_mounted_) ::umount2(folder_.path().c_str(), MNT_DETACH);
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;

  [[nodiscard]] bool is_mounted() const { return is_mounted_; }
  [[nodiscard]] std::string state() const { return folder_.At("state"); }
  void Fill() const {
    std::ofstream filler(folder_.At("filler"), std::ios::binary);
    const std::string block(4096, 'x');
    while (filler.write(block.data(), static_cast<std::streamsize>(block.size())).flush()) {
    }
  }
  void MakeRoom() const { ::unlink(folder_.At("filler").c_str()); }

 private:
  TemporaryFolder folder_;
  bool is_mounted_ = false;
};

TEST(FullDiskTest, TheJobPausesAndSaysSoAndGoesOnWhenThereIsRoom) {
  const SmallDisk disk;
  if (!disk.is_mounted()) GTEST_SKIP() << "only root may mount a small disk";
  CoordinatorProcess coordinator(KeptIn(disk.state()));
  const auto worker = coordinator.StartWorker();
  const std::string job = coordinator.TrySubmit(kLongJob).value();
  ASSERT_TRUE(coordinator.WaitForPasses(job, 3)) << "the job is too short";
  disk.Fill();
  for (int i = 0; i < 6000 && coordinator.Get(job).condition().empty(); ++i)
    std::this_thread::sleep_for(milliseconds(10));
  const v1::Job paused = coordinator.Get(job);
  EXPECT_EQ(paused.condition(),
            "paused: no room in " + disk.state() + "; it goes on when there is");
  EXPECT_EQ(paused.state(), v1::JOB_STATE_PAUSED);
  EXPECT_EQ(paused.pause_cause(), v1::PAUSE_CAUSE_DISK);
  EXPECT_LT(paused.progress().passes(), kLongJob.passes) << "no more than a crash may lose";

  SmallJob other = kLongJob;
  other.request_id = "other";
  const auto refused = coordinator.TrySubmit(other);
  EXPECT_TRUE(absl::IsResourceExhausted(refused.status())) << refused.status();
  EXPECT_THAT(std::string(refused.status().message()), HasSubstr("no room in " + disk.state()));

  disk.MakeRoom();
  const v1::Job ended = coordinator.Wait(job);
  ExpectQuietEnd(coordinator, ended, kLongJob);
  EXPECT_EQ(ended.condition(), "");
  EXPECT_THAT(ended.DebugString(), HasSubstr("paused: no room in"));
  EXPECT_EQ(coordinator.List().size(), 1U);
  ASSERT_TRUE(coordinator.TrySubmit(other).ok());
}

TEST(FullDiskTest, AnImageThatDoesNotFitIsKeptWhenThereIsRoom) {
  const SmallDisk disk;
  if (!disk.is_mounted()) GTEST_SKIP() << "only root may mount a small disk";
  // No checkpoint, so that the image is the first that finds no room.
  CoordinatorProcess coordinator({"--state", disk.state(), "--checkpoint-share", "1e-9"});
  const auto worker = coordinator.StartWorker();
  const std::string job = coordinator.TrySubmit(kLongJob).value();
  ASSERT_TRUE(coordinator.WaitForPasses(job, 3)) << "the job is too short";
  disk.Fill();
  for (int i = 0; i < 6000 && coordinator.Get(job).condition().empty(); ++i)
    std::this_thread::sleep_for(milliseconds(10));
  EXPECT_THAT(coordinator.Get(job).condition(), HasSubstr("no room in"));
  disk.MakeRoom();
  ExpectQuietEnd(coordinator, coordinator.Wait(job), kLongJob);
}

TEST(FullDiskTest, AReadOnlyDiskPausesTheJobToo) {
  const SmallDisk disk;
  if (!disk.is_mounted()) GTEST_SKIP() << "only root may mount a small disk";
  CoordinatorProcess coordinator(KeptIn(disk.state()));
  const auto worker = coordinator.StartWorker();
  const std::string job = coordinator.TrySubmit(kLongJob).value();
  ASSERT_TRUE(coordinator.WaitForPasses(job, 3)) << "the job is too short";
  const std::string checkpoints = disk.state() + "/checkpoints";
  ASSERT_EQ(::mount(checkpoints.c_str(), checkpoints.c_str(), nullptr, MS_BIND, nullptr), 0);
  ASSERT_EQ(
      ::mount(nullptr, checkpoints.c_str(), nullptr, MS_BIND | MS_REMOUNT | MS_RDONLY, nullptr), 0);
  for (int i = 0; i < 6000 && coordinator.Get(job).condition().empty(); ++i)
    std::this_thread::sleep_for(milliseconds(10));
  EXPECT_THAT(coordinator.Get(job).condition(), HasSubstr("cannot be written"));
  ASSERT_EQ(::umount2(checkpoints.c_str(), MNT_DETACH), 0);
  ExpectQuietEnd(coordinator, coordinator.Wait(job), kLongJob);
}

}  // namespace
}  // namespace lucerna
