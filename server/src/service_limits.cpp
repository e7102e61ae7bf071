#include "service_limits.h"

#include "time_convert.h"

namespace amhex::server {

amhex::v1::Limits ToProto(const Limits& limits) {
  amhex::v1::Limits out;
  out.set_max_inline_input_bytes(limits.max_inline_input_bytes);
  out.set_max_blob_bytes(limits.max_blob_bytes);
  out.set_max_message_bytes(limits.max_message_bytes);
  out.set_preferred_chunk_bytes(limits.preferred_chunk_bytes);
  out.set_max_point_count(limits.max_point_count);
  out.set_max_triangle_count(limits.max_triangle_count);
  out.set_max_attribute_count(limits.max_attribute_count);
  out.set_max_queued_job_count(limits.max_queued_job_count);
  out.set_max_label_count(limits.max_label_count);
  out.set_max_label_bytes(limits.max_label_bytes);
  out.set_max_watcher_count(limits.max_watcher_count);
  out.set_max_upload_count(limits.max_upload_count);
  out.set_max_page_size(limits.max_page_size);
  out.set_max_worker_memory_bytes(limits.max_worker_memory_bytes);
  out.set_max_running_memory_bytes(limits.max_running_memory_bytes);
  out.set_max_tenant_watcher_count(limits.max_tenant_watcher_count);
  out.set_max_blob_store_bytes(limits.max_blob_store_bytes);
  out.set_min_free_disk_bytes(limits.min_free_disk_bytes);
  out.set_max_attempts(limits.max_attempts);
  *out.mutable_quarantine_duration() = ToProto(limits.quarantine_duration);
  *out.mutable_max_connection_age() = ToProto(limits.max_connection_age);
  *out.mutable_max_run_duration() = ToProto(limits.max_run_duration);
  *out.mutable_max_retention_duration() = ToProto(limits.max_retention_duration);
  *out.mutable_default_retention_duration() = ToProto(limits.default_retention_duration);
  return out;
}

}  // namespace amhex::server
