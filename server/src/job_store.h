// What a durable queue must do. Implementations pass tests/service/job_store_test.cpp.
//
// Every time comes from the caller, so that tests can turn the clock. Attempts are fenced: a claim
// raises the job's epoch, and whoever holds an older epoch gets ABORTED and must discard its work.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "amhex/v1/job.pb.h"

namespace amhex::server {

struct NewJob {
  std::string id;            // a fresh UUID
  std::string request_id;    // may be empty
  std::string request_hash;  // digest of the request; compared when request_id repeats
  amhex::v1::Job job;        // input, encoding, params, priority, labels, timeouts, max_attempts
  absl::Duration ttl;        // from the job's end to its removal
};

struct SubmittedJob {
  amhex::v1::Job job;
  bool is_new = false;  // false: request_id was known
};

struct ClaimedJob {
  std::string id;
  int64_t epoch = 0;  // fencing token of this attempt
  amhex::v1::Job job;
};

// How an attempt ended for good.
struct FinalOutcome {
  amhex::v1::Job::State state = amhex::v1::Job::FAILED;  // SUCCEEDED, FAILED or CANCELLED
  amhex::v1::Job details;  // only stages, failed_stage and error or result are kept
};

struct JobQuery {
  int page_size = 0;
  int64_t before_number = 0;  // only older jobs; 0: from the newest
  std::vector<amhex::v1::Job::State> states;
  std::map<std::string, std::string> labels;
};

struct JobPage {
  std::vector<amhex::v1::Job> jobs;  // newest first
  int64_t next_before_number = 0;    // 0 on the last page
};

enum class ReleaseMode {
  kGiveAttemptBack,  // the server interrupted the attempt
  kSpendAttempt,     // the worker died
};

class JobStore {
 public:
  virtual ~JobStore() = default;

  // A number that grows with every opening of the store.
  virtual absl::StatusOr<int64_t> NextGeneration() = 0;

  // ALREADY_EXISTS REQUEST_ID_REUSED; RESOURCE_EXHAUSTED QUEUE_FULL beyond `max_queued` jobs.
  virtual absl::StatusOr<SubmittedJob> Submit(const NewJob& job, int64_t max_queued,
                                              absl::Time now) = 0;
  // NOT_FOUND JOB_NOT_FOUND.
  virtual absl::StatusOr<amhex::v1::Job> Get(const std::string& id) = 0;
  virtual absl::StatusOr<JobPage> List(const JobQuery& query) = 0;

  // The next job to run by (priority, creation), or nothing.
  virtual absl::StatusOr<std::optional<ClaimedJob>> Claim(const std::string& worker, absl::Time now,
                                                          absl::Duration lease) = 0;
  // Extends the lease; true if the job is to be cancelled. ABORTED if fenced.
  virtual absl::StatusOr<bool> Heartbeat(const std::string& id, int64_t epoch, absl::Time now,
                                         absl::Duration lease) = 0;
  // ABORTED if fenced: the outcome is not recorded.
  virtual absl::Status Finish(const std::string& id, int64_t epoch, const FinalOutcome& outcome,
                              absl::Time now) = 0;
  // Back to the queue, not before `not_before`; the caller checks max_attempts. ABORTED if fenced.
  virtual absl::Status Release(const std::string& id, int64_t epoch, ReleaseMode mode,
                               absl::Time not_before) = 0;

  // QUEUED becomes CANCELLED with `outcome`, RUNNING is marked; final jobs stay. NOT_FOUND.
  virtual absl::StatusOr<amhex::v1::Job> RequestCancel(const std::string& id,
                                                       const FinalOutcome& outcome,
                                                       absl::Time now) = 0;
  // NOT_FOUND; FAILED_PRECONDITION JOB_NOT_FINAL.
  virtual absl::Status Delete(const std::string& id) = 0;

  // Puts every RUNNING job back, the attempt given back. For the start, when no worker runs yet.
  virtual absl::StatusOr<int64_t> RequeueRunning() = 0;
  // Puts jobs whose lease ended back (attempts left) and returns those without attempts left.
  virtual absl::StatusOr<std::vector<ClaimedJob>> ReapExpiredLeases(absl::Time now) = 0;
  // Fails the queued jobs that waited longer than their queue_timeout; returns their ids.
  virtual absl::StatusOr<std::vector<std::string>> ExpireQueued(const FinalOutcome& outcome,
                                                                absl::Time now) = 0;
  // Removes final jobs past their expire_time; returns their ids.
  virtual absl::StatusOr<std::vector<std::string>> RemoveExpired(absl::Time now) = 0;

  virtual absl::StatusOr<std::map<amhex::v1::Job::State, int64_t>> CountByState() = 0;
  // When the oldest queued job was created.
  virtual absl::StatusOr<std::optional<absl::Time>> OldestQueued() = 0;
  // True if a job names the blob as input or result.
  virtual absl::StatusOr<bool> IsBlobUsed(const std::string& sha256) = 0;
};

}  // namespace amhex::server
