// After closing: poor cells are absorbed and starred anew, neighbouring stars are joined.
#pragma once

#include "absl/status/statusor.h"
#include "amhex/params.h"
#include "amhex/run_context.h"
#include "assembly/cell_complex.h"
#include "input/hull.h"

namespace amhex {

// Replaces cells below `quality` and joins stars where that saves cells; a closed complex stays
// closed. Errors: CANCELLED, DEADLINE_EXCEEDED.
absl::StatusOr<CellComplex> ImproveClosure(const CellComplex& complex, const Hull& hull,
                                           double quality, int depth, RunContext& run);

}  // namespace amhex
