// What a durable queue must do. Implementations pass tests/service/job_store_test.cpp.
//
// Every time comes from the caller, so that tests can turn the clock. Attempts are fenced: a claim
// raises the job's epoch, and whoever holds an older epoch gets ABORTED and must discard its work.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "amhex/v1/job.pb.h"

namespace amhex::server {

// One step of priority counts as much as this wait in the queue: a job overtakes only those that
// came at most (steps * kPriorityStep) before it, so nothing waits for ever.
inline constexpr absl::Duration kPriorityStep = absl::Minutes(1);

// No job is released for longer. One that is to wait beyond that was queued before the clock was
// set back, and waits no more.
inline constexpr absl::Duration kLongestDelay = absl::Minutes(10);

// Whom a job belongs to and what that tenant may have. Zero bounds nothing.
struct Tenant {
  std::string name = "default";
  int32_t weight = 1;            // share of the workers' time against other tenants', [1, 1000]
  int64_t max_queued_jobs = 0;   // waiting at the same time
  int64_t max_running_jobs = 0;  // running at the same time
  int64_t max_blob_bytes = 0;    // owned at the same time; the caller of the store sees to it
};

// What a job is expected to take.
struct ExpectedCost {
  int64_t memory_bytes = 0;  // peak of the worker; 0: not known
  absl::Duration duration;   // of one attempt, on one core
};

struct NewJob {
  std::string id;  // a fresh UUID
  Tenant tenant;
  std::string request_id;    // may be empty; unique per tenant
  std::string request_hash;  // digest of the request; compared when request_id repeats
  // Jobs of one tenant with the same key have the same result; empty: never shared.
  std::string cache_key;
  ExpectedCost cost;
  amhex::v1::Job job;  // input, encoding, params, priority, labels, timeouts, max_attempts
  absl::Duration ttl;  // from the job's end to its removal
};

struct SubmittedJob {
  amhex::v1::Job job;
  bool is_new = false;  // false: request_id was known
};

// Who asks for a job, and what it can run.
struct Claimant {
  std::string node;    // of the cluster; its restart gives back what it ran
  std::string worker;  // on that node
  absl::Duration lease;
  int64_t total_memory_bytes = std::numeric_limits<int64_t>::max();  // larger jobs are not for it
  int64_t free_memory_bytes = std::numeric_limits<int64_t>::max();   // larger jobs must wait
  // A job that is next but does not fit is overtaken by smaller ones for this long.
  absl::Duration max_overtaking = absl::Seconds(30);
};

struct ClaimedJob {
  std::string id;
  int64_t epoch = 0;  // fencing token of this attempt
  amhex::v1::Job job;
};

// How an attempt ended for good.
struct FinalOutcome {
  amhex::v1::Job::State state = amhex::v1::Job::FAILED;  // SUCCEEDED, FAILED or CANCELLED
  amhex::v1::Job details;  // only stages, failed_stage, shared_result and error or result
};

struct JobQuery {
  std::optional<std::string> tenant;  // absent: of all tenants
  int page_size = 0;
  // Of the jobs of a page as they are sent; a page has one job, however large.
  int64_t page_bytes = std::numeric_limits<int64_t>::max();
  int64_t before_number = 0;  // only older jobs; 0: from the newest
  std::vector<amhex::v1::Job::State> states;
  std::map<std::string, std::string> labels;
};

struct JobPage {
  std::vector<amhex::v1::Job> jobs;  // newest first
  // 0 on the last page. Others may be empty: each looks at a bounded number of jobs.
  int64_t next_before_number = 0;
};

// Jobs whose leases ended, found by one look. The caller ends those that do not go back.
struct ReapedLeases {
  std::vector<std::string> requeued;  // ids
  std::vector<ClaimedJob> exhausted;  // no attempt is left
  std::vector<ClaimedJob> cancelled;  // their cancel was requested
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

  // A job is final at once when a SUCCEEDED one of the tenant has its cache_key. ALREADY_EXISTS
  // REQUEST_ID_REUSED; RESOURCE_EXHAUSTED QUEUE_FULL beyond `max_queued` jobs of all tenants, and
  // QUOTA_EXCEEDED beyond the tenant's. The tenant owns the input from then on.
  virtual absl::StatusOr<SubmittedJob> Submit(const NewJob& job, int64_t max_queued,
                                              absl::Time now) = 0;
  // NOT_FOUND JOB_NOT_FOUND. Job.tenant tells whose it is; callers must not show it to others.
  virtual absl::StatusOr<amhex::v1::Job> Get(const std::string& id) = 0;
  virtual absl::StatusOr<JobPage> List(const JobQuery& query) = 0;

  // The next job to run, or nothing. First the tenant that has had the least of the workers' time
  // for its weight, then its job of the least creation time + priority * kPriorityStep. A job waits
  // while one with its cache_key runs.
  virtual absl::StatusOr<std::optional<ClaimedJob>> Claim(const Claimant& claimant,
                                                          absl::Time now) = 0;
  // Extends the lease; true if the job is to be cancelled. ABORTED if fenced.
  virtual absl::StatusOr<bool> Heartbeat(const std::string& id, int64_t epoch, absl::Time now,
                                         absl::Duration lease) = 0;
  // ABORTED if fenced: the outcome is not recorded. A success also ends the queued jobs of the
  // tenant with the same cache_key; returns their ids. The tenant owns the result from then on.
  virtual absl::StatusOr<std::vector<std::string>> Finish(const std::string& id, int64_t epoch,
                                                          const FinalOutcome& outcome,
                                                          absl::Time now) = 0;
  // Back to the queue, not before `not_before`, at most kLongestDelay from now; the caller checks
  // max_attempts. ABORTED if fenced; CANCELLED if a cancel was requested: the caller ends the job,
  // which runs still.
  virtual absl::Status Release(const std::string& id, int64_t epoch, ReleaseMode mode,
                               absl::Time now, absl::Time not_before) = 0;

  // QUEUED becomes CANCELLED with `outcome`, RUNNING is marked; final jobs stay. NOT_FOUND.
  virtual absl::StatusOr<amhex::v1::Job> RequestCancel(const std::string& id,
                                                       const FinalOutcome& outcome,
                                                       absl::Time now) = 0;
  // NOT_FOUND; FAILED_PRECONDITION JOB_NOT_FINAL.
  virtual absl::Status Delete(const std::string& id) = 0;

  // Puts the RUNNING jobs of a node back, the attempts given back. For the node's start, when none
  // of its workers runs yet. Those whose cancel was requested lose their lease instead, so that
  // whoever reaps ends them: a job to be cancelled is never queued.
  virtual absl::StatusOr<int64_t> RequeueRunning(const std::string& node) = 0;
  // Puts jobs whose lease ended back if they have attempts left.
  virtual absl::StatusOr<ReapedLeases> ReapExpiredLeases(absl::Time now) = 0;
  // Fails the queued jobs that waited longer than their queue_timeout; returns their ids.
  virtual absl::StatusOr<std::vector<std::string>> ExpireQueued(const FinalOutcome& outcome,
                                                                absl::Time now) = 0;
  // Removes final jobs past their expire_time; returns their ids.
  virtual absl::StatusOr<std::vector<std::string>> RemoveExpired(absl::Time now) = 0;
  // Removes up to `count` final jobs that ended before `before`, oldest end first; returns their
  // ids. For when blobs take more room than there is.
  virtual absl::StatusOr<std::vector<std::string>> RemoveOldestFinal(int count,
                                                                     absl::Time before) = 0;

  virtual absl::StatusOr<std::map<amhex::v1::Job::State, int64_t>> CountByState() = 0;
  // When the oldest queued job was created.
  virtual absl::StatusOr<std::optional<absl::Time>> OldestQueued() = 0;
  // How long the queued jobs are expected to take, together.
  virtual absl::StatusOr<absl::Duration> QueuedCost() = 0;

  // Notes that a tenant owns a blob: it uploaded it, or a job of its names it. Renews `now`.
  virtual absl::Status GrantBlob(const std::string& tenant, const amhex::v1::BlobRef& blob,
                                 absl::Time now) = 0;
  virtual absl::StatusOr<bool> OwnsBlob(const std::string& tenant, const std::string& sha256) = 0;
  // Bytes of all blobs that a tenant owns.
  virtual absl::StatusOr<int64_t> OwnedBytes(const std::string& tenant) = 0;
  // Ends the ownership of blobs granted before `before` that no job of the tenant names; returns
  // how many.
  virtual absl::StatusOr<int64_t> DropUnusedGrants(absl::Time before) = 0;
  // Calls `hide` if no job names the blob as input or result and no tenant owns it, and returns
  // true if that still held when `hide` had returned: while it runs, nobody can come to use the
  // blob. It may be called again after a collision. False, or an error: the blob is to stay.
  virtual absl::StatusOr<bool> CollectBlob(const std::string& sha256,
                                           const std::function<void()>& hide) = 0;
  // Tells whether the bytes of a blob are stored. Submissions, grants and successes that name one
  // that is not fail with FAILED_PRECONDITION BLOB_MISSING, and results that are gone are not
  // shared. Asked at a moment when CollectBlob hides nothing. Set before the store is used, or
  // never: then every blob counts as stored.
  using BlobIsStored = std::function<bool(const std::string& sha256)>;
  void CheckBlobsWith(BlobIsStored is_stored) { blob_is_stored_ = std::move(is_stored); }

  // For stores that several nodes share.
  // Where the node that runs a job can be reached; empty if none does, or only this one could.
  virtual absl::StatusOr<std::string> RunnerAddress(const std::string&) { return std::string(); }
  // From now on `on_change` is told the ids of jobs that changed through any node, soon after; some
  // may be missed. An empty id: any job may have changed. Called from one thread; once at most.
  virtual void Subscribe(std::function<void(const std::string& id)>&&) {}
  // `on_change` is not called any more once it has returned.
  virtual void Unsubscribe() {}

 protected:
  bool IsStored(const std::string& sha256) const {
    return !blob_is_stored_ || blob_is_stored_(sha256);
  }

 private:
  BlobIsStored blob_is_stored_;
};

}  // namespace amhex::server
