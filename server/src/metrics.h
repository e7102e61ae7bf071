// Every Prometheus family of the server, in one struct. Job ids are never labels.
#pragma once

#include <prometheus/counter.h>
#include <prometheus/family.h>
#include <prometheus/gauge.h>
#include <prometheus/histogram.h>
#include <prometheus/registry.h>

#include <cstdint>
#include <memory>
#include <string>

namespace amhex::server {

// Thread-safe.
class Metrics {
 public:
  explicit Metrics(const std::string& version);

  std::shared_ptr<prometheus::Registry> registry() const { return registry_; }

  // Counters.
  prometheus::Counter& jobs_submitted;
  prometheus::Counter& JobsFinished(const std::string& state, const std::string& reason);
  prometheus::Counter& Primitives(const std::string& type);
  prometheus::Counter& ProgressFrames(const std::string& outcome);  // sent, conflated
  prometheus::Counter& BlobBytes(const std::string& direction);     // in, out
  prometheus::Counter& DecodeRejected(const std::string& reason);
  prometheus::Counter& WorkerRestarts(const std::string& cause);
  prometheus::Counter& ResultCache(const std::string& result);  // hit, miss
  prometheus::Counter& lease_expired;
  prometheus::Counter& device_faults;

  // Gauges.
  prometheus::Gauge& JobsInState(const std::string& state);
  prometheus::Gauge& queue_oldest_age_seconds;
  prometheus::Gauge& queue_cost_seconds;
  prometheus::Gauge& watchers;
  prometheus::Gauge& blob_store_bytes;
  prometheus::Gauge& disk_free_bytes;
  prometheus::Gauge& memory_reserved_bytes;
  prometheus::Gauge& workers_ready;
  prometheus::Gauge& workers_quarantined;
  prometheus::Gauge& store_up;

  // Histograms.
  prometheus::Histogram& queue_wait_seconds;
  // By the cells of the mesh; of failed jobs, too, whose size is not known.
  prometheus::Histogram& JobDuration(int64_t cell_count);
  prometheus::Histogram& attempts;
  prometheus::Histogram& cancel_latency_seconds;
  prometheus::Histogram& memory_estimate_ratio;
  prometheus::Histogram& cells;
  prometheus::Histogram& hexahedra_ratio;
  prometheus::Histogram& StageDuration(const std::string& stage);
  // `method` as in amhex.v1.Mesher/GetJob, `status` as in NOT_FOUND.
  prometheus::Histogram& CallDuration(const std::string& method, const std::string& status);

 private:
  Metrics(const std::string& version, const std::shared_ptr<prometheus::Registry>& registry);

  std::shared_ptr<prometheus::Registry> registry_;
  prometheus::Family<prometheus::Counter>& finished_family_;
  prometheus::Family<prometheus::Counter>& primitives_family_;
  prometheus::Family<prometheus::Counter>& frames_family_;
  prometheus::Family<prometheus::Counter>& blob_bytes_family_;
  prometheus::Family<prometheus::Counter>& decode_rejected_family_;
  prometheus::Family<prometheus::Counter>& restarts_family_;
  prometheus::Family<prometheus::Counter>& result_cache_family_;
  prometheus::Family<prometheus::Gauge>& jobs_family_;
  prometheus::Family<prometheus::Histogram>& job_family_;
  prometheus::Family<prometheus::Histogram>& stage_family_;
  prometheus::Family<prometheus::Histogram>& call_family_;
};

}  // namespace amhex::server
