// Faces that open gaps between indirect neighbours. Paper: section 5.1, "Closing Cuts", Figure 9.
#pragma once

#include <array>
#include <vector>

#include "base/stop_poll.h"
#include "geometry/cubes.h"
#include "geometry/merge_sets.h"

namespace amhex {

// [cube][direction] 6 * other cube + direction over there; -1 while open.
using FaceMatches = std::vector<std::array<int, 6>>;

struct CutRules {
  double max_gap = 0;  // mean cell sizes
  Collapse collapse = Collapse::kForbidden;
};

// Merges pairs of open faces of different cubes that share a merged edge, look at each other and
// lie within the gap, nearest first, until nothing changes. Returns the number of pairs merged.
int CloseCuts(const Cubes& cubes, const CutRules& rules, const StopPoll& poll, MergeSets* sets,
              FaceMatches* matches);

}  // namespace amhex
