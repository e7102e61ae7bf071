// Chooses a conforming set of primitives. Section 5.2, III, listing 3.
#pragma once

#include "absl/status/statusor.h"
#include "amhex/params.h"
#include "amhex/run_context.h"
#include "assembly/cell_complex.h"
#include "geometry/merged_cubes.h"
#include "topology/primitive_table.h"

namespace amhex {

// The chosen cells satisfy:
//   - every half-face belongs to at most one cell,
//   - every cell is valid with a quality above params.assembly.min_quality,
//   - hull_faces holds exactly the chosen cells' half-faces that a cube declared part of the hull
//     and that no other cell lies against.
// `vertices` are those of `cubes`, unused ones included. What stays open is left to closure.
//
// Errors: CANCELLED, DEADLINE_EXCEEDED.
absl::StatusOr<CellComplex> AssembleCells(const PrimitiveTable& table, const MergedCubes& cubes,
                                          const MeshingParams& params, RunContext& context);

}  // namespace amhex
