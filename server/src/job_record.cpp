#include "job_record.h"

#include <algorithm>

#include "errors.h"
#include "job_id.h"

namespace amhex::server {
namespace {

using amhex::v1::Job;

constexpr absl::Duration kFullQueueRetryDelay = absl::Seconds(5);
// Of a job's tag and size within a message.
constexpr int64_t kJobFieldBytes = 1 + 5;

bool HasLabels(const Job& job, const std::map<std::string, std::string>& labels) {
  return std::all_of(labels.begin(), labels.end(), [&job](const auto& label) {
    const auto found = job.labels().find(label.first);
    return found != job.labels().end() && found->second == label.second;
  });
}

}  // namespace

absl::Status JobNotFound(const std::string& id) {
  return MakeError(absl::StatusCode::kNotFound, amhex::v1::JOB_NOT_FOUND,
                   "no job " + JobName(id) + " exists, or it has expired");
}

absl::Status JobNotFinal(const Job& job) {
  return MakeError(absl::StatusCode::kFailedPrecondition, amhex::v1::JOB_NOT_FINAL,
                   job.name() + " is " + Job::State_Name(job.state()) + "; cancel it first");
}

absl::Status Fenced(const std::string& id) {
  return absl::AbortedError("another attempt of " + JobName(id) + " has taken over");
}

absl::Status CancelRequested(const std::string& id) {
  return absl::CancelledError("the cancel of " + JobName(id) + " was requested");
}

absl::Status BlobMissing(const std::string& sha256) {
  return WithPrecondition(MakeError(absl::StatusCode::kFailedPrecondition, amhex::v1::BLOB_MISSING,
                                    "no blob " + sha256 + " is stored; upload it first"),
                          "MISSING", "blobs/" + sha256);
}

absl::Status QueueFull(int64_t queued) {
  return WithRetryDelay(MakeError(absl::StatusCode::kResourceExhausted, amhex::v1::QUEUE_FULL,
                                  std::to_string(queued) + " jobs wait, which is the limit"),
                        kFullQueueRetryDelay);
}

absl::Status RequestIdReused(const std::string& request_id) {
  return MakeError(absl::StatusCode::kAlreadyExists, amhex::v1::REQUEST_ID_REUSED,
                   "request_id " + request_id + " was used for a different request");
}

absl::Status AttemptsExhausted(int attempts, const std::string& how) {
  return MakeError(
      absl::StatusCode::kInternal, amhex::v1::ATTEMPTS_EXHAUSTED,
      "the worker died in each of " + std::to_string(attempts) + " attempts, last by " + how);
}

FinalOutcome ErrorOutcome(Job::State state, const absl::Status& error) {
  FinalOutcome outcome;
  outcome.state = state;
  *outcome.details.mutable_error() = ToRpcStatus(error);
  return outcome;
}

FinalOutcome CancelledOutcome() {
  return ErrorOutcome(Job::CANCELLED,
                      MakeError(absl::StatusCode::kCancelled, amhex::v1::CANCEL_REQUESTED,
                                "the job was cancelled on request"));
}

std::string OutcomeBytes(const FinalOutcome& outcome) {
  Job kept;
  *kept.mutable_stages() = outcome.details.stages();
  kept.set_failed_stage(outcome.details.failed_stage());
  if (outcome.details.has_error()) *kept.mutable_error() = outcome.details.error();
  kept.set_shared_result(outcome.details.shared_result());
  if (outcome.details.has_result()) *kept.mutable_result() = outcome.details.result();
  return kept.SerializeAsString();
}

FinalOutcome SharedOutcome(const Job& details) {
  FinalOutcome outcome;
  outcome.state = Job::SUCCEEDED;
  outcome.details = details;
  outcome.details.clear_stages();
  outcome.details.set_shared_result(true);
  return outcome;
}

bool JobPageMaker::IsAskedFor(Job::State state, const std::string& spec) const {
  const auto& states = query_.states;
  if (!states.empty() && std::find(states.begin(), states.end(), state) == states.end()) {
    return false;
  }
  if (query_.labels.empty()) return true;
  Job job;
  return job.ParseFromString(spec) && HasLabels(job, query_.labels);
}

bool JobPageMaker::Take(Job job) {
  const auto bytes = static_cast<int64_t>(job.ByteSizeLong()) + kJobFieldBytes;
  const bool fits = bytes_ + bytes <= query_.page_bytes || page_.jobs.empty();
  if (!fits || static_cast<int>(page_.jobs.size()) >= query_.page_size) return false;
  bytes_ += bytes;
  page_.jobs.push_back(std::move(job));
  return true;
}

bool JobPageMaker::End() {
  page_.next_before_number = before_;
  return false;
}

}  // namespace amhex::server
