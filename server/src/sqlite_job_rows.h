// Rows of the job table: its schema, and how a row becomes a Job.
#pragma once

#include <string>

#include "job_columns.h"
#include "job_record.h"
#include "job_store.h"
#include "sqlite.h"

namespace amhex::server {

// Times are microseconds since 1970. `spec` is a serialized Job with what the client sent,
// `outcome` one with stages, failed_stage and error or result. `queue_key` orders a tenant's queue.
// `tenant.served` is the time its jobs have run, divided by its weight.
//
// Without statistics the planner takes job_state wherever a state is asked for, and with it reads
// all jobs of that state; where that may be many, statements name their index.
inline constexpr char kSchema[] = R"sql(
CREATE TABLE IF NOT EXISTS job (
  number INTEGER PRIMARY KEY AUTOINCREMENT,
  id TEXT NOT NULL UNIQUE,
  tenant TEXT NOT NULL,
  request_id TEXT,
  request_hash TEXT NOT NULL,
  cache_key TEXT,
  state INTEGER NOT NULL CHECK (state BETWEEN 1 AND 5),
  queue_key INTEGER NOT NULL,
  memory_bytes INTEGER NOT NULL,
  expected_micros INTEGER NOT NULL DEFAULT 0,
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
  lease_node TEXT,
  lease_owner TEXT,
  lease_until INTEGER,
  cancel_requested INTEGER NOT NULL DEFAULT 0,
  UNIQUE (tenant, request_id)
);
CREATE INDEX IF NOT EXISTS job_state ON job(state);
CREATE INDEX IF NOT EXISTS job_claim ON job(tenant, queue_key, number) WHERE state = 1;
CREATE INDEX IF NOT EXISTS job_busy ON job(tenant) WHERE state <= 2;
CREATE INDEX IF NOT EXISTS job_deadline ON job(queue_deadline)
  WHERE state = 1 AND queue_deadline IS NOT NULL;
CREATE INDEX IF NOT EXISTS job_oldest ON job(create_time, expected_micros) WHERE state = 1;
CREATE INDEX IF NOT EXISTS job_lease ON job(lease_until) WHERE state = 2;
CREATE INDEX IF NOT EXISTS job_expire ON job(expire_time) WHERE state >= 3;
CREATE INDEX IF NOT EXISTS job_end ON job(end_time) WHERE state >= 3;
CREATE INDEX IF NOT EXISTS job_list ON job(tenant, number);
CREATE INDEX IF NOT EXISTS job_cache ON job(tenant, cache_key) WHERE cache_key IS NOT NULL;
CREATE INDEX IF NOT EXISTS job_input ON job(input_sha256);
CREATE INDEX IF NOT EXISTS job_result ON job(result_sha256) WHERE result_sha256 IS NOT NULL;
CREATE TABLE IF NOT EXISTS tenant (name TEXT PRIMARY KEY, weight INTEGER NOT NULL,
                                   max_running INTEGER NOT NULL, served INTEGER NOT NULL);
CREATE TABLE IF NOT EXISTS blob_owner (tenant TEXT NOT NULL, sha256 TEXT NOT NULL,
                                       bytes INTEGER NOT NULL, grant_time INTEGER NOT NULL,
                                       PRIMARY KEY (tenant, sha256));
CREATE INDEX IF NOT EXISTS blob_owner_sha256 ON blob_owner(sha256);
CREATE INDEX IF NOT EXISTS blob_owner_bytes ON blob_owner(tenant, bytes);
CREATE TABLE IF NOT EXISTS generation (only_row INTEGER PRIMARY KEY CHECK (only_row = 1),
                                       number INTEGER NOT NULL);
INSERT OR IGNORE INTO generation VALUES (1, 0);
)sql";

// Version 1 knew one tenant and no sizes. Its table is set aside, made anew and filled again.
inline constexpr char kLeaveVersion1[] = R"sql(
ALTER TABLE job RENAME TO job_version_1;
DROP INDEX job_state; DROP INDEX job_claim; DROP INDEX job_lease; DROP INDEX job_expire;
DROP INDEX job_input; DROP INDEX job_result;
)sql";
inline constexpr char kFillFromVersion1[] = R"sql(
INSERT INTO job(number, id, tenant, request_id, request_hash, state, queue_key, memory_bytes, spec,
                outcome, input_sha256, result_sha256, create_time, not_before, queue_deadline,
                start_time, end_time, expire_time, ttl, attempt, max_attempts, lease_epoch,
                cancel_requested)
  SELECT number, id, 'default', request_id, request_hash, CASE state WHEN 2 THEN 1 ELSE state END,
         create_time + 60000000 * priority, 0, spec, outcome, input_sha256, result_sha256,
         create_time, not_before, queue_deadline, start_time, end_time, expire_time, ttl, attempt,
         max_attempts, lease_epoch, cancel_requested
  FROM job_version_1;
INSERT OR IGNORE INTO tenant VALUES ('default', 1, 0, 0);
INSERT OR IGNORE INTO blob_owner SELECT 'default', input_sha256, 0, create_time FROM job;
INSERT OR IGNORE INTO blob_owner SELECT 'default', result_sha256, 0, create_time FROM job
  WHERE result_sha256 IS NOT NULL;
DROP TABLE job_version_1;
)sql";

// Version 2 did not know how long jobs are expected to take.
inline constexpr char kFromVersion2[] =
    "ALTER TABLE job ADD COLUMN expected_micros INTEGER NOT NULL DEFAULT 0";

inline constexpr int kSchemaVersion = 3;

}  // namespace amhex::server
