// Do rounds, their lag and their slices keep what estimate/rounds.h promises, for every pass?
#include "render/estimate/rounds.h"

#include <gtest/gtest.h>

namespace lucerna {
namespace {

TEST(RoundsTest, CoverEveryPassOnceAndInOrder) {
  std::uint64_t next = 0;
  while (next < 100'000) {
    const PassRange round = RoundOf(next);
    ASSERT_EQ(round.first, next);
    ASSERT_GT(round.last, round.first);
    for (std::uint64_t pass = round.first; pass < round.last; ++pass)
      ASSERT_EQ(RoundOf(pass), round);
    ASSERT_TRUE(IsSlice(round));
    next = round.last;
  }
}

// Of a quarter of the passes before them up to eight, then of an eighth.
TEST(RoundsTest, GrowWithThePassesBeforeThem) {
  EXPECT_EQ(RoundOf(7).size(), 1U);
  EXPECT_EQ(RoundOf(8).size(), 2U);
  EXPECT_EQ(RoundOf(31).size(), 4U);
  EXPECT_EQ(RoundOf(32).size(), 8U);
  EXPECT_EQ(RoundOf(127).size(), 8U);
  EXPECT_EQ(RoundOf(128).size(), 16U);
  for (std::uint64_t pass = kFirstLongRound; pass < 10'000; ++pass) {
    const PassRange round = RoundOf(pass);
    EXPECT_LE((round.size() > kLongestQuickRound ? 8 : 4) * round.size(), round.first);
    EXPECT_LE(round.size(), kLongestRound);
    if (round.size() < kLongestRound) {
      EXPECT_GT(16 * round.size(), round.first);
    }
  }
}

// A round's radii follow from whole rounds: all but an eighth of the passes before it, at first; in
// the long run all but a half; and no more of them are missing than that and a round.
TEST(RoundsTest, LagBehind) {
  EXPECT_EQ(RadiiFrom(RoundOf(0)), 0U);
  EXPECT_EQ(RadiiFrom(RoundOf(1)), 0U);
  EXPECT_EQ(RadiiFrom(RoundOf(2)), 1U);
  for (std::uint64_t pass = 2; pass < 10'000; ++pass) {
    const PassRange round = RoundOf(pass);
    const std::uint64_t from = RadiiFrom(round);
    EXPECT_EQ(RoundOf(from).first, from);
    if (round.first <= kFirstLongLag) {
      EXPECT_LE(from, round.first - std::max<std::uint64_t>(round.first / 8, 1));
      EXPECT_GE(8 * (from + round.size()), 7 * round.first) << pass;
    } else {
      EXPECT_LE(2 * from, round.first + kFirstLongLag) << pass;
      EXPECT_GE(16 * (from + round.size()), 7 * round.first) << pass;
    }
    if (from > 0) {
      EXPECT_LE(RadiiFrom(RoundOf(round.first - 1)), from);
    }
  }
}

// What is kept of the radii does not grow with the passes.
TEST(RoundsTest, FollowFromAFewStatesOfTheRadii) {
  for (std::uint64_t pass = kFirstLongLag; pass < 100'000; pass = RoundOf(pass).last) {
    std::set<std::uint64_t> states;
    for (PassRange round = RoundOf(pass); RadiiFrom(round) <= pass; round = RoundOf(round.last))
      states.insert(RadiiFrom(round));
    EXPECT_LE(states.size(), 9U) << pass;
  }
}

TEST(RoundsTest, SlicesArePowersOfTwoWithinARound) {
  EXPECT_TRUE(IsSlice({64, 72}));
  EXPECT_TRUE(IsSlice({68, 72}));
  EXPECT_TRUE(IsSlice({70, 71}));
  EXPECT_FALSE(IsSlice({66, 70}));
  EXPECT_FALSE(IsSlice({64, 67}));
  EXPECT_FALSE(IsSlice({64, 64}));
  EXPECT_FALSE(IsSlice({64, 80}));  // two rounds
  EXPECT_EQ(SiblingOf({68, 70}), (PassRange{70, 72}));
  EXPECT_EQ(SiblingOf({70, 72}), (PassRange{68, 70}));
  EXPECT_EQ(SiblingOf({64, 68}), (PassRange{68, 72}));
}

}  // namespace
}  // namespace lucerna
