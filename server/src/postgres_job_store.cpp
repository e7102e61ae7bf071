#include "postgres_job_store.h"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "errors.h"
#include "job_record.h"
#include "logging.h"
#include "postgres_job_rows.h"
#include "status_macros.h"
#include "time_convert.h"

namespace amhex::server {
namespace {

using amhex::v1::Job;

// Clocks that agree this well are taken as one; leases are much longer.
constexpr absl::Duration kNegligibleSkew = absl::Milliseconds(50);
constexpr absl::Duration kListenInterval = absl::Milliseconds(200);
constexpr absl::Duration kListenRetryPause = absl::Milliseconds(500);

PostgresPool::Options PoolOptions(const PostgresJobStore::Options& options) {
  PostgresPool::Options pool;
  pool.url = options.url;
  pool.connection_count = options.connection_count;
  pool.patience = options.patience;
  return pool;
}

PostgresPool::Options QuickPoolOptions(const PostgresJobStore::Options& options) {
  PostgresPool::Options pool = PoolOptions(options);
  pool.connection_count = 1;
  pool.session_setup = "SET synchronous_commit = off";
  return pool;
}

}  // namespace

PostgresJobStore::PostgresJobStore(const Options& options)
    : options_(options), pool_(PoolOptions(options)), quick_pool_(QuickPoolOptions(options)) {}

PostgresJobStore::~PostgresJobStore() { Unsubscribe(); }

absl::StatusOr<std::unique_ptr<PostgresJobStore>> PostgresJobStore::Open(const Options& options) {
  std::unique_ptr<PostgresJobStore> store(new PostgresJobStore(options));
  AMHEX_RETURN_IF_ERROR(store->BringSchemaUpToDate());
  AMHEX_RETURN_IF_ERROR(store->MeasureClock());
  return store;
}

absl::Status PostgresJobStore::BringSchemaUpToDate() {
  return pool_.Transact([](PostgresConnection& db) -> absl::Status {
    AMHEX_RETURN_IF_ERROR(
        db.Execute("SELECT pg_advisory_xact_lock(" + std::to_string(kSchemaLock) + ")"));
    AMHEX_RETURN_IF_ERROR(db.Execute(kPostgresSchema));
    AMHEX_ASSIGN_OR_RETURN(auto rows, db.Run("SELECT number FROM schema_version"));
    const int64_t found = rows.Next() ? rows.IntColumn(0) : 0;
    if (found == 1) return db.Execute(kPostgresFromVersion1);
    if (found == kPostgresSchemaVersion) return absl::OkStatus();
    return absl::FailedPreconditionError("the job store has version " + std::to_string(found) +
                                         ", this server knows up to " +
                                         std::to_string(kPostgresSchemaVersion));
  });
}

absl::Status PostgresJobStore::MeasureClock() {
  const absl::Time before = options_.clock();
  AMHEX_ASSIGN_OR_RETURN(
      const int64_t database_micros,
      Number("SELECT (extract(epoch FROM clock_timestamp()) * 1000000)::bigint", {}));
  const absl::Time middle = before + (options_.clock() - before) / 2;
  const absl::Duration offset = absl::FromUnixMicros(database_micros) - middle;
  const bool negligible = absl::AbsDuration(offset) < kNegligibleSkew;
  clock_offset_micros_ = negligible ? 0 : absl::ToInt64Microseconds(offset);
  return absl::OkStatus();
}

int64_t PostgresJobStore::Micros(absl::Time time) const {
  return absl::ToUnixMicros(time) + clock_offset_micros_;
}

absl::StatusOr<int64_t> PostgresJobStore::Number(const std::string& sql,
                                                 const PostgresValues& values) {
  int64_t number = 0;
  const absl::Status status = pool_.Transact([&](PostgresConnection& db) -> absl::Status {
    AMHEX_ASSIGN_OR_RETURN(auto rows, db.Run(sql, values));
    number = rows.Next() && !rows.IsNull(0) ? rows.IntColumn(0) : 0;
    return absl::OkStatus();
  });
  if (!status.ok()) return status;
  return number;
}

absl::StatusOr<std::vector<std::string>> PostgresJobStore::Ids(const std::string& sql,
                                                               const PostgresValues& values) {
  std::vector<std::string> ids;
  const absl::Status status = pool_.Transact([&](PostgresConnection& db) -> absl::Status {
    AMHEX_ASSIGN_OR_RETURN(auto rows, db.Run(sql, values));
    ids.clear();
    while (rows.Next()) ids.push_back(rows.TextColumn(0));
    return absl::OkStatus();
  });
  if (!status.ok()) return status;
  return ids;
}

absl::StatusOr<int64_t> PostgresJobStore::NextGeneration() {
  return Number("SELECT nextval('generation')", {});
}

absl::StatusOr<Job> PostgresJobStore::Get(const std::string& id) {
  Job job;
  const absl::Status status = pool_.Transact([&](PostgresConnection& db) -> absl::Status {
    AMHEX_ASSIGN_OR_RETURN(job, GetJob(db, id));
    return absl::OkStatus();
  });
  if (!status.ok()) return status;
  return job;
}

// States and labels are compared here, not in the database: so many rows are read at a time and no
// more.
absl::StatusOr<JobPage> PostgresJobStore::List(const JobQuery& query) {
  JobPageMaker maker(&query);
  bool is_more = true;
  while (is_more) {
    PostgresValues values;
    values.Int(maker.before()).Int(kListRows);
    if (query.tenant) values.Text(*query.tenant);
    PostgresRows read;
    AMHEX_RETURN_IF_ERROR(pool_.Transact([&](PostgresConnection& db) -> absl::Status {
      AMHEX_ASSIGN_OR_RETURN(read, db.Run(std::string(kSelectJob) + "WHERE number < $1" +
                                              (query.tenant ? " AND tenant = $3" : "") +
                                              " ORDER BY number DESC LIMIT $2",
                                          values));
      return absl::OkStatus();
    }));
    for (int row = 0; row < kListRows && is_more; ++row) {
      is_more = read.Next() && maker.ShowRow(read);
    }
  }
  return maker.page();
}

absl::StatusOr<Job> PostgresJobStore::RequestCancel(const std::string& id,
                                                    const FinalOutcome& outcome, absl::Time now) {
  Job job;
  const absl::Status status = pool_.Transact([&](PostgresConnection& db) -> absl::Status {
    AMHEX_RETURN_IF_ERROR(
        db.Run("UPDATE job SET cancel_requested = true WHERE id = $1 AND state IN (1, 2)",
               PostgresValues().Text(id))
            .status());
    AMHEX_RETURN_IF_ERROR(End(db, id, "state = 1", outcome, Micros(now)).status());
    AMHEX_ASSIGN_OR_RETURN(job, GetJob(db, id));
    return absl::OkStatus();
  });
  if (!status.ok()) return status;
  Announce({id});
  return job;
}

absl::Status PostgresJobStore::Delete(const std::string& id) {
  return pool_.Transact([&](PostgresConnection& db) -> absl::Status {
    AMHEX_ASSIGN_OR_RETURN(const Job job, GetJob(db, id));
    AMHEX_ASSIGN_OR_RETURN(
        const auto removed,
        db.Run("DELETE FROM job WHERE id = $1 AND state >= 3", PostgresValues().Text(id)));
    return removed.ChangeCount() > 0 ? absl::OkStatus() : JobNotFinal(job);
  });
}

absl::StatusOr<std::string> PostgresJobStore::RunnerAddress(const std::string& id) {
  AMHEX_ASSIGN_OR_RETURN(const auto found, Ids("SELECT address FROM lease WHERE job_id = $1",
                                               PostgresValues().Text(id)));
  return found.empty() ? std::string() : found.front();
}

void PostgresJobStore::Announce(const std::vector<std::string>& ids) {
  if (ids.empty()) return;
  // Only a hint: whoever misses it looks for himself soon.
  quick_pool_
      .Transact([&ids](PostgresConnection& db) -> absl::Status {
        for (const std::string& id : ids) {
          AMHEX_RETURN_IF_ERROR(
              db.Run("SELECT pg_notify($1, $2)", PostgresValues().Text(kJobChannel).Text(id))
                  .status());
        }
        return absl::OkStatus();
      })
      .IgnoreError();
}

void PostgresJobStore::Subscribe(std::function<void(const std::string& id)>&& on_change) {
  on_change_ = std::move(on_change);
  listener_ = std::thread([this] { Listen(); });
}

void PostgresJobStore::Unsubscribe() {
  stopping_ = true;
  if (listener_.joinable()) listener_.join();
}

void PostgresJobStore::Listen() {
  while (!stopping_) {
    auto connection = PostgresConnection::Open(options_.url, options_.patience);
    absl::Status status = connection.status();
    if (status.ok()) status = (*connection)->Execute(std::string("LISTEN ") + kJobChannel);
    // What was announced meanwhile was missed.
    if (status.ok()) on_change_("");
    while (status.ok() && !stopping_) {
      const auto ids = (*connection)->WaitForNotifications(kListenInterval);
      status = ids.status();
      if (!status.ok()) break;
      for (const std::string& id : *ids) on_change_(id);
    }
    if (!stopping_) absl::SleepFor(kListenRetryPause);
  }
}

}  // namespace amhex::server
