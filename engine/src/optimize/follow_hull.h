// Moves vertices of the boundary where hull and boundary are farther from each other than is wanted
// although the vertices lie on the hull.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "amhex/run_context.h"
#include "assembly/cell_complex.h"
#include "input/hull.h"
#include "optimize/hull_features.h"

namespace amhex {

// Where a sample of the hull is farther from the boundary, or the boundary from the hull, than the
// larger of 0.5 % of the diagonal and a sixth of an edge length, or a crease farther than a tenth
// from the boundary's edges, the vertices around are drawn jointly to where the distances are less,
// off the hull by as much as does not count if need be (draw_jointly), and moved on the hull one by
// one (gap_closer): a ridge between two vertices gets one of them. No cell falls
// below both what the poorest around the vertex had and 0.31, none folds, corners and vertices of
// creases stay on them. Where the boundary would cross itself afterwards, and before parts of the
// hull farther than an edge length away, which are lost, vertices stay.
//
// Requires a closed complex. Same result at any thread count. Errors: CANCELLED, DEADLINE_EXCEEDED;
// RunStopped is thrown where no status can be returned.
absl::StatusOr<CellComplex> FollowHull(CellComplex complex, const Hull& hull,
                                       const HullFeatures& features, const RunContext& run);

// The same for gaps near `places` alone.
absl::StatusOr<CellComplex> FollowHullAround(const std::vector<Vec3d>& places, CellComplex complex,
                                             const Hull& hull, const HullFeatures& features,
                                             const RunContext& run);

}  // namespace amhex
