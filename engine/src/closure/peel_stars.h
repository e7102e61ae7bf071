// Merging upwards: cells cut out of stars, so that one cell stands where many met at an apex.
#pragma once

#include "absl/status/statusor.h"
#include "amhex/run_context.h"
#include "assembly/cell_complex.h"

namespace amhex {

// For every star inside the mesh (a vertex of pyramids and tetrahedra alone): looks among its walls
// for hexahedra, hexprisms, prisms and slices that have most of their faces there, and puts them in
// as long as that saves cells and what remains of the star stays good. A closed complex stays
// closed and covers the same space; its hull faces stay. Linear in the number of cells. Errors:
// CANCELLED, DEADLINE_EXCEEDED.
absl::StatusOr<CellComplex> PeelStars(const CellComplex& complex, const RunContext& run);

}  // namespace amhex
