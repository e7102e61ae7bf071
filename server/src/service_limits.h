// Every bound on what clients may ask for, in one place. Told to clients by GetCapabilities.
#pragma once

#include <cstdint>

#include "absl/time/time.h"
#include "amhex/v1/capabilities.pb.h"

namespace amhex::server {

inline constexpr int64_t kKibibyte = 1024;
inline constexpr int64_t kMebibyte = 1024 * kKibibyte;

struct Limits {
  int64_t max_inline_input_bytes = kMebibyte;
  int64_t max_blob_bytes = 256 * kMebibyte;
  int64_t max_message_bytes = 4 * kMebibyte;  // gRPC's own default
  int64_t preferred_chunk_bytes = kMebibyte;
  int64_t max_point_count = 50'000'000;
  int64_t max_triangle_count = 100'000'000;
  int32_t max_attribute_count = 16;
  int32_t max_queued_job_count = 10'000;
  int32_t max_label_count = 32;
  int32_t max_label_bytes = 256;
  int32_t max_watcher_count = 256;          // of one job
  int32_t max_tenant_watcher_count = 1024;  // of one tenant: what one connection can carry
  int32_t max_upload_count = 64;
  // What one tenant may have of them, so that none can take all: three quarters, rounded up.
  int32_t max_tenant_upload_count() const { return max_upload_count - max_upload_count / 4; }
  int32_t max_page_size = 1000;
  int64_t max_worker_memory_bytes = 0;   // 0: no bound
  int64_t max_running_memory_bytes = 0;  // of all jobs that run, as predicted; 0: no bound
  int64_t max_blob_store_bytes = 0;      // 0: no bound
  // Inputs leave so much of the disk to the queue and to results; as much as the result of a
  // million cells takes.
  int64_t min_free_disk_bytes = 64 * kMebibyte;
  int32_t max_attempts = 3;
  // What has killed so many workers is refused for so long; zero: never.
  absl::Duration quarantine_duration = absl::Hours(1);
  // Older connections take no new calls, so that balancers can spread callers; zero: none is.
  absl::Duration max_connection_age = absl::Minutes(30);
  absl::Duration max_run_duration = absl::Hours(4);
  absl::Duration max_retention_duration = absl::Hours(24 * 30);
  absl::Duration default_retention_duration = absl::Hours(24 * 7);
};

// Bounds that no operator needs to change.
inline constexpr int kDefaultPageSize = 50;
inline constexpr int kMaxPriority = 100;
inline constexpr int kDefaultPriority = 50;
inline constexpr int kMaxFindMissingBlobs = 1000;

amhex::v1::Limits ToProto(const Limits& limits);

}  // namespace amhex::server
