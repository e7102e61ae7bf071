// Rows of the job table in PostgreSQL: its schema, and how a row becomes a Job.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "job_columns.h"
#include "job_store.h"
#include "postgres.h"

namespace amhex::server {

// The same columns as in sqlite_job_rows.h; times are microseconds since 1970. What changes with
// every heartbeat lies in `lease`, a small table without secondary indexes, so that renewing costs
// neither index entries nor copies of wide rows. The unique index on running twins lets one job of
// a cache_key run at a time, however many nodes claim at once.
inline constexpr char kPostgresSchema[] = R"sql(
CREATE TABLE IF NOT EXISTS job (
  number bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
  id text NOT NULL UNIQUE,
  tenant text NOT NULL,
  request_id text,
  request_hash text NOT NULL,
  cache_key text,
  state smallint NOT NULL CHECK (state BETWEEN 1 AND 5),
  queue_key bigint NOT NULL,
  memory_bytes bigint NOT NULL,
  expected_micros bigint NOT NULL DEFAULT 0,
  spec bytea NOT NULL,
  outcome bytea,
  input_sha256 text NOT NULL,
  result_sha256 text,
  create_time bigint NOT NULL,
  not_before bigint NOT NULL,
  queue_deadline bigint,
  start_time bigint,
  end_time bigint,
  expire_time bigint,
  ttl bigint NOT NULL,
  attempt integer NOT NULL DEFAULT 0,
  max_attempts integer NOT NULL,
  lease_epoch bigint NOT NULL DEFAULT 0,
  cancel_requested boolean NOT NULL DEFAULT false,
  UNIQUE (tenant, request_id)
);
CREATE INDEX IF NOT EXISTS job_claim ON job(tenant, queue_key, number) WHERE state = 1;
CREATE INDEX IF NOT EXISTS job_deadline ON job(queue_deadline) WHERE state = 1;
CREATE INDEX IF NOT EXISTS job_oldest ON job(create_time) WHERE state = 1;
CREATE INDEX IF NOT EXISTS job_running ON job(tenant, start_time) WHERE state = 2;
CREATE UNIQUE INDEX IF NOT EXISTS job_running_twin ON job(tenant, cache_key) WHERE state = 2;
CREATE INDEX IF NOT EXISTS job_expire ON job(expire_time) WHERE state >= 3;
CREATE INDEX IF NOT EXISTS job_end ON job(end_time) WHERE state >= 3;
CREATE INDEX IF NOT EXISTS job_state ON job(state);
CREATE INDEX IF NOT EXISTS job_list ON job(tenant, number);
CREATE INDEX IF NOT EXISTS job_cache ON job(tenant, cache_key) WHERE cache_key IS NOT NULL;
CREATE INDEX IF NOT EXISTS job_input ON job(input_sha256);
CREATE INDEX IF NOT EXISTS job_result ON job(result_sha256) WHERE result_sha256 IS NOT NULL;
CREATE TABLE IF NOT EXISTS lease (
  job_id text PRIMARY KEY REFERENCES job(id) ON DELETE CASCADE,
  epoch bigint NOT NULL,
  node text NOT NULL,
  worker text NOT NULL,
  address text NOT NULL,
  until bigint NOT NULL
) WITH (fillfactor = 50);
CREATE TABLE IF NOT EXISTS tenant (
  name text PRIMARY KEY, weight bigint NOT NULL, max_running bigint NOT NULL,
  served bigint NOT NULL) WITH (fillfactor = 50);
CREATE TABLE IF NOT EXISTS blob_owner (
  tenant text NOT NULL, sha256 text NOT NULL, bytes bigint NOT NULL, grant_time bigint NOT NULL,
  PRIMARY KEY (tenant, sha256));
CREATE INDEX IF NOT EXISTS blob_owner_sha256 ON blob_owner(sha256);
CREATE SEQUENCE IF NOT EXISTS generation;
CREATE TABLE IF NOT EXISTS schema_version (number integer NOT NULL);
INSERT INTO schema_version SELECT 2 WHERE NOT EXISTS (SELECT 1 FROM schema_version);
)sql";

// Version 1 did not know how long jobs are expected to take. Its nodes that still run go on.
inline constexpr char kPostgresFromVersion1[] = R"sql(
ALTER TABLE job ADD COLUMN expected_micros bigint NOT NULL DEFAULT 0;
UPDATE schema_version SET number = 2;
)sql";

inline constexpr int kPostgresSchemaVersion = 2;

// Every node waits for it before it looks at the schema; any number that nothing else uses.
inline constexpr int64_t kSchemaLock = 0x616d686578;
// The first half of the keys of the locks on blobs; the second half is a hash of the blob's digest.
inline constexpr int64_t kBlobLocks = 0x626c6f62;
// The channel on which changed jobs are announced by their ids.
inline constexpr char kJobChannel[] = "amhex_job";

// One row of kSelectJob.
struct PostgresJob {
  int64_t number = 0;
  std::string id;
  int64_t epoch = 0;
  amhex::v1::Job job;
};

PostgresJob ReadJob(const PostgresRows& row);

// NOT_FOUND JOB_NOT_FOUND.
absl::StatusOr<amhex::v1::Job> GetJob(PostgresConnection& connection, const std::string& id);

}  // namespace amhex::server
