// What was saved is there at the next start, in order, and nobody else's database is touched.
#include "server/state/state_store.h"

#include <thread>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include <sqlite3.h>

#include "render/base/files.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace {

using testing::HasSubstr;

StoredJob JobNumber(std::uint64_t serial, const std::string& record = "record") {
  return {.serial = serial,
          .request_id = absl::StrCat("request ", serial),
          .turn = 100 - serial,
          .name = "scene.pbrt",
          .state = "queued",
          .record = record};
}

// Runs SQL on a database that nobody has open.
void RunSql(const std::string& path, const std::string& sql) {
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &database), SQLITE_OK);
  EXPECT_EQ(sqlite3_exec(database, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK);
  sqlite3_close(database);
}

TEST(StateStoreTest, HasAllJobsAtTheNextStart) {
  const TemporaryFolder folder;
  std::string bytes = "nul ";
  bytes.push_back('\0');
  bytes += "\xFF";
  {
    const auto store = StateStore::Open(folder.At("db"), "first").value();
    EXPECT_EQ(store->instance(), "first");
    EXPECT_EQ(store->NextSerial().value(), 1U);
    ASSERT_TRUE(store->Save(JobNumber(2)).ok());
    ASSERT_TRUE(store->Save(JobNumber(1, bytes)).ok());
    ASSERT_TRUE(store->Save(JobNumber(3)).ok());
    StoredJob changed = JobNumber(2, "changed");
    changed.state = "succeeded";
    changed.turn = 7;
    ASSERT_TRUE(store->Save(changed).ok());
  }
  const auto store = StateStore::Open(folder.At("db"), "second").value();
  EXPECT_EQ(store->instance(), "first") << "the ids of its jobs stay as they are";
  StoredJob changed = JobNumber(2, "changed");
  changed.state = "succeeded";
  changed.turn = 7;
  EXPECT_EQ(store->Load().value(),
            (std::vector<StoredJob>{JobNumber(1, bytes), changed, JobNumber(3)}));
}

TEST(StateStoreTest, HasTheWorkersThatWereSavedAndNotRemoved) {
  const TemporaryFolder folder;
  const StoredWorker liar = {"a", "quarantined", "host", "it lies", true};
  StoredWorker slow = {"b", "quarantined", "slow", "it stalls", false};
  const std::vector<StoredWorker> first = {liar, slow, {"c", "draining", "", "", false}};
  {
    const auto store = StateStore::Open(folder.At("db"), "first").value();
    EXPECT_EQ(store->LoadWorkers().value().size(), 0U);
    ASSERT_TRUE(store->SaveWorkers(first, {}).ok());
    slow.state = "draining";
    const std::vector<std::string> removed = {"c", "unknown"};
    ASSERT_TRUE(store->SaveWorkers({&slow, 1}, removed).ok());
  }
  const auto store = StateStore::Open(folder.At("db"), "second").value();
  EXPECT_EQ(store->LoadWorkers().value(), (std::vector<StoredWorker>{liar, slow}));
}

TEST(StateStoreTest, ADatabaseOfTheFirstVersionKeepsItsJobsAndMayHaveWorkers) {
  const TemporaryFolder folder;
  {
    const auto store = StateStore::Open(folder.At("db"), "first").value();
    ASSERT_TRUE(store->Save(JobNumber(1)).ok());
  }
  RunSql(folder.At("db"), "DROP TABLE workers; PRAGMA user_version=1");
  const StoredWorker worker = {"a", "draining", "host", "", false};
  for (int start = 0; start < 2; ++start) {
    const auto store = StateStore::Open(folder.At("db"), "second").value();
    EXPECT_EQ(store->Load().value(), std::vector{JobNumber(1)});
    ASSERT_TRUE(store->SaveWorkers({&worker, 1}, {}).ok());
    EXPECT_EQ(store->LoadWorkers().value(), std::vector{worker});
  }
}

TEST(StateStoreTest, ChangesThatWaitReachTheDiskTogetherAndInOrder) {
  const TemporaryFolder folder;
  {
    const auto store = StateStore::Open(folder.At("db"), "first").value();
    const auto removed_later = store->BeginSave(JobNumber(1));
    const auto saved = store->BeginSave(JobNumber(2));
    const auto changed = store->BeginSave(JobNumber(2, "changed"));
    const auto removed = store->BeginRemove(1);
    const auto last = store->BeginSave(JobNumber(3));
    EXPECT_TRUE(last().ok());
    // All are there before the others have waited.
    EXPECT_EQ(store->Load().value(),
              (std::vector<StoredJob>{JobNumber(2, "changed"), JobNumber(3)}));
    for (const auto& written : {removed_later, saved, changed, removed})
      EXPECT_TRUE(written().ok());
  }
  EXPECT_EQ(StateStore::Open(folder.At("db"), "first").value()->Load().value().size(), 2U);
}

TEST(StateStoreTest, AChangeThatFailsDoesNotTakeOthersWithIt) {
  const TemporaryFolder folder;
  ASSERT_TRUE(StateStore::Open(folder.At("db"), "first").value()->Save(JobNumber(1)).ok());
  RunSql(folder.At("db"),
         "CREATE TRIGGER refuse BEFORE INSERT ON jobs WHEN NEW.serial = 3 "
         "BEGIN SELECT RAISE(ABORT, 'refused'); END");
  const auto store = StateStore::Open(folder.At("db"), "first").value();
  const auto good = store->BeginSave(JobNumber(2));
  const auto refused = store->BeginSave(JobNumber(3));
  const auto removed = store->BeginRemove(1);
  EXPECT_TRUE(good().ok());
  EXPECT_FALSE(refused().ok());
  EXPECT_TRUE(removed().ok());
  EXPECT_EQ(store->Load().value(), (std::vector<StoredJob>{JobNumber(2)}));
}

TEST(StateStoreTest, ManyThreadsLoseNothing) {
  constexpr std::uint64_t kThreads = 8;
  constexpr std::uint64_t kJobs = 20;
  const TemporaryFolder folder;
  {
    const auto store = StateStore::Open(folder.At("db"), "first").value();
    std::vector<std::thread> threads;
    for (std::uint64_t thread = 0; thread < kThreads; ++thread) {
      threads.emplace_back([&, thread] {
        for (std::uint64_t i = 1; i <= kJobs; ++i)
          EXPECT_TRUE(store->Save(JobNumber(thread * kJobs + i)).ok());
      });
    }
    for (std::thread& thread : threads)
      thread.join();
  }
  const auto jobs = StateStore::Open(folder.At("db"), "first").value()->Load().value();
  ASSERT_EQ(jobs.size(), kThreads * kJobs);
  EXPECT_EQ(jobs.back(), JobNumber(kThreads * kJobs));
}

TEST(StateStoreTest, NeverGivesTheNumberOfARemovedJobAgain) {
  const TemporaryFolder folder;
  {
    const auto store = StateStore::Open(folder.At("db"), "i").value();
    ASSERT_TRUE(store->Save(JobNumber(1)).ok());
    ASSERT_TRUE(store->Save(JobNumber(5)).ok());
    ASSERT_TRUE(store->Remove(5).ok());
    ASSERT_TRUE(store->Remove(4).ok());
  }
  const auto store = StateStore::Open(folder.At("db"), "i").value();
  EXPECT_EQ(store->Load().value(), std::vector<StoredJob>{JobNumber(1)});
  EXPECT_EQ(store->NextSerial().value(), 6U);
}

TEST(StateStoreTest, OneCoordinatorAtATime) {
  const TemporaryFolder folder;
  const auto store = StateStore::Open(folder.At("db"), "i").value();
  const auto other = StateStore::Open(folder.At("db"), "j");
  EXPECT_TRUE(absl::IsFailedPrecondition(other.status())) << other.status();
  EXPECT_THAT(std::string(other.status().message()), HasSubstr("another coordinator"));
}

TEST(StateStoreTest, RefusesANewerVersionAndOtherPeoplesFiles) {
  const TemporaryFolder folder;
  ASSERT_TRUE(StateStore::Open(folder.At("db"), "i").ok());
  RunSql(folder.At("db"), "PRAGMA user_version=1000");
  const auto newer = StateStore::Open(folder.At("db"), "i");
  EXPECT_TRUE(absl::IsFailedPrecondition(newer.status()));
  EXPECT_THAT(std::string(newer.status().message()), HasSubstr("newer version"));

  RunSql(folder.At("foreign"), "CREATE TABLE t (x)");
  const auto foreign = StateStore::Open(folder.At("foreign"), "i");
  EXPECT_TRUE(absl::IsFailedPrecondition(foreign.status())) << foreign.status();

  ASSERT_TRUE(WriteFile(folder.At("text"), std::string(4096, 'x')).ok());
  EXPECT_TRUE(absl::IsDataLoss(StateStore::Open(folder.At("text"), "i").status()));

  EXPECT_TRUE(
      absl::IsPermissionDenied(StateStore::Open(folder.At("no/such/folder"), "i").status()));
}

}  // namespace
}  // namespace lucerna
