// The guarantee: whatever assembly left open is filled, or the run fails with the place.
//
// Cheapest repair first: loose cells go, faces near the hull snap to it, small cavities become
// stars, large networks of slits are carved into stars part by part, and what remains becomes
// Delaunay tetrahedra, whose slits stars close again. Not in the paper, whose assembly ends when no
// tetrahedron fits any more.
#pragma once

#include "absl/status/statusor.h"
#include "amhex/params.h"
#include "amhex/run_context.h"
#include "assembly/cell_complex.h"
#include "input/hull.h"

namespace amhex {

// Returns a complex without open faces: every face is shared by two cells or lies on the hull.
// A higher `attempt` gives another filling, over voids that are that many cells wider; 0 first.
// Errors: CANCELLED, DEADLINE_EXCEEDED, INTERNAL (cavities that resist, the message tells where; no
// cell left).
absl::StatusOr<CellComplex> CloseComplex(const CellComplex& complex, const Hull& hull,
                                         const MeshingParams& params, RunContext& run,
                                         int attempt = 0);

// For a closed complex whose vertices have moved since: opens the mesh `layers` cells around the
// defects of its boundary (boundary_defects.h) and closes it again. Without defects the complex
// comes back as it is. Errors: as CloseComplex.
struct Mended {
  CellComplex complex;
  bool changed = false;
};
absl::StatusOr<Mended> MendBoundary(const CellComplex& complex, const Hull& hull, int layers,
                                    const MeshingParams& params, RunContext& run);

// For a closed complex: takes out the cells poorer than `quality`, the stars that they belong to
// and `layers` of cells around them, and closes what that opens anew. Whether the new cells are
// better is for the caller to see. Errors: as CloseComplex.
struct PoorCells {
  double quality = 0;
  int layers = 0;
};
absl::StatusOr<Mended> RefillPoorCells(const CellComplex& complex, const Hull& hull,
                                       const PoorCells& poor, const MeshingParams& params,
                                       RunContext& run);

}  // namespace amhex
