// The small parts of the coordinator: what is kept of ended jobs, who is next, what is counted.
#include <cstdint>
#include <limits>
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

TEST(JobRetentionTest, JobsWithoutPhotonsOrImageTakeNoRoom) {
  const RetentionLimits limits = {.jobs = 10, .pixels = 0, .images = 1, .image_bytes = 0};
  const EndedJob cancelled = {.pixels = 1000};
  const EndedJob ended = {.has_photons = true, .pixels = 60, .has_image = true, .image_bytes = 30};
  EXPECT_EQ(DecideRetention({cancelled, cancelled, ended, ended}, limits),
            (std::vector<KeptOfJob>{
                {true, true, true}, {true, true, true}, {true, true, true}, {true, false, false}}));
}

TEST(JobQueueTest, GivesOneJobATimeInOrder) {
  JobQueue queue(2);
  EXPECT_TRUE(queue.is_idle());
  queue.Push(1);
  queue.Push(2);
  EXPECT_TRUE(queue.is_full());
  queue.Push(3);
  queue.Remove(2);
  queue.Remove(7);
  EXPECT_EQ(queue.Begin(), 1U);
  EXPECT_EQ(queue.current(), 1U);
  EXPECT_FALSE(queue.is_idle());
  queue.End();
  EXPECT_EQ(queue.Begin(), 3U);
  queue.End();
  EXPECT_TRUE(queue.is_idle());
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
