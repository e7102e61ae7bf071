// The engine's one entry point.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "amhex/input_hull.h"
#include "amhex/params.h"
#include "amhex/run_context.h"
#include "amhex/volume_mesh.h"

namespace amhex {

struct MeshingResult {
  AtMostHexaMesh mesh;  // valid: conforming, closed, every cell positive
  MeshStatistics statistics;
  std::vector<StageReport> stages;    // kStageCount entries, in order
  MeshingParams effective_params;     // defaults resolved; a rerun with these gives the same bits
  std::string backend_note;           // which backend ran and why
  std::vector<std::string> warnings;  // e.g. "the input has 5 openings, closed by the engine"
};

// Meshes `hull`. Same input, parameters and backend give the same bits at any thread count.
//
// Errors: INVALID_ARGUMENT (bad parameter or input, names the offending field or index),
// FAILED_PRECONDITION (CUDA asked for and not available), CANCELLED, DEADLINE_EXCEEDED,
// RESOURCE_EXHAUSTED (memory), INTERNAL (no valid mesh was found; the message names the place).
// Time and memory are linear in the number of cells plus O(n log n) in the input's size.
absl::StatusOr<MeshingResult> Mesh(const InputHull& hull, const MeshingParams& params,
                                   RunContext& run);

// The same with cells aligned to what `input.guidance` holds. A volume mesh that is reassembled
// takes no guidance (INVALID_ARGUMENT): none of its vertices moves.
absl::StatusOr<MeshingResult> Mesh(const MeshingInput& input, const MeshingParams& params,
                                   RunContext& run);

// What a run would cost, without running it; used by admission and by `validate_only`.
struct CostEstimate {
  int64_t cell_count = 0;
  int64_t memory_bytes = 0;
  // Peak on a CUDA device if the run uses one; 0 for Backend::kCpu.
  int64_t device_memory_bytes = 0;
  double seconds = 0;
};
// Errors: INVALID_ARGUMENT and OUT_OF_RANGE (bad parameter, bad input), RESOURCE_EXHAUSTED with the
// numbers (more memory than run.memory_limit_bytes, or than the device has that is asked for).
absl::StatusOr<CostEstimate> EstimateCost(const InputHull& hull, const MeshingParams& params);

// The same without the geometry, for an input of so many triangles, points or cells. Where only the
// geometry tells, because params.sizing gives an edge length, cell_count and memory_bytes are 0 and
// seconds those of the default number of cells.
CostEstimate PredictCost(const MeshingParams& params, int64_t input_element_count);

// One line per usable backend, e.g. "cpu (2 threads)"; the reason for each that is not.
struct BackendInfo {
  Backend backend = Backend::kCpu;
  bool available = false;
  std::string description;
  int64_t memory_bytes = 0;  // of the device; 0 for the CPU and without a device
};
std::vector<BackendInfo> ListBackends();

// Whether a run of this process ended in a fault after which CUDA refuses every further call, such
// as a bad access on the device. Only a new process can use the device again.
bool IsDeviceLost();

// "amhex 0.1.0 (<git description>)"; part of result-cache keys.
std::string EngineVersion();

}  // namespace amhex
