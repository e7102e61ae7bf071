// After closing: poor cells are absorbed and starred anew, neighbouring stars are joined.
#pragma once

#include "absl/status/statusor.h"
#include "amhex/params.h"
#include "amhex/run_context.h"
#include "assembly/cell_complex.h"
#include "input/hull.h"

namespace amhex {

// Joins neighbouring stars where that saves cells. A closed complex stays closed.
// Errors: CANCELLED, DEADLINE_EXCEEDED.
absl::StatusOr<CellComplex> JoinStars(const CellComplex& complex, const Hull& hull,
                                      RunContext& run);

// Replaces cells below `quality`, worst first, absorbing up to `depth` neighbours each. A closed
// complex stays closed. Errors: CANCELLED, DEADLINE_EXCEEDED.
absl::StatusOr<CellComplex> RepairCells(const CellComplex& complex, const Hull& hull,
                                        double quality, int depth, RunContext& run);

}  // namespace amhex
