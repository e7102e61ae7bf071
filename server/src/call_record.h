// How long a call took and how it ended, for the metrics.
#pragma once

#include <grpcpp/support/status.h>

#include "absl/status/status.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "grpc_status.h"
#include "metrics.h"
#include "monotonic_clock.h"

namespace amhex::server {

// Made when the call comes; one per call.
class CallRecord {
 public:
  // `method` as in amhex.v1.Mesher/GetJob; it must outlive this object.
  CallRecord(Metrics* metrics, const char* method) : metrics_(metrics), method_(method) {}

  // What to finish the call with; to be called once.
  grpc::Status End(const absl::Status& status) const {
    metrics_->CallDuration(method_, absl::StatusCodeToString(status.code()))
        .Observe(absl::ToDoubleSeconds(MonotonicNow() - begin_));
    return ToGrpc(status);
  }

 private:
  Metrics* const metrics_;
  const char* const method_;
  const absl::Time begin_ = MonotonicNow();
};

}  // namespace amhex::server
