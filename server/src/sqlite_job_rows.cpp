#include "sqlite_job_rows.h"

#include "job_id.h"
#include "time_convert.h"

namespace amhex::server {

using amhex::v1::Job;

Job ReadJob(const SqliteStatement& row) {
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
