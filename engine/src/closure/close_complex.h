// The guarantee: whatever assembly left open is filled, or the run fails with the place.
//
// Cheapest repair first: loose cells go, faces near the hull snap to it, small cavities become
// stars, and what remains becomes Delaunay tetrahedra, whose slits stars close again. Not in the
// paper, whose assembly ends when no tetrahedron fits any more.
#pragma once

#include "absl/status/statusor.h"
#include "amhex/params.h"
#include "amhex/run_context.h"
#include "assembly/cell_complex.h"
#include "input/hull.h"

namespace amhex {

// Returns a complex without open faces: every face is shared by two cells or lies on the hull.
// Errors: CANCELLED, DEADLINE_EXCEEDED, INTERNAL (cavities that resist; the message tells where).
absl::StatusOr<CellComplex> CloseComplex(const CellComplex& complex, const Hull& hull,
                                         const MeshingParams& params, RunContext& run);

}  // namespace amhex
