// Puts vertices into a placed mesh's boundary where it stays too far from the hull, if that pays.
#pragma once

#include "absl/status/statusor.h"
#include "amhex/run_context.h"
#include "assembly/cell_complex.h"
#include "optimize/improve_mesh.h"

namespace amhex {

// What SplitAtGaps makes of the mesh where LossOf, with `good_minimum`, finds it the better one;
// else the mesh as it is. Errors: CANCELLED, DEADLINE_EXCEEDED.
absl::StatusOr<CellComplex> SplitWherePaid(CellComplex complex, const Improvement& with,
                                           double good_minimum, const RunContext& run);

}  // namespace amhex
