#include "sqlite_job_store.h"

#include <algorithm>
#include <utility>

#include "errors.h"
#include "job_id.h"
#include "sqlite_job_rows.h"
#include "status_macros.h"
#include "time_convert.h"

namespace amhex::server {

using amhex::v1::Job;

SqliteJobStore::SqliteJobStore(std::unique_ptr<SqliteDatabase> database)
    : database_(std::move(database)) {}

absl::StatusOr<std::unique_ptr<SqliteJobStore>> SqliteJobStore::Open(const std::string& path) {
  AMHEX_ASSIGN_OR_RETURN(auto database, SqliteDatabase::Open(path));
  AMHEX_RETURN_IF_ERROR(database->Execute("PRAGMA journal_mode=WAL; PRAGMA synchronous=FULL;"));
  std::unique_ptr<SqliteJobStore> store(new SqliteJobStore(std::move(database)));
  AMHEX_RETURN_IF_ERROR(store->BringSchemaUpToDate());
  return store;
}

absl::Status SqliteJobStore::BringSchemaUpToDate() {
  AMHEX_ASSIGN_OR_RETURN(const int64_t found, database_->QueryInt("PRAGMA user_version"));
  if (found > kSchemaVersion) {
    return absl::FailedPreconditionError("the job store has version " + std::to_string(found) +
                                         ", this server knows up to " +
                                         std::to_string(kSchemaVersion));
  }
  SqliteTransaction transaction(database_.get());
  AMHEX_RETURN_IF_ERROR(transaction.status());
  if (found == 1) AMHEX_RETURN_IF_ERROR(database_->Execute(kLeaveVersion1));
  if (found == 2) AMHEX_RETURN_IF_ERROR(database_->Execute(kFromVersion2));
  AMHEX_RETURN_IF_ERROR(database_->Execute(kSchema));
  if (found == 1) AMHEX_RETURN_IF_ERROR(database_->Execute(kFillFromVersion1));
  AMHEX_RETURN_IF_ERROR(
      database_->Execute("PRAGMA user_version=" + std::to_string(kSchemaVersion)));
  return transaction.Commit();
}

absl::StatusOr<int64_t> SqliteJobStore::NextGeneration() {
  std::lock_guard<std::mutex> lock(mutex_);
  AMHEX_RETURN_IF_ERROR(database_->Execute("UPDATE generation SET number = number + 1"));
  return database_->QueryInt("SELECT number FROM generation");
}

absl::StatusOr<std::optional<SubmittedJob>> SqliteJobStore::FindRequestLocked(const NewJob& job) {
  if (job.request_id.empty()) return std::optional<SubmittedJob>();
  AMHEX_ASSIGN_OR_RETURN(auto known,
                         database_->Prepare("SELECT id, request_hash FROM job WHERE tenant = ? AND"
                                            " request_id = ?"));
  AMHEX_ASSIGN_OR_RETURN(const bool has_row,
                         known.Text(job.tenant.name).Text(job.request_id).Step());
  if (!has_row) return std::optional<SubmittedJob>();
  if (known.TextColumn(1) != job.request_hash) {
    return RequestIdReused(job.request_id);
  }
  AMHEX_ASSIGN_OR_RETURN(Job existing, GetLocked(known.TextColumn(0)));
  return std::optional<SubmittedJob>(SubmittedJob{std::move(existing), false});
}

absl::Status SqliteJobStore::CheckRoomLocked(const NewJob& job, int64_t max_queued) {
  AMHEX_ASSIGN_OR_RETURN(const int64_t queued,
                         database_->QueryInt("SELECT count(*) FROM job WHERE state = 1"));
  if (queued >= max_queued) {
    return QueueFull(queued);
  }
  if (job.tenant.max_queued_jobs <= 0) return absl::OkStatus();
  AMHEX_ASSIGN_OR_RETURN(auto count, database_->Prepare("SELECT count(*) FROM job INDEXED BY"
                                                        " job_claim WHERE tenant = ?"
                                                        " AND state = 1"));
  AMHEX_RETURN_IF_ERROR(count.Text(job.tenant.name).Step().status());
  if (count.IntColumn(0) < job.tenant.max_queued_jobs) return absl::OkStatus();
  return QuotaExceeded("queued jobs", job.tenant.max_queued_jobs);
}

// A tenant that comes back has no claim on the time it did not use: it starts level with the one
// that has had the least among those at work, or with everyone's most when nobody is.
absl::Status SqliteJobStore::EnrolTenantLocked(const Tenant& tenant) {
  AMHEX_ASSIGN_OR_RETURN(
      auto enrol, database_->Prepare("INSERT INTO tenant VALUES(?1, ?2, ?3, 0) ON CONFLICT(name)"
                                     " DO UPDATE SET weight = ?2, max_running = ?3"));
  enrol.Text(tenant.name).Int(std::max(tenant.weight, 1)).Int(tenant.max_running_jobs);
  AMHEX_RETURN_IF_ERROR(enrol.Run());
  AMHEX_ASSIGN_OR_RETURN(
      auto level, database_->Prepare(
                      "UPDATE tenant SET served = max(served, coalesce("
                      "(SELECT min(served) FROM tenant AS other WHERE EXISTS (SELECT 1 FROM job"
                      " INDEXED BY job_busy WHERE job.tenant = other.name AND state <= 2)),"
                      "(SELECT max(served) FROM tenant), 0)) WHERE name = ?1 AND NOT EXISTS"
                      " (SELECT 1 FROM job INDEXED BY job_busy WHERE tenant = ?1 AND state <= 2)"));
  return level.Text(tenant.name).Run();
}

absl::Status SqliteJobStore::InsertLocked(const NewJob& job, absl::Time now) {
  AMHEX_ASSIGN_OR_RETURN(
      auto insert,
      database_->Prepare("INSERT INTO job(id, tenant, request_id, request_hash, cache_key, state,"
                         " queue_key, memory_bytes, expected_micros, spec, input_sha256,"
                         " create_time, not_before, queue_deadline, ttl, max_attempts)"
                         " VALUES(?,?,?,?,?,1,?,?,?,?,?,?,?,?,?,?)"));
  const int64_t create_time = absl::ToUnixMicros(now);
  insert.Text(job.id).Text(job.tenant.name);
  job.request_id.empty() ? insert.Null() : insert.Text(job.request_id);
  insert.Text(job.request_hash);
  job.cache_key.empty() ? insert.Null() : insert.Text(job.cache_key);
  insert.Int(absl::ToUnixMicros(now + job.job.priority() * kPriorityStep));
  insert.Int(job.cost.memory_bytes).Int(absl::ToInt64Microseconds(job.cost.duration));
  insert.Blob(job.job.SerializeAsString()).Text(job.job.input().sha256());
  insert.Int(create_time).Int(create_time);
  job.job.has_queue_timeout()
      ? insert.Int(absl::ToUnixMicros(now + FromProto(job.job.queue_timeout())))
      : insert.Null();
  insert.Int(absl::ToInt64Microseconds(job.ttl)).Int(job.job.max_attempts());
  return insert.Run();
}

absl::StatusOr<std::optional<FinalOutcome>> SqliteJobStore::FindResultLocked(const NewJob& job) {
  if (job.cache_key.empty()) return std::optional<FinalOutcome>();
  AMHEX_ASSIGN_OR_RETURN(auto select,
                         database_->Prepare("SELECT outcome FROM job INDEXED BY job_cache"
                                            " WHERE tenant = ? AND cache_key = ?"
                                            " AND state = 3 ORDER BY number DESC LIMIT 1"));
  AMHEX_ASSIGN_OR_RETURN(const bool has_row,
                         select.Text(job.tenant.name).Text(job.cache_key).Step());
  Job details;
  if (!has_row || !details.ParseFromString(select.TextColumn(0))) {
    return std::optional<FinalOutcome>();
  }
  return std::optional<FinalOutcome>(SharedOutcome(details));
}

absl::StatusOr<SubmittedJob> SqliteJobStore::Submit(const NewJob& job, int64_t max_queued,
                                                    absl::Time now) {
  std::lock_guard<std::mutex> lock(mutex_);
  SqliteTransaction transaction(database_.get());
  AMHEX_RETURN_IF_ERROR(transaction.status());
  AMHEX_ASSIGN_OR_RETURN(auto known, FindRequestLocked(job));
  if (known) return *known;
  AMHEX_ASSIGN_OR_RETURN(auto result, FindResultLocked(job));
  if (result && !IsStored(result->details.result().mesh().sha256())) result.reset();
  if (!result) AMHEX_RETURN_IF_ERROR(CheckRoomLocked(job, max_queued));
  AMHEX_RETURN_IF_ERROR(EnrolTenantLocked(job.tenant));
  AMHEX_RETURN_IF_ERROR(InsertLocked(job, now));
  AMHEX_RETURN_IF_ERROR(GrantLocked(job.tenant.name, job.job.input(), now));
  if (result) AMHEX_RETURN_IF_ERROR(EndLocked(job.id, "state = 1", *result, now).status());
  AMHEX_ASSIGN_OR_RETURN(Job stored, GetLocked(job.id));
  AMHEX_RETURN_IF_ERROR(transaction.Commit());
  return SubmittedJob{std::move(stored), true};
}

absl::StatusOr<Job> SqliteJobStore::GetLocked(const std::string& id) {
  AMHEX_ASSIGN_OR_RETURN(auto select, database_->Prepare(std::string(kSelectJob) + "WHERE id = ?"));
  AMHEX_ASSIGN_OR_RETURN(const bool has_row, select.Text(id).Step());
  if (!has_row) return JobNotFound(id);
  return ReadJobColumns(select);
}

absl::StatusOr<Job> SqliteJobStore::Get(const std::string& id) {
  std::lock_guard<std::mutex> lock(mutex_);
  return GetLocked(id);
}

absl::StatusOr<JobPage> SqliteJobStore::List(const JobQuery& query) {
  JobPageMaker maker(&query);
  bool is_more = true;
  while (is_more) {
    std::lock_guard<std::mutex> lock(mutex_);
    AMHEX_ASSIGN_OR_RETURN(is_more, ShowRowsLocked(query, &maker));
  }
  return maker.page();
}

absl::StatusOr<bool> SqliteJobStore::ShowRowsLocked(const JobQuery& query, JobPageMaker* maker) {
  // States are compared here, so that each look at the database reads so many rows and no more.
  std::string where = "WHERE number < ?";
  if (query.tenant) where += " AND tenant = ?";
  AMHEX_ASSIGN_OR_RETURN(
      auto select, database_->Prepare(std::string(kSelectJob) + where +
                                      " ORDER BY number DESC LIMIT " + std::to_string(kListRows)));
  select.Int(maker->before());
  if (query.tenant) select.Text(*query.tenant);
  for (int row = 0; row < kListRows; ++row) {
    AMHEX_ASSIGN_OR_RETURN(const bool has_row, select.Step());
    if (!has_row || !maker->ShowRow(select)) return false;
  }
  return true;
}

absl::StatusOr<Job> SqliteJobStore::RequestCancel(const std::string& id,
                                                  const FinalOutcome& outcome, absl::Time now) {
  std::lock_guard<std::mutex> lock(mutex_);
  SqliteTransaction transaction(database_.get());
  AMHEX_RETURN_IF_ERROR(transaction.status());
  AMHEX_ASSIGN_OR_RETURN(
      auto mark,
      database_->Prepare("UPDATE job SET cancel_requested = 1 WHERE id = ? AND state IN (1, 2)"));
  AMHEX_RETURN_IF_ERROR(mark.Text(id).Run());
  AMHEX_RETURN_IF_ERROR(EndLocked(id, "state = 1", outcome, now).status());
  AMHEX_ASSIGN_OR_RETURN(Job job, GetLocked(id));
  AMHEX_RETURN_IF_ERROR(transaction.Commit());
  return job;
}

absl::Status SqliteJobStore::Delete(const std::string& id) {
  std::lock_guard<std::mutex> lock(mutex_);
  AMHEX_ASSIGN_OR_RETURN(const Job job, GetLocked(id));
  AMHEX_ASSIGN_OR_RETURN(auto remove,
                         database_->Prepare("DELETE FROM job WHERE id = ? AND state >= 3"));
  AMHEX_RETURN_IF_ERROR(remove.Text(id).Run());
  if (database_->ChangeCount() > 0) return absl::OkStatus();
  return JobNotFinal(job);
}

}  // namespace amhex::server
