// Which of the closed trials the mesh is made from.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "amhex/params.h"
#include "amhex/run_context.h"
#include "assembly/cell_complex.h"
#include "input/hull.h"
#include "trials.h"

namespace amhex {

struct PlacedTrial {
  CellComplex complex;
  std::vector<std::string> device_notes;  // what the device had no room for, each once
};

// Assembles one trial more; empty: there is none.
using SpareTrial = std::function<absl::StatusOr<AssembledTrials>()>;

// Stage place_vertices: the best of the closed trials with its vertices in their places and its
// poor places refilled. One that waits is closed, and `spare` assembled, where otherwise a poor
// cell is left, a part of the solid is lost, the boundary stays too far from the hull or no mesh is
// valid. Where none is with any of them, the trials are filled anew; what comes back is invalid
// only where that was in vain, too.
// Errors: CANCELLED, DEADLINE_EXCEEDED, INTERNAL, and those of RunOnCuda.
absl::StatusOr<PlacedTrial> PlaceBestTrial(const std::vector<CellComplex>& assemblies,
                                           ClosedTrials trials, const Hull& hull,
                                           const MeshingParams& params, RunContext& run,
                                           const SpareTrial& spare = {});

}  // namespace amhex
