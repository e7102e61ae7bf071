// Merging upwards: cells cut out of stars, so that one cell stands where many met at an apex.
#pragma once

#include <cstdint>

#include "absl/status/statusor.h"
#include "amhex/run_context.h"
#include "assembly/cell_complex.h"

namespace amhex {

// Whether what remains of a star may have cells that fold (cell_quality.h) over a bent wall. Moving
// vertices straightens most of them; where they do not move any more, none may.
enum class StarFolds : uint8_t { kAllowed, kRefused };

// For every star (a vertex of pyramids and tetrahedra alone): looks among its walls for hexahedra,
// hexprisms, prisms and slices that have most of their faces there, and puts them in as long as
// that saves cells and what remains of the star stays good. A closed complex stays closed. Away
// from the hull it covers the same space; stars at the hull may get other hull faces
// (recap_star.h), which moves the hull by up to a sixth of an edge length there. Linear in the
// number of cells. Stars that `peeled` had too when it was given to this, with all that is around
// them, were looked at then. Errors: CANCELLED, DEADLINE_EXCEEDED.
absl::StatusOr<CellComplex> PeelStars(const CellComplex& complex, StarFolds folds,
                                      const RunContext& run, const CellComplex& peeled = {});

}  // namespace amhex
