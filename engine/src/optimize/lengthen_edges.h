// Edges of next to no length, which scaled Jacobians do not see: those are of unit edges.
#pragma once

#include "absl/status/statusor.h"
#include "amhex/run_context.h"
#include "assembly/cell_complex.h"
#include "input/hull.h"
#include "optimize/hull_features.h"

namespace amhex {

// No edge is to be shorter, edge lengths of the wanted cells.
inline constexpr double kShortestEdge = 0.01;

// Where two vertices have been drawn to one point of a crease, or to two creases that nearly meet,
// the cells between them may be as good as any by their scaled Jacobians (1e-7 edge lengths were
// seen) and yet no solver can use them. One end of each such edge goes on along it until it is
// kShortestEdge long: one inside before one on a face, that before one on a crease, and one at a
// corner of the hull last. No cell that is better than the mesh's minimum falls below that, or,
// where it cannot be had so, below 0.31; others get no worse, and no vertex leaves the hull by more
// than does not count. Where that is not enough either the edge stays.
//
// Linear in the number of cells, nothing moves where no edge is short. Same result at any thread
// count. Errors: CANCELLED, DEADLINE_EXCEEDED; RunStopped is thrown where no status can be
// returned.
absl::StatusOr<CellComplex> LengthenEdges(CellComplex complex, const Hull& hull,
                                          const HullFeatures& features, const RunContext& run);

}  // namespace amhex
