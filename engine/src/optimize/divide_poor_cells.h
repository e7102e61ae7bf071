// Poor cells that no filling of their places has mended.
#pragma once

#include "absl/status/statusor.h"
#include "assembly/cell_complex.h"
#include "optimize/place_refill.h"

namespace amhex {

// A few of the poorest cells below kPoor, one after the other, fewer where they resist: a face or
// an edge of the cell gets a vertex in its middle, on the hull if it lies on the boundary, or one
// of its vertices goes with all cells around it and the room is filled anew; the best of these ways
// is taken where cells then lack less, none is poorer, and the boundary is as lawful and as near to
// the hull as it was. What lies farther than some edge lengths from such a cell stays as it is.
// Linear in the number of cells, and some seconds of one core for each cell. Errors: CANCELLED,
// DEADLINE_EXCEEDED.
absl::StatusOr<CellComplex> DividePoorCells(CellComplex complex, const RefillWith& with);

}  // namespace amhex
