// The side of SqliteJobStore that housekeeping uses: restarts, leases, deadlines, counts.
#include <utility>

#include "sqlite_job_rows.h"
#include "sqlite_job_store.h"
#include "status_macros.h"

namespace amhex::server {

using amhex::v1::Job;

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
