// The side of PostgresJobStore that housekeeping uses: restarts, leases, deadlines, counts, and who
// owns which blob. All of it may run on every node at the same time.
#include <utility>

#include "postgres_job_rows.h"
#include "postgres_job_store.h"
#include "status_macros.h"

namespace amhex::server {

using amhex::v1::Job;

absl::StatusOr<int64_t> PostgresJobStore::RequeueRunning(const std::string& node) {
  AMHEX_RETURN_IF_ERROR(Ids("WITH ended AS (UPDATE lease SET until = 0, epoch = epoch + 1 FROM job"
                            " WHERE node = $1 AND id = job_id AND state = 2"
                            " AND lease_epoch = epoch AND cancel_requested RETURNING job_id)"
                            " UPDATE job SET lease_epoch = lease_epoch + 1 FROM ended"
                            " WHERE id = job_id RETURNING id",
                            PostgresValues().Text(node))
                            .status());
  AMHEX_ASSIGN_OR_RETURN(
      const auto ids,
      Ids("WITH gone AS (DELETE FROM lease WHERE node = $1 AND until > 0 RETURNING job_id, epoch)"
          " UPDATE job SET state = 1, attempt = attempt - 1, lease_epoch = lease_epoch + 1,"
          " not_before = create_time FROM gone WHERE id = gone.job_id AND state = 2"
          " AND lease_epoch = gone.epoch RETURNING id",
          PostgresValues().Text(node)));
  Announce(ids);
  return static_cast<int64_t>(ids.size());
}

absl::StatusOr<ReapedLeases> PostgresJobStore::ReapExpiredLeases(absl::Time now) {
  AMHEX_RETURN_IF_ERROR(MeasureClock());
  ReapedLeases reaped;
  std::vector<Charge> charges;
  const absl::Status status = pool_.Transact([&](PostgresConnection& db) -> absl::Status {
    reaped = {};
    charges.clear();
    // A heartbeat that comes in between wins: the row is looked at again once it is unlocked.
    AMHEX_ASSIGN_OR_RETURN(
        auto back,
        db.Run("WITH gone AS (DELETE FROM lease USING job WHERE until < $1 AND id = job_id"
               " AND attempt < max_attempts AND NOT cancel_requested RETURNING job_id, epoch)"
               " UPDATE job SET state = 1, not_before = $1 FROM gone WHERE id = gone.job_id"
               " AND state = 2 AND lease_epoch = gone.epoch"
               " RETURNING id, tenant, $1 - start_time",
               PostgresValues().Int(Micros(now))));
    while (back.Next()) {
      reaped.requeued.push_back(back.TextColumn(0));
      charges.push_back({back.TextColumn(1), back.IntColumn(2)});
    }
    // Attempts are compared here as well: a claim that was held up for longer than its lease may
    // have been committed since, and has ended already.
    AMHEX_ASSIGN_OR_RETURN(
        auto spent,
        db.Run(std::string(kSelectJob) + "JOIN lease ON job_id = id WHERE state = 2 AND until < $1"
                                         " AND (attempt >= max_attempts OR cancel_requested)",
               PostgresValues().Int(Micros(now))));
    while (spent.Next()) {
      PostgresJob job = ReadJob(spent);
      auto& ends = job.job.cancel_requested() ? reaped.cancelled : reaped.exhausted;
      ends.push_back({job.id, job.epoch, std::move(job.job)});
    }
    return absl::OkStatus();
  });
  if (!status.ok()) return status;
  ChargeTenants(charges);
  Announce(reaped.requeued);
  return reaped;
}

absl::StatusOr<std::vector<std::string>> PostgresJobStore::ExpireQueued(const FinalOutcome& outcome,
                                                                        absl::Time now) {
  std::vector<std::string> ids;
  const absl::Status status = pool_.Transact([&](PostgresConnection& db) -> absl::Status {
    ids.clear();
    AMHEX_ASSIGN_OR_RETURN(auto late,
                           db.Run("SELECT id FROM job WHERE state = 1 AND queue_deadline <= $1"
                                  " ORDER BY number FOR UPDATE SKIP LOCKED",
                                  PostgresValues().Int(Micros(now))));
    while (late.Next()) {
      const std::string id = late.TextColumn(0);
      AMHEX_ASSIGN_OR_RETURN(const auto ended, End(db, id, "state = 1", outcome, Micros(now)));
      if (ended) ids.push_back(id);
    }
    return absl::OkStatus();
  });
  if (!status.ok()) return status;
  Announce(ids);
  return ids;
}

absl::StatusOr<std::vector<std::string>> PostgresJobStore::RemoveExpired(absl::Time now) {
  return Ids("DELETE FROM job WHERE state >= 3 AND expire_time <= $1 RETURNING id",
             PostgresValues().Int(Micros(now)));
}

absl::StatusOr<std::vector<std::string>> PostgresJobStore::RemoveOldestFinal(int count,
                                                                             absl::Time before) {
  return Ids(
      "DELETE FROM job WHERE number IN (SELECT number FROM job WHERE state >= 3"
      " AND end_time < $1 ORDER BY end_time, number LIMIT $2) RETURNING id",
      PostgresValues().Int(Micros(before)).Int(count));
}

absl::StatusOr<std::map<Job::State, int64_t>> PostgresJobStore::CountByState() {
  std::map<Job::State, int64_t> counts;
  const absl::Status status = pool_.Transact([&](PostgresConnection& db) -> absl::Status {
    counts.clear();
    AMHEX_ASSIGN_OR_RETURN(auto rows, db.Run("SELECT state, count(*) FROM job GROUP BY state"));
    while (rows.Next()) counts[static_cast<Job::State>(rows.IntColumn(0))] = rows.IntColumn(1);
    return absl::OkStatus();
  });
  if (!status.ok()) return status;
  return counts;
}

absl::StatusOr<std::optional<absl::Time>> PostgresJobStore::OldestQueued() {
  AMHEX_ASSIGN_OR_RETURN(const int64_t micros,
                         Number("SELECT min(create_time) FROM job WHERE state = 1", {}));
  if (micros == 0) return std::optional<absl::Time>();
  return std::optional<absl::Time>(absl::FromUnixMicros(micros - clock_offset_micros_));
}

absl::StatusOr<absl::Duration> PostgresJobStore::QueuedCost() {
  AMHEX_ASSIGN_OR_RETURN(
      const int64_t micros,
      Number("SELECT coalesce(sum(expected_micros), 0)::bigint FROM job WHERE state = 1", {}));
  return absl::Microseconds(micros);
}

absl::StatusOr<bool> PostgresJobStore::OwnsBlob(const std::string& tenant,
                                                const std::string& sha256) {
  AMHEX_ASSIGN_OR_RETURN(const int64_t count,
                         Number("SELECT count(*) FROM blob_owner WHERE tenant = $1 AND sha256 = $2",
                                PostgresValues().Text(tenant).Text(sha256)));
  return count > 0;
}

absl::StatusOr<int64_t> PostgresJobStore::OwnedBytes(const std::string& tenant) {
  return Number("SELECT coalesce(sum(bytes), 0)::bigint FROM blob_owner WHERE tenant = $1",
                PostgresValues().Text(tenant));
}

absl::StatusOr<int64_t> PostgresJobStore::DropUnusedGrants(absl::Time before) {
  AMHEX_ASSIGN_OR_RETURN(
      const auto dropped,
      Ids("DELETE FROM blob_owner WHERE grant_time < $1"
          " AND NOT EXISTS (SELECT 1 FROM job WHERE job.input_sha256 = blob_owner.sha256"
          " AND job.tenant = blob_owner.tenant)"
          " AND NOT EXISTS (SELECT 1 FROM job WHERE job.result_sha256 = blob_owner.sha256"
          " AND job.tenant = blob_owner.tenant) RETURNING sha256",
          PostgresValues().Int(Micros(before))));
  return static_cast<int64_t>(dropped.size());
}

// Whoever comes to use a blob holds its lock (KeepBlob) until that is committed. Here it is taken
// alone, and the look comes after it, in a statement of its own that sees what was committed last.
// If the commit fails, the lock may have been lost before `hide` returned.
absl::StatusOr<bool> PostgresJobStore::CollectBlob(const std::string& sha256,
                                                   const std::function<void()>& hide) {
  bool is_unused = false;
  const absl::Status status = pool_.Transact([&](PostgresConnection& db) -> absl::Status {
    is_unused = false;
    const PostgresValues key = PostgresValues().Int(kBlobLocks).Text(sha256);
    AMHEX_ASSIGN_OR_RETURN(
        auto locked,
        db.Run("SELECT pg_try_advisory_xact_lock($1::integer, hashtext($2))::integer", key));
    if (!locked.Next() || locked.IntColumn(0) == 0) return absl::OkStatus();
    AMHEX_ASSIGN_OR_RETURN(
        auto used,
        db.Run("SELECT CASE WHEN EXISTS (SELECT 1 FROM job WHERE input_sha256 = $1)"
               " OR EXISTS (SELECT 1 FROM job WHERE result_sha256 = $1)"
               " OR EXISTS (SELECT 1 FROM blob_owner WHERE sha256 = $1) THEN 1 ELSE 0 END",
               PostgresValues().Text(sha256)));
    is_unused = used.Next() && used.IntColumn(0) == 0;
    if (is_unused) hide();
    return absl::OkStatus();
  });
  if (!status.ok()) return status;
  return is_unused;
}

}  // namespace amhex::server
