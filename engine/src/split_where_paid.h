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

// For a mesh whose rest has been drawn (optimize/draw_rest.h): faces are looked at as closely as
// there, and what SplitAtGaps makes of it is drawn once more. Coming near enough everywhere may
// cost a hundredth of the average. Meshes of points that scatter stay as they are.
absl::StatusOr<CellComplex> SplitRest(CellComplex complex, const Improvement& with,
                                      const RunContext& run);

}  // namespace amhex
