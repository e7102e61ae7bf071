// The side of SqliteJobStore that housekeeping uses: restarts, leases, deadlines, counts, and who
// owns which blob.
#include <utility>

#include "job_record.h"
#include "sqlite_job_rows.h"
#include "sqlite_job_store.h"
#include "status_macros.h"

namespace amhex::server {

using amhex::v1::Job;

absl::StatusOr<int64_t> SqliteJobStore::RequeueRunning(const std::string& node) {
  std::lock_guard<std::mutex> lock(mutex_);
  SqliteTransaction transaction(database_.get());
  AMHEX_RETURN_IF_ERROR(transaction.status());
  AMHEX_ASSIGN_OR_RETURN(
      auto end_leases,
      database_->Prepare("UPDATE job SET lease_epoch = lease_epoch + 1, lease_until = 0"
                         " WHERE state = 2 AND lease_node = ? AND cancel_requested = 1"));
  AMHEX_RETURN_IF_ERROR(end_leases.Text(node).Run());
  AMHEX_ASSIGN_OR_RETURN(
      auto update,
      database_->Prepare("UPDATE job SET state = 1, attempt = attempt - 1,"
                         " lease_epoch = lease_epoch + 1, lease_node = NULL, lease_owner = NULL,"
                         " lease_until = NULL, not_before = create_time"
                         " WHERE state = 2 AND lease_node = ? AND cancel_requested = 0"));
  AMHEX_RETURN_IF_ERROR(update.Text(node).Run());
  const int64_t count = database_->ChangeCount();
  AMHEX_RETURN_IF_ERROR(transaction.Commit());
  return count;
}

absl::StatusOr<ReapedLeases> SqliteJobStore::ReapExpiredLeases(absl::Time now) {
  std::lock_guard<std::mutex> lock(mutex_);
  SqliteTransaction transaction(database_.get());
  AMHEX_RETURN_IF_ERROR(transaction.status());
  const int64_t now_micros = absl::ToUnixMicros(now);
  std::vector<ClaimedJob> expired;
  {
    AMHEX_ASSIGN_OR_RETURN(auto select, database_->Prepare(std::string(kSelectJob) +
                                                           "WHERE state = 2 AND lease_until < ?"));
    select.Int(now_micros);
    while (true) {
      AMHEX_ASSIGN_OR_RETURN(const bool has_row, select.Step());
      if (!has_row) break;
      expired.push_back(
          {select.TextColumn(kId), select.IntColumn(kLeaseEpoch), ReadJobColumns(select)});
    }
  }
  ReapedLeases reaped;
  for (ClaimedJob& job : expired) {
    if (job.job.cancel_requested()) {
      reaped.cancelled.push_back(std::move(job));
      continue;
    }
    if (job.job.attempt_count() >= job.job.max_attempts()) {
      reaped.exhausted.push_back(std::move(job));
      continue;
    }
    AMHEX_RETURN_IF_ERROR(ChargeLocked(job.id, job.epoch, now));
    AMHEX_ASSIGN_OR_RETURN(
        auto back, database_->Prepare("UPDATE job SET state = 1, lease_node = NULL,"
                                      " lease_owner = NULL, lease_until = NULL, not_before = ?"
                                      " WHERE id = ?"));
    AMHEX_RETURN_IF_ERROR(back.Int(now_micros).Text(job.id).Run());
    reaped.requeued.push_back(job.id);
  }
  AMHEX_RETURN_IF_ERROR(transaction.Commit());
  return reaped;
}

absl::StatusOr<std::vector<std::string>> SqliteJobStore::IdsLocked(SqliteStatement* select) {
  std::vector<std::string> ids;
  while (true) {
    AMHEX_ASSIGN_OR_RETURN(const bool has_row, select->Step());
    if (!has_row) break;
    ids.push_back(select->TextColumn(0));
  }
  return ids;
}

absl::StatusOr<std::vector<std::string>> SqliteJobStore::ExpireQueued(const FinalOutcome& outcome,
                                                                      absl::Time now) {
  std::lock_guard<std::mutex> lock(mutex_);
  SqliteTransaction transaction(database_.get());
  AMHEX_RETURN_IF_ERROR(transaction.status());
  AMHEX_ASSIGN_OR_RETURN(auto select,
                         database_->Prepare("SELECT id FROM job INDEXED BY job_deadline"
                                            " WHERE state = 1 AND queue_deadline <= ?"));
  AMHEX_ASSIGN_OR_RETURN(auto ids, IdsLocked(&select.Int(absl::ToUnixMicros(now))));
  for (const std::string& id : ids) {
    AMHEX_RETURN_IF_ERROR(EndLocked(id, "state = 1", outcome, now).status());
  }
  AMHEX_RETURN_IF_ERROR(transaction.Commit());
  return ids;
}

absl::StatusOr<std::vector<std::string>> SqliteJobStore::RemoveExpired(absl::Time now) {
  std::lock_guard<std::mutex> lock(mutex_);
  AMHEX_ASSIGN_OR_RETURN(
      auto remove,
      database_->Prepare("DELETE FROM job WHERE state >= 3 AND expire_time <= ? RETURNING id"));
  return IdsLocked(&remove.Int(absl::ToUnixMicros(now)));
}

absl::StatusOr<std::vector<std::string>> SqliteJobStore::RemoveOldestFinal(int count,
                                                                           absl::Time before) {
  std::lock_guard<std::mutex> lock(mutex_);
  AMHEX_ASSIGN_OR_RETURN(
      auto remove, database_->Prepare("DELETE FROM job WHERE number IN (SELECT number FROM job"
                                      " WHERE state >= 3 AND end_time < ? ORDER BY end_time, number"
                                      " LIMIT ?) RETURNING id"));
  return IdsLocked(&remove.Int(absl::ToUnixMicros(before)).Int(count));
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
  AMHEX_ASSIGN_OR_RETURN(auto select, database_->Prepare("SELECT min(create_time) FROM job"
                                                         " INDEXED BY job_oldest WHERE state = 1"));
  AMHEX_ASSIGN_OR_RETURN(const bool has_row, select.Step());
  if (!has_row || select.IsNull(0)) return std::optional<absl::Time>();
  return std::optional<absl::Time>(absl::FromUnixMicros(select.IntColumn(0)));
}

absl::StatusOr<absl::Duration> SqliteJobStore::QueuedCost() {
  std::lock_guard<std::mutex> lock(mutex_);
  AMHEX_ASSIGN_OR_RETURN(const int64_t micros,
                         database_->QueryInt("SELECT coalesce(sum(expected_micros), 0) FROM job"
                                             " INDEXED BY job_oldest WHERE state = 1"));
  return absl::Microseconds(micros);
}

absl::Status SqliteJobStore::GrantLocked(const std::string& tenant, const amhex::v1::BlobRef& blob,
                                         absl::Time now) {
  AMHEX_ASSIGN_OR_RETURN(auto grant,
                         database_->Prepare("INSERT INTO blob_owner VALUES(?1, ?2, ?3, ?4)"
                                            " ON CONFLICT(tenant, sha256) DO UPDATE SET"
                                            " bytes = max(bytes, ?3), grant_time = ?4"));
  grant.Text(tenant).Text(blob.sha256()).Int(blob.size_bytes());
  AMHEX_RETURN_IF_ERROR(grant.Int(absl::ToUnixMicros(now)).Run());
  return IsStored(blob.sha256()) ? absl::OkStatus() : BlobMissing(blob.sha256());
}

absl::Status SqliteJobStore::GrantBlob(const std::string& tenant, const amhex::v1::BlobRef& blob,
                                       absl::Time now) {
  std::lock_guard<std::mutex> lock(mutex_);
  SqliteTransaction transaction(database_.get());
  AMHEX_RETURN_IF_ERROR(transaction.status());
  AMHEX_RETURN_IF_ERROR(GrantLocked(tenant, blob, now));
  return transaction.Commit();
}

absl::StatusOr<bool> SqliteJobStore::OwnsBlob(const std::string& tenant,
                                              const std::string& sha256) {
  std::lock_guard<std::mutex> lock(mutex_);
  AMHEX_ASSIGN_OR_RETURN(
      auto select, database_->Prepare("SELECT 1 FROM blob_owner WHERE tenant = ? AND sha256 = ?"));
  return select.Text(tenant).Text(sha256).Step();
}

absl::StatusOr<int64_t> SqliteJobStore::OwnedBytes(const std::string& tenant) {
  std::lock_guard<std::mutex> lock(mutex_);
  AMHEX_ASSIGN_OR_RETURN(
      auto select,
      database_->Prepare("SELECT coalesce(sum(bytes), 0) FROM blob_owner WHERE tenant = ?"));
  AMHEX_RETURN_IF_ERROR(select.Text(tenant).Step().status());
  return select.IntColumn(0);
}

// So many at a time that others have their turn in between.
absl::StatusOr<int64_t> SqliteJobStore::DropUnusedGrants(absl::Time before) {
  constexpr int64_t kGrantsAtOnce = 500;
  int64_t last = 0;
  int64_t dropped = 0;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    AMHEX_ASSIGN_OR_RETURN(last, database_->QueryInt("SELECT max(rowid) FROM blob_owner"));
  }
  for (int64_t first = 1; first <= last; first += kGrantsAtOnce) {
    std::lock_guard<std::mutex> lock(mutex_);
    AMHEX_ASSIGN_OR_RETURN(
        auto drop,
        database_->Prepare(
            "DELETE FROM blob_owner WHERE rowid BETWEEN ? AND ? AND grant_time < ?"
            " AND NOT EXISTS (SELECT 1 FROM job WHERE job.input_sha256 = blob_owner.sha256"
            " AND job.tenant = blob_owner.tenant)"
            " AND NOT EXISTS (SELECT 1 FROM job WHERE job.result_sha256 = blob_owner.sha256"
            " AND job.tenant = blob_owner.tenant)"));
    drop.Int(first).Int(first + kGrantsAtOnce - 1).Int(absl::ToUnixMicros(before));
    AMHEX_RETURN_IF_ERROR(drop.Run());
    dropped += database_->ChangeCount();
  }
  return dropped;
}

absl::StatusOr<bool> SqliteJobStore::CollectBlob(const std::string& sha256,
                                                 const std::function<void()>& hide) {
  std::lock_guard<std::mutex> lock(mutex_);
  AMHEX_ASSIGN_OR_RETURN(
      auto select, database_->Prepare("SELECT EXISTS (SELECT 1 FROM job WHERE input_sha256 = ?1)"
                                      " OR EXISTS (SELECT 1 FROM job WHERE result_sha256 = ?1)"
                                      " OR EXISTS (SELECT 1 FROM blob_owner WHERE sha256 = ?1)"));
  AMHEX_ASSIGN_OR_RETURN(const bool has_row, select.Text(sha256).Step());
  if (!has_row || select.IntColumn(0) != 0) return false;
  hide();
  return true;
}

}  // namespace amhex::server
