#include "postgres_job_rows.h"

#include "job_record.h"
#include "status_macros.h"

namespace amhex::server {
using amhex::v1::Job;

PostgresJob ReadJob(const PostgresRows& row) {
  PostgresJob read;
  read.number = row.IntColumn(kNumber);
  read.id = row.TextColumn(kId);
  read.epoch = row.IntColumn(kLeaseEpoch);
  read.job = ReadJobColumns(row);
  return read;
}

absl::StatusOr<Job> GetJob(PostgresConnection& connection, const std::string& id) {
  AMHEX_ASSIGN_OR_RETURN(auto rows, connection.Run(std::string(kSelectJob) + "WHERE id = $1",
                                                   PostgresValues().Text(id)));
  if (!rows.Next()) return JobNotFound(id);
  return ReadJob(rows).job;
}

}  // namespace amhex::server
