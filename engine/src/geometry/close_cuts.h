// Faces that open gaps between indirect neighbours. Paper: section 5.1, "Closing Cuts", Figure 9.
#pragma once

#include "base/stop_poll.h"
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
int CloseCuts(const CutRules& rules, const StopPoll& poll, const MergeView& sets);

}  // namespace amhex
