// What job stores and manager share: errors, outcomes, and what is kept of these.
#pragma once

#include <map>
#include <string>

#include "absl/status/status.h"
#include "job_store.h"

namespace amhex::server {

absl::Status JobNotFound(const std::string& id);
// FAILED_PRECONDITION JOB_NOT_FINAL: it cannot be deleted yet.
absl::Status JobNotFinal(const amhex::v1::Job& job);
// ABORTED: another attempt has taken over.
absl::Status Fenced(const std::string& id);
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

bool HasLabels(const amhex::v1::Job& job, const std::map<std::string, std::string>& labels);

}  // namespace amhex::server
