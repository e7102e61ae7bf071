#include "postgres.h"

#include <libpq-fe.h>
#include <poll.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <utility>

#include "absl/strings/cord.h"
#include "absl/time/clock.h"
#include "errors.h"
#include "logging.h"
#include "monotonic_clock.h"
#include "status_macros.h"

namespace amhex::server {
namespace {

// What clients may do when the database cannot be reached.
constexpr absl::Duration kRetryDelay = absl::Seconds(2);
constexpr absl::Duration kReconnectPause = absl::Milliseconds(250);
constexpr char kCollisionPayload[] = "amhex/collision";
constexpr int kMaxCollisions = 8;
// SQLSTATE codes after which the same transaction may succeed (appendix A of PostgreSQL's manual).
constexpr const char* kCollisionStates[] = {"40001", "40P01", "23505"};
// SQLSTATE classes that tell that the server ends or has no room: connection exception,
// insufficient resources, operator intervention.
constexpr const char* kUnavailableClasses[] = {"08", "53", "57"};

absl::Status Unavailable() {
  return WithRetryDelay(MakeError(absl::StatusCode::kUnavailable, amhex::v1::STORE_UNAVAILABLE,
                                  "the database of the queue does not answer"),
                        kRetryDelay);
}

absl::Status StatementError(const PGresult* result) {
  const char* state = PQresultErrorField(result, PG_DIAG_SQLSTATE);
  const std::string code = state == nullptr ? "" : state;
  if (std::any_of(std::begin(kCollisionStates), std::end(kCollisionStates),
                  [&code](const char* collision) { return code == collision; })) {
    absl::Status collision = absl::AbortedError("the transaction collided with another one");
    collision.SetPayload(kCollisionPayload, absl::Cord(code));
    return collision;
  }
  LogError("database_error", {{"state", code}, {"message", PQresultErrorMessage(result)}});
  if (code.empty() ||
      std::any_of(std::begin(kUnavailableClasses), std::end(kUnavailableClasses),
                  [&code](const char* group) { return code.compare(0, 2, group) == 0; })) {
    return Unavailable();
  }
  return ServerFault("the database of the queue refused a statement");
}

// Waits until `fd` is ready for `events`; false at the deadline.
bool WaitForSocket(int fd, short events, absl::Time deadline) {
  pollfd entry{fd, events, 0};
  while (true) {
    const absl::Duration left = deadline - MonotonicNow();
    if (left <= absl::ZeroDuration()) return false;
    const auto timeout = static_cast<int>(
        absl::ToInt64Milliseconds(std::min<absl::Duration>(left, absl::Hours(1))) + 1);
    const int count = poll(&entry, 1, timeout);
    if (count > 0) return true;
    if (count < 0 && errno != EINTR) return true;  // libpq will meet the error itself
  }
}

}  // namespace

PostgresValues& PostgresValues::Int(int64_t value) {
  values_.push_back({std::to_string(value), false, false});
  return *this;
}

PostgresValues& PostgresValues::Text(const std::string& value) {
  values_.push_back({value, false, false});
  return *this;
}

PostgresValues& PostgresValues::Bytes(const std::string& value) {
  values_.push_back({value, false, true});
  return *this;
}

PostgresValues& PostgresValues::Null() {
  values_.push_back({"", true, false});
  return *this;
}

void PostgresRows::Clear::operator()(pg_result* result) const { PQclear(result); }

bool PostgresRows::Next() { return result_ != nullptr && ++row_ < PQntuples(result_.get()); }

int64_t PostgresRows::IntColumn(int column) const {
  // Binary integers are big-endian, with two, four or eight bytes; booleans have one.
  const int size = PQgetlength(result_.get(), row_, column);
  const auto* bytes =
      reinterpret_cast<const unsigned char*>(PQgetvalue(result_.get(), row_, column));
  uint64_t value = size > 1 && (bytes[0] & 0x80) != 0 ? ~uint64_t{0} : 0;
  for (int i = 0; i < size; ++i) value = value << 8 | bytes[i];
  return static_cast<int64_t>(value);
}

std::string PostgresRows::TextColumn(int column) const {
  return {PQgetvalue(result_.get(), row_, column),
          static_cast<size_t>(PQgetlength(result_.get(), row_, column))};
}

bool PostgresRows::IsNull(int column) const {
  return PQgetisnull(result_.get(), row_, column) != 0;
}

int64_t PostgresRows::ChangeCount() const {
  return result_ ? std::atoll(PQcmdTuples(result_.get())) : 0;
}

absl::StatusOr<std::unique_ptr<PostgresConnection>> PostgresConnection::Open(
    const std::string& url, absl::Duration patience) {
  const absl::Time deadline = MonotonicNow() + patience;
  PGconn* raw = PQconnectStart(url.c_str());
  if (raw == nullptr) return Unavailable();
  std::unique_ptr<PostgresConnection> connection(new PostgresConnection(raw, patience));
  if (PQstatus(raw) == CONNECTION_BAD) return connection->Lost("connect");
  PostgresPollingStatusType state = PGRES_POLLING_WRITING;
  while (state != PGRES_POLLING_OK) {
    const short events = state == PGRES_POLLING_READING ? POLLIN : POLLOUT;
    if (!WaitForSocket(PQsocket(raw), events, deadline)) return connection->Lost("connect");
    state = PQconnectPoll(raw);
    if (state == PGRES_POLLING_FAILED) return connection->Lost("connect");
  }
  PQsetnonblocking(raw, 1);
  PQsetNoticeProcessor(
      raw, [](void*, const char*) {}, nullptr);
  // Nothing here holds a transaction open while it does something else.
  AMHEX_RETURN_IF_ERROR(connection->Execute("SET idle_in_transaction_session_timeout = '30s'"));
  return connection;
}

PostgresConnection::~PostgresConnection() { PQfinish(connection_); }

absl::Status PostgresConnection::Lost(const std::string& what) {
  broken_ = true;
  // The message of libpq may name hosts and users, which is for the log only.
  LogWarning("database_lost", {{"during", what}, {"message", PQerrorMessage(connection_)}});
  return Unavailable();
}

absl::Status PostgresConnection::WaitForAnswer(absl::Time deadline) {
  while (true) {
    const int unsent = PQflush(connection_);
    if (unsent < 0) return Lost("send");
    if (unsent == 0 && PQisBusy(connection_) == 0) return absl::OkStatus();
    const short events = unsent > 0 ? POLLIN | POLLOUT : POLLIN;
    if (!WaitForSocket(PQsocket(connection_), events, deadline)) return Lost("wait");
    if (PQconsumeInput(connection_) == 0) return Lost("receive");
  }
}

absl::StatusOr<PostgresRows> PostgresConnection::Collect() {
  const absl::Time deadline = MonotonicNow() + patience_;
  PostgresRows rows;
  absl::Status error;
  while (true) {
    AMHEX_RETURN_IF_ERROR(WaitForAnswer(deadline));
    PGresult* result = PQgetResult(connection_);
    if (result == nullptr) break;
    PostgresRows latest(result);
    const ExecStatusType status = PQresultStatus(result);
    if (status == PGRES_COMMAND_OK || status == PGRES_TUPLES_OK) {
      rows = std::move(latest);
    } else if (error.ok()) {
      error = StatementError(result);
    }
  }
  if (PQstatus(connection_) == CONNECTION_BAD) return Lost("answer");
  if (!error.ok()) return error;
  return rows;
}

absl::StatusOr<PostgresRows> PostgresConnection::Run(const std::string& sql,
                                                     const PostgresValues& values) {
  std::vector<const char*> bytes;
  std::vector<int> lengths;
  std::vector<int> formats;
  for (const PostgresValues::Value& value : values.values_) {
    bytes.push_back(value.is_null ? nullptr : value.bytes.data());
    lengths.push_back(static_cast<int>(value.bytes.size()));
    formats.push_back(value.is_binary ? 1 : 0);
  }
  constexpr int kBinaryResults = 1;
  if (PQsendQueryParams(connection_, sql.c_str(), static_cast<int>(bytes.size()), nullptr,
                        bytes.data(), lengths.data(), formats.data(), kBinaryResults) == 0) {
    return Lost("send");
  }
  return Collect();
}

absl::Status PostgresConnection::Execute(const std::string& script) {
  if (PQsendQuery(connection_, script.c_str()) == 0) return Lost("send");
  return Collect().status();
}

absl::StatusOr<std::vector<std::string>> PostgresConnection::WaitForNotifications(
    absl::Duration patience) {
  std::vector<std::string> payloads;
  if (WaitForSocket(PQsocket(connection_), POLLIN, MonotonicNow() + patience) &&
      PQconsumeInput(connection_) == 0) {
    return Lost("listen");
  }
  while (PGnotify* notification = PQnotifies(connection_)) {
    payloads.emplace_back(notification->extra);
    PQfreemem(notification);
  }
  return payloads;
}

absl::StatusOr<std::unique_ptr<PostgresConnection>> PostgresPool::Take() {
  {
    std::unique_lock<std::mutex> lock(mutex_);
    const bool free = returned_.wait_for(lock, absl::ToChronoMilliseconds(options_.patience),
                                         [this] { return in_use_ < options_.connection_count; });
    if (!free) return Unavailable();
    // While the database is away, callers are told so at once instead of queueing up.
    if (idle_.empty() && MonotonicNow() < next_attempt_) return last_failure_;
    ++in_use_;
    if (!idle_.empty()) {
      auto connection = std::move(idle_.back());
      idle_.pop_back();
      return connection;
    }
  }
  auto opened = PostgresConnection::Open(options_.url, options_.patience);
  if (opened.ok() && !options_.session_setup.empty()) {
    if (auto status = (*opened)->Execute(options_.session_setup); !status.ok()) opened = status;
  }
  if (opened.ok()) return opened;
  std::lock_guard<std::mutex> lock(mutex_);
  --in_use_;
  returned_.notify_one();
  next_attempt_ = MonotonicNow() + kReconnectPause;
  last_failure_ = opened.status();
  return opened;
}

void PostgresPool::GiveBack(std::unique_ptr<PostgresConnection> connection) {
  std::lock_guard<std::mutex> lock(mutex_);
  --in_use_;
  returned_.notify_one();
  if (connection->broken()) {
    // What broke one connection has probably broken those that rest as well.
    idle_.clear();
  } else {
    idle_.push_back(std::move(connection));
  }
}

absl::Status PostgresPool::TryOnce(const Work& work) {
  AMHEX_ASSIGN_OR_RETURN(auto connection, Take());
  absl::Status status = connection->Execute("BEGIN");
  if (status.ok()) status = work(*connection);
  if (status.ok()) status = connection->Execute("COMMIT");
  if (!status.ok() && !connection->broken()) connection->Execute("ROLLBACK").IgnoreError();
  GiveBack(std::move(connection));
  return status;
}

absl::Status PostgresPool::RepeatOnCollision(const Work& work) {
  absl::Status status;
  for (int attempt = 0; attempt < kMaxCollisions; ++attempt) {
    status = TryOnce(work);
    if (!status.GetPayload(kCollisionPayload)) return status;
    absl::SleepFor(absl::Milliseconds(1 << attempt));
  }
  return Unavailable();
}

absl::Status PostgresPool::Transact(const Work& work) {
  absl::Status status = RepeatOnCollision(work);
  if (!absl::IsUnavailable(status)) return status;
  return RepeatOnCollision(work);
}

absl::Status PostgresPool::TransactOnce(const Work& work) { return RepeatOnCollision(work); }

}  // namespace amhex::server
