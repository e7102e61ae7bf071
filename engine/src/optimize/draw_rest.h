// The last word on distances: places that are still too far from the hull, or are so again.
#pragma once

#include <cstddef>

#include "absl/status/statusor.h"
#include "amhex/run_context.h"
#include "assembly/cell_complex.h"
#include "input/hull.h"
#include "optimize/hull_features.h"

namespace amhex {

// Places that are drawn in one round, the farthest first.
inline constexpr size_t kMostPlacesDrawn = 64;

struct RestDrawn {
  CellComplex complex;
  size_t places_left = 0;  // that are too far from the hull, by the margin that was aimed at

  bool is_near() const { return places_left == 0; }
};

// Sweeps that regain quality after the boundary was drawn to the hull (follow_hull) move it once
// more, and what a new vertex mends (split_at_gaps) may cost a place next to it. Where few places
// are farther than they may be, faces looked at closely, these are drawn jointly again, by the same
// rules, and no sweep follows. The mesh's minimum falls, not below 0.31, only where nothing is too
// far away after that.
//
// Nothing is done where more places than `most_places`, if that is fewer, are too far away.
//
// Requires a closed complex. Same result at any thread count. Errors: CANCELLED, DEADLINE_EXCEEDED;
// RunStopped is thrown where no status can be returned.
absl::StatusOr<RestDrawn> DrawRest(CellComplex complex, const Hull& hull,
                                   const HullFeatures& features, const RunContext& run,
                                   size_t most_places = kMostPlacesDrawn);

}  // namespace amhex
