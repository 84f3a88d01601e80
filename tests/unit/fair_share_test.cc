// Among jobs that always have work to lend, owners are lent alike, jobs of an owner are lent alike,
// and higher priorities come first; nobody has a credit or a debt from a time without competition.
#include "server/fair_share.h"

#include <cmath>
#include <map>
#include <string>

#include "gtest/gtest.h"

namespace lucerna {
namespace {

constexpr WorkKind kKind = WorkKind::kPasses;

// Lends so many leases of `size`, each of which takes `cost` [s] of processor time by job; how much
// time each job was lent.
std::map<std::string, double> Lend(FairShare& shares, int leases,
                                   const std::map<std::string, double>& cost,
                                   std::uint64_t size = 4) {
  std::map<std::string, double> lent;
  for (int i = 0; i < leases; ++i) {
    const std::string job = shares.Next().value();
    shares.CountLent(job, kKind, size);
    const double time_s = cost.at(job);
    shares.CountWork(job, kKind, size,
                     std::chrono::duration_cast<Duration>(std::chrono::duration<double>(time_s)));
    lent[job] += time_s;
  }
  return lent;
}

void Add(FairShare& shares, const std::string& job, const std::string& owner, int priority = 0) {
  shares.SetClaim(job, {.priority = priority, .owner = owner});
  shares.SetLendable(job, true);
}

TEST(FairShareTest, AnOwnerOfFiveJobsIsLentAsMuchAsOneOfOne) {
  FairShare shares;
  std::map<std::string, double> cost;
  for (const char* job : {"a1", "a2", "a3", "a4", "a5"}) {
    Add(shares, job, "a");
    cost[job] = 1;
  }
  Add(shares, "b1", "b");
  cost["b1"] = 1;
  const auto lent = Lend(shares, 1000, cost);
  EXPECT_EQ(lent.at("b1"), 500);
  for (const char* job : {"a1", "a2", "a3", "a4", "a5"})
    EXPECT_EQ(lent.at(job), 100) << job;
}

TEST(FairShareTest, WhatCountsIsProcessorTimeAndNotLeases) {
  FairShare shares;
  Add(shares, "heavy", "a");
  Add(shares, "light", "b");
  const auto lent = Lend(shares, 1100, {{"heavy", 10}, {"light", 1}});
  // The first lease of each weighs as any other; then they differ by a lease at most.
  EXPECT_NEAR(lent.at("heavy"), lent.at("light"), 20);
}

TEST(FairShareTest, LowerPrioritiesAreLentWhatHigherOnesLeaveOver) {
  FairShare shares;
  Add(shares, "low", "a");
  Add(shares, "high", "a", 1);
  Add(shares, "high too", "b", 1);
  const std::map<std::string, double> cost = {{"low", 1}, {"high", 1}, {"high too", 1}};
  auto lent = Lend(shares, 10, cost);
  EXPECT_EQ(lent["low"], 0);
  EXPECT_EQ(lent["high"], 5);
  shares.SetLendable("high", false);
  shares.SetHeld("high too", true);
  EXPECT_EQ(Lend(shares, 1, cost)["low"], 1);
  shares.SetClaim("low", {.priority = 2, .owner = "a"});
  shares.SetHeld("high too", false);
  EXPECT_EQ(Lend(shares, 3, cost)["low"], 3);
}

TEST(FairShareTest, WhoComesBackBeginsWhereTheOthersAre) {
  FairShare shares;
  Add(shares, "a1", "a");
  Add(shares, "b1", "b");
  const std::map<std::string, double> cost = {{"a1", 1}, {"b1", 1}, {"c1", 1}};
  shares.SetLendable("b1", false);
  Lend(shares, 1000, cost);
  // Neither one that was away nor a new one makes up for it.
  shares.SetLendable("b1", true);
  Add(shares, "c1", "c");
  auto lent = Lend(shares, 30, cost);
  for (const char* job : {"a1", "b1", "c1"})
    EXPECT_NEAR(lent[job], 10, 1) << job;
  // Nor has one that was lent much while it was alone a debt.
  shares.SetLendable("b1", false);
  shares.SetLendable("c1", false);
  Lend(shares, 1000, cost);
  shares.SetLendable("a1", false);
  shares.SetLendable("b1", true);
  Lend(shares, 5, cost);
  shares.SetLendable("a1", true);
  lent = Lend(shares, 20, cost);
  EXPECT_NEAR(lent["a1"], 10, 1);
}

TEST(FairShareTest, NothingIsLentOfHeldJobsAndJobsWithoutWork) {
  FairShare shares;
  EXPECT_FALSE(shares.Next());
  Add(shares, "a", "");
  shares.SetHeld("a", true);
  EXPECT_TRUE(shares.IsHeld("a"));
  EXPECT_FALSE(shares.Next());
  shares.SetHeld("a", false);
  EXPECT_EQ(shares.Next(), "a");
  shares.SetLendable("a", false);
  EXPECT_FALSE(shares.Next());
  shares.SetLendable("a", true);
  shares.Forget("a");
  EXPECT_FALSE(shares.Next());
}

// Times come from workers.
TEST(FairShareTest, TimesThatCannotBeDoNotStarveAnybody) {
  FairShare shares;
  Add(shares, "a", "a");
  Add(shares, "b", "b");
  std::map<std::string, int> leases;
  for (int i = 0; i < 100; ++i) {
    const std::string job = shares.Next().value();
    ++leases[job];
    shares.CountLent(job, kKind, 1);
    shares.CountWork(job, kKind, 1, job == "a" ? -Duration::max() : Duration::zero());
  }
  EXPECT_EQ(leases["a"], 50);
  shares.CountWork("a", kKind, 0, Duration::max());
  // One lie costs what some ten minutes of work cost, and is forgotten.
  shares.CountWork("a", kKind, 4, Duration::max());
  EXPECT_GT(Lend(shares, 4000, {{"a", 1}, {"b", 1}})["a"], 1000);
  for (int i = 0; i < 10; ++i)
    shares.CountLent(shares.Next().value(), kKind, UINT64_MAX);
  EXPECT_TRUE(shares.Next());
}

}  // namespace
}  // namespace lucerna
