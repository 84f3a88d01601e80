// The small parts of the coordinator: what is kept of ended jobs, who is next, what is counted.
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "gtest/gtest.h"

#include "server/commit_accounting.h"
#include "server/job_queue.h"
#include "server/job_retention.h"

namespace lucerna {
namespace {

TEST(JobRetentionTest, TheNewestKeepsAllHoweverLargeAndOlderOnesWhatFits) {
  const RetentionLimits limits = {.jobs = 4, .pixels = 100, .images = 3, .image_bytes = 50};
  const EndedJob large = {
      .has_photons = true, .pixels = 1000, .has_image = true, .image_bytes = 1000};
  const EndedJob small = {.has_photons = true, .pixels = 60, .has_image = true, .image_bytes = 30};
  EXPECT_EQ(DecideRetention({large, small, small, small, small}, limits),
            (std::vector<KeptOfJob>{{true, true, true},
                                    {true, true, true},
                                    {true, false, false},
                                    {true, false, false},
                                    {false, false, false}}));
}

TEST(JobRetentionTest, NothingIsKeptOfJobsThatEndedTooLongAgo) {
  const RetentionLimits limits = {.age = std::chrono::hours(24)};
  const EndedJob young = {.age = std::chrono::hours(23)};
  const EndedJob old = {.age = std::chrono::hours(25)};
  const std::vector<KeptOfJob> kept = DecideRetention({young, old, young}, limits);
  EXPECT_TRUE(kept[0].record);
  EXPECT_FALSE(kept[1].record);
  EXPECT_TRUE(kept[2].record);
  EXPECT_TRUE(DecideRetention({old}, {})[0].record) << "no limit";
}

TEST(JobRetentionTest, OfManySmallJobsOnlyTheNewestAreInMemory) {
  const RetentionLimits limits = {.pixels = 250, .in_memory = 2};
  const EndedJob small = {.has_photons = true, .is_in_memory = true, .pixels = 100};
  const EndedJob on_disk = {.has_photons = true, .pixels = 100};
  EXPECT_EQ(DecideRetention({small, on_disk, small, small, small}, limits),
            (std::vector<KeptOfJob>{{.in_memory = true},
                                    {.in_memory = true},
                                    {.in_memory = true},
                                    {.photons = false, .in_memory = false},
                                    {.photons = false, .in_memory = false}}));
  EXPECT_EQ(DecideRetention({small, small, small}, limits).back(), (KeptOfJob{.in_memory = false}))
      << "its checkpoint stays";
}

TEST(JobRetentionTest, JobsWithoutPhotonsOrImageTakeNoRoom) {
  const RetentionLimits limits = {.jobs = 10, .pixels = 0, .images = 1, .image_bytes = 0};
  const EndedJob cancelled = {.pixels = 1000};
  const EndedJob ended = {.has_photons = true, .pixels = 60, .has_image = true, .image_bytes = 30};
  EXPECT_EQ(DecideRetention({cancelled, cancelled, ended, ended}, limits),
            (std::vector<KeptOfJob>{
                {true, true, true}, {true, true, true}, {true, true, true}, {true, false, false}}));
}

// Begins the turn of the job whose turn it is; 0: of none.
std::uint64_t BeginNext(JobQueue& queue) {
  const std::optional<std::uint64_t> next = queue.Next();
  if (next) queue.Begin(*next);
  return next.value_or(0);
}

TEST(JobQueueTest, GivesSoManyJobsATurnInOrder) {
  JobQueue queue(2, 2);
  EXPECT_TRUE(queue.has_room());
  queue.Push(11, {.number = 1});
  queue.Push(12, {.number = 3});
  EXPECT_TRUE(queue.is_full());
  queue.Push(13, {.number = 2});
  queue.Push(14, {.number = 0});
  queue.Remove(14);
  queue.Remove(99);
  EXPECT_EQ(BeginNext(queue), 11U);
  EXPECT_FALSE(queue.has_room());
  EXPECT_EQ(BeginNext(queue), 13U);
  EXPECT_EQ(BeginNext(queue), 0U) << "two have a turn";
  queue.End(11);
  EXPECT_EQ(BeginNext(queue), 12U);
  queue.End(13);
  EXPECT_TRUE(queue.has_room());
}

// A job that was paused and resumed, or extended, while its last turn was still ending.
TEST(JobQueueTest, AJobHasOneTurnAtATime) {
  JobQueue queue(4, 2);
  queue.Push(1, {});
  ASSERT_EQ(BeginNext(queue), 1U);
  queue.Push(1, {});
  EXPECT_EQ(BeginNext(queue), 0U);
  queue.End(1);
  EXPECT_EQ(BeginNext(queue), 1U);
}

TEST(JobQueueTest, HigherPriorityComesFirstAndTakesTheTurnOfALowerOne) {
  JobQueue queue(8, 2);
  queue.Push(1, {.priority = 0, .number = 1});
  queue.Push(2, {.priority = -5, .number = 2});
  queue.Push(3, {.priority = -9, .number = 3});
  ASSERT_EQ(BeginNext(queue), 1U);
  ASSERT_EQ(BeginNext(queue), 2U);
  EXPECT_EQ(queue.TakeYielding(), std::nullopt) << "the one that waits has a lower priority";
  queue.SetPriority(3, 7);
  EXPECT_EQ(queue.TakeYielding(), 2U) << "the lowest of those that run";
  EXPECT_EQ(queue.TakeYielding(), std::nullopt) << "there is a place now";
  EXPECT_EQ(BeginNext(queue), 3U);
  queue.Push(2, {.priority = -5, .number = 2});
  queue.End(2);
  EXPECT_EQ(BeginNext(queue), 0U);
  queue.SetPriority(1, -50);
  EXPECT_EQ(queue.TakeYielding(), 1U) << "its priority fell below that of one that waits";
}

TEST(JobQueueTest, AnOwnerWithOneJobNeverWaitsForSeveralOfAnother) {
  JobQueue queue(8, 2);
  for (std::uint64_t i = 1; i <= 5; ++i)
    queue.Push(i, {.owner = "many", .number = i});
  ASSERT_EQ(BeginNext(queue), 1U);
  ASSERT_EQ(BeginNext(queue), 2U);
  EXPECT_EQ(queue.TakeYielding(), std::nullopt) << "of the same owner";
  queue.Push(6, {.owner = "one", .number = 6});
  EXPECT_EQ(queue.TakeYielding(), 2U) << "the newer of the two";
  EXPECT_EQ(BeginNext(queue), 6U);
  queue.Push(2, {.owner = "many", .number = 2});
  queue.End(2);
  EXPECT_EQ(queue.TakeYielding(), std::nullopt) << "back and forth";
  queue.End(1);
  EXPECT_EQ(BeginNext(queue), 2U) << "it came before the others of its owner";
}

TEST(JobQueueTest, AJobThatCannotGoOnLeavesItsPlaceAndTakesItAgain) {
  JobQueue queue(8, 1);
  queue.Push(1, {.number = 1});
  queue.Push(2, {.number = 2});
  ASSERT_EQ(BeginNext(queue), 1U);
  queue.SetHasPlace(1, false);
  ASSERT_EQ(BeginNext(queue), 2U);
  EXPECT_TRUE(queue.HasTurn(1));
  queue.SetHasPlace(1, true);
  EXPECT_EQ(queue.TakeYielding(), 2U) << "one turn too many";
  EXPECT_EQ(queue.TakeYielding(), std::nullopt);
}

TEST(CommitAccountingTest, CountsABatchForTheJobAndItsWorker) {
  Job job;
  job.life = JobLife(SteadyTime(std::chrono::seconds(10)));
  Delivery delivery;
  delivery.worker = "a registration of w-1";
  delivery.record = "w-1";
  delivery.pass = {"job", 3};
  delivery.cpu = std::chrono::seconds(2);
  delivery.size_bytes = 100;
  DeliveredCounts counts;
  counts.tally.photons = 1000;
  counts.tally.dropped = 1;
  counts.dropped_photons = {{3, 42}};
  counts.rows = 2;
  CountCommit(job, delivery, counts, "first name", SteadyTime(std::chrono::seconds(14)));
  CountCommit(job, delivery, counts, "other name", SteadyTime(std::chrono::seconds(15)));
  EXPECT_EQ(job.counters.to_first_photons, std::chrono::seconds(4));
  EXPECT_EQ(job.counters.photons, 2000U);
  EXPECT_EQ(job.counters.tally.dropped, 2U);
  EXPECT_EQ(job.counters.dropped_photons[0], (PhotonKey{3, 42}));
  EXPECT_EQ(job.counters.worker_cpu, std::chrono::seconds(4));
  EXPECT_EQ(job.counters.bytes_received, 200U);
  EXPECT_EQ(job.counters.hitpoints_returned, 4U);
  EXPECT_EQ(job.workers.at("w-1").name, "first name");
  EXPECT_EQ(job.workers.at("w-1").photons, 2000U);
  EXPECT_EQ(job.workers.at("w-1").batches, 2U);
  CountFetch(job, 50, 7);
  CountFetch(job, 5, 0);
  EXPECT_EQ(job.counters.bytes_sent, 55U);
  EXPECT_EQ(job.counters.hitpoints_sent, 7U);
}

// What a worker says of its time may be anything.
TEST(CommitAccountingTest, TimesThatDoNotFitAreAsLongAsThereIsRoomFor) {
  Job job;
  Delivery delivery;
  delivery.cpu = Duration::max();
  for (int i = 0; i < 3; ++i)
    CountCommit(job, delivery, DeliveredCounts(), "w", SteadyTime());
  EXPECT_EQ(job.counters.worker_cpu, Duration::max() / 4);
}

}  // namespace
}  // namespace lucerna
