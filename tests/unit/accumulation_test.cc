// Sums of accumulations must be the same in any order, must be taken out again exactly, and must
// refuse as a whole what does not fit, changing nothing.
#include "render/estimate/accumulation.h"

#include <algorithm>
#include <array>
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
  accumulation.tally.photons = 10;
  accumulation.tally.rays = 30;
  accumulation.tally.energy = {.emitted = 100, .roulette_gain = 7, .absorbed = 107};
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
  EXPECT_EQ(forward.counts().ToVector(), (std::vector<std::int64_t>{2, 2, 6, 2}));
  EXPECT_EQ(forward.flux(1).ToVector(), (std::vector<std::int64_t>{7, -5, 1002, -5}));
  EXPECT_EQ(forward.tally().rays, 90U);
}

TEST(PassSumsTest, CountsPhotonsByLight) {
  Accumulation one = Make({0}, 1);
  one.tally.lights = {{.sent = 6, .in_view = {0, 2}}, {.sent = 4, .in_view = {4, 0}}};
  Accumulation other = Make({1}, 1);
  other.tally.lights = {{.sent = 3, .in_view = {1, 1}}};
  PassSums sums(4);
  ASSERT_TRUE(sums.Add(other).ok());
  ASSERT_TRUE(sums.Add(one).ok());
  EXPECT_EQ(sums.tally().lights, (std::vector<LightTally>{{.sent = 9, .in_view = {1, 3}},
                                                          {.sent = 4, .in_view = {4, 0}}}));
}

TEST(PassSumsTest, RefusesPhotonsByLightThatContradictThePhotons) {
  using Lights = std::vector<LightTally>;
  PassSums sums(4);
  for (const Lights& lights :
       {Lights{{.sent = 11}},              // more than there were
        Lights{{.sent = 6}, {.sent = 5}},  // together
        Lights{{.sent = ~std::uint64_t{0}}, {.sent = 11}},
        Lights{{.sent = 3, .in_view = {4, 0}}},                           // found, never sent
        Lights{{.sent = 3, .in_view = {0, 4}}}, Lights{{.sent = 3}, {}},  // ends with none
        Lights(kMaxLightTallies + 1, {.sent = 0})}) {
    Accumulation bad = Make({0}, 1);
    bad.tally.lights = lights;
    EXPECT_TRUE(absl::IsInvalidArgument(sums.Add(bad)));
    EXPECT_EQ(sums.tally(), BatchTally());
  }
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
  EXPECT_EQ(sums.flux(0).ToVector(), (std::vector<std::int64_t>{0, kMost}));
  EXPECT_EQ(sums.counts().ToVector(), (std::vector<std::int64_t>{0, 2}));
  EXPECT_TRUE(sums.Add(Make({0, 1}, -1)).ok());

  PassSums with_evidence(2, 1);
  Accumulation evidence = Make({1}, 0);
  evidence.evidence = {{std::numeric_limits<std::int64_t>::min()}};
  ASSERT_TRUE(with_evidence.Add(evidence).ok());
  EXPECT_TRUE(absl::IsOutOfRange(with_evidence.Add(evidence)));
  EXPECT_EQ(with_evidence.evidence()[0][1], std::numeric_limits<std::int64_t>::min());
}

TEST(PassSumsTest, RowsOneByOneAreThoseOfAnAccumulation) {
  Accumulation whole = Make({0, 2, 3}, 7);
  whole.evidence = {{5, -6, 8}};
  PassSums by_rows(4, 1);
  for (std::size_t i = 0; i < whole.size(); ++i) {
    const std::array<std::int64_t, 1> evidence = {whole.evidence[0][i]};
    EXPECT_TRUE(by_rows.AddRow(whole.hitpoints[i], whole.counts[i], {7, 7, 7}, evidence));
  }
  // The rest has a tally and no rows.
  Accumulation rest = Make({}, 0);
  rest.evidence = {{}};
  ASSERT_TRUE(by_rows.Add(rest).ok());
  EXPECT_EQ(by_rows.ToAccumulation().value(), whole);

  PassSums sums(4, 1);
  ASSERT_TRUE(sums.Add(whole).ok());
  EXPECT_EQ(sums.ToAccumulation().value(), whole) << "there and back";
}

TEST(PassSumsTest, KeepsTheTallyWhenItsColumnsAreTaken) {
  Accumulation whole = Make({0, 2}, 7);
  whole.evidence = {{5, -6}};
  whole.found = {{.index = 3, .numbers = {}, .row = 2}};
  PassSums sums(3, 1);
  ASSERT_TRUE(sums.Add(whole).ok());
  const SumColumns columns = sums.TakeColumns();
  EXPECT_EQ(columns.counts.ToVector(), (std::vector<std::int64_t>{2, 0, 2}));
  for (const PackedIntegers& channel : columns.flux)
    EXPECT_EQ(channel.ToVector(), (std::vector<std::int64_t>{7, 0, 7}));
  ASSERT_EQ(columns.evidence.size(), 1U);
  EXPECT_EQ(columns.evidence[0].ToVector(), (std::vector<std::int64_t>{5, 0, -6}));
  EXPECT_EQ(sums.size(), 0U);
  EXPECT_TRUE(sums.flux(0).empty());
  EXPECT_TRUE(sums.evidence().empty());
  EXPECT_EQ(sums.tally(), whole.tally);
  EXPECT_EQ(sums.FoundInOrder(), whole.found);
}

TEST(PassSumsTest, ARowThatWouldWrapAddsNothing) {
  constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max();
  const std::array<std::int64_t, 1> one = {1};
  const std::array<std::int64_t, 1> most = {kMost};
  PassSums sums(1, 1);
  ASSERT_TRUE(sums.AddRow(0, 2, {1, kMost, 1}, one));
  const auto is_as_before = [&] {
    return sums.counts()[0] == 2 && sums.flux(0)[0] == 1 && sums.flux(1)[0] == kMost &&
           sums.flux(2)[0] == 1 && sums.evidence()[0][0] == 1;
  };
  EXPECT_FALSE(sums.AddRow(0, 1, {1, 1, 1}, one));
  EXPECT_TRUE(is_as_before());
  EXPECT_FALSE(sums.AddRow(0, 1, {1, 0, 1}, most));
  EXPECT_TRUE(is_as_before());
  EXPECT_FALSE(sums.AddRow(0, std::numeric_limits<std::uint64_t>::max(), {1, 0, 1}, one));
  EXPECT_TRUE(is_as_before());
  // An accumulation has no room for as many photons of one hitpoint.
  ASSERT_TRUE(sums.AddRow(0, std::uint64_t{1} << 32, {0, 0, 0}, one));
  EXPECT_TRUE(absl::IsOutOfRange(sums.ToAccumulation().status()));
}

// Every counter, one after the other, at its end.
TEST(PassSumsTest, RefusesATallyThatWouldWrap) {
  constexpr std::uint64_t kMost = std::numeric_limits<std::uint64_t>::max();
  constexpr std::int64_t kMostSigned = std::numeric_limits<std::int64_t>::max();
  std::vector<BatchTally> full(13);
  full[0].photons = kMost;
  full[1].rays = kMost;
  full[2].deposits = kMost;
  full[3].pairs = kMost;
  full[4].dropped = kMost;
  full[5].excess = kMost;
  // Each account of energy against the emitted one, which is at its end too, or against another.
  full[6].energy = {.emitted = kMostSigned, .roulette_loss = kMostSigned};
  full[7].energy = {.emitted = kMostSigned, .absorbed = kMostSigned};
  full[8].energy = {.emitted = kMostSigned, .escaped = kMostSigned};
  full[9].energy = {.emitted = kMostSigned, .smoothing = kMostSigned};
  full[10].energy = {.emitted = kMostSigned, .cut_off = kMostSigned};
  full[11].energy = {.emitted = kMostSigned, .dropped = kMostSigned};
  full[12].energy = {.roulette_gain = kMostSigned, .absorbed = kMostSigned};
  for (const BatchTally& tally : full) {
    Accumulation accumulation;
    accumulation.tally = tally;
    PassSums sums(1);
    ASSERT_TRUE(sums.Add(accumulation).ok());
    EXPECT_TRUE(absl::IsOutOfRange(sums.Add(accumulation)));
    EXPECT_EQ(sums.tally(), tally) << "nothing has changed";
    // Counters that are only read stand still at the end.
    BatchTally read = tally;
    read += tally;
    EXPECT_EQ(read, tally);
  }
}

TEST(PassSumsTest, RefusesEnergyThatDoesNotBalance) {
  PassSums sums(4);
  Accumulation lost = Make({0}, 1);
  --lost.tally.energy.absorbed;
  EXPECT_TRUE(absl::IsInvalidArgument(sums.Add(lost)));
  // Also where the difference is a multiple of 2^64.
  constexpr std::int64_t kHalf = std::numeric_limits<std::int64_t>::min();
  lost.tally.energy = {.absorbed = kHalf, .escaped = kHalf};
  EXPECT_TRUE(absl::IsInvalidArgument(sums.Add(lost)));
}

// A pass of 1e12 photons that all reach one hitpoint, each with its 2^18 quanta, in batches as
// large as can be counted: every bit of the sum is right, far beyond the 2^53 of a double.
TEST(PassSumsTest, CountsATrillionPhotonsToTheLastQuantum) {
  constexpr std::uint64_t kPhotons = 1'000'000'000'000;
  PassSums sums(1);
  std::uint64_t left = kPhotons;
  while (left > 0) {
    const auto count = static_cast<std::uint32_t>(std::min<std::uint64_t>(left, UINT32_MAX));
    Accumulation batch;
    batch.hitpoints = {0};
    batch.counts = {count};
    for (auto& channel : batch.flux)
      channel = {(std::int64_t{count} << 18) + 1};
    batch.tally.photons = count;
    ASSERT_TRUE(sums.Add(batch).ok());
    left -= count;
  }
  constexpr std::int64_t kBatches = (kPhotons + UINT32_MAX - 1) / UINT32_MAX;
  EXPECT_EQ(sums.counts()[0], kPhotons);
  EXPECT_EQ(sums.flux(1)[0], (static_cast<std::int64_t>(kPhotons) << 18) + kBatches);
}

TEST(PassSumsTest, AddsUpAndRefusesWhatBreaksItsPromises) {
  Accumulation a;
  a.hitpoints = {0, 2};
  a.counts = {1, 2};
  for (auto& channel : a.flux)
    channel = {5, -7};
  a.tally.pairs = 3;
  PassSums sums(3);
  ASSERT_TRUE(sums.Add(a).ok());
  ASSERT_TRUE(sums.Add(a).ok());
  EXPECT_EQ(sums.flux(1).ToVector(), (std::vector<std::int64_t>{10, 0, -14}));

  sums = PassSums(3);
  Accumulation bad = a;
  bad.hitpoints = {2, 0};
  EXPECT_EQ(sums.Add(bad).code(), absl::StatusCode::kInvalidArgument);
  bad.hitpoints = {0, 3};
  EXPECT_EQ(sums.Add(bad).code(), absl::StatusCode::kInvalidArgument);
  bad = a;
  bad.counts = {1, 0};
  EXPECT_EQ(sums.Add(bad).code(), absl::StatusCode::kInvalidArgument);
  bad = a;
  bad.flux[2].pop_back();
  EXPECT_EQ(sums.Add(bad).code(), absl::StatusCode::kInvalidArgument);
  // The second row overflows: the first must not have been added.
  Accumulation large = a;
  large.flux[0] = {1, INT64_MAX};
  ASSERT_TRUE(sums.Add(large).ok());
  EXPECT_EQ(sums.Add(large).code(), absl::StatusCode::kOutOfRange);
  EXPECT_EQ(sums.flux(0).ToVector(), (std::vector<std::int64_t>{1, 0, INT64_MAX}));
}

}  // namespace
}  // namespace lucerna
