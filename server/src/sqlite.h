// A thin cover over SQLite's C interface: connections, statements, transactions.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

struct sqlite3;
struct sqlite3_stmt;

namespace amhex::server {

// One prepared statement with its values. Thread-compatible.
class SqliteStatement {
 public:
  SqliteStatement() = default;
  explicit SqliteStatement(sqlite3_stmt* statement) : statement_(statement) {}

  // Parameters are numbered from 1 in the order of the calls.
  SqliteStatement& Int(int64_t value);
  SqliteStatement& Text(const std::string& value);
  SqliteStatement& Blob(const std::string& value);
  SqliteStatement& Null();

  // True while there is a row.
  absl::StatusOr<bool> Step();
  // Runs a statement that gives no rows.
  absl::Status Run();

  int64_t IntColumn(int column) const;
  std::string TextColumn(int column) const;  // also for blobs
  bool IsNull(int column) const;

 private:
  struct Finalize {
    void operator()(sqlite3_stmt* statement) const;
  };
  std::unique_ptr<sqlite3_stmt, Finalize> statement_;
  int bound_ = 0;
};

// One connection. Thread-compatible.
class SqliteDatabase {
 public:
  // `path` may be ":memory:".
  static absl::StatusOr<std::unique_ptr<SqliteDatabase>> Open(const std::string& path);
  ~SqliteDatabase();

  // Runs statements without values or rows.
  absl::Status Execute(const std::string& sql);
  absl::StatusOr<SqliteStatement> Prepare(const std::string& sql);
  // The number that a query without values gives; 0 if it gives no row.
  absl::StatusOr<int64_t> QueryInt(const std::string& sql);
  // Rows changed by the latest statement.
  int64_t ChangeCount() const;

 private:
  explicit SqliteDatabase(sqlite3* database) : database_(database) {}
  sqlite3* database_;
};

// Begins at construction, rolls back at destruction unless committed.
class SqliteTransaction {
 public:
  explicit SqliteTransaction(SqliteDatabase* database);
  ~SqliteTransaction();
  const absl::Status& status() const { return status_; }
  absl::Status Commit();

 private:
  SqliteDatabase* database_;
  absl::Status status_;
  bool open_ = false;
};

}  // namespace amhex::server
