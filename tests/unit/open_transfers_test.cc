// How much may one caller have under way, and when is a stream over that has stopped?
#include "server/open_transfers.h"

#include <memory>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace lucerna {
namespace {

using std::chrono::seconds;

class SetClock final : public Clock {
 public:
  [[nodiscard]] SteadyTime Steady() const override { return now; }
  [[nodiscard]] WallTime Wall() const override { return {}; }
  SteadyTime now;
};

TEST(OpenTransfersTest, EachCallerHasSoManyStreamsAndBytes) {
  const SetClock clock;
  OpenTransfers transfers(clock, {.streams = 2, .bytes = 100, .longest_silence = seconds(10)});
  const auto nothing = [] {};
  auto first = transfers.Open("alice", nothing);
  auto second = transfers.Open("alice", nothing);
  ASSERT_TRUE(first.ok() && second.ok());
  EXPECT_TRUE(absl::IsResourceExhausted(transfers.Open("alice", nothing).status()));
  EXPECT_TRUE(transfers.Open("bob", nothing).ok());

  EXPECT_TRUE((*first)->Announce(60).ok());
  EXPECT_TRUE(absl::IsResourceExhausted((*second)->Announce(41)));
  EXPECT_TRUE((*second)->Announce(40).ok());
  first = absl::CancelledError("over");
  const auto third = transfers.Open("alice", nothing);
  ASSERT_TRUE(third.ok());
  EXPECT_TRUE((*third)->Announce(60).ok()) << "what is over counts no more";
  EXPECT_TRUE(absl::IsResourceExhausted((*third)->Announce(~std::uint64_t{0})));
}

TEST(OpenTransfersTest, OneAloneMayBeLargerThanAllTogether) {
  const SetClock clock;
  OpenTransfers transfers(clock, {.streams = 2, .bytes = 100, .longest_silence = seconds(10)});
  const auto large = transfers.Open("alice", [] {});
  const auto small = transfers.Open("alice", [] {});
  EXPECT_TRUE((*large)->Announce(1000).ok());
  EXPECT_TRUE(absl::IsResourceExhausted((*small)->Announce(1)));
}

TEST(OpenTransfersTest, AStreamThatStopsIsEndedOnceAndOthersAreNot) {
  SetClock clock;
  OpenTransfers transfers(clock, {.streams = 9, .bytes = 100, .longest_silence = seconds(10)});
  int ends_of_silent = 0;
  int ends_of_others = 0;
  const auto silent = transfers.Open("a", [&] { ++ends_of_silent; });
  const auto moving = transfers.Open("a", [&] { ++ends_of_others; });
  const auto complete = transfers.Open("a", [&] { ++ends_of_others; });
  (*complete)->Complete();
  clock.now += seconds(10);
  transfers.Tick();
  EXPECT_EQ(ends_of_silent, 0) << "not yet";
  (*moving)->Progress();
  clock.now += seconds(1);
  transfers.Tick();
  transfers.Tick();
  EXPECT_EQ(ends_of_silent, 1);
  EXPECT_EQ(ends_of_others, 0);
}

}  // namespace
}  // namespace lucerna
