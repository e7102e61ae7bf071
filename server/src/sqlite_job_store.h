// The embedded queue: one SQLite file, one connection, one process.
//
// Write-ahead log with synchronous=FULL: what was acknowledged survives a power cut. A single
// connection does all reading, writing and checkpointing under one mutex, because releases of
// SQLite before 3.51.3 can corrupt the log when two connections checkpoint at once.
#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "job_record.h"
#include "job_store.h"
#include "sqlite.h"

namespace amhex::server {

// Thread-safe.
class SqliteJobStore : public JobStore {
 public:
  // `path` is a file, or ":memory:" for a queue that ends with the process.
  static absl::StatusOr<std::unique_ptr<SqliteJobStore>> Open(const std::string& path);

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

 private:
  // What a queued job needs to be claimed.
  struct Candidate {
    std::string id;
    int64_t epoch = 0;
    int64_t memory_bytes = 0;
    absl::Time ready_time;  // since when it could have been claimed
  };

  explicit SqliteJobStore(std::unique_ptr<SqliteDatabase> database);

  absl::Status BringSchemaUpToDate();
  absl::StatusOr<amhex::v1::Job> GetLocked(const std::string& id);
  // False if the page has all it can have.
  absl::StatusOr<bool> ShowRowsLocked(const JobQuery& query, JobPageMaker* maker);
  absl::StatusOr<std::vector<std::string>> IdsLocked(SqliteStatement* select);
  // Makes a job final where `condition` (on the columns) still holds; false if it does not.
  absl::StatusOr<bool> EndLocked(const std::string& id, const std::string& condition,
                                 const FinalOutcome& outcome, absl::Time now);
  absl::StatusOr<std::optional<SubmittedJob>> FindRequestLocked(const NewJob& job);
  absl::Status CheckRoomLocked(const NewJob& job, int64_t max_queued);
  absl::Status EnrolTenantLocked(const Tenant& tenant);
  absl::Status InsertLocked(const NewJob& job, absl::Time now);
  // The outcome of a succeeded job with the same cache_key.
  absl::StatusOr<std::optional<FinalOutcome>> FindResultLocked(const NewJob& job);
  absl::Status GrantLocked(const std::string& tenant, const amhex::v1::BlobRef& blob,
                           absl::Time now);
  absl::StatusOr<std::vector<std::string>> EndTwinsLocked(const std::string& id,
                                                          const FinalOutcome& outcome,
                                                          absl::Time now);
  // Whether the cancel of a job that is held was requested; ABORTED if fenced.
  absl::StatusOr<bool> CheckHeldLocked(const std::string& id, int64_t epoch);
  // Adds the time of an attempt to what its tenant has had.
  absl::Status ChargeLocked(const std::string& id, int64_t epoch, absl::Time now);
  absl::StatusOr<std::vector<std::string>> TenantsByShareLocked(absl::Time now);
  absl::StatusOr<std::optional<Candidate>> NextOfTenantLocked(const std::string& tenant,
                                                              int64_t memory_bytes, absl::Time now);
  absl::StatusOr<std::optional<Candidate>> ChooseLocked(const Claimant& claimant, absl::Time now);

  std::mutex mutex_;
  std::unique_ptr<SqliteDatabase> database_;
};

}  // namespace amhex::server
