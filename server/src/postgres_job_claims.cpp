// The side of PostgresJobStore that workers use: whose turn it is, leases, and how attempts end.
#include <utility>

#include "job_record.h"
#include "postgres_job_rows.h"
#include "postgres_job_store.h"
#include "status_macros.h"

namespace amhex::server {

using amhex::v1::Job;

// Tenants with queued jobs that may run one more, the one that has had the least first. An attempt
// under way counts with its time so far and a second on top, so that several workers that ask at
// once serve several tenants.
absl::StatusOr<std::vector<PostgresJobStore::Share>> PostgresJobStore::TenantsByShare(
    PostgresConnection& db, int64_t now) {
  AMHEX_ASSIGN_OR_RETURN(
      auto rows,
      db.Run("SELECT name, max_running FROM tenant LEFT JOIN (SELECT tenant, count(*) AS running,"
             " sum(greatest($1::bigint - start_time, 0) + 1000000) AS elapsed FROM job"
             " WHERE state = 2 GROUP BY tenant) AS busy ON busy.tenant = name"
             " WHERE (max_running = 0 OR coalesce(running, 0) < max_running)"
             " AND EXISTS (SELECT 1 FROM job WHERE job.tenant = name AND state = 1)"
             " ORDER BY served + div(coalesce(elapsed, 0), weight), name",
             PostgresValues().Int(now)));
  std::vector<Share> shares;
  while (rows.Next()) shares.push_back({rows.TextColumn(0), rows.IntColumn(1)});
  return shares;
}

// Locks the job, and skips those that another claim has locked. Where the tenant may run only so
// many jobs, its claims go one by one.
absl::StatusOr<std::optional<PostgresJobStore::Candidate>> PostgresJobStore::NextOfTenant(
    PostgresConnection& db, const Share& share, int64_t memory_bytes, int64_t now) {
  if (share.max_running > 0) {
    AMHEX_RETURN_IF_ERROR(db.Run("SELECT pg_advisory_xact_lock(hashtextextended($1, 0))",
                                 PostgresValues().Text(share.tenant))
                              .status());
    AMHEX_ASSIGN_OR_RETURN(auto running,
                           db.Run("SELECT count(*) FROM job WHERE tenant = $1 AND state = 2",
                                  PostgresValues().Text(share.tenant)));
    if (running.Next() && running.IntColumn(0) >= share.max_running) {
      return std::optional<Candidate>();
    }
  }
  AMHEX_ASSIGN_OR_RETURN(
      auto next,
      db.Run("SELECT id, memory_bytes, greatest(create_time, not_before) FROM job AS next"
             " WHERE tenant = $1 AND state = 1 AND (not_before <= $2 OR not_before > $4)"
             " AND (queue_deadline IS NULL OR queue_deadline > $2) AND memory_bytes <= $3"
             " AND (cache_key IS NULL OR NOT EXISTS (SELECT 1 FROM job AS twin WHERE"
             " twin.tenant = $1 AND twin.cache_key = next.cache_key AND twin.state = 2))"
             " ORDER BY queue_key, number LIMIT 1 FOR UPDATE SKIP LOCKED",
             PostgresValues()
                 .Text(share.tenant)
                 .Int(now)
                 .Int(memory_bytes)
                 .Int(now + absl::ToInt64Microseconds(kLongestDelay))));
  if (!next.Next()) return std::optional<Candidate>();
  return std::optional<Candidate>(
      {next.TextColumn(0), share.tenant, next.IntColumn(1), next.IntColumn(2)});
}

absl::StatusOr<std::optional<PostgresJobStore::Candidate>> PostgresJobStore::Choose(
    PostgresConnection& db, const Claimant& claimant, int64_t now) {
  AMHEX_ASSIGN_OR_RETURN(const auto shares, TenantsByShare(db, now));
  for (const Share& share : shares) {
    AMHEX_ASSIGN_OR_RETURN(const auto head,
                           NextOfTenant(db, share, claimant.total_memory_bytes, now));
    if (!head) continue;
    if (head->memory_bytes <= claimant.free_memory_bytes) return head;
    // It has been overtaken for long enough: what becomes free is kept for it.
    if (now - head->ready_time > absl::ToInt64Microseconds(claimant.max_overtaking)) {
      return std::optional<Candidate>();
    }
    AMHEX_ASSIGN_OR_RETURN(const auto smaller,
                           NextOfTenant(db, share, claimant.free_memory_bytes, now));
    if (smaller) return smaller;
  }
  return std::optional<Candidate>();
}

absl::StatusOr<std::optional<ClaimedJob>> PostgresJobStore::ClaimOn(PostgresConnection& db,
                                                                    const Claimant& claimant,
                                                                    int64_t now) {
  AMHEX_ASSIGN_OR_RETURN(const auto chosen, Choose(db, claimant, now));
  if (!chosen) return std::optional<ClaimedJob>();
  AMHEX_ASSIGN_OR_RETURN(
      auto claimed,
      db.Run("UPDATE job SET state = 2, attempt = attempt + 1, lease_epoch = lease_epoch + 1,"
             " start_time = $1 WHERE id = $2 RETURNING lease_epoch",
             PostgresValues().Int(now).Text(chosen->id)));
  if (!claimed.Next()) return std::optional<ClaimedJob>();
  PostgresValues lease;
  lease.Text(chosen->id).Int(claimed.IntColumn(0)).Text(claimant.node).Text(claimant.worker);
  lease.Text(options_.address).Int(now + absl::ToInt64Microseconds(claimant.lease));
  AMHEX_RETURN_IF_ERROR(
      db.Run("INSERT INTO lease VALUES ($1, $2, $3, $4, $5, $6)", lease).status());
  AMHEX_ASSIGN_OR_RETURN(Job job, GetJob(db, chosen->id));
  return std::optional<ClaimedJob>({chosen->id, claimed.IntColumn(0), std::move(job)});
}

absl::StatusOr<std::optional<ClaimedJob>> PostgresJobStore::FindClaim(PostgresConnection& db,
                                                                      const Claimant& claimant) {
  AMHEX_ASSIGN_OR_RETURN(
      auto rows,
      db.Run(std::string(kSelectJob) + "WHERE id IN (SELECT job_id FROM lease WHERE node = $1"
                                       " AND worker = $2) AND state = 2 LIMIT 1",
             PostgresValues().Text(claimant.node).Text(claimant.worker)));
  if (!rows.Next()) return std::optional<ClaimedJob>();
  PostgresJob found = ReadJob(rows);
  return std::optional<ClaimedJob>({found.id, found.epoch, std::move(found.job)});
}

// A worker asks for a job only when it has none. If its last claim was in doubt, what it holds
// according to the database is what that claim has taken.
absl::StatusOr<std::optional<ClaimedJob>> PostgresJobStore::Claim(const Claimant& claimant,
                                                                  absl::Time now) {
  const std::string who = claimant.node + "/" + claimant.worker;
  bool in_doubt = false;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    in_doubt = doubtful_claimants_.count(who) > 0;
  }
  std::optional<ClaimedJob> claimed;
  const absl::Status status = pool_.TransactOnce([&](PostgresConnection& db) -> absl::Status {
    claimed.reset();
    if (in_doubt) {
      AMHEX_ASSIGN_OR_RETURN(claimed, FindClaim(db, claimant));
      if (claimed) return absl::OkStatus();
    }
    AMHEX_ASSIGN_OR_RETURN(claimed, ClaimOn(db, claimant, Micros(now)));
    return absl::OkStatus();
  });
  if (absl::IsUnavailable(status) != in_doubt) {
    std::lock_guard<std::mutex> lock(mutex_);
    in_doubt ? void(doubtful_claimants_.erase(who)) : void(doubtful_claimants_.insert(who));
  }
  if (!status.ok()) return status;
  if (claimed) Announce({claimed->id});
  return claimed;
}

absl::StatusOr<bool> PostgresJobStore::Heartbeat(const std::string& id, int64_t epoch,
                                                 absl::Time now, absl::Duration lease) {
  bool cancel = false;
  const absl::Status status = pool_.Transact([&](PostgresConnection& db) -> absl::Status {
    AMHEX_ASSIGN_OR_RETURN(
        auto kept, db.Run("UPDATE lease SET until = $1 FROM job WHERE job_id = $2 AND epoch = $3"
                          " AND id = job_id RETURNING cancel_requested",
                          PostgresValues().Int(Micros(now + lease)).Text(id).Int(epoch)));
    if (!kept.Next()) return Fenced(id);
    cancel = kept.IntColumn(0) != 0;
    return absl::OkStatus();
  });
  if (!status.ok()) return status;
  return cancel;
}

void PostgresJobStore::ChargeTenants(const std::vector<Charge>& charges) {
  for (const Charge& charge : charges) {
    if (charge.micros <= 0) continue;
    quick_pool_
        .TransactOnce([&charge](PostgresConnection& db) {
          return db
              .Run("UPDATE tenant SET served = served + $1::bigint / weight WHERE name = $2",
                   PostgresValues().Int(charge.micros).Text(charge.tenant))
              .status();
        })
        .IgnoreError();
  }
}

absl::StatusOr<std::optional<PostgresJobStore::Charge>> PostgresJobStore::End(
    PostgresConnection& db, const std::string& id, const std::string& condition,
    const FinalOutcome& outcome, int64_t now) {
  PostgresValues values;
  values.Int(outcome.state).Bytes(OutcomeBytes(outcome));
  outcome.details.has_result() ? values.Text(outcome.details.result().mesh().sha256())
                               : values.Null();
  values.Int(now).Text(id);
  AMHEX_ASSIGN_OR_RETURN(
      auto ended, db.Run("UPDATE job SET state = $1, outcome = $2, result_sha256 = $3,"
                         " end_time = $4::bigint, expire_time = $4::bigint + ttl WHERE id = $5"
                         " AND " +
                             condition + " RETURNING tenant, $4::bigint - start_time",
                         values));
  if (!ended.Next()) return std::optional<Charge>();
  return std::optional<Charge>({ended.TextColumn(0), ended.IsNull(1) ? 0 : ended.IntColumn(1)});
}

// Queued jobs that wait for the result of `id`, which has just succeeded.
absl::StatusOr<std::vector<std::string>> PostgresJobStore::EndTwins(PostgresConnection& db,
                                                                    const std::string& id,
                                                                    const FinalOutcome& outcome,
                                                                    int64_t now) {
  AMHEX_ASSIGN_OR_RETURN(
      auto rows, db.Run("SELECT twin.id FROM job JOIN job AS twin ON twin.tenant = job.tenant AND"
                        " twin.cache_key = job.cache_key AND twin.state = 1 WHERE job.id = $1"
                        " ORDER BY twin.number",
                        PostgresValues().Text(id)));
  std::vector<std::string> twins;
  while (rows.Next()) {
    AMHEX_ASSIGN_OR_RETURN(const auto ended, End(db, rows.TextColumn(0), "state = 1",
                                                 SharedOutcome(outcome.details), now));
    if (ended) twins.push_back(rows.TextColumn(0));
  }
  return twins;
}

absl::StatusOr<std::vector<std::string>> PostgresJobStore::Finish(const std::string& id,
                                                                  int64_t epoch,
                                                                  const FinalOutcome& outcome,
                                                                  absl::Time now) {
  std::vector<std::string> twins;
  std::vector<Charge> charges;
  bool is_repetition = false;
  const absl::Status status = pool_.Transact([&](PostgresConnection& db) -> absl::Status {
    const bool may_be_done = std::exchange(is_repetition, true);
    charges.clear();
    AMHEX_RETURN_IF_ERROR(db.Run("DELETE FROM lease WHERE job_id = $1 AND epoch = $2",
                                 PostgresValues().Text(id).Int(epoch))
                              .status());
    const std::string held = "state = 2 AND lease_epoch = " + std::to_string(epoch);
    AMHEX_ASSIGN_OR_RETURN(const auto charge, End(db, id, held, outcome, Micros(now)));
    if (!charge) return may_be_done ? CheckFinished(db, id, epoch, outcome) : Fenced(id);
    charges.push_back(*charge);
    if (outcome.state != Job::SUCCEEDED) return absl::OkStatus();
    AMHEX_RETURN_IF_ERROR(Grant(db, charge->tenant, outcome.details.result().mesh(), Micros(now)));
    AMHEX_ASSIGN_OR_RETURN(twins, EndTwins(db, id, outcome, Micros(now)));
    return absl::OkStatus();
  });
  if (!status.ok()) return status;
  ChargeTenants(charges);
  std::vector<std::string> changed = twins;
  changed.push_back(id);
  Announce(changed);
  return twins;
}

// OK if the attempt has ended with this very outcome.
absl::Status PostgresJobStore::CheckFinished(PostgresConnection& db, const std::string& id,
                                             int64_t epoch, const FinalOutcome& outcome) {
  AMHEX_ASSIGN_OR_RETURN(
      auto done,
      db.Run("SELECT 1 FROM job WHERE id = $1 AND lease_epoch = $2 AND state = $3"
             " AND outcome = $4",
             PostgresValues().Text(id).Int(epoch).Int(outcome.state).Bytes(OutcomeBytes(outcome))));
  return done.Next() ? absl::OkStatus() : Fenced(id);
}

absl::Status PostgresJobStore::Release(const std::string& id, int64_t epoch, ReleaseMode mode,
                                       absl::Time now, absl::Time not_before) {
  std::vector<Charge> charges;
  bool is_repetition = false;
  absl::Status status = pool_.Transact([&](PostgresConnection& db) -> absl::Status {
    const bool may_be_done = std::exchange(is_repetition, true);
    charges.clear();
    AMHEX_RETURN_IF_ERROR(db.Run("DELETE FROM lease WHERE job_id = $1 AND epoch = $2",
                                 PostgresValues().Text(id).Int(epoch))
                              .status());
    const int spent = mode == ReleaseMode::kGiveAttemptBack ? 1 : 0;
    AMHEX_ASSIGN_OR_RETURN(
        auto released,
        db.Run("UPDATE job SET state = 1, attempt = attempt - $1, not_before = $2 WHERE id = $3"
               " AND state = 2 AND lease_epoch = $4 AND NOT cancel_requested"
               " RETURNING tenant, $5::bigint - start_time",
               PostgresValues()
                   .Int(spent)
                   .Int(Micros(not_before))
                   .Text(id)
                   .Int(epoch)
                   .Int(Micros(now))));
    if (released.Next()) {
      charges.push_back({released.TextColumn(0), released.IntColumn(1)});
      return absl::OkStatus();
    }
    AMHEX_ASSIGN_OR_RETURN(
        auto held, db.Run("SELECT 1 FROM job WHERE id = $1 AND lease_epoch = $2 AND state = 2",
                          PostgresValues().Text(id).Int(epoch)));
    if (held.Next()) return CancelRequested(id);
    if (!may_be_done) return Fenced(id);
    AMHEX_ASSIGN_OR_RETURN(
        auto done, db.Run("SELECT 1 FROM job WHERE id = $1 AND lease_epoch = $2 AND state = 1",
                          PostgresValues().Text(id).Int(epoch)));
    return done.Next() ? absl::OkStatus() : Fenced(id);
  });
  if (!status.ok()) return status;
  ChargeTenants(charges);
  Announce({id});
  return absl::OkStatus();
}

}  // namespace amhex::server
