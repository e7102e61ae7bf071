// Faces that open gaps between indirect neighbours. Paper: section 5.1, "Closing Cuts", Figure 9.
#pragma once

#include "absl/status/statusor.h"
#include "amhex/run_context.h"
#include "geometry/merge_view.h"

namespace amhex {

struct CutRules {
  double max_gap = 0;  // mean cell sizes
  Collapse collapse = Collapse::kForbidden;
};

// Rounds of closing at most.
inline constexpr int kMaxCutRounds = 8;

// Merges pairs of open faces of different cubes that share a merged edge, look at each other and
// lie within the gap, nearest first, until nothing changes. Returns the number of pairs merged.
// Same result at any thread count. Errors: CANCELLED, DEADLINE_EXCEEDED; RunStopped is thrown where
// no status can be returned.
absl::StatusOr<int> CloseCuts(const CutRules& rules, const RunContext& run, const MergeView& sets);

}  // namespace amhex
