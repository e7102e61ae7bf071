// What job stores and manager share: errors, outcomes, and what is kept of these.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "job_columns.h"
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
inline constexpr int kListRows = 250;
// A page ends after so many rows, also if none of them is asked for; the next one goes on.
inline constexpr int kMaxListRows = 40 * kListRows;

// Fills a page with those of the jobs it is shown, newest first, that are asked for.
class JobPageMaker {
 public:
  // `query` must stay.
  explicit JobPageMaker(const JobQuery* query)
      : query_(*query),
        before_(query->before_number > 0 ? query->before_number
                                         : std::numeric_limits<int64_t>::max()) {}

  // Of a row of kSelectJob; see job_columns.h for `Row`. False if the page ends before it.
  template <class Row>
  bool ShowRow(const Row& row) {
    if (rows_ == kMaxListRows) return End();
    ++rows_;
    if (IsAskedFor(static_cast<amhex::v1::Job::State>(row.IntColumn(kState)),
                   row.TextColumn(kSpec)) &&
        !Take(ReadJobColumns(row))) {
      return End();
    }
    before_ = row.IntColumn(kNumber);
    return true;
  }
  // Where to read on.
  int64_t before() const { return before_; }
  JobPage page() { return std::move(page_); }

 private:
  bool IsAskedFor(amhex::v1::Job::State state, const std::string& spec) const;
  // False if the page has no room for the job.
  bool Take(amhex::v1::Job job);
  // False.
  bool End();

  const JobQuery& query_;
  int64_t before_;
  int rows_ = 0;
  int64_t bytes_ = 0;
  JobPage page_;
};

}  // namespace amhex::server
