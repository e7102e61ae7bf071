// The last stage but one: vertices to their places, poor cells replaced, vertices again.
#pragma once

#include "absl/status/statusor.h"
#include "amhex/params.h"
#include "amhex/run_context.h"
#include "assembly/cell_complex.h"
#include "input/hull.h"

namespace amhex {

class DeviceUse;

// Alternates PlaceVertices (geometry) with PeelStars, JoinStars and RepairCells (topology) until
// nothing is replaced or a bound on the rounds is reached, then RefillPlaces mends what is still
// poor. The complex must be closed and stays so. Vertices are placed on `device`, or on the CPU
// where it is null; RefillPlaces, with its many small parts, stays on the CPU.
// Errors: CANCELLED, DEADLINE_EXCEEDED, and those of RunOnCuda.
absl::StatusOr<CellComplex> ImproveMesh(CellComplex complex, const Hull& hull,
                                        const MeshingParams& params, RunContext& run,
                                        DeviceUse* device = nullptr);

}  // namespace amhex
