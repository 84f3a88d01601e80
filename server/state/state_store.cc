#include "server/state/state_store.h"

#include <cerrno>
#include <string_view>

#include <sqlite3.h>

#include "render/base/fail_point.h"

namespace lucerna {
namespace {

// "Luce": what `file` shows of the database.
constexpr std::int64_t kApplicationId = 0x4C756365;
// 2 has workers.
constexpr std::int64_t kVersion = 2;

constexpr const char* kSchema = R"(
CREATE TABLE coordinator (instance TEXT NOT NULL);
CREATE TABLE jobs (
  serial INTEGER PRIMARY KEY AUTOINCREMENT,
  request_id TEXT NOT NULL UNIQUE,
  turn INTEGER NOT NULL,
  name TEXT NOT NULL,
  state TEXT NOT NULL,
  record BLOB NOT NULL
);
)";
constexpr const char* kWorkersSchema = R"(
CREATE TABLE workers (
  id TEXT PRIMARY KEY NOT NULL,
  state TEXT NOT NULL,
  name TEXT NOT NULL,
  reason TEXT NOT NULL,
  has_lied INTEGER NOT NULL
);
)";

std::string_view BytesOf(sqlite3_stmt* statement, int column) {
  const void* const bytes = sqlite3_column_blob(statement, column);
  const auto size = static_cast<std::size_t>(sqlite3_column_bytes(statement, column));
  return {static_cast<const char*>(bytes), bytes == nullptr ? 0 : size};
}

}  // namespace

// A statement with its values, which is released with it.
class StateStore::Statement {
 public:
  Statement(sqlite3* database, const char* sql) {
    sqlite3_prepare_v2(database, sql, -1, &statement_, nullptr);
  }
  ~Statement() { sqlite3_finalize(statement_); }
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  void Bind(int index, std::uint64_t value) {
    sqlite3_bind_int64(statement_, index, static_cast<std::int64_t>(value));
  }
  void BindText(int index, std::string_view text) {
    sqlite3_bind_text64(statement_, index, text.data(), text.size(), SQLITE_STATIC, SQLITE_UTF8);
  }
  void BindBytes(int index, std::string_view bytes) {
    sqlite3_bind_blob64(statement_, index, bytes.data(), bytes.size(), SQLITE_STATIC);
  }
  // SQLITE_ROW or SQLITE_DONE unless something is wrong, also with what was prepared or bound.
  [[nodiscard]] int Step() {
    return statement_ == nullptr ? SQLITE_ERROR : sqlite3_step(statement_);
  }
  [[nodiscard]] sqlite3_stmt* get() const { return statement_; }

 private:
  sqlite3_stmt* statement_ = nullptr;
};

Status StateStore::Fault() const {
  const std::string message = absl::StrCat(path_, ": ", std::string(sqlite3_errmsg(database_)));
  const int system = sqlite3_system_errno(database_);
  switch (sqlite3_errcode(database_) & 0xFF) {
    case SQLITE_FULL:
      return absl::ResourceExhaustedError(message);
    case SQLITE_READONLY:
    case SQLITE_PERM:
    case SQLITE_CANTOPEN:
      return absl::PermissionDeniedError(message);
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return absl::FailedPreconditionError(absl::StrCat(
          path_, ": another coordinator uses it; give each coordinator a --state of its own"));
    case SQLITE_CORRUPT:
    case SQLITE_NOTADB:
      return absl::DataLossError(message);
    case SQLITE_IOERR:
      if (system == ENOSPC || system == EDQUOT) return absl::ResourceExhaustedError(message);
      if (system == EROFS) return absl::PermissionDeniedError(message);
      return absl::UnavailableError(message);
    default:
      return absl::InternalError(message);
  }
}

Status StateStore::Run(const char* sql) const {
  return sqlite3_exec(database_, sql, nullptr, nullptr, nullptr) == SQLITE_OK ? absl::OkStatus()
                                                                              : Fault();
}

StatusOr<std::int64_t> StateStore::Number(const char* sql) const {
  Statement statement(database_, sql);
  const int result = statement.Step();
  if (result == SQLITE_DONE) return std::int64_t{0};
  if (result != SQLITE_ROW) return Fault();
  return sqlite3_column_int64(statement.get(), 0);
}

StatusOr<std::unique_ptr<StateStore>> StateStore::Open(const std::string& path,
                                                       const std::string& new_instance) {
  sqlite3* database = nullptr;
  const int opened =
      sqlite3_open_v2(path.c_str(), &database, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE, nullptr);
  if (database == nullptr) return absl::ResourceExhaustedError("no memory for SQLite");
  auto store = std::unique_ptr<StateStore>(new StateStore(path, database));
  const MutexLock lock(store->mutex_);
  if (opened != SQLITE_OK) return store->Fault();
  LUCERNA_RETURN_IF_ERROR(store->SetUp(new_instance));
  return store;
}

Status StateStore::SetUp(const std::string& new_instance) {
  // Exclusive first: the write-ahead log then needs no memory shared with other processes, and the
  // lock is held until the process ends.
  LUCERNA_RETURN_IF_ERROR(
      Run("PRAGMA locking_mode=EXCLUSIVE; PRAGMA journal_mode=WAL; PRAGMA synchronous=FULL;"
          "BEGIN IMMEDIATE; COMMIT"));
  LUCERNA_ASSIGN_OR_RETURN(const std::int64_t version, Number("PRAGMA user_version"));
  LUCERNA_ASSIGN_OR_RETURN(const std::int64_t application, Number("PRAGMA application_id"));
  LUCERNA_ASSIGN_OR_RETURN(const std::int64_t tables, Number("SELECT count(*) FROM sqlite_schema"));
  if (tables == 0) {
    LUCERNA_RETURN_IF_ERROR(Run("BEGIN IMMEDIATE"));
    LUCERNA_RETURN_IF_ERROR(Run(kSchema));
    LUCERNA_RETURN_IF_ERROR(Run(kWorkersSchema));
    {
      Statement insert(database_, "INSERT INTO coordinator VALUES (?)");
      insert.BindText(1, new_instance);
      if (insert.Step() != SQLITE_DONE) return Fault();
    }
    LUCERNA_RETURN_IF_ERROR(Run(
        absl::StrCat("PRAGMA application_id=", kApplicationId, "; PRAGMA user_version=", kVersion)
            .c_str()));
    FailPoint("store.unmade");
    LUCERNA_RETURN_IF_ERROR(Run("COMMIT"));
    FailPoint("store.made");
  } else if (application != kApplicationId) {
    return absl::FailedPreconditionError(
        absl::StrCat(path_, ": not a database of a Lucerna coordinator; give another --state"));
  } else if (version > kVersion) {
    return absl::FailedPreconditionError(absl::StrCat(
        path_, ": written by a newer version of Lucerna (format ", version,
        ", this one reads up to ", kVersion, "); start that version, or give another --state"));
  } else if (version < kVersion) {
    LUCERNA_RETURN_IF_ERROR(Run(absl::StrCat("BEGIN IMMEDIATE; ", kWorkersSchema,
                                             "PRAGMA user_version=", kVersion, "; COMMIT")
                                    .c_str()));
  }
  Statement select(database_, "SELECT instance FROM coordinator");
  if (select.Step() != SQLITE_ROW) return Fault();
  instance_ = std::string(BytesOf(select.get(), 0));
  return absl::OkStatus();
}

StateStore::~StateStore() {
  sqlite3_close(database_);
}

StateStore::Written StateStore::BeginSave(StoredJob job) {
  Change change;
  change.job = std::move(job);
  return Begin(std::move(change));
}

StateStore::Written StateStore::BeginRemove(std::uint64_t serial) {
  Change change;
  change.removes = true;
  change.job.serial = serial;
  return Begin(std::move(change));
}

StateStore::Written StateStore::Begin(Change change) {
  auto shared = std::make_shared<Change>(std::move(change));
  const MutexLock lock(queue_mutex_);
  queue_.push_back(shared);
  return [this, shared = std::move(shared)] { return WaitFor(shared); };
}

Status StateStore::WaitFor(const std::shared_ptr<Change>& change) {
  std::vector<std::shared_ptr<Change>> changes;
  {
    const MutexLock lock(queue_mutex_);
    while (!change->is_done && is_writing_)
      written_.Wait(queue_mutex_);
    if (change->is_done) return change->result;
    is_writing_ = true;
    changes.swap(queue_);
  }
  Write(changes);
  const MutexLock lock(queue_mutex_);
  for (const std::shared_ptr<Change>& written : changes)
    written->is_done = true;
  is_writing_ = false;
  written_.NotifyAll();
  return change->result;
}

void StateStore::Write(const std::vector<std::shared_ptr<Change>>& changes) {
  const MutexLock lock(mutex_);
  const Status together = WriteTogether(changes);
  // One that does not fit must not take the others with it: a removal needs no room.
  const bool is_each_alone = !together.ok() && changes.size() > 1;
  for (const std::shared_ptr<Change>& change : changes)
    change->result = is_each_alone ? WriteTogether({&change, 1}) : together;
}

Status StateStore::WriteTogether(std::span<const std::shared_ptr<Change>> changes) {
  for (const std::shared_ptr<Change>& change : changes)
    FailPoint(change->removes ? "job.unremoved" : "job.unsaved");
  Status result = Run("BEGIN IMMEDIATE");
  for (const std::shared_ptr<Change>& change : changes) {
    if (result.ok()) result = Make(*change);
  }
  LUCERNA_RETURN_IF_ERROR(EndTransaction(result));
  for (const std::shared_ptr<Change>& change : changes)
    FailPoint(change->removes ? "job.removed" : "job.saved");
  return absl::OkStatus();
}

Status StateStore::EndTransaction(Status result) {
  if (result.ok()) result = Run("COMMIT");
  // Unless SQLite has done so by itself.
  if (!result.ok() && sqlite3_get_autocommit(database_) == 0) Run("ROLLBACK").IgnoreError();
  return result;
}

Status StateStore::SaveWorkers(std::span<const StoredWorker> saved,
                               std::span<const std::string> removed) {
  const MutexLock lock(mutex_);
  FailPoint("workers.unsaved");
  Status result = Run("BEGIN IMMEDIATE");
  for (const StoredWorker& worker : saved) {
    if (!result.ok()) break;
    Statement statement(database_,
                        "INSERT OR REPLACE INTO workers (id, state, name, reason, has_lied) "
                        "VALUES (?, ?, ?, ?, ?)");
    statement.BindText(1, worker.id);
    statement.BindText(2, worker.state);
    statement.BindText(3, worker.name);
    statement.BindText(4, worker.reason);
    statement.Bind(5, worker.has_lied ? 1 : 0);
    if (statement.Step() != SQLITE_DONE) result = Fault();
  }
  for (const std::string& id : removed) {
    if (!result.ok()) break;
    Statement statement(database_, "DELETE FROM workers WHERE id = ?");
    statement.BindText(1, id);
    if (statement.Step() != SQLITE_DONE) result = Fault();
  }
  LUCERNA_RETURN_IF_ERROR(EndTransaction(result));
  FailPoint("workers.saved");
  return absl::OkStatus();
}

StatusOr<std::vector<StoredWorker>> StateStore::LoadWorkers() const {
  const MutexLock lock(mutex_);
  Statement statement(database_,
                      "SELECT id, state, name, reason, has_lied FROM workers ORDER BY id");
  std::vector<StoredWorker> workers;
  int result = statement.Step();
  for (; result == SQLITE_ROW; result = statement.Step()) {
    sqlite3_stmt* const row = statement.get();
    workers.push_back({.id = std::string(BytesOf(row, 0)),
                       .state = std::string(BytesOf(row, 1)),
                       .name = std::string(BytesOf(row, 2)),
                       .reason = std::string(BytesOf(row, 3)),
                       .has_lied = sqlite3_column_int64(row, 4) != 0});
  }
  if (result != SQLITE_DONE) return Fault();
  return workers;
}

Status StateStore::Make(const Change& change) {
  const StoredJob& job = change.job;
  Statement statement(
      database_,
      change.removes
          ? "DELETE FROM jobs WHERE serial = ?"
          : "INSERT OR REPLACE INTO jobs (serial, request_id, turn, name, state, record) "
            "VALUES (?, ?, ?, ?, ?, ?)");
  statement.Bind(1, job.serial);
  if (!change.removes) {
    statement.BindText(2, job.request_id);
    statement.Bind(3, job.turn);
    statement.BindText(4, job.name);
    statement.BindText(5, job.state);
    statement.BindBytes(6, job.record);
  }
  return statement.Step() == SQLITE_DONE ? absl::OkStatus() : Fault();
}

StatusOr<std::vector<StoredJob>> StateStore::Load() const {
  const MutexLock lock(mutex_);
  Statement statement(database_,
                      "SELECT serial, request_id, turn, name, state, record FROM jobs "
                      "ORDER BY serial");
  std::vector<StoredJob> jobs;
  int result = statement.Step();
  for (; result == SQLITE_ROW; result = statement.Step()) {
    sqlite3_stmt* const row = statement.get();
    jobs.push_back({.serial = static_cast<std::uint64_t>(sqlite3_column_int64(row, 0)),
                    .request_id = std::string(BytesOf(row, 1)),
                    .turn = static_cast<std::uint64_t>(sqlite3_column_int64(row, 2)),
                    .name = std::string(BytesOf(row, 3)),
                    .state = std::string(BytesOf(row, 4)),
                    .record = std::string(BytesOf(row, 5))});
  }
  if (result != SQLITE_DONE) return Fault();
  return jobs;
}

StatusOr<std::uint64_t> StateStore::NextSerial() const {
  const MutexLock lock(mutex_);
  // Kept by AUTOINCREMENT, also of rows that are removed.
  LUCERNA_ASSIGN_OR_RETURN(const std::int64_t last,
                           Number("SELECT seq FROM sqlite_sequence WHERE name = 'jobs'"));
  return static_cast<std::uint64_t>(last) + 1;
}

}  // namespace lucerna
