// Places that hold the minimum, each opened, filled anew and placed on its own.
#pragma once

#include "absl/status/statusor.h"
#include "amhex/params.h"
#include "amhex/run_context.h"
#include "assembly/cell_complex.h"
#include "input/hull.h"
#include "optimize/hull_features.h"

namespace amhex {

// For a closed complex whose vertices are placed: opens the stars around poor cells, fills them
// anew in several ways, places the vertices of a few rings around, and keeps what makes the place
// better: fewer or less poor cells, and none poorer than the poorest before. Nothing elsewhere
// moves. Places that do not touch are worked on side by side; same result at any thread count.
// Errors: CANCELLED, DEADLINE_EXCEEDED.
absl::StatusOr<CellComplex> RefillPlaces(const CellComplex& complex, const Hull& hull,
                                         const HullFeatures& features, const MeshingParams& params,
                                         const RunContext& run);

}  // namespace amhex
