#include "worker/job_run.h"

#include <fcntl.h>
#include <sys/resource.h>

#include <chrono>
#include <exception>
#include <iostream>
#include <new>
#include <utility>

#include "absl/time/time.h"
#include "convert.h"
#include "errors.h"
#include "files.h"
#include "mesh_codec.h"
#include "monotonic_clock.h"
#include "status_macros.h"
#include "surface_codec.h"
#include "time_convert.h"
#include "worker/remaining_time.h"

namespace amhex::server {
namespace {

using amhex::worker::Finished;
using amhex::worker::FromWorker;

// Progress frames are at least this far apart, changes of stage excepted.
constexpr auto kMinFrameInterval = std::chrono::milliseconds(50);

int64_t PeakMemoryBytes() {
  rusage usage;
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<int64_t>(usage.ru_maxrss) * 1024;
}

// Reports the worker's own stages, which the engine does not know.
class OwnStage {
 public:
  OwnStage(amhex::v1::Stage stage, const SendNews& send)
      : stage_(stage), send_(send), start_(MonotonicNow()) {
    FromWorker news;
    news.mutable_progress()->set_stage(stage);
    send_(news);
  }

  void Done(size_t io_bytes) {
    FromWorker news;
    news.mutable_stage()->set_io_bytes(static_cast<int64_t>(io_bytes));
    news.mutable_stage()->set_stage(stage_);
    *news.mutable_stage()->mutable_wall_duration() = ToProto(MonotonicNow() - start_);
    news.mutable_stage()->set_peak_memory_bytes(PeakMemoryBytes());
    send_(news);
  }

 private:
  const amhex::v1::Stage stage_;
  const SendNews& send_;
  const absl::Time start_;
};

Limits DecodeLimits(const amhex::worker::RunJob& order) {
  Limits limits;
  limits.max_point_count = order.input_limits().max_point_count();
  limits.max_triangle_count = order.input_limits().max_triangle_count();
  limits.max_attribute_count = order.input_limits().max_attribute_count();
  return limits;
}

// Gives the engine's error the reason its code stands for.
absl::Status WithReason(const absl::Status& error) {
  if (!ReasonOf(error).empty()) return error;
  const auto reason = [&error] {
    switch (error.code()) {
      case absl::StatusCode::kInvalidArgument:
      case absl::StatusCode::kOutOfRange:
        return amhex::v1::INPUT_INVALID;
      case absl::StatusCode::kFailedPrecondition:
        return amhex::v1::BACKEND_UNAVAILABLE;
      case absl::StatusCode::kResourceExhausted:
        return amhex::v1::OUT_OF_MEMORY;
      case absl::StatusCode::kDeadlineExceeded:
        return amhex::v1::RUN_TIMEOUT;
      case absl::StatusCode::kCancelled:
        return amhex::v1::CANCEL_REQUESTED;
      default:
        return amhex::v1::NO_VALID_MESH;
    }
  }();
  return MakeError(error.code(), reason, std::string(error.message()));
}

void RelayProgress(const SendNews& send, double expected_seconds, RunContext* context) {
  using Clock = std::chrono::steady_clock;
  context->on_progress = [send, remaining = RemainingTime(expected_seconds), start = Clock::now(),
                          last_time = Clock::time_point::min(),
                          last_stage = -1](const Progress& progress) mutable {
    const Clock::time_point now = Clock::now();
    const int stage = static_cast<int>(progress.stage);
    const bool stage_changed = stage != last_stage;
    if (!stage_changed && now - last_time < kMinFrameInterval) return;
    last_time = now;
    last_stage = stage;
    FromWorker news;
    *news.mutable_progress() = ToProto(progress);
    const double elapsed = std::chrono::duration<double>(now - start).count();
    *news.mutable_progress()->mutable_remaining_duration() =
        ToProto(absl::Seconds(remaining.Seconds(progress.stage, progress.stage_fraction, elapsed)));
    send(news);
  };
  context->on_stage_done = [send](const StageReport& report) {
    FromWorker news;
    *news.mutable_stage() = ToProto(report);
    send(news);
  };
}

absl::StatusOr<MeshingInput> ReadInput(const amhex::worker::RunJob& order, const SendNews& send) {
  OwnStage stage(amhex::v1::STAGE_DECODE_INPUT, send);
  AMHEX_ASSIGN_OR_RETURN(const std::string bytes, ReadWholeFile(order.input_path()));
  AMHEX_ASSIGN_OR_RETURN(MeshingInput input,
                         DecodeInput(order.input_encoding(), bytes, DecodeLimits(order)));
  stage.Done(bytes.size());
  return input;
}

// What only the geometry tells: the server has admitted the job without it.
absl::Status CheckMemory(const CostEstimate& estimate, int64_t limit) {
  if (limit <= 0 || estimate.memory_bytes <= limit) return absl::OkStatus();
  return MakeError(absl::StatusCode::kResourceExhausted, amhex::v1::OUT_OF_MEMORY,
                   "about " + std::to_string(estimate.memory_bytes) + " bytes are needed for " +
                       std::to_string(estimate.cell_count) + " cells; a job may take " +
                       std::to_string(limit),
                   {{"expected_bytes", std::to_string(estimate.memory_bytes)},
                    {"limit_bytes", std::to_string(limit)}});
}

absl::StatusOr<Finished> Run(const amhex::worker::RunJob& order, const SendNews& send,
                             RunContext* context) {
  if (order.has_run_timeout()) {
    const absl::Duration timeout = FromProto(order.run_timeout());
    context->SetDeadline(RunContext::Clock::now() +
                         absl::ToChronoNanoseconds(std::min(timeout, absl::Hours(24 * 365))));
  }
  AMHEX_ASSIGN_OR_RETURN(const MeshingInput input, ReadInput(order, send));
  const MeshingParams params = ToEngine(order.params());
  Finished finished;
  if (order.estimate_only()) {
    AMHEX_ASSIGN_OR_RETURN(const CostEstimate estimate, EstimateCost(input.hull, params));
    *finished.mutable_estimate() = ToProto(estimate);
    return finished;
  }
  AMHEX_RETURN_IF_ERROR(context->CheckStop());
  // An estimate that cannot be had is an error that the engine will tell better, but for memory
  // that is not there: then nothing is begun.
  const auto estimate = EstimateCost(input.hull, params);
  if (absl::IsResourceExhausted(estimate.status())) return estimate.status();
  if (estimate.ok()) AMHEX_RETURN_IF_ERROR(CheckMemory(*estimate, order.memory_limit_bytes()));
  RelayProgress(send, estimate.ok() ? estimate->seconds : 0, context);
  AMHEX_ASSIGN_OR_RETURN(const MeshingResult result, Mesh(input, params, *context));
  OwnStage stage(amhex::v1::STAGE_ENCODE_RESULT, send);
  AMHEX_RETURN_IF_ERROR(WriteMeshFile(result.mesh, order.output_path()));
  AMHEX_ASSIGN_OR_RETURN(const UniqueFd written, OpenFile(order.output_path(), O_RDONLY));
  AMHEX_ASSIGN_OR_RETURN(const int64_t written_bytes, FileSize(written.get()));
  *finished.mutable_result() = ToProto(result);
  finished.mutable_result()->set_encoding(amhex::v1::MESH_ENCODING_ARRAYS);
  stage.Done(static_cast<size_t>(written_bytes));
  return finished;
}

}  // namespace

amhex::worker::Finished RunJob(const amhex::worker::RunJob& order, const SendNews& send,
                               RunContext* context) {
  absl::StatusOr<Finished> finished = absl::InternalError("the job did not run");
  try {
    finished = Run(order, send, context);
  } catch (const std::bad_alloc&) {
    finished = MakeError(absl::StatusCode::kResourceExhausted, amhex::v1::OUT_OF_MEMORY,
                         "the job needs more memory than a worker may take");
  } catch (const std::exception& exception) {
    // What it says is for the log: it may name files.
    std::cerr << "amhex-worker: exception: " << exception.what() << std::endl;
    finished = ServerFault("the job ended with an exception");
  }
  if (finished.ok()) return *std::move(finished);
  Finished failed;
  *failed.mutable_error() = ToRpcStatus(WithReason(finished.status()));
  return failed;
}

}  // namespace amhex::server
