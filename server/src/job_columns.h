// The columns of the table of jobs as both stores read them, and the job they hold.
#pragma once

#include "absl/time/time.h"
#include "amhex/v1/job.pb.h"
#include "job_id.h"
#include "time_convert.h"

namespace amhex::server {

// Begins a statement whose rows ReadJobColumns understands; in the order of JobColumn.
inline constexpr char kSelectJob[] =
    "SELECT number, id, tenant, state, spec, outcome, create_time, start_time, end_time,"
    " expire_time, attempt, cancel_requested, lease_epoch, max_attempts, memory_bytes FROM job ";

enum JobColumn {
  kNumber,
  kId,
  kTenant,
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
  kMaxAttempts,
  kMemoryBytes
};

// The job in the current row. `Row` is SqliteStatement or PostgresRows.
template <class Row>
amhex::v1::Job ReadJobColumns(const Row& row) {
  using amhex::v1::Job;
  Job job;
  job.ParseFromString(row.TextColumn(kSpec));
  if (!row.IsNull(kOutcome)) job.MergeFromString(row.TextColumn(kOutcome));
  job.set_name(JobName(row.TextColumn(kId)));
  job.set_tenant(row.TextColumn(kTenant));
  job.set_expected_memory_bytes(row.IntColumn(kMemoryBytes));
  job.set_state(static_cast<Job::State>(row.IntColumn(kState)));
  job.set_attempt_count(static_cast<int32_t>(row.IntColumn(kAttempt)));
  job.set_max_attempts(static_cast<int32_t>(row.IntColumn(kMaxAttempts)));
  job.set_cancel_requested(row.IntColumn(kCancelRequested) != 0);
  const auto time = [&row](int column) {
    return ToProto(absl::FromUnixMicros(row.IntColumn(column)));
  };
  *job.mutable_create_time() = time(kCreateTime);
  if (!row.IsNull(kStartTime)) *job.mutable_start_time() = time(kStartTime);
  if (!row.IsNull(kEndTime)) *job.mutable_end_time() = time(kEndTime);
  if (!row.IsNull(kExpireTime)) *job.mutable_expire_time() = time(kExpireTime);
  return job;
}

}  // namespace amhex::server
