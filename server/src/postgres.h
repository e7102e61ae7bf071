// A thin cover over libpq: connections that never wait beyond a deadline, parameters, results, and
// transactions that are repeated when the database asks for it.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"

struct pg_conn;
struct pg_result;

namespace amhex::server {

// The values $1, $2, ... of a statement, in the order of the calls.
class PostgresValues {
 public:
  PostgresValues& Int(int64_t value);
  PostgresValues& Text(const std::string& value);
  PostgresValues& Bytes(const std::string& value);
  PostgresValues& Null();

 private:
  friend class PostgresConnection;
  struct Value {
    std::string bytes;
    bool is_null = false;
    bool is_binary = false;
  };
  std::vector<Value> values_;
};

// The rows of a statement. Columns are integers, booleans, texts or byte strings.
class PostgresRows {
 public:
  PostgresRows() = default;
  explicit PostgresRows(pg_result* result) : result_(result) {}

  // True while there is a row; the first call moves to the first one.
  bool Next();
  int64_t IntColumn(int column) const;
  std::string TextColumn(int column) const;  // also for byte strings
  bool IsNull(int column) const;
  // Rows changed by a statement, or read.
  int64_t ChangeCount() const;

 private:
  struct Clear {
    void operator()(pg_result* result) const;
  };
  std::unique_ptr<pg_result, Clear> result_;
  int row_ = -1;
};

// One connection. Thread-compatible. Errors are UNAVAILABLE when the connection is lost or the
// database did not answer in time, ABORTED when the transaction is to be repeated, else INTERNAL.
class PostgresConnection {
 public:
  static absl::StatusOr<std::unique_ptr<PostgresConnection>> Open(const std::string& url,
                                                                  absl::Duration patience);
  ~PostgresConnection();

  absl::StatusOr<PostgresRows> Run(const std::string& sql, const PostgresValues& values = {});
  // Runs several statements without values.
  absl::Status Execute(const std::string& script);
  // Waits for notifications on the channels listened to, and returns their payloads.
  absl::StatusOr<std::vector<std::string>> WaitForNotifications(absl::Duration patience);
  bool broken() const { return broken_; }

 private:
  PostgresConnection(pg_conn* connection, absl::Duration patience)
      : connection_(connection), patience_(patience) {}

  absl::StatusOr<PostgresRows> Collect();
  // Sends what is still to be sent and waits until the answer can be read.
  absl::Status WaitForAnswer(absl::Time deadline);
  absl::Status Lost(const std::string& what);

  pg_conn* const connection_;
  const absl::Duration patience_;
  bool broken_ = false;
};

// A few connections, opened when needed and replaced when broken. Thread-safe.
class PostgresPool {
 public:
  struct Options {
    std::string url;
    int connection_count = 4;
    // For connecting, for each statement, and for a connection to become free.
    absl::Duration patience = absl::Seconds(5);
    // Run on every new connection.
    std::string session_setup;
  };
  using Work = std::function<absl::Status(PostgresConnection&)>;

  explicit PostgresPool(const Options& options) : options_(options) {}

  // Runs `work` between BEGIN and COMMIT. It is repeated when the transaction collided with
  // another one, and once when the connection broke, even if the COMMIT may have come through: it
  // must then find its own changes and leave it at that.
  absl::Status Transact(const Work& work);
  // The same, but not repeated when the connection broke.
  absl::Status TransactOnce(const Work& work);

  const Options& options() const { return options_; }

 private:
  absl::StatusOr<std::unique_ptr<PostgresConnection>> Take();
  void GiveBack(std::unique_ptr<PostgresConnection> connection);
  absl::Status TryOnce(const Work& work);
  absl::Status RepeatOnCollision(const Work& work);

  const Options options_;
  std::mutex mutex_;
  std::condition_variable returned_;
  std::vector<std::unique_ptr<PostgresConnection>> idle_;
  int in_use_ = 0;
  // After a failure to connect, no other attempt is made before this.
  absl::Time next_attempt_ = absl::InfinitePast();
  absl::Status last_failure_;
};

}  // namespace amhex::server
