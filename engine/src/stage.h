// Runs one stage: times it, reports it, turns what it throws into a status.
#pragma once

#include <chrono>
#include <new>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "amhex/run_context.h"
#include "base/status_error.h"
#include "base/stop_poll.h"
#include "cuda/device_time.h"

namespace amhex {

// Peak resident memory of this process so far, in bytes.
int64_t PeakMemoryBytes();

// Calls `body`, which returns absl::StatusOr<T>, as stage `stage` of `run`. The one place where
// exceptions end: RunStopped becomes the run's status, StatusError its own, std::bad_alloc
// RESOURCE_EXHAUSTED, any other INTERNAL.
template <class Body>
std::invoke_result_t<Body> GuardStage(RunContext& run, Stage stage, Body&& body) {
  if (absl::Status status = run.CheckStop(); !status.ok()) return status;
  run.BeginStage(stage);
  const auto start = RunContext::Clock::now();
  const double device_start = DeviceSecondsOfThread();
  try {
    std::invoke_result_t<Body> result = body();
    if (!result.ok()) {
      return absl::Status(result.status().code(),
                          absl::StrCat(StageName(stage), ": ", result.status().message()));
    }
    StageReport report;
    report.stage = stage;
    report.wall_seconds = std::chrono::duration<double>(RunContext::Clock::now() - start).count();
    report.device_seconds = DeviceSecondsOfThread() - device_start;
    report.peak_memory_bytes = PeakMemoryBytes();
    run.EndStage(report);
    return result;
  } catch (const RunStopped&) {
    return run.CheckStop();
  } catch (const StatusError& error) {
    return absl::Status(error.status().code(),
                        absl::StrCat(StageName(stage), ": ", error.status().message()));
  } catch (const std::bad_alloc&) {
    return absl::ResourceExhaustedError(
        absl::StrCat(StageName(stage), ": out of memory after ", PeakMemoryBytes(),
                     " bytes; ask for fewer cells or raise the memory limit"));
  } catch (const std::exception& error) {
    return absl::InternalError(absl::StrCat(StageName(stage), ": ", error.what()));
  }
}

// What comes next is one of `count` equal parts of the stage.
inline void SetPart(size_t index, size_t count, RunContext& run) {
  const auto of = static_cast<double>(count);
  run.SetStagePart(static_cast<double>(index) / of, static_cast<double>(index + 1) / of);
}

}  // namespace amhex
