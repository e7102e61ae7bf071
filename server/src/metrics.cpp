#include "metrics.h"

#include <utility>

namespace amhex::server {
namespace {

using prometheus::Counter;
using prometheus::Family;
using prometheus::Gauge;
using prometheus::Histogram;
using prometheus::Registry;
using Buckets = Histogram::BucketBoundaries;

// From a millisecond to the longest permitted run.
const Buckets& SecondsBuckets() {
  static const Buckets kBuckets = {0.001, 0.005, 0.01, 0.05, 0.1, 0.25, 0.5,  1,    2.5,
                                   5,     10,    25,   50,   100, 250,  1000, 3600, 14400};
  return kBuckets;
}

// By the least number of cells.
constexpr std::pair<int64_t, const char*> kSizeClasses[] = {
    {1, "to_1e3"}, {1'001, "to_1e4"}, {10'001, "to_1e5"}, {100'001, "to_1e6"}, {1'000'001, "more"}};

Family<Counter>& CounterFamily(Registry& registry, const char* name, const char* help) {
  return prometheus::BuildCounter().Name(name).Help(help).Register(registry);
}

Counter& OneCounter(Registry& registry, const char* name, const char* help) {
  return CounterFamily(registry, name, help).Add({});
}

Gauge& OneGauge(Registry& registry, const char* name, const char* help) {
  return prometheus::BuildGauge().Name(name).Help(help).Register(registry).Add({});
}

Family<Histogram>& HistogramFamily(Registry& registry, const char* name, const char* help) {
  return prometheus::BuildHistogram().Name(name).Help(help).Register(registry);
}

Histogram& OneHistogram(Registry& registry, const char* name, const char* help,
                        const Buckets& buckets) {
  return HistogramFamily(registry, name, help).Add({}, buckets);
}

}  // namespace

Metrics::Metrics(const std::string& version)
    : Metrics(version, std::make_shared<prometheus::Registry>()) {}

Metrics::Metrics(const std::string& version, const std::shared_ptr<Registry>& registry)
    : jobs_submitted(OneCounter(*registry, "amhex_jobs_submitted_total", "Jobs accepted.")),
      lease_expired(OneCounter(*registry, "amhex_lease_expired_total",
                               "Attempts whose lease ended without news.")),
      device_faults(OneCounter(*registry, "amhex_device_faults_total",
                               "Workers that ended because they had lost their device.")),
      queue_oldest_age_seconds(
          OneGauge(*registry, "amhex_queue_oldest_age_seconds", "Age of the oldest queued job.")),
      queue_cost_seconds(OneGauge(*registry, "amhex_queue_cost_seconds",
                                  "Time that the queued jobs are expected to take one core.")),
      watchers(OneGauge(*registry, "amhex_watchers", "Streams that watch a job.")),
      blob_store_bytes(
          OneGauge(*registry, "amhex_blob_store_bytes", "Bytes of all complete blobs.")),
      disk_free_bytes(OneGauge(*registry, "amhex_disk_free_bytes",
                               "Bytes that the disk of the blobs has left.")),
      memory_reserved_bytes(OneGauge(*registry, "amhex_memory_reserved_bytes",
                                     "Memory set aside for the running jobs.")),
      workers_ready(OneGauge(*registry, "amhex_workers_ready", "Workers that can take jobs.")),
      workers_quarantined(OneGauge(*registry, "amhex_workers_quarantined",
                                   "Workers that keep failing the trial job.")),
      store_up(
          OneGauge(*registry, "amhex_store_up", "1 while the store of the queue answers, else 0.")),
      queue_wait_seconds(OneHistogram(*registry, "amhex_queue_wait_seconds",
                                      "Time from submission to the first attempt.",
                                      SecondsBuckets())),
      attempts(OneHistogram(*registry, "amhex_attempts", "Attempts of finished jobs.",
                            {1, 2, 3, 4, 5, 10})),
      cancel_latency_seconds(OneHistogram(*registry, "amhex_cancel_latency_seconds",
                                          "Time from the wish to cancel to the free worker.",
                                          SecondsBuckets())),
      memory_estimate_ratio(
          OneHistogram(*registry, "amhex_memory_estimate_ratio",
                       "Memory set aside for succeeded jobs, over the most their worker has taken.",
                       {0.25, 0.5, 0.75, 1, 1.5, 2, 4, 8, 16})),
      cells(OneHistogram(*registry, "amhex_cells", "Cells of finished meshes.",
                         {100, 1e3, 1e4, 1e5, 1e6, 1e7})),
      hexahedra_ratio(OneHistogram(*registry, "amhex_hexahedra_ratio",
                                   "Hexahedra among the cells of finished meshes.",
                                   {0.1, 0.25, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99, 1})),
      registry_(registry),
      finished_family_(
          CounterFamily(*registry, "amhex_jobs_finished_total", "Jobs that became final.")),
      primitives_family_(
          CounterFamily(*registry, "amhex_primitives_total", "Cells made, by type.")),
      frames_family_(CounterFamily(*registry, "amhex_progress_frames_total",
                                   "Frames for watchers, by what became of them.")),
      blob_bytes_family_(
          CounterFamily(*registry, "amhex_blob_bytes_total", "Bytes of blobs moved.")),
      decode_rejected_family_(
          CounterFamily(*registry, "amhex_decode_rejected_total", "Inputs refused, by reason.")),
      restarts_family_(CounterFamily(*registry, "amhex_worker_restarts_total",
                                     "Workers replaced, by what ended them.")),
      result_cache_family_(CounterFamily(*registry, "amhex_result_cache_requests_total",
                                         "New jobs, by whether their result was there.")),
      jobs_family_(prometheus::BuildGauge()
                       .Name("amhex_jobs")
                       .Help("Jobs remembered, by state.")
                       .Register(*registry)),
      job_family_(HistogramFamily(*registry, "amhex_job_duration_seconds",
                                  "Time of the last attempt of finished jobs, by their cells.")),
      stage_family_(
          HistogramFamily(*registry, "amhex_stage_duration_seconds", "Time of finished stages.")),
      call_family_(HistogramFamily(*registry, "grpc_server_call_duration_seconds",
                                   "Time of calls, streams from their beginning to their end.")) {
  prometheus::BuildGauge()
      .Name("amhex_build_info")
      .Help("Always 1; the label tells the version.")
      .Register(*registry)
      .Add({{"version", version}})
      .Set(1);
}

Counter& Metrics::JobsFinished(const std::string& state, const std::string& reason) {
  return finished_family_.Add({{"state", state}, {"reason", reason}});
}
Counter& Metrics::Primitives(const std::string& type) {
  return primitives_family_.Add({{"type", type}});
}
Counter& Metrics::ProgressFrames(const std::string& outcome) {
  return frames_family_.Add({{"outcome", outcome}});
}
Counter& Metrics::BlobBytes(const std::string& direction) {
  return blob_bytes_family_.Add({{"dir", direction}});
}
Counter& Metrics::DecodeRejected(const std::string& reason) {
  return decode_rejected_family_.Add({{"reason", reason}});
}
Counter& Metrics::WorkerRestarts(const std::string& cause) {
  return restarts_family_.Add({{"cause", cause}});
}
Counter& Metrics::ResultCache(const std::string& result) {
  return result_cache_family_.Add({{"result", result}});
}
Gauge& Metrics::JobsInState(const std::string& state) {
  return jobs_family_.Add({{"state", state}});
}
Histogram& Metrics::StageDuration(const std::string& stage) {
  return stage_family_.Add({{"stage", stage}}, SecondsBuckets());
}
Histogram& Metrics::JobDuration(int64_t cell_count) {
  const char* size_class = "unknown";
  for (const auto& [least, name] : kSizeClasses) {
    if (cell_count >= least) size_class = name;
  }
  return job_family_.Add({{"size_class", size_class}}, SecondsBuckets());
}
Histogram& Metrics::CallDuration(const std::string& method, const std::string& status) {
  return call_family_.Add({{"method", method}, {"status", status}}, SecondsBuckets());
}

}  // namespace amhex::server
