#include "sqlite_job_store.h"

#include <algorithm>
#include <utility>

#include "errors.h"
#include "job_id.h"
#include "status_macros.h"
#include "time_convert.h"

namespace amhex::server {
namespace {

using amhex::v1::Job;

// Times are microseconds since 1970. `spec` is a serialized Job with what the client sent,
// `outcome` one with stages, failed_stage and error or result.
constexpr char kSchema[] = R"sql(
CREATE TABLE IF NOT EXISTS job (
  number INTEGER PRIMARY KEY AUTOINCREMENT,
  id TEXT NOT NULL UNIQUE,
  request_id TEXT UNIQUE,
  request_hash TEXT NOT NULL,
  state INTEGER NOT NULL CHECK (state BETWEEN 1 AND 5),
  priority INTEGER NOT NULL,
  spec BLOB NOT NULL,
  outcome BLOB,
  input_sha256 TEXT NOT NULL,
  result_sha256 TEXT,
  create_time INTEGER NOT NULL,
  not_before INTEGER NOT NULL,
  queue_deadline INTEGER,
  start_time INTEGER,
  end_time INTEGER,
  expire_time INTEGER,
  ttl INTEGER NOT NULL,
  attempt INTEGER NOT NULL DEFAULT 0,
  max_attempts INTEGER NOT NULL,
  lease_epoch INTEGER NOT NULL DEFAULT 0,
  lease_owner TEXT,
  lease_until INTEGER,
  cancel_requested INTEGER NOT NULL DEFAULT 0
);
CREATE INDEX IF NOT EXISTS job_claim ON job(priority, number) WHERE state = 1;
CREATE INDEX IF NOT EXISTS job_lease ON job(lease_until) WHERE state = 2;
CREATE INDEX IF NOT EXISTS job_expire ON job(expire_time) WHERE state >= 3;
CREATE INDEX IF NOT EXISTS job_input ON job(input_sha256);
CREATE INDEX IF NOT EXISTS job_result ON job(result_sha256) WHERE result_sha256 IS NOT NULL;
CREATE TABLE IF NOT EXISTS generation (only_row INTEGER PRIMARY KEY CHECK (only_row = 1),
                                       number INTEGER NOT NULL);
INSERT OR IGNORE INTO generation VALUES (1, 0);
)sql";

constexpr int kSchemaVersion = 1;

constexpr char kSelectJob[] =
    "SELECT number, id, state, spec, outcome, create_time, start_time, end_time, expire_time,"
    " attempt, cancel_requested, lease_epoch, max_attempts FROM job ";

enum Column {
  kNumber,
  kId,
  kState,
  kSpec,
  kOutcome,
  kCreateTime,
  kStartTime,
  kEndTime,
  kExpireTime,
  kAttempt,
  kCancelRequested,
  kLeaseEpoch,
  kMaxAttempts
};

absl::Status JobNotFound(const std::string& id) {
  return MakeError(absl::StatusCode::kNotFound, amhex::v1::JOB_NOT_FOUND,
                   "no job " + JobName(id) + " exists, or it has expired");
}

absl::Status Fenced(const std::string& id) {
  return absl::AbortedError("another attempt of " + JobName(id) + " has taken over");
}

Job ReadJob(const SqliteStatement& row) {
  Job job;
  job.ParseFromString(row.TextColumn(kSpec));
  if (!row.IsNull(kOutcome)) job.MergeFromString(row.TextColumn(kOutcome));
  job.set_name(JobName(row.TextColumn(kId)));
  job.set_state(static_cast<Job::State>(row.IntColumn(kState)));
  job.set_attempt_count(static_cast<int32_t>(row.IntColumn(kAttempt)));
  job.set_max_attempts(static_cast<int32_t>(row.IntColumn(kMaxAttempts)));
  job.set_cancel_requested(row.IntColumn(kCancelRequested) != 0);
  const auto time = [&row](int column) {
    return ToProto(absl::FromUnixMicros(row.IntColumn(column)));
  };
  *job.mutable_create_time() = time(kCreateTime);
  if (!row.IsNull(kStartTime)) *job.mutable_start_time() = time(kStartTime);
  if (!row.IsNull(kEndTime)) *job.mutable_end_time() = time(kEndTime);
  if (!row.IsNull(kExpireTime)) *job.mutable_expire_time() = time(kExpireTime);
  return job;
}

std::string OutcomeBytes(const FinalOutcome& outcome) {
  Job kept;
  *kept.mutable_stages() = outcome.details.stages();
  kept.set_failed_stage(outcome.details.failed_stage());
  if (outcome.details.has_error()) *kept.mutable_error() = outcome.details.error();
  if (outcome.details.has_result()) *kept.mutable_result() = outcome.details.result();
  return kept.SerializeAsString();
}

std::string StateList(const std::vector<Job::State>& states) {
  std::string list;
  for (const Job::State state : states) {
    if (!list.empty()) list += ",";
    list += std::to_string(static_cast<int>(state));
  }
  return list;
}

bool HasLabels(const Job& job, const std::map<std::string, std::string>& labels) {
  return std::all_of(labels.begin(), labels.end(), [&job](const auto& label) {
    const auto found = job.labels().find(label.first);
    return found != job.labels().end() && found->second == label.second;
  });
}

}  // namespace

SqliteJobStore::SqliteJobStore(std::unique_ptr<SqliteDatabase> database)
    : database_(std::move(database)) {}

absl::StatusOr<std::unique_ptr<SqliteJobStore>> SqliteJobStore::Open(const std::string& path) {
  AMHEX_ASSIGN_OR_RETURN(auto database, SqliteDatabase::Open(path));
  AMHEX_RETURN_IF_ERROR(database->Execute("PRAGMA journal_mode=WAL; PRAGMA synchronous=FULL;"));
  AMHEX_ASSIGN_OR_RETURN(auto version, database->Prepare("PRAGMA user_version"));
  AMHEX_ASSIGN_OR_RETURN(const bool has_row, version.Step());
  const int64_t found = has_row ? version.IntColumn(0) : 0;
  version = SqliteStatement();
  if (found > kSchemaVersion) {
    return absl::FailedPreconditionError("the job store has version " + std::to_string(found) +
                                         ", this server knows up to " +
                                         std::to_string(kSchemaVersion));
  }
  AMHEX_RETURN_IF_ERROR(database->Execute(kSchema));
  AMHEX_RETURN_IF_ERROR(database->Execute("PRAGMA user_version=" + std::to_string(kSchemaVersion)));
  return std::unique_ptr<SqliteJobStore>(new SqliteJobStore(std::move(database)));
}

absl::StatusOr<int64_t> SqliteJobStore::NextGeneration() {
  std::lock_guard<std::mutex> lock(mutex_);
  AMHEX_RETURN_IF_ERROR(database_->Execute("UPDATE generation SET number = number + 1"));
  return CountLocked("SELECT number FROM generation");
}

absl::StatusOr<int64_t> SqliteJobStore::CountLocked(const std::string& sql) {
  AMHEX_ASSIGN_OR_RETURN(auto statement, database_->Prepare(sql));
  AMHEX_ASSIGN_OR_RETURN(const bool has_row, statement.Step());
  return has_row ? statement.IntColumn(0) : 0;
}

absl::StatusOr<std::optional<SubmittedJob>> SqliteJobStore::FindRequestLocked(const NewJob& job) {
  if (job.request_id.empty()) return std::optional<SubmittedJob>();
  AMHEX_ASSIGN_OR_RETURN(
      auto known, database_->Prepare("SELECT id, request_hash FROM job WHERE request_id = ?"));
  AMHEX_ASSIGN_OR_RETURN(const bool has_row, known.Text(job.request_id).Step());
  if (!has_row) return std::optional<SubmittedJob>();
  if (known.TextColumn(1) != job.request_hash) {
    return MakeError(absl::StatusCode::kAlreadyExists, amhex::v1::REQUEST_ID_REUSED,
                     "request_id " + job.request_id + " was used for a different request");
  }
  AMHEX_ASSIGN_OR_RETURN(Job existing, GetLocked(known.TextColumn(0)));
  return std::optional<SubmittedJob>(SubmittedJob{std::move(existing), false});
}

absl::StatusOr<SubmittedJob> SqliteJobStore::Submit(const NewJob& job, int64_t max_queued,
                                                    absl::Time now) {
  std::lock_guard<std::mutex> lock(mutex_);
  SqliteTransaction transaction(database_.get());
  AMHEX_RETURN_IF_ERROR(transaction.status());
  AMHEX_ASSIGN_OR_RETURN(auto known, FindRequestLocked(job));
  if (known) return *known;
  AMHEX_ASSIGN_OR_RETURN(const int64_t queued,
                         CountLocked("SELECT count(*) FROM job WHERE state = 1"));
  if (queued >= max_queued) {
    return WithRetryDelay(MakeError(absl::StatusCode::kResourceExhausted, amhex::v1::QUEUE_FULL,
                                    std::to_string(queued) + " jobs wait, which is the limit"),
                          absl::Seconds(5));
  }
  AMHEX_ASSIGN_OR_RETURN(
      auto insert,
      database_->Prepare("INSERT INTO job(id, request_id, request_hash, state, priority, spec,"
                         " input_sha256, create_time, not_before, queue_deadline, ttl,"
                         " max_attempts) VALUES(?,?,?,1,?,?,?,?,?,?,?,?)"));
  const int64_t create_time = absl::ToUnixMicros(now);
  insert.Text(job.id);
  job.request_id.empty() ? insert.Null() : insert.Text(job.request_id);
  insert.Text(job.request_hash).Int(job.job.priority()).Blob(job.job.SerializeAsString());
  insert.Text(job.job.input().sha256()).Int(create_time).Int(create_time);
  job.job.has_queue_timeout()
      ? insert.Int(absl::ToUnixMicros(now + FromProto(job.job.queue_timeout())))
      : insert.Null();
  insert.Int(absl::ToInt64Microseconds(job.ttl)).Int(job.job.max_attempts());
  AMHEX_RETURN_IF_ERROR(insert.Run());
  AMHEX_ASSIGN_OR_RETURN(Job stored, GetLocked(job.id));
  AMHEX_RETURN_IF_ERROR(transaction.Commit());
  return SubmittedJob{std::move(stored), true};
}

absl::StatusOr<Job> SqliteJobStore::GetLocked(const std::string& id) {
  AMHEX_ASSIGN_OR_RETURN(auto select, database_->Prepare(std::string(kSelectJob) + "WHERE id = ?"));
  AMHEX_ASSIGN_OR_RETURN(const bool has_row, select.Text(id).Step());
  if (!has_row) return JobNotFound(id);
  return ReadJob(select);
}

absl::StatusOr<Job> SqliteJobStore::Get(const std::string& id) {
  std::lock_guard<std::mutex> lock(mutex_);
  return GetLocked(id);
}

absl::StatusOr<JobPage> SqliteJobStore::List(const JobQuery& query) {
  std::lock_guard<std::mutex> lock(mutex_);
  std::string where = "WHERE (? = 0 OR number < ?)";
  if (!query.states.empty()) where += " AND state IN (" + StateList(query.states) + ")";
  AMHEX_ASSIGN_OR_RETURN(
      auto select, database_->Prepare(std::string(kSelectJob) + where + " ORDER BY number DESC"));
  select.Int(query.before_number).Int(query.before_number);
  JobPage page;
  int64_t last_number = 0;
  while (true) {
    AMHEX_ASSIGN_OR_RETURN(const bool has_row, select.Step());
    if (!has_row) break;
    Job job = ReadJob(select);
    if (!HasLabels(job, query.labels)) continue;
    if (static_cast<int>(page.jobs.size()) == query.page_size) {
      page.next_before_number = last_number;
      break;
    }
    last_number = select.IntColumn(kNumber);
    page.jobs.push_back(std::move(job));
  }
  return page;
}

absl::StatusOr<std::optional<ClaimedJob>> SqliteJobStore::Claim(const std::string& worker,
                                                                absl::Time now,
                                                                absl::Duration lease) {
  std::lock_guard<std::mutex> lock(mutex_);
  SqliteTransaction transaction(database_.get());
  AMHEX_RETURN_IF_ERROR(transaction.status());
  const int64_t now_micros = absl::ToUnixMicros(now);
  AMHEX_ASSIGN_OR_RETURN(
      auto next, database_->Prepare("SELECT id, lease_epoch FROM job WHERE state = 1 AND"
                                    " not_before <= ? AND (queue_deadline IS NULL OR"
                                    " queue_deadline > ?) ORDER BY priority, number LIMIT 1"));
  AMHEX_ASSIGN_OR_RETURN(const bool has_row, next.Int(now_micros).Int(now_micros).Step());
  if (!has_row) return std::optional<ClaimedJob>();
  ClaimedJob claimed;
  claimed.id = next.TextColumn(0);
  claimed.epoch = next.IntColumn(1) + 1;
  AMHEX_ASSIGN_OR_RETURN(
      auto update,
      database_->Prepare("UPDATE job SET state = 2, attempt = attempt + 1, lease_epoch = ?,"
                         " lease_owner = ?, lease_until = ?, start_time = ? WHERE id = ?"));
  update.Int(claimed.epoch).Text(worker).Int(absl::ToUnixMicros(now + lease));
  AMHEX_RETURN_IF_ERROR(update.Int(now_micros).Text(claimed.id).Run());
  AMHEX_ASSIGN_OR_RETURN(claimed.job, GetLocked(claimed.id));
  AMHEX_RETURN_IF_ERROR(transaction.Commit());
  return std::optional<ClaimedJob>(std::move(claimed));
}

absl::StatusOr<bool> SqliteJobStore::Heartbeat(const std::string& id, int64_t epoch, absl::Time now,
                                               absl::Duration lease) {
  std::lock_guard<std::mutex> lock(mutex_);
  AMHEX_ASSIGN_OR_RETURN(
      auto update, database_->Prepare("UPDATE job SET lease_until = ? WHERE id = ? AND state = 2"
                                      " AND lease_epoch = ? RETURNING cancel_requested"));
  update.Int(absl::ToUnixMicros(now + lease)).Text(id).Int(epoch);
  AMHEX_ASSIGN_OR_RETURN(const bool has_row, update.Step());
  if (!has_row) return Fenced(id);
  const bool cancel = update.IntColumn(0) != 0;
  AMHEX_RETURN_IF_ERROR(update.Step().status());
  return cancel;
}

absl::StatusOr<bool> SqliteJobStore::EndLocked(const std::string& id, const std::string& condition,
                                               const FinalOutcome& outcome, absl::Time now) {
  AMHEX_ASSIGN_OR_RETURN(
      auto update,
      database_->Prepare("UPDATE job SET state = ?, outcome = ?, result_sha256 = ?, end_time = ?,"
                         " expire_time = ? + ttl, lease_owner = NULL, lease_until = NULL"
                         " WHERE id = ? AND " +
                         condition));
  update.Int(outcome.state).Blob(OutcomeBytes(outcome));
  outcome.details.has_result() ? update.Text(outcome.details.result().mesh().sha256())
                               : update.Null();
  const int64_t now_micros = absl::ToUnixMicros(now);
  AMHEX_RETURN_IF_ERROR(update.Int(now_micros).Int(now_micros).Text(id).Run());
  return database_->ChangeCount() > 0;
}

absl::Status SqliteJobStore::Finish(const std::string& id, int64_t epoch,
                                    const FinalOutcome& outcome, absl::Time now) {
  std::lock_guard<std::mutex> lock(mutex_);
  AMHEX_ASSIGN_OR_RETURN(
      const bool changed,
      EndLocked(id, "state = 2 AND lease_epoch = " + std::to_string(epoch), outcome, now));
  return changed ? absl::OkStatus() : Fenced(id);
}

absl::Status SqliteJobStore::Release(const std::string& id, int64_t epoch, ReleaseMode mode,
                                     absl::Time not_before) {
  std::lock_guard<std::mutex> lock(mutex_);
  AMHEX_ASSIGN_OR_RETURN(
      auto update,
      database_->Prepare("UPDATE job SET state = 1, attempt = attempt - ?, not_before = ?,"
                         " lease_owner = NULL, lease_until = NULL"
                         " WHERE id = ? AND state = 2 AND lease_epoch = ?"));
  update.Int(mode == ReleaseMode::kGiveAttemptBack ? 1 : 0).Int(absl::ToUnixMicros(not_before));
  AMHEX_RETURN_IF_ERROR(update.Text(id).Int(epoch).Run());
  return database_->ChangeCount() > 0 ? absl::OkStatus() : Fenced(id);
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
  return MakeError(absl::StatusCode::kFailedPrecondition, amhex::v1::JOB_NOT_FINAL,
                   JobName(id) + " is " + Job::State_Name(job.state()) + "; cancel it first");
}

absl::StatusOr<int64_t> SqliteJobStore::RequeueRunning() {
  std::lock_guard<std::mutex> lock(mutex_);
  AMHEX_RETURN_IF_ERROR(
      database_->Execute("UPDATE job SET state = 1, attempt = attempt - 1,"
                         " lease_epoch = lease_epoch + 1, lease_owner = NULL,"
                         " lease_until = NULL, not_before = create_time WHERE state = 2"));
  return database_->ChangeCount();
}

absl::StatusOr<std::vector<ClaimedJob>> SqliteJobStore::ReapExpiredLeases(absl::Time now) {
  std::lock_guard<std::mutex> lock(mutex_);
  SqliteTransaction transaction(database_.get());
  AMHEX_RETURN_IF_ERROR(transaction.status());
  const int64_t now_micros = absl::ToUnixMicros(now);
  AMHEX_ASSIGN_OR_RETURN(
      auto back,
      database_->Prepare("UPDATE job SET state = 1, lease_owner = NULL, lease_until = NULL,"
                         " not_before = ? WHERE state = 2 AND lease_until < ?"
                         " AND attempt < max_attempts"));
  AMHEX_RETURN_IF_ERROR(back.Int(now_micros).Int(now_micros).Run());
  AMHEX_ASSIGN_OR_RETURN(auto spent, database_->Prepare(std::string(kSelectJob) +
                                                        "WHERE state = 2 AND lease_until < ?"));
  spent.Int(now_micros);
  std::vector<ClaimedJob> exhausted;
  while (true) {
    AMHEX_ASSIGN_OR_RETURN(const bool has_row, spent.Step());
    if (!has_row) break;
    exhausted.push_back({spent.TextColumn(kId), spent.IntColumn(kLeaseEpoch), ReadJob(spent)});
  }
  AMHEX_RETURN_IF_ERROR(transaction.Commit());
  return exhausted;
}

absl::StatusOr<std::vector<std::string>> SqliteJobStore::IdsLocked(const std::string& sql,
                                                                   absl::Time now) {
  AMHEX_ASSIGN_OR_RETURN(auto select, database_->Prepare(sql));
  select.Int(absl::ToUnixMicros(now));
  std::vector<std::string> ids;
  while (true) {
    AMHEX_ASSIGN_OR_RETURN(const bool has_row, select.Step());
    if (!has_row) break;
    ids.push_back(select.TextColumn(0));
  }
  return ids;
}

absl::StatusOr<std::vector<std::string>> SqliteJobStore::ExpireQueued(const FinalOutcome& outcome,
                                                                      absl::Time now) {
  std::lock_guard<std::mutex> lock(mutex_);
  AMHEX_ASSIGN_OR_RETURN(
      auto ids, IdsLocked("SELECT id FROM job WHERE state = 1 AND queue_deadline <= ?", now));
  for (const std::string& id : ids) {
    AMHEX_RETURN_IF_ERROR(EndLocked(id, "state = 1", outcome, now).status());
  }
  return ids;
}

absl::StatusOr<std::vector<std::string>> SqliteJobStore::RemoveExpired(absl::Time now) {
  std::lock_guard<std::mutex> lock(mutex_);
  AMHEX_ASSIGN_OR_RETURN(
      auto ids, IdsLocked("SELECT id FROM job WHERE state >= 3 AND expire_time <= ?", now));
  if (ids.empty()) return ids;
  AMHEX_ASSIGN_OR_RETURN(
      auto remove, database_->Prepare("DELETE FROM job WHERE state >= 3 AND expire_time <= ?"));
  AMHEX_RETURN_IF_ERROR(remove.Int(absl::ToUnixMicros(now)).Run());
  return ids;
}

absl::StatusOr<std::map<Job::State, int64_t>> SqliteJobStore::CountByState() {
  std::lock_guard<std::mutex> lock(mutex_);
  AMHEX_ASSIGN_OR_RETURN(auto select,
                         database_->Prepare("SELECT state, count(*) FROM job GROUP BY state"));
  std::map<Job::State, int64_t> counts;
  while (true) {
    AMHEX_ASSIGN_OR_RETURN(const bool has_row, select.Step());
    if (!has_row) break;
    counts[static_cast<Job::State>(select.IntColumn(0))] = select.IntColumn(1);
  }
  return counts;
}

absl::StatusOr<std::optional<absl::Time>> SqliteJobStore::OldestQueued() {
  std::lock_guard<std::mutex> lock(mutex_);
  AMHEX_ASSIGN_OR_RETURN(auto select,
                         database_->Prepare("SELECT min(create_time) FROM job WHERE state = 1"));
  AMHEX_ASSIGN_OR_RETURN(const bool has_row, select.Step());
  if (!has_row || select.IsNull(0)) return std::optional<absl::Time>();
  return std::optional<absl::Time>(absl::FromUnixMicros(select.IntColumn(0)));
}

absl::StatusOr<bool> SqliteJobStore::IsBlobUsed(const std::string& sha256) {
  std::lock_guard<std::mutex> lock(mutex_);
  AMHEX_ASSIGN_OR_RETURN(
      auto select, database_->Prepare("SELECT EXISTS (SELECT 1 FROM job WHERE input_sha256 = ?1)"
                                      " OR EXISTS (SELECT 1 FROM job WHERE result_sha256 = ?1)"));
  AMHEX_ASSIGN_OR_RETURN(const bool has_row, select.Text(sha256).Step());
  return has_row && select.IntColumn(0) != 0;
}

}  // namespace amhex::server
