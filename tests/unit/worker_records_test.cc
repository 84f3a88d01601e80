// What is kept of workers beyond the process, and which of those that have gone are forgotten
// first.
#include "server/worker_records.h"

#include <string>
#include <vector>

#include "gtest/gtest.h"

#include "tests/support/steady_time.h"

namespace lucerna {
namespace {

TEST(WorkerRecordsTest, EachChangeOfAStandingIsReturnedOnce) {
  WorkerRecords records;
  records.Join("a", "host", At(0));
  EXPECT_TRUE(records.TakeChanged().empty()) << "nothing is to be kept of a worker that is active";
  records.Drain("a");
  records.Quarantine("a", "it lies", /*has_lied=*/true);
  const WorkerStanding liar = {"a", "host", WorkerState::kQuarantined, "it lies", true};
  EXPECT_EQ(records.TakeChanged(), std::vector{liar});
  EXPECT_TRUE(records.TakeChanged().empty());
  records.NoteChanged("a");
  EXPECT_EQ(records.TakeChanged(), std::vector{liar});
  records.Release("a");
  ASSERT_EQ(records.TakeChanged(), (std::vector<WorkerStanding>{{.id = "a", .name = "host"}}));
}

TEST(WorkerRecordsTest, ARestoredWorkerIsLentNothingWhenItRegisters) {
  WorkerRecords records;
  const WorkerStanding liar = {"a", "host", WorkerState::kQuarantined, "it lies", true};
  records.Restore(liar, At(0));
  EXPECT_TRUE(records.TakeChanged().empty()) << "it is kept already";
  ASSERT_NE(records.Find("a"), nullptr);
  EXPECT_FALSE(records.Find("a")->is_connected);
  records.Join("a", "host", At(1));
  EXPECT_FALSE(records.Find("a")->may_be_lent());
  EXPECT_EQ(records.Find("a")->reason, "it lies");
  EXPECT_TRUE(records.Find("a")->has_lied);
}

TEST(WorkerRecordsTest, OfWorkersThatHaveGoneThoseThatAreLentNothingStayLongest) {
  WorkerRecords records(/*max_gone=*/2);
  records.Restore({.id = "drained", .state = WorkerState::kDraining}, At(0));
  records.Restore({.id = "liar", .state = WorkerState::kQuarantined}, At(1));
  for (const char* const id : {"x", "y"}) {
    records.Join(id, id, At(2));
    records.Leave(id, At(3));
    EXPECT_EQ(records.Find(id), nullptr);
  }
  EXPECT_TRUE(records.TakeChanged().empty());
  records.Restore({.id = "third", .state = WorkerState::kQuarantined}, At(4));
  EXPECT_EQ(records.Find("drained"), nullptr);
  EXPECT_EQ(records.TakeChanged(), (std::vector<WorkerStanding>{{.id = "drained"}}))
      << "what was kept of it goes too";
}

}  // namespace
}  // namespace lucerna
