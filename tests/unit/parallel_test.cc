// A team works every index once, in pieces no larger than asked, and rounds denormals to zero on
// each of its threads and nowhere else.
#include "render/base/parallel.h"

#include <atomic>
#include <vector>

#include "gtest/gtest.h"
#include <xmmintrin.h>

namespace lucerna {
namespace {

class ThreadTeamTest : public testing::TestWithParam<int> {};

TEST_P(ThreadTeamTest, WorksEveryIndexOnceInSmallPieces) {
  ThreadTeam team(GetParam());
  for (const std::size_t count :
       {std::size_t{0}, std::size_t{1}, std::size_t{7}, std::size_t{8}, std::size_t{1001}}) {
    std::vector<std::atomic<int>> visits(count);
    std::atomic<std::size_t> largest = 0;
    team.For(count, 8, [&](std::size_t begin, std::size_t end) {
      std::size_t seen = largest;
      while (seen < end - begin && !largest.compare_exchange_weak(seen, end - begin)) {
      }
      for (std::size_t i = begin; i < end; ++i)
        ++visits[i];
    });
    for (std::size_t i = 0; i < count; ++i)
      EXPECT_EQ(visits[i], 1) << i << " of " << count;
    EXPECT_LE(largest, 8U);
  }
}

TEST_P(ThreadTeamTest, FlushesDenormalsInsideAndOnlyThere) {
  ThreadTeam team(GetParam());
  const unsigned int before = _mm_getcsr();
  std::atomic<int> with_denormals = 0;
  team.For(64, 1, [&](std::size_t, std::size_t) {
    volatile float tiny = 1e-38F;
    volatile float smaller = tiny * 1e-3F;
    if (smaller != 0) ++with_denormals;
  });
  EXPECT_EQ(with_denormals, 0);
  EXPECT_EQ(_mm_getcsr() & 0x8040U, before & 0x8040U);
}

INSTANTIATE_TEST_SUITE_P(Threads, ThreadTeamTest, testing::Values(1, 2, 3));

TEST(ThreadTeamTest, TakesAllThreadsWhenAskedForNone) {
  EXPECT_GE(ThreadTeam(0).threads(), 1);
}

}  // namespace
}  // namespace lucerna
