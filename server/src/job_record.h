// What job stores and manager share: errors, outcomes, and what is kept of these.
#pragma once

#include <cstdint>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "job_store.h"

namespace amhex::server {

absl::Status JobNotFound(const std::string& id);
// FAILED_PRECONDITION JOB_NOT_FINAL: it cannot be deleted yet.
absl::Status JobNotFinal(const amhex::v1::Job& job);
// ABORTED: another attempt has taken over.
absl::Status Fenced(const std::string& id);
// CANCELLED: a job cannot go back to the queue.
absl::Status CancelRequested(const std::string& id);
// FAILED_PRECONDITION BLOB_MISSING.
absl::Status BlobMissing(const std::string& sha256);
absl::Status QueueFull(int64_t queued);
absl::Status RequestIdReused(const std::string& request_id);
// INTERNAL ATTEMPTS_EXHAUSTED; `how` the last worker ended.
absl::Status AttemptsExhausted(int attempts, const std::string& how);

FinalOutcome ErrorOutcome(amhex::v1::Job::State state, const absl::Status& error);
FinalOutcome CancelledOutcome();

// What the outcome column holds.
std::string OutcomeBytes(const FinalOutcome& outcome);
// The outcome of a job that gets the result of another one.
FinalOutcome SharedOutcome(const amhex::v1::Job& details);

// A store is read so many rows at a time for a page, which may come from many more of them: others
// have their turn in between.
inline constexpr int kListRows = 1000;

// Fills a page with those of the jobs it is shown, newest first, that are asked for.
class JobPageMaker {
 public:
  // `query` must stay.
  explicit JobPageMaker(const JobQuery* query) : query_(*query), before_(query->before_number) {}

  // False if the page is full and ends before this job.
  bool Show(amhex::v1::Job job, int64_t number);
  // Where to read on.
  int64_t before() const { return before_; }
  JobPage Take() { return std::move(page_); }

 private:
  const JobQuery& query_;
  int64_t before_;
  int64_t bytes_ = 0;
  JobPage page_;
};

}  // namespace amhex::server
