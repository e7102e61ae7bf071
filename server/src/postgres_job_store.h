// The queue of a cluster: one PostgreSQL database that all nodes share.
//
// Every call is one short transaction. Calls come back within seconds when the database is away,
// with UNAVAILABLE, and go on when it is back; a call whose commit was in doubt is repeated and
// then finds its own changes. Claims lock rows that others skip, so nodes do not wait for each
// other. Attempts are fenced by their epoch as in every store.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "job_store.h"
#include "postgres.h"

namespace amhex::server {

// Thread-safe.
class PostgresJobStore : public JobStore {
 public:
  struct Options {
    std::string url;  // postgres://user@host/database?sslmode=verify-full
    // Where other nodes reach this one's gRPC services; told to them with each claim.
    std::string address;
    int connection_count = 4;
    absl::Duration patience = absl::Seconds(5);
    // This machine's clock. Times are stored in the database's own, so nodes may disagree.
    std::function<absl::Time()> clock = absl::Now;
  };

  static absl::StatusOr<std::unique_ptr<PostgresJobStore>> Open(const Options& options);
  ~PostgresJobStore() override;

  absl::StatusOr<int64_t> NextGeneration() override;
  absl::StatusOr<SubmittedJob> Submit(const NewJob& job, int64_t max_queued,
                                      absl::Time now) override;
  absl::StatusOr<amhex::v1::Job> Get(const std::string& id) override;
  absl::StatusOr<JobPage> List(const JobQuery& query) override;
  absl::StatusOr<std::optional<ClaimedJob>> Claim(const Claimant& claimant,
                                                  absl::Time now) override;
  absl::StatusOr<bool> Heartbeat(const std::string& id, int64_t epoch, absl::Time now,
                                 absl::Duration lease) override;
  absl::StatusOr<std::vector<std::string>> Finish(const std::string& id, int64_t epoch,
                                                  const FinalOutcome& outcome,
                                                  absl::Time now) override;
  absl::Status Release(const std::string& id, int64_t epoch, ReleaseMode mode, absl::Time now,
                       absl::Time not_before) override;
  absl::StatusOr<amhex::v1::Job> RequestCancel(const std::string& id, const FinalOutcome& outcome,
                                               absl::Time now) override;
  absl::Status Delete(const std::string& id) override;
  absl::StatusOr<int64_t> RequeueRunning(const std::string& node) override;
  absl::StatusOr<ReapedLeases> ReapExpiredLeases(absl::Time now) override;
  absl::StatusOr<std::vector<std::string>> ExpireQueued(const FinalOutcome& outcome,
                                                        absl::Time now) override;
  absl::StatusOr<std::vector<std::string>> RemoveExpired(absl::Time now) override;
  absl::StatusOr<std::vector<std::string>> RemoveOldestFinal(int count, absl::Time before) override;
  absl::StatusOr<std::map<amhex::v1::Job::State, int64_t>> CountByState() override;
  absl::StatusOr<std::optional<absl::Time>> OldestQueued() override;
  absl::StatusOr<absl::Duration> QueuedCost() override;
  absl::Status GrantBlob(const std::string& tenant, const amhex::v1::BlobRef& blob,
                         absl::Time now) override;
  absl::StatusOr<bool> OwnsBlob(const std::string& tenant, const std::string& sha256) override;
  absl::StatusOr<int64_t> OwnedBytes(const std::string& tenant) override;
  absl::StatusOr<int64_t> DropUnusedGrants(absl::Time before) override;
  absl::StatusOr<bool> CollectBlob(const std::string& sha256,
                                   const std::function<void()>& hide) override;

  absl::StatusOr<std::string> RunnerAddress(const std::string& id) override;
  void Subscribe(std::function<void(const std::string& id)>&& on_change) override;
  void Unsubscribe() override;

 private:
  struct Candidate {
    std::string id;
    std::string tenant;
    int64_t memory_bytes = 0;
    int64_t ready_time = 0;
  };
  struct Share {
    std::string tenant;
    int64_t max_running = 0;
  };
  // The time of an attempt, to be charged to its tenant.
  struct Charge {
    std::string tenant;
    int64_t micros = 0;
  };

  explicit PostgresJobStore(const Options& options);

  absl::Status BringSchemaUpToDate();
  absl::Status MeasureClock();
  // A time of this machine's clock in the database's, in microseconds.
  int64_t Micros(absl::Time time) const;
  // Reads one number.
  absl::StatusOr<int64_t> Number(const std::string& sql, const PostgresValues& values);
  // Runs a statement whose rows are ids.
  absl::StatusOr<std::vector<std::string>> Ids(const std::string& sql,
                                               const PostgresValues& values);

  absl::StatusOr<SubmittedJob> SubmitOn(PostgresConnection& db, const NewJob& job,
                                        int64_t max_queued, int64_t now);
  absl::StatusOr<std::optional<amhex::v1::Job>> FindRequest(PostgresConnection& db,
                                                            const NewJob& job);
  absl::Status CheckRoom(PostgresConnection& db, const NewJob& job, int64_t max_queued);
  absl::Status EnrolTenant(PostgresConnection& db, const Tenant& tenant);
  absl::Status Insert(PostgresConnection& db, const NewJob& job, int64_t now);
  absl::StatusOr<std::optional<FinalOutcome>> FindResult(PostgresConnection& db, const NewJob& job);
  // Keeps a blob from being collected until the transaction ends. False if it is not stored.
  absl::StatusOr<bool> KeepBlob(PostgresConnection& db, const std::string& sha256);
  absl::Status Grant(PostgresConnection& db, const std::string& tenant,
                     const amhex::v1::BlobRef& blob, int64_t now);
  // Makes a job final where `condition` still holds. What to charge, or nothing if it does not.
  absl::StatusOr<std::optional<Charge>> End(PostgresConnection& db, const std::string& id,
                                            const std::string& condition,
                                            const FinalOutcome& outcome, int64_t now);
  absl::StatusOr<std::vector<std::string>> EndTwins(PostgresConnection& db, const std::string& id,
                                                    const FinalOutcome& outcome, int64_t now);
  absl::Status CheckFinished(PostgresConnection& db, const std::string& id, int64_t epoch,
                             const FinalOutcome& outcome);

  absl::StatusOr<std::vector<Share>> TenantsByShare(PostgresConnection& db, int64_t now);
  absl::StatusOr<std::optional<Candidate>> NextOfTenant(PostgresConnection& db, const Share& share,
                                                        int64_t memory_bytes, int64_t now);
  absl::StatusOr<std::optional<Candidate>> Choose(PostgresConnection& db, const Claimant& claimant,
                                                  int64_t now);
  absl::StatusOr<std::optional<ClaimedJob>> ClaimOn(PostgresConnection& db,
                                                    const Claimant& claimant, int64_t now);
  // The job that a claim has taken whose commit was in doubt.
  absl::StatusOr<std::optional<ClaimedJob>> FindClaim(PostgresConnection& db,
                                                      const Claimant& claimant);

  // After a commit: these must not hold it up, and losing them in a crash does no harm.
  void Announce(const std::vector<std::string>& ids);
  void ChargeTenants(const std::vector<Charge>& charges);
  void Listen();

  const Options options_;
  PostgresPool pool_;
  PostgresPool quick_pool_;  // its commits do not wait for the disk
  std::atomic<int64_t> clock_offset_micros_{0};
  std::mutex mutex_;
  std::set<std::string> doubtful_claimants_;
  std::function<void(const std::string&)> on_change_;
  std::atomic<bool> stopping_{false};
  std::thread listener_;
};

}  // namespace amhex::server
