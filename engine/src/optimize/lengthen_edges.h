// Short edges, which scaled Jacobians do not see: those are of unit edges.
#pragma once

#include "absl/status/statusor.h"
#include "amhex/run_context.h"
#include "assembly/cell_complex.h"
#include "input/hull.h"
#include "optimize/hull_features.h"

namespace amhex {

// In edge lengths of the wanted cells: no edge is to be shorter than the one, and none needs to be
// shorter than the other where cells have room.
inline constexpr double kShortestEdge = 0.01;
inline constexpr double kWantedEdge = 0.2;

// Where two vertices have been drawn to one point of a crease, or to two creases that nearly meet,
// the cells between them may be as good as any by their scaled Jacobians (1e-7 edge lengths were
// seen) and yet no solver can use them; and the shortest edge decides about the time step of an
// explicit one. One end of each such edge goes on along it, step by step: one inside before one on
// a face, that before one on a crease, and one at a corner of the hull last. Where its cells do not
// admit it alone the vertices inside make room.
//
// Until an edge is kShortestEdge long no cell that is better than the mesh's minimum falls below
// that, or, where it cannot be had so, below 0.31 or at last 0.28. From there to kWantedEdge
// nothing is given up: the minimum stays, the average of the cells around hardly falls, nothing
// comes to be too far from the hull, creases stay as near as they are, and no other edge becomes
// too short for it. Where that is not enough the edge stays as it is.
//
// Linear in the number of cells and of short edges; nothing moves where no edge is short. Same
// result at any thread count. Errors: CANCELLED, DEADLINE_EXCEEDED; RunStopped is thrown where no
// status can be returned.
absl::StatusOr<CellComplex> LengthenEdges(CellComplex complex, const Hull& hull,
                                          const HullFeatures& features, const RunContext& run);

}  // namespace amhex
