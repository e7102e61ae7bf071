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
  absl::StatusOr<std::optional<ClaimedJob>> Claim(const std::string& worker, absl::Time now,
                                                  absl::Duration lease) override;
  absl::StatusOr<bool> Heartbeat(const std::string& id, int64_t epoch, absl::Time now,
                                 absl::Duration lease) override;
  absl::Status Finish(const std::string& id, int64_t epoch, const FinalOutcome& outcome,
                      absl::Time now) override;
  absl::Status Release(const std::string& id, int64_t epoch, ReleaseMode mode,
                       absl::Time not_before) override;
  absl::StatusOr<amhex::v1::Job> RequestCancel(const std::string& id, const FinalOutcome& outcome,
                                               absl::Time now) override;
  absl::Status Delete(const std::string& id) override;
  absl::StatusOr<int64_t> RequeueRunning() override;
  absl::StatusOr<std::vector<ClaimedJob>> ReapExpiredLeases(absl::Time now) override;
  absl::StatusOr<std::vector<std::string>> ExpireQueued(const FinalOutcome& outcome,
                                                        absl::Time now) override;
  absl::StatusOr<std::vector<std::string>> RemoveExpired(absl::Time now) override;
  absl::StatusOr<std::map<amhex::v1::Job::State, int64_t>> CountByState() override;
  absl::StatusOr<std::optional<absl::Time>> OldestQueued() override;
  absl::StatusOr<bool> IsBlobUsed(const std::string& sha256) override;

 private:
  explicit SqliteJobStore(std::unique_ptr<SqliteDatabase> database);

  absl::StatusOr<amhex::v1::Job> GetLocked(const std::string& id);
  absl::StatusOr<int64_t> CountLocked(const std::string& sql);
  absl::StatusOr<std::vector<std::string>> IdsLocked(const std::string& sql, absl::Time now);
  // Makes a job final where `condition` (on the columns) still holds; false if it does not.
  absl::StatusOr<bool> EndLocked(const std::string& id, const std::string& condition,
                                 const FinalOutcome& outcome, absl::Time now);
  absl::StatusOr<std::optional<SubmittedJob>> FindRequestLocked(const NewJob& job);

  std::mutex mutex_;
  std::unique_ptr<SqliteDatabase> database_;
};

}  // namespace amhex::server
