// Every call that is parked is answered once: with work, when its time is over, or because it
// broke.
#include "server/parked_syncs.h"

#include <atomic>
#include <string>
#include <thread>
#include <vector>

#include "gtest/gtest.h"

#include "tests/support/steady_time.h"

namespace lucerna {
namespace {

ParkedSyncs::TryAnswer NothingYet() {
  return [](const std::string&, const Scheduler::Report&) { return std::nullopt; };
}
ParkedSyncs::TryAnswer AnswerFor(std::string worker) {
  return [worker](const std::string& of,
                  const Scheduler::Report&) -> std::optional<StatusOr<SyncAnswer>> {
    if (of != worker) return std::nullopt;
    SyncAnswer answer;
    answer.revoked = {"lease"};
    return answer;
  };
}
void NoneBroke(const ParkedSyncs::Call& call) {
  ADD_FAILURE() << call.worker << " did not break";
}

// The answers to one call.
struct Answers {
  std::vector<StatusOr<SyncAnswer>> all;
  ParkedSyncs::Answer Take() {
    return [this](StatusOr<SyncAnswer> answer) { all.push_back(std::move(answer)); };
  }
};

TEST(ParkedSyncsTest, AnswersWhomThereIsSomethingForAndWhoseTimeIsOver) {
  ParkedSyncs parked;
  Answers a;
  Answers b;
  EXPECT_NE(parked.Park({"a", {}, At(5), a.Take()}), 0U);
  EXPECT_NE(parked.Park({"b", {}, At(9), b.Take()}), 0U);
  parked.AnswerReady(At(1), NothingYet(), NoneBroke);
  EXPECT_TRUE(a.all.empty() && b.all.empty());
  parked.AnswerReady(At(2), AnswerFor("b"), NoneBroke);
  ASSERT_EQ(b.all.size(), 1U);
  EXPECT_EQ(b.all[0]->revoked, std::vector<std::string>{"lease"});
  EXPECT_TRUE(a.all.empty());
  parked.AnswerReady(At(5), NothingYet(), NoneBroke);
  ASSERT_EQ(a.all.size(), 1U);
  EXPECT_TRUE(a.all[0].ok() && a.all[0]->revoked.empty());
  parked.AnswerReady(At(99), AnswerFor("b"), NoneBroke);
  EXPECT_EQ(a.all.size() + b.all.size(), 2U);
}

TEST(ParkedSyncsTest, ACallThatBreaksIsHandedOutOnce) {
  ParkedSyncs parked;
  Answers a;
  const std::uint64_t ticket = parked.Park({"a", {}, At(5), a.Take()});
  EXPECT_EQ(parked.Break(ticket)->worker, "a");
  EXPECT_FALSE(parked.Break(ticket));
  parked.AnswerReady(At(9), AnswerFor("a"), NoneBroke);
  EXPECT_TRUE(a.all.empty());
}

// The work that it was about to get must go back: `on_broken` does that.
TEST(ParkedSyncsTest, ACallThatBreaksWhileItIsTriedIsNotAnsweredWithWork) {
  ParkedSyncs parked;
  Answers a;
  const std::uint64_t ticket = parked.Park({"a", {}, At(5), a.Take()});
  std::vector<std::string> broke;
  parked.AnswerReady(
      At(1),
      [&](const std::string& worker, const Scheduler::Report& report) {
        EXPECT_FALSE(parked.Break(ticket));
        return AnswerFor("a")(worker, report);
      },
      [&](const ParkedSyncs::Call& call) { broke.push_back(call.worker); });
  EXPECT_EQ(broke, std::vector<std::string>{"a"});
  EXPECT_TRUE(a.all.empty());
}

TEST(ParkedSyncsTest, AClosedOneHandsOutAllAndTakesNoMore) {
  ParkedSyncs parked;
  Answers a;
  const std::uint64_t ticket = parked.Park({"a", {}, At(5), a.Take()});
  EXPECT_EQ(parked.Close().size(), 1U);
  EXPECT_FALSE(parked.Break(ticket));
  EXPECT_EQ(parked.Park({"a", {}, At(5), a.Take()}), 0U);
}

TEST(ParkedSyncsTest, EveryCallIsAnsweredOnceWhoeverIsFirst) {
  for (int round = 0; round < 50; ++round) {
    ParkedSyncs parked;
    std::vector<std::atomic<int>> answers(200);
    std::vector<std::uint64_t> tickets;
    for (std::atomic<int>& count : answers) {
      tickets.push_back(
          parked.Park({"w", {}, At(5), [&count](const StatusOr<SyncAnswer>&) { ++count; }}));
    }
    const auto on_broken = [](const ParkedSyncs::Call& call) {
      call.answer(absl::CancelledError("the connection broke"));
    };
    std::vector<std::thread> threads;
    for (int t = 0; t < 2; ++t) {
      threads.emplace_back([&] { parked.AnswerReady(At(1), AnswerFor("w"), on_broken); });
    }
    threads.emplace_back([&] {
      for (std::size_t i = 0; i < tickets.size(); i += 2) {
        if (const auto broken = parked.Break(tickets[i])) on_broken(*broken);
      }
    });
    threads.emplace_back([&] {
      for (const ParkedSyncs::Call& call : parked.Close())
        call.answer(absl::UnavailableError("closing"));
    });
    for (std::thread& thread : threads)
      thread.join();
    for (const std::atomic<int>& count : answers)
      EXPECT_EQ(count, 1);
  }
}

}  // namespace
}  // namespace lucerna
