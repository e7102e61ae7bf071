// Rows of the job table: its schema, and how a row becomes a Job.
#pragma once

#include <string>

#include "absl/status/status.h"
#include "job_store.h"
#include "sqlite.h"

namespace amhex::server {

// Times are microseconds since 1970. `spec` is a serialized Job with what the client sent,
// `outcome` one with stages, failed_stage and error or result.
inline constexpr char kSchema[] = R"sql(
CREATE TABLE IF NOT EXISTS job (
  number INTEGER PRIMARY KEY AUTOINCREMENT,
  id TEXT NOT NULL UNIQUE,
  request_id TEXT UNIQUE,
  request_hash TEXT NOT NULL,
  state INTEGER NOT NULL CHECK (state BETWEEN 1 AND 5),
  priority INTEGER NOT NULL,
  spec BLOB NOT NULL,
  outcome BLOB,
  input_sha256 TEXT NOT NULL,
  result_sha256 TEXT,
  create_time INTEGER NOT NULL,
  not_before INTEGER NOT NULL,
  queue_deadline INTEGER,
  start_time INTEGER,
  end_time INTEGER,
  expire_time INTEGER,
  ttl INTEGER NOT NULL,
  attempt INTEGER NOT NULL DEFAULT 0,
  max_attempts INTEGER NOT NULL,
  lease_epoch INTEGER NOT NULL DEFAULT 0,
  lease_owner TEXT,
  lease_until INTEGER,
  cancel_requested INTEGER NOT NULL DEFAULT 0
);
CREATE INDEX IF NOT EXISTS job_state ON job(state);
CREATE INDEX IF NOT EXISTS job_claim ON job(priority, number) WHERE state = 1;
CREATE INDEX IF NOT EXISTS job_lease ON job(lease_until) WHERE state = 2;
CREATE INDEX IF NOT EXISTS job_expire ON job(expire_time) WHERE state >= 3;
CREATE INDEX IF NOT EXISTS job_input ON job(input_sha256);
CREATE INDEX IF NOT EXISTS job_result ON job(result_sha256) WHERE result_sha256 IS NOT NULL;
CREATE TABLE IF NOT EXISTS generation (only_row INTEGER PRIMARY KEY CHECK (only_row = 1),
                                       number INTEGER NOT NULL);
INSERT OR IGNORE INTO generation VALUES (1, 0);
)sql";

inline constexpr int kSchemaVersion = 1;

// The columns that ReadJob needs, in the order of JobColumn.
inline constexpr char kSelectJob[] =
    "SELECT number, id, state, spec, outcome, create_time, start_time, end_time, expire_time,"
    " attempt, cancel_requested, lease_epoch, max_attempts FROM job ";

enum JobColumn {
  kNumber,
  kId,
  kState,
  kSpec,
  kOutcome,
  kCreateTime,
  kStartTime,
  kEndTime,
  kExpireTime,
  kAttempt,
  kCancelRequested,
  kLeaseEpoch,
  kMaxAttempts
};

absl::Status JobNotFound(const std::string& id);
// ABORTED: another attempt has taken over.
absl::Status Fenced(const std::string& id);

// The job in the current row of a statement that begins with kSelectJob.
amhex::v1::Job ReadJob(const SqliteStatement& row);

// What the outcome column holds.
std::string OutcomeBytes(const FinalOutcome& outcome);

}  // namespace amhex::server
