// The side of PostgresJobStore that takes jobs in.
#include <algorithm>
#include <utility>

#include "errors.h"
#include "job_id.h"
#include "job_record.h"
#include "postgres_job_rows.h"
#include "postgres_job_store.h"
#include "status_macros.h"
#include "time_convert.h"

namespace amhex::server {

using amhex::v1::Job;

absl::StatusOr<std::optional<Job>> PostgresJobStore::FindRequest(PostgresConnection& db,
                                                                 const NewJob& job) {
  if (job.request_id.empty()) return std::optional<Job>();
  AMHEX_ASSIGN_OR_RETURN(
      auto known, db.Run("SELECT id, request_hash FROM job WHERE tenant = $1 AND request_id = $2",
                         PostgresValues().Text(job.tenant.name).Text(job.request_id)));
  if (!known.Next()) return std::optional<Job>();
  if (known.TextColumn(1) != job.request_hash) return RequestIdReused(job.request_id);
  AMHEX_ASSIGN_OR_RETURN(Job existing, GetJob(db, known.TextColumn(0)));
  return std::optional<Job>(std::move(existing));
}

// Nodes that submit at the same time may overshoot by as many jobs as there are nodes.
absl::Status PostgresJobStore::CheckRoom(PostgresConnection& db, const NewJob& job,
                                         int64_t max_queued) {
  AMHEX_ASSIGN_OR_RETURN(
      auto all,
      db.Run("SELECT count(*) FROM (SELECT 1 FROM job WHERE state = 1 LIMIT $1::bigint) AS queued",
             PostgresValues().Int(max_queued)));
  if (!all.Next() || all.IntColumn(0) >= max_queued) return QueueFull(max_queued);
  const int64_t quota = job.tenant.max_queued_jobs;
  if (quota <= 0) return absl::OkStatus();
  AMHEX_ASSIGN_OR_RETURN(
      auto own, db.Run("SELECT count(*) FROM (SELECT 1 FROM job WHERE tenant = $1 AND state = 1"
                       " LIMIT $2::bigint) AS queued",
                       PostgresValues().Text(job.tenant.name).Int(quota)));
  if (own.Next() && own.IntColumn(0) < quota) return absl::OkStatus();
  return QuotaExceeded("queued jobs", quota);
}

// A tenant that comes back has no claim on the time it did not use: it starts level with the one
// that has had the least among those at work, or with everyone's most when nobody is. A tenant that
// is at work already is only read, so that its submissions do not wait for each other.
absl::Status PostgresJobStore::EnrolTenant(PostgresConnection& db, const Tenant& tenant) {
  PostgresValues values;
  values.Text(tenant.name).Int(std::max(tenant.weight, 1)).Int(tenant.max_running_jobs);
  AMHEX_ASSIGN_OR_RETURN(
      auto current,
      db.Run("SELECT 1 FROM tenant WHERE name = $1 AND weight = $2 AND max_running = $3 AND EXISTS"
             " (SELECT 1 FROM job WHERE tenant = $1 AND state IN (1, 2))",
             values));
  if (current.Next()) return absl::OkStatus();
  AMHEX_RETURN_IF_ERROR(db.Run("INSERT INTO tenant VALUES ($1, $2, $3, 0) ON CONFLICT (name)"
                               " DO UPDATE SET weight = $2, max_running = $3",
                               values)
                            .status());
  return db
      .Run(
          "UPDATE tenant SET served = greatest(served, coalesce("
          "(SELECT min(served) FROM tenant AS other WHERE EXISTS (SELECT 1 FROM job"
          " WHERE job.tenant = other.name AND state IN (1, 2))),"
          "(SELECT max(served) FROM tenant), 0)) WHERE name = $1 AND NOT EXISTS"
          " (SELECT 1 FROM job WHERE tenant = $1 AND state IN (1, 2))",
          PostgresValues().Text(tenant.name))
      .status();
}

absl::Status PostgresJobStore::Insert(PostgresConnection& db, const NewJob& job, int64_t now) {
  PostgresValues values;
  values.Text(job.id).Text(job.tenant.name);
  job.request_id.empty() ? values.Null() : values.Text(job.request_id);
  values.Text(job.request_hash);
  job.cache_key.empty() ? values.Null() : values.Text(job.cache_key);
  values.Int(now + absl::ToInt64Microseconds(job.job.priority() * kPriorityStep));
  values.Int(job.cost.memory_bytes).Int(absl::ToInt64Microseconds(job.cost.duration));
  values.Bytes(job.job.SerializeAsString());
  values.Text(job.job.input().sha256()).Int(now);
  job.job.has_queue_timeout()
      ? values.Int(now + absl::ToInt64Microseconds(FromProto(job.job.queue_timeout())))
      : values.Null();
  values.Int(absl::ToInt64Microseconds(job.ttl)).Int(job.job.max_attempts());
  return db
      .Run(
          "INSERT INTO job(id, tenant, request_id, request_hash, cache_key, state, queue_key,"
          " memory_bytes, expected_micros, spec, input_sha256, create_time, not_before,"
          " queue_deadline, ttl, max_attempts)"
          " VALUES ($1, $2, $3, $4, $5, 1, $6, $7, $8, $9, $10, $11, $11, $12, $13, $14)",
          values)
      .status();
}

absl::StatusOr<std::optional<FinalOutcome>> PostgresJobStore::FindResult(PostgresConnection& db,
                                                                         const NewJob& job) {
  if (job.cache_key.empty()) return std::optional<FinalOutcome>();
  AMHEX_ASSIGN_OR_RETURN(auto found,
                         db.Run("SELECT outcome FROM job WHERE tenant = $1 AND cache_key = $2"
                                " AND state = 3 ORDER BY number DESC LIMIT 1",
                                PostgresValues().Text(job.tenant.name).Text(job.cache_key)));
  Job details;
  if (!found.Next() || !details.ParseFromString(found.TextColumn(0))) {
    return std::optional<FinalOutcome>();
  }
  AMHEX_ASSIGN_OR_RETURN(const bool is_stored, KeepBlob(db, details.result().mesh().sha256()));
  if (!is_stored) return std::optional<FinalOutcome>();
  return std::optional<FinalOutcome>(SharedOutcome(details));
}

absl::StatusOr<bool> PostgresJobStore::KeepBlob(PostgresConnection& db, const std::string& sha256) {
  AMHEX_RETURN_IF_ERROR(db.Run("SELECT pg_advisory_xact_lock_shared($1::integer, hashtext($2))",
                               PostgresValues().Int(kBlobLocks).Text(sha256))
                            .status());
  return IsStored(sha256);
}

absl::Status PostgresJobStore::Grant(PostgresConnection& db, const std::string& tenant,
                                     const amhex::v1::BlobRef& blob, int64_t now) {
  AMHEX_ASSIGN_OR_RETURN(const bool is_stored, KeepBlob(db, blob.sha256()));
  if (!is_stored) return BlobMissing(blob.sha256());
  return db
      .Run(
          "INSERT INTO blob_owner VALUES ($1, $2, $3, $4) ON CONFLICT (tenant, sha256) DO UPDATE"
          " SET bytes = greatest(blob_owner.bytes, excluded.bytes),"
          " grant_time = excluded.grant_time",
          PostgresValues().Text(tenant).Text(blob.sha256()).Int(blob.size_bytes()).Int(now))
      .status();
}

absl::StatusOr<SubmittedJob> PostgresJobStore::SubmitOn(PostgresConnection& db, const NewJob& job,
                                                        int64_t max_queued, int64_t now) {
  AMHEX_ASSIGN_OR_RETURN(auto known, FindRequest(db, job));
  // It may be known because this very call, repeated, has stored it.
  if (known) return SubmittedJob{*known, JobIdFromName(known->name()) == job.id};
  AMHEX_ASSIGN_OR_RETURN(const auto result, FindResult(db, job));
  if (!result) AMHEX_RETURN_IF_ERROR(CheckRoom(db, job, max_queued));
  AMHEX_RETURN_IF_ERROR(EnrolTenant(db, job.tenant));
  AMHEX_RETURN_IF_ERROR(Insert(db, job, now));
  AMHEX_RETURN_IF_ERROR(Grant(db, job.tenant.name, job.job.input(), now));
  if (result) AMHEX_RETURN_IF_ERROR(End(db, job.id, "state = 1", *result, now).status());
  AMHEX_ASSIGN_OR_RETURN(Job stored, GetJob(db, job.id));
  return SubmittedJob{std::move(stored), true};
}

absl::StatusOr<SubmittedJob> PostgresJobStore::Submit(const NewJob& job, int64_t max_queued,
                                                      absl::Time now) {
  SubmittedJob submitted;
  bool is_repetition = false;
  const absl::Status status = pool_.Transact([&](PostgresConnection& db) -> absl::Status {
    if (std::exchange(is_repetition, true)) {
      auto stored = GetJob(db, job.id);
      if (stored.ok()) {
        submitted = {*std::move(stored), true};
        return absl::OkStatus();
      }
    }
    AMHEX_ASSIGN_OR_RETURN(submitted, SubmitOn(db, job, max_queued, Micros(now)));
    return absl::OkStatus();
  });
  if (!status.ok()) return status;
  if (submitted.is_new) Announce({job.id});
  return submitted;
}

absl::Status PostgresJobStore::GrantBlob(const std::string& tenant, const amhex::v1::BlobRef& blob,
                                         absl::Time now) {
  return pool_.Transact(
      [&](PostgresConnection& db) { return Grant(db, tenant, blob, Micros(now)); });
}

}  // namespace amhex::server
