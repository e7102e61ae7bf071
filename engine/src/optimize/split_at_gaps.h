// Changes the cells at the boundary where it stays too far from the hull: mostly no vertex is
// there.
#pragma once

#include <cstdint>

#include "absl/status/statusor.h"
#include "amhex/run_context.h"
#include "assembly/cell_complex.h"
#include "input/hull.h"
#include "optimize/hull_features.h"

namespace amhex {

enum class SplitTurn : uint8_t { kFirst, kLast };

// For a complex that has been drawn to its hull (follow_hull.h). Where a sample is still farther
// away than is wanted, a vertex on the hull divides the nearest face of the boundary or one of its
// edges, and the cells there become pyramids and tetrahedra around it: four to eight more cells. A
// vertex that stands out of the hull with few cells goes with them; and where nothing else helps,
// the cells at the nearest vertex make room for others (closure/close_complex.h, RefillOpening).
// Vertices around then move to where the cells are best. What is new stays where the distance falls
// to what is wanted, or by half of what it is beyond that, no cell becomes poorer than the poorest
// around was or 0.31, and the boundary neither touches nor crosses itself. A handful of places, the
// farthest first, and behind them what is up to two edge lengths away. Where there are more, the
// hull is rougher than cells of this size can follow: only a handful of those that are 2.5 times as
// far as is wanted is seen to, and nothing where there are more of them, too.
//
// At last, faces are looked at closely (FaceDetail), and up to two dozen places are seen to: all or
// nothing, so nothing changes where there are more, or once three of them resist.
//
// Requires a closed complex. Same result at any thread count. Errors: CANCELLED, DEADLINE_EXCEEDED;
// RunStopped is thrown where no status can be returned.
absl::StatusOr<CellComplex> SplitAtGaps(const CellComplex& complex, const Hull& hull,
                                        const HullFeatures& features, const MeshingParams& params,
                                        SplitTurn turn, const RunContext& run);

}  // namespace amhex
