#include "sqlite_job_store.h"

#include <algorithm>
#include <utility>

#include "errors.h"
#include "job_id.h"
#include "sqlite_job_rows.h"
#include "status_macros.h"
#include "time_convert.h"

namespace amhex::server {
namespace {

using amhex::v1::Job;

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

}  // namespace amhex::server
