// Cells that are no hexahedra, put together anew where the vertices have come to admit it.
#pragma once

#include "absl/status/statusor.h"
#include "amhex/run_context.h"
#include "assembly/cell_complex.h"

namespace amhex {

// What filled a cavity was chosen before its vertices moved. Then some of it may be larger cells:
// two triangles have become flat enough for a quad, and what lies behind them on either side a
// prism, a slice or a hexahedron. These are looked for among all cells that are no hexahedra and
// taken, several at a time where one needs the other, as long as that gains
// (reassembly/merge_cells): none of a scaled Jacobian below 0.2, which moving vertices will raise,
// and none that encloses a hexahedron. No vertex moves; a quad on the hull bends by at most 30
// degrees, and by less than `sharp_angle_degrees`, from which on creases are kept. A closed complex
// stays closed, and its cells in their order, a larger one where its first part was.
//
// Linear in the number of cells. Same result at any thread count. Errors: CANCELLED,
// DEADLINE_EXCEEDED.
absl::StatusOr<CellComplex> MergeOthers(CellComplex complex, double sharp_angle_degrees,
                                        RunContext& run);

}  // namespace amhex
