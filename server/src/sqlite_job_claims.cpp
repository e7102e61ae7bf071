// The side of SqliteJobStore that workers use: whose turn it is, leases, and how attempts end.
#include <algorithm>
#include <utility>

#include "sqlite_job_rows.h"
#include "sqlite_job_store.h"
#include "status_macros.h"

namespace amhex::server {

using amhex::v1::Job;

// Tenants with queued jobs that may run one more, the one that has had the least first. An attempt
// under way counts with its time so far and a second on top, so that several workers that ask at
// once serve several tenants.
absl::StatusOr<std::vector<std::string>> SqliteJobStore::TenantsByShareLocked(absl::Time now) {
  AMHEX_ASSIGN_OR_RETURN(
      auto select, database_->Prepare(
                       "SELECT name FROM tenant LEFT JOIN (SELECT tenant, count(*) AS running,"
                       " sum(max(?1 - start_time, 0) + 1000000) AS elapsed FROM job WHERE state = 2"
                       " GROUP BY tenant) AS busy ON busy.tenant = name"
                       " WHERE (max_running = 0 OR coalesce(running, 0) < max_running)"
                       " AND EXISTS (SELECT 1 FROM job INDEXED BY job_claim WHERE job.tenant = name"
                       " AND state = 1)"
                       " ORDER BY served + coalesce(elapsed, 0) / weight, name"));
  select.Int(absl::ToUnixMicros(now));
  return IdsLocked(&select);
}

absl::StatusOr<std::optional<SqliteJobStore::Candidate>> SqliteJobStore::NextOfTenantLocked(
    const std::string& tenant, int64_t memory_bytes, absl::Time now) {
  AMHEX_ASSIGN_OR_RETURN(
      auto next,
      database_->Prepare(
          "SELECT id, lease_epoch, memory_bytes, max(create_time, not_before) FROM job AS next"
          " WHERE tenant = ?1 AND state = 1 AND (not_before <= ?2 OR not_before > ?4)"
          " AND (queue_deadline IS NULL OR queue_deadline > ?2) AND memory_bytes <= ?3"
          " AND (cache_key IS NULL OR NOT EXISTS (SELECT 1 FROM job AS twin WHERE"
          " twin.tenant = ?1 AND twin.cache_key = next.cache_key AND twin.state = 2))"
          " ORDER BY queue_key, number LIMIT 1"));
  next.Text(tenant).Int(absl::ToUnixMicros(now)).Int(memory_bytes);
  next.Int(absl::ToUnixMicros(now + kLongestDelay));
  AMHEX_ASSIGN_OR_RETURN(const bool has_row, next.Step());
  if (!has_row) return std::optional<Candidate>();
  return std::optional<Candidate>({next.TextColumn(0), next.IntColumn(1), next.IntColumn(2),
                                   absl::FromUnixMicros(next.IntColumn(3))});
}

absl::StatusOr<std::optional<SqliteJobStore::Candidate>> SqliteJobStore::ChooseLocked(
    const Claimant& claimant, absl::Time now) {
  AMHEX_ASSIGN_OR_RETURN(const auto tenants, TenantsByShareLocked(now));
  for (const std::string& tenant : tenants) {
    AMHEX_ASSIGN_OR_RETURN(const auto head,
                           NextOfTenantLocked(tenant, claimant.total_memory_bytes, now));
    if (!head) continue;
    if (head->memory_bytes <= claimant.free_memory_bytes) return head;
    // It has been overtaken for long enough: what becomes free is kept for it.
    if (now - head->ready_time > claimant.max_overtaking) return std::optional<Candidate>();
    AMHEX_ASSIGN_OR_RETURN(const auto smaller,
                           NextOfTenantLocked(tenant, claimant.free_memory_bytes, now));
    if (smaller) return smaller;
  }
  return std::optional<Candidate>();
}

absl::StatusOr<std::optional<ClaimedJob>> SqliteJobStore::Claim(const Claimant& claimant,
                                                                absl::Time now) {
  std::lock_guard<std::mutex> lock(mutex_);
  SqliteTransaction transaction(database_.get());
  AMHEX_RETURN_IF_ERROR(transaction.status());
  AMHEX_ASSIGN_OR_RETURN(const auto chosen, ChooseLocked(claimant, now));
  if (!chosen) return std::optional<ClaimedJob>();
  ClaimedJob claimed;
  claimed.id = chosen->id;
  claimed.epoch = chosen->epoch + 1;
  AMHEX_ASSIGN_OR_RETURN(
      auto update,
      database_->Prepare("UPDATE job SET state = 2, attempt = attempt + 1, lease_epoch = ?,"
                         " lease_node = ?, lease_owner = ?, lease_until = ?, start_time = ?"
                         " WHERE id = ?"));
  update.Int(claimed.epoch).Text(claimant.node).Text(claimant.worker);
  update.Int(absl::ToUnixMicros(now + claimant.lease)).Int(absl::ToUnixMicros(now));
  AMHEX_RETURN_IF_ERROR(update.Text(claimed.id).Run());
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

absl::Status SqliteJobStore::ChargeLocked(const std::string& id, int64_t epoch, absl::Time now) {
  AMHEX_ASSIGN_OR_RETURN(
      auto charge,
      database_->Prepare("UPDATE tenant SET served = served + (SELECT max(?1 - start_time, 0)"
                         " FROM job WHERE id = ?2) / weight WHERE name = (SELECT tenant FROM job"
                         " WHERE id = ?2 AND state = 2 AND lease_epoch = ?3)"));
  return charge.Int(absl::ToUnixMicros(now)).Text(id).Int(epoch).Run();
}

absl::StatusOr<bool> SqliteJobStore::EndLocked(const std::string& id, const std::string& condition,
                                               const FinalOutcome& outcome, absl::Time now) {
  AMHEX_ASSIGN_OR_RETURN(
      auto update,
      database_->Prepare("UPDATE job SET state = ?, outcome = ?, result_sha256 = ?, end_time = ?,"
                         " expire_time = ? + ttl, lease_node = NULL, lease_owner = NULL,"
                         " lease_until = NULL WHERE id = ? AND " +
                         condition));
  update.Int(outcome.state).Blob(OutcomeBytes(outcome));
  outcome.details.has_result() ? update.Text(outcome.details.result().mesh().sha256())
                               : update.Null();
  const int64_t now_micros = absl::ToUnixMicros(now);
  AMHEX_RETURN_IF_ERROR(update.Int(now_micros).Int(now_micros).Text(id).Run());
  return database_->ChangeCount() > 0;
}

// Queued jobs that wait for the result of `id`, which has just succeeded.
absl::StatusOr<std::vector<std::string>> SqliteJobStore::EndTwinsLocked(const std::string& id,
                                                                        const FinalOutcome& outcome,
                                                                        absl::Time now) {
  AMHEX_ASSIGN_OR_RETURN(
      auto select,
      database_->Prepare("SELECT twin.id FROM job JOIN job AS twin ON twin.tenant = job.tenant AND"
                         " twin.cache_key = job.cache_key AND twin.state = 1 WHERE job.id = ?"));
  AMHEX_ASSIGN_OR_RETURN(auto twins, IdsLocked(&select.Text(id)));
  const FinalOutcome shared = SharedOutcome(outcome.details);
  for (const std::string& twin : twins) {
    AMHEX_RETURN_IF_ERROR(EndLocked(twin, "state = 1", shared, now).status());
  }
  return twins;
}

absl::StatusOr<std::vector<std::string>> SqliteJobStore::Finish(const std::string& id,
                                                                int64_t epoch,
                                                                const FinalOutcome& outcome,
                                                                absl::Time now) {
  std::lock_guard<std::mutex> lock(mutex_);
  SqliteTransaction transaction(database_.get());
  AMHEX_RETURN_IF_ERROR(transaction.status());
  const std::string held = "state = 2 AND lease_epoch = " + std::to_string(epoch);
  AMHEX_RETURN_IF_ERROR(ChargeLocked(id, epoch, now));
  AMHEX_ASSIGN_OR_RETURN(const bool changed, EndLocked(id, held, outcome, now));
  if (!changed) return Fenced(id);
  std::vector<std::string> twins;
  if (outcome.state == Job::SUCCEEDED) {
    AMHEX_ASSIGN_OR_RETURN(const Job job, GetLocked(id));
    AMHEX_RETURN_IF_ERROR(GrantLocked(job.tenant(), outcome.details.result().mesh(), now));
    AMHEX_ASSIGN_OR_RETURN(twins, EndTwinsLocked(id, outcome, now));
  }
  AMHEX_RETURN_IF_ERROR(transaction.Commit());
  return twins;
}

absl::Status SqliteJobStore::Release(const std::string& id, int64_t epoch, ReleaseMode mode,
                                     absl::Time now, absl::Time not_before) {
  std::lock_guard<std::mutex> lock(mutex_);
  SqliteTransaction transaction(database_.get());
  AMHEX_RETURN_IF_ERROR(transaction.status());
  AMHEX_ASSIGN_OR_RETURN(const bool is_cancelled, CheckHeldLocked(id, epoch));
  if (is_cancelled) return CancelRequested(id);
  AMHEX_RETURN_IF_ERROR(ChargeLocked(id, epoch, now));
  AMHEX_ASSIGN_OR_RETURN(
      auto update,
      database_->Prepare("UPDATE job SET state = 1, attempt = attempt - ?, not_before = ?,"
                         " lease_node = NULL, lease_owner = NULL, lease_until = NULL"
                         " WHERE id = ?"));
  update.Int(mode == ReleaseMode::kGiveAttemptBack ? 1 : 0).Int(absl::ToUnixMicros(not_before));
  AMHEX_RETURN_IF_ERROR(update.Text(id).Run());
  return transaction.Commit();
}

absl::StatusOr<bool> SqliteJobStore::CheckHeldLocked(const std::string& id, int64_t epoch) {
  AMHEX_ASSIGN_OR_RETURN(auto select,
                         database_->Prepare("SELECT cancel_requested FROM job WHERE id = ?"
                                            " AND state = 2 AND lease_epoch = ?"));
  AMHEX_ASSIGN_OR_RETURN(const bool has_row, select.Text(id).Int(epoch).Step());
  if (!has_row) return Fenced(id);
  return select.IntColumn(0) != 0;
}

}  // namespace amhex::server
