#include "postgres_job_rows.h"

#include "job_id.h"
#include "job_record.h"
#include "status_macros.h"
#include "time_convert.h"

namespace amhex::server {
namespace {

// The columns of kSelectPostgresJob.
enum Column {
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

}  // namespace

using amhex::v1::Job;

PostgresJob ReadJob(const PostgresRows& row) {
  PostgresJob read;
  read.number = row.IntColumn(kNumber);
  read.id = row.TextColumn(kId);
  read.epoch = row.IntColumn(kLeaseEpoch);
  Job& job = read.job;
  job.ParseFromString(row.TextColumn(kSpec));
  if (!row.IsNull(kOutcome)) job.MergeFromString(row.TextColumn(kOutcome));
  job.set_name(JobName(read.id));
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
  return read;
}

absl::StatusOr<Job> GetJob(PostgresConnection& connection, const std::string& id) {
  AMHEX_ASSIGN_OR_RETURN(
      auto rows,
      connection.Run(std::string(kSelectPostgresJob) + "WHERE id = $1", PostgresValues().Text(id)));
  if (!rows.Next()) return JobNotFound(id);
  return ReadJob(rows).job;
}

}  // namespace amhex::server
