// Sums of accumulations must be the same in any order, must be taken out again exactly, and must
// refuse as a whole what does not fit, changing nothing.
#include "render/estimate/accumulation.h"

#include <limits>

#include "gtest/gtest.h"

namespace lucerna {
namespace {

Accumulation Make(std::vector<std::uint32_t> rows, std::int64_t flux) {
  Accumulation accumulation;
  accumulation.counts.assign(rows.size(), 2);
  for (auto& channel : accumulation.flux)
    channel.assign(rows.size(), flux);
  accumulation.hitpoints = std::move(rows);
  accumulation.tally = {10, 30, 20, 5, 1};
  return accumulation;
}

bool AreEqual(const PassSums& a, const PassSums& b) {
  return a.counts() == b.counts() && a.flux(0) == b.flux(0) && a.flux(1) == b.flux(1) &&
         a.flux(2) == b.flux(2) && a.tally() == b.tally();
}

TEST(PassSumsTest, DoesNotCareForTheOrder) {
  const std::vector<Accumulation> parts = {Make({0, 2}, 7), Make({1, 2, 3}, -5), Make({2}, 1000)};
  PassSums forward(4);
  PassSums backward(4);
  for (const auto& part : parts)
    ASSERT_TRUE(forward.Add(part).ok());
  for (auto part = parts.rbegin(); part != parts.rend(); ++part) {
    ASSERT_TRUE(backward.Add(*part).ok());
  }
  EXPECT_TRUE(AreEqual(forward, backward));
  EXPECT_EQ(forward.counts(), (std::vector<std::uint64_t>{2, 2, 6, 2}));
  EXPECT_EQ(forward.flux(1), (std::vector<std::int64_t>{7, -5, 1002, -5}));
  EXPECT_EQ(forward.tally().rays, 90U);
}

TEST(PassSumsTest, TakesOutWhatWasPutIn) {
  PassSums sums(4);
  PassSums kept(4);
  ASSERT_TRUE(sums.Add(Make({0, 3}, 9)).ok());
  ASSERT_TRUE(kept.Add(Make({0, 3}, 9)).ok());
  ASSERT_TRUE(sums.Add(Make({1, 3}, 4)).ok());
  ASSERT_TRUE(sums.Subtract(Make({1, 3}, 4)).ok());
  EXPECT_TRUE(AreEqual(sums, kept));
  EXPECT_TRUE(absl::IsOutOfRange(sums.Subtract(Make({2}, 0)))) << "was never put in";
}

TEST(PassSumsTest, RefusesAsAWholeWhatBreaksAPromise) {
  PassSums sums(4);
  const PassSums empty(4);
  EXPECT_TRUE(absl::IsInvalidArgument(sums.Add(Make({0, 4}, 1)))) << "no such hitpoint";
  EXPECT_TRUE(absl::IsInvalidArgument(sums.Add(Make({0, 2, 1}, 1)))) << "not increasing";
  EXPECT_TRUE(absl::IsInvalidArgument(sums.Add(Make({1, 1}, 1)))) << "twice";
  Accumulation without_photons = Make({0, 1}, 1);
  without_photons.counts[1] = 0;
  EXPECT_TRUE(absl::IsInvalidArgument(sums.Add(without_photons)));
  Accumulation ragged = Make({0, 1}, 1);
  ragged.flux[2].pop_back();
  EXPECT_TRUE(absl::IsInvalidArgument(sums.Add(ragged)));
  EXPECT_TRUE(AreEqual(sums, empty));
}

TEST(PassSumsTest, RefusesASumThatWouldWrap) {
  constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max();
  PassSums sums(2);
  ASSERT_TRUE(sums.Add(Make({1}, kMost)).ok());
  EXPECT_TRUE(absl::IsOutOfRange(sums.Add(Make({0, 1}, 1))));
  EXPECT_EQ(sums.flux(0), (std::vector<std::int64_t>{0, kMost}));
  EXPECT_EQ(sums.counts(), (std::vector<std::uint64_t>{0, 2}));
  EXPECT_TRUE(sums.Add(Make({0, 1}, -1)).ok());
}

}  // namespace
}  // namespace lucerna
