// The scheduler, the mergers and the store are asked by many threads at once. Whatever the
// interleaving: every photon and every pass is merged exactly once, the sums are those of one
// thread, and no bytes are lost. Links no gRPC, so that ThreadSanitizer can be believed.
#include <atomic>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "gtest/gtest.h"

#include "server/blob_store.h"
#include "server/pass_merger.h"
#include "server/round_merger.h"
#include "server/scheduler.h"

namespace lucerna {
namespace {

constexpr std::size_t kHitpoints = 64;
constexpr std::uint64_t kPhotons = 20'000;
const PassKey kPass = {"job", 0};

// What a batch brings depends on its range alone.
Accumulation BatchOf(WorkRange range) {
  Accumulation accumulation;
  for (std::uint32_t i = 0; i < kHitpoints; ++i) {
    accumulation.hitpoints.push_back(i);
    accumulation.counts.push_back(static_cast<std::uint32_t>(range.size()));
    for (std::size_t c = 0; c < 3; ++c) {
      accumulation.flux[c].push_back(static_cast<std::int64_t>(range.first * (i + 1) + c));
    }
  }
  accumulation.tally.photons = range.size();
  return accumulation;
}

void RunThreads(int count, const std::function<void(int)>& body) {
  std::vector<std::thread> threads;
  for (int t = 0; t < count; ++t)
    threads.emplace_back(body, t);
  for (std::thread& thread : threads)
    thread.join();
}

TEST(CoordinatorPartsTest, FaultyWorkersTogetherMergeEveryPhotonOnce) {
  SchedulerOptions options;
  options.fixed_batch = 100;
  // Some workers here fail on purpose, again and again.
  options.poison_workers = 1'000'000;
  options.poison_failures = 1'000'000;
  Scheduler scheduler(options);
  PassMerger merger;
  merger.Open(kPass, kHitpoints, kPhotons);
  scheduler.OpenPass(kPass, kPhotons);
  std::atomic<std::uint64_t> accepted = 0;
  std::atomic<std::int64_t> now_ms = 0;
  const auto now = [&] { return SteadyTime(std::chrono::milliseconds(now_ms++)); };

  RunThreads(4, [&](int thread) {
    std::string worker = scheduler.AddWorker("w", now()).value();
    for (int round = 0; !merger.IsComplete(kPass); ++round) {
      Scheduler::Report report;
      report.wants_lease = true;
      if (!scheduler.TakeReport(worker, report, now()).ok()) {
        worker = scheduler.AddWorker("w", now()).value();
        continue;
      }
      const auto answer = scheduler.AnswerFor(worker, report, now());
      if (!answer.ok() || !answer->lease) {
        scheduler.Expire(now());
        std::this_thread::yield();
        continue;
      }
      const BatchLease& lease = *answer->lease;
      const bool is_late = round % 5 == thread;
      // Loses its connection first and delivers all the same.
      if (is_late) scheduler.LoseWorker(worker);
      if (round % 7 == thread) continue;  // drops the batch
      const auto outcome = merger.Merge(lease.pass, lease.range, BatchOf(lease.range));
      ASSERT_TRUE(outcome.ok()) << outcome.status();
      if (*outcome == MergeOutcome::kAccepted) {
        accepted += lease.range.size();
        scheduler.Commit(lease.pass, lease.range, now());
      }
    }
  });

  EXPECT_EQ(accepted, kPhotons);
  const PassSums sums = merger.Take(kPass);
  PassSums expected(kHitpoints);
  for (std::uint64_t first = 0; first < kPhotons; first += 100) {
    ASSERT_TRUE(expected.Add(BatchOf({first, first + 100})).ok());
  }
  EXPECT_EQ(sums.counts(), expected.counts());
  for (int c = 0; c < 3; ++c)
    EXPECT_EQ(sums.flux(c), expected.flux(c));
  EXPECT_EQ(sums.tally(), expected.tally());
}

TEST(CoordinatorPartsTest, ABatchThatManyDeliverAtOnceIsAcceptedOnce) {
  for (int round = 0; round < 50; ++round) {
    PassMerger merger;
    merger.Open(kPass, kHitpoints, 100);
    std::atomic<int> accepted = 0;
    RunThreads(4, [&](int) {
      const auto outcome = merger.Merge(kPass, {0, 100}, BatchOf({0, 100}));
      ASSERT_TRUE(outcome.ok());
      if (*outcome == MergeOutcome::kAccepted) ++accepted;
    });
    EXPECT_EQ(accepted, 1);
    EXPECT_EQ(merger.Take(kPass).tally().photons, 100U);
  }
}

// What a slice brings depends on its passes alone.
SliceSums SliceOf(const PassRange& passes) {
  SliceSums sum = EmptySlice({passes.first, passes.first + 1}, kHitpoints, 0);
  for (PackedFloats& column : sum.columns) {
    for (std::size_t pixel = 0; pixel < column.size(); ++pixel)
      column.Set(pixel, static_cast<float>((passes.first * (pixel + 1)) % 251));
  }
  sum.tally.photons = 10;
  sum.tally.rays = passes.first;
  if (passes.size() == 1) return sum;
  const std::uint64_t middle = passes.first + passes.size() / 2;
  sum = SliceOf({passes.first, middle});
  EXPECT_TRUE(MergeSibling(sum, SliceOf({middle, passes.last})).ok());
  return sum;
}

// Workers take slices of two rounds at once, some of them die with theirs and deliver all the same,
// while another thread looks at what has come, as the job's runner does.
TEST(CoordinatorPartsTest, FaultyWorkersTogetherMergeEveryPassOnce) {
  const std::vector<PassRange> rounds = {RoundOf(512), RoundOf(576)};
  SchedulerOptions options;
  options.poison_workers = 1'000'000;
  options.poison_failures = 1'000'000;
  Scheduler scheduler(options);
  RoundMerger merger;
  for (const PassRange& round : rounds) {
    const PassKey key = {"job", round.first};
    merger.Open(key,
                {.passes = round, .pixels = kHitpoints, .evidence = 0, .photons_per_pass = 10});
    scheduler.OpenRound(key, {round.first, round.last}, {});
  }
  const auto is_whole = [&] {
    for (const PassRange& round : rounds) {
      if (merger.PrefixEnd({"job", round.first}) != round.last) return false;
    }
    return true;
  };
  std::atomic<std::uint64_t> accepted = 0;
  std::atomic<std::int64_t> now_ms = 0;
  const auto now = [&] { return SteadyTime(std::chrono::milliseconds(now_ms++)); };

  RunThreads(5, [&](int thread) {
    if (thread == 4) {
      // The runner: what has come never gets less, and is the sum of whole slices.
      std::uint64_t end = rounds[0].first;
      while (!is_whole()) {
        const ImageSums::Slices prefix = merger.Prefix({"job", rounds[0].first});
        std::uint64_t next = rounds[0].first;
        for (const auto& slice : prefix) {
          ASSERT_EQ(slice->passes.first, next);
          next = slice->passes.last;
          ASSERT_EQ(slice->tally.photons, 10 * slice->passes.size());
        }
        ASSERT_GE(next, end);
        end = next;
      }
      return;
    }
    std::string worker = scheduler.AddWorker("w", now()).value();
    for (int step = 0; !is_whole(); ++step) {
      Scheduler::Report report;
      report.wants_lease = true;
      if (!scheduler.TakeReport(worker, report, now()).ok()) {
        worker = scheduler.AddWorker("w", now()).value();
        continue;
      }
      const auto answer = scheduler.AnswerFor(worker, report, now());
      if (!answer.ok() || !answer->lease) {
        scheduler.Expire(now());
        std::this_thread::yield();
        continue;
      }
      const BatchLease& lease = *answer->lease;
      if (step % 5 == thread) scheduler.LoseWorker(worker);
      if (step % 7 == thread) continue;  // drops the slice
      const auto outcome = merger.Merge(lease.pass, SliceOf({lease.range.first, lease.range.last}));
      ASSERT_TRUE(outcome.ok()) << outcome.status();
      if (*outcome == MergeOutcome::kAccepted) {
        accepted += lease.range.size();
        scheduler.Commit(lease.pass, lease.range, now());
      }
    }
  });

  EXPECT_EQ(accepted, rounds[0].size() + rounds[1].size());
  for (const PassRange& round : rounds)
    EXPECT_EQ(*merger.Take({"job", round.first}), SliceOf(round));
}

TEST(CoordinatorPartsTest, ASliceThatManyDeliverAtOnceIsAcceptedOnce) {
  const PassKey key = {"job", 16};
  for (int i = 0; i < 50; ++i) {
    RoundMerger merger;
    merger.Open(
        key, {.passes = RoundOf(16), .pixels = kHitpoints, .evidence = 0, .photons_per_pass = 10});
    std::atomic<std::uint64_t> accepted = 0;
    RunThreads(4, [&](int thread) {
      for (std::uint64_t k = 0; k < 4; ++k) {
        const std::uint64_t pass = 16 + (k + static_cast<std::uint64_t>(thread)) % 4;
        const auto outcome = merger.Merge(key, SliceOf({pass, pass + 1}));
        ASSERT_TRUE(outcome.ok());
        if (*outcome == MergeOutcome::kAccepted) ++accepted;
      }
    });
    EXPECT_EQ(accepted, 4U);
    EXPECT_EQ(*merger.Take(key), SliceOf(RoundOf(16)));
  }
}

// A job ends while slices are on their way: late ones find no round, or one that is opened anew.
TEST(CoordinatorPartsTest, ARoundMayEndWhileSlicesCome) {
  const PassKey key = {"job", 16};
  RoundMerger merger;
  std::atomic<bool> is_over = false;
  RunThreads(3, [&](int thread) {
    if (thread == 0) {
      for (int i = 0; i < 300; ++i) {
        merger.Open(
            key,
            {.passes = RoundOf(16), .pixels = kHitpoints, .evidence = 0, .photons_per_pass = 10});
        while (i % 3 == 0 && merger.PrefixEnd(key) != RoundOf(16).last)
          std::this_thread::yield();
        if (i % 3 == 0) {
          EXPECT_EQ(*merger.Take(key), SliceOf(RoundOf(16)));
        } else {
          merger.Drop(key);
        }
      }
      is_over = true;
      return;
    }
    for (std::uint64_t k = 0; !is_over; ++k) {
      const std::uint64_t pass = 16 + k % 4;
      const auto outcome = merger.Merge(key, SliceOf({pass, pass + 1}));
      ASSERT_TRUE(outcome.ok()) << outcome.status();
    }
  });
}

TEST(CoordinatorPartsTest, ThePinnedBytesOfEveryThreadStay) {
  BlobStore blobs(10'000);
  RunThreads(4, [&](int thread) {
    for (int i = 0; i < 500; ++i) {
      const std::string mine = absl::StrCat("radii of pass ", i, " of ", thread);
      const std::string shared = absl::StrCat("mesh ", i % 7);
      const Digest digest = Sha256(mine);
      StatusOr<BlobPin> pin = blobs.PutPinned(digest, mine, AfterLastPin::kDrop);
      ASSERT_TRUE(pin.ok());
      const StatusOr<BlobPin> pin_of_shared = blobs.PutPinned(Sha256(shared), shared);
      ASSERT_TRUE(pin_of_shared.ok());
      const auto blob = blobs.Get(digest);
      ASSERT_TRUE(blob.ok());
      EXPECT_EQ(**blob, mine);
      ASSERT_TRUE(blobs.Get(Sha256(shared)).ok());
      *pin = BlobPin();
      EXPECT_FALSE(blobs.Has(digest));
    }
  });
  EXPECT_LE(blobs.size_bytes(), 10'000U);
}

}  // namespace
}  // namespace lucerna
