#include "sqlite.h"

#include <sqlite3.h>

#include "errors.h"
#include "status_macros.h"

namespace amhex::server {
namespace {

constexpr int kBusyTimeoutMilliseconds = 5000;
constexpr absl::Duration kBusyRetryDelay = absl::Seconds(1);

// The message names the kind of error, never the statement.
absl::Status DatabaseError(int code) {
  if (code == SQLITE_FULL) {
    return MakeError(absl::StatusCode::kResourceExhausted, amhex::v1::STORAGE_FULL,
                     "the disk of the job store is full");
  }
  if (code == SQLITE_BUSY || code == SQLITE_LOCKED) {
    // Another process holds it, as some backups do. What is tried again succeeds when it lets go.
    return WithRetryDelay(MakeError(absl::StatusCode::kUnavailable, amhex::v1::STORE_UNAVAILABLE,
                                    "the job store is held by another process"),
                          kBusyRetryDelay);
  }
  return ServerFault(std::string("the job store failed: ") + sqlite3_errstr(code));
}

}  // namespace

void SqliteStatement::Finalize::operator()(sqlite3_stmt* statement) const {
  sqlite3_finalize(statement);
}

SqliteStatement& SqliteStatement::Int(int64_t value) {
  sqlite3_bind_int64(statement_.get(), ++bound_, value);
  return *this;
}

SqliteStatement& SqliteStatement::Text(const std::string& value) {
  sqlite3_bind_text(statement_.get(), ++bound_, value.data(), static_cast<int>(value.size()),
                    SQLITE_TRANSIENT);
  return *this;
}

SqliteStatement& SqliteStatement::Blob(const std::string& value) {
  sqlite3_bind_blob(statement_.get(), ++bound_, value.data(), static_cast<int>(value.size()),
                    SQLITE_TRANSIENT);
  return *this;
}

SqliteStatement& SqliteStatement::Null() {
  sqlite3_bind_null(statement_.get(), ++bound_);
  return *this;
}

absl::StatusOr<bool> SqliteStatement::Step() {
  const int code = sqlite3_step(statement_.get());
  if (code == SQLITE_ROW) return true;
  if (code == SQLITE_DONE) return false;
  return DatabaseError(code);
}

absl::Status SqliteStatement::Run() { return Step().status(); }

int64_t SqliteStatement::IntColumn(int column) const {
  return sqlite3_column_int64(statement_.get(), column);
}

std::string SqliteStatement::TextColumn(int column) const {
  const void* bytes = sqlite3_column_blob(statement_.get(), column);
  const int size = sqlite3_column_bytes(statement_.get(), column);
  return bytes == nullptr ? std::string()
                          : std::string(static_cast<const char*>(bytes), static_cast<size_t>(size));
}

bool SqliteStatement::IsNull(int column) const {
  return sqlite3_column_type(statement_.get(), column) == SQLITE_NULL;
}

absl::StatusOr<std::unique_ptr<SqliteDatabase>> SqliteDatabase::Open(const std::string& path) {
  sqlite3* database = nullptr;
  const int flags = SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_NOMUTEX;
  const int code = sqlite3_open_v2(path.c_str(), &database, flags, nullptr);
  std::unique_ptr<SqliteDatabase> result(new SqliteDatabase(database));
  if (code != SQLITE_OK) return DatabaseError(code);
  sqlite3_busy_timeout(database, kBusyTimeoutMilliseconds);
  return result;
}

SqliteDatabase::~SqliteDatabase() { sqlite3_close_v2(database_); }

absl::Status SqliteDatabase::Execute(const std::string& sql) {
  const int code = sqlite3_exec(database_, sql.c_str(), nullptr, nullptr, nullptr);
  return code == SQLITE_OK ? absl::OkStatus() : DatabaseError(code);
}

absl::StatusOr<SqliteStatement> SqliteDatabase::Prepare(const std::string& sql) {
  sqlite3_stmt* statement = nullptr;
  const int code = sqlite3_prepare_v2(database_, sql.c_str(), -1, &statement, nullptr);
  if (code != SQLITE_OK) return DatabaseError(code);
  return SqliteStatement(statement);
}

absl::StatusOr<int64_t> SqliteDatabase::QueryInt(const std::string& sql) {
  AMHEX_ASSIGN_OR_RETURN(auto statement, Prepare(sql));
  AMHEX_ASSIGN_OR_RETURN(const bool has_row, statement.Step());
  return has_row ? statement.IntColumn(0) : 0;
}

int64_t SqliteDatabase::ChangeCount() const { return sqlite3_changes64(database_); }

SqliteTransaction::SqliteTransaction(SqliteDatabase* database)
    : database_(database), status_(database->Execute("BEGIN IMMEDIATE")), open_(status_.ok()) {}

SqliteTransaction::~SqliteTransaction() {
  // A rollback can only fail if the transaction has ended by itself, which is what is wanted.
  if (open_) database_->Execute("ROLLBACK").IgnoreError();
}

absl::Status SqliteTransaction::Commit() {
  absl::Status status = database_->Execute("COMMIT");
  if (status.ok()) open_ = false;
  return status;
}

}  // namespace amhex::server
