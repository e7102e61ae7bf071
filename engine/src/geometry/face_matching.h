// Which cube faces could be glued, and how well they fit. Paper: section 5.1, "Matching Scores".
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "amhex/run_context.h"
#include "geometry/cubes.h"
#include "geometry/merge_sets.h"
#include "relax/sites.h"

namespace amhex {

class DeviceUse;

// Two faces of neighbouring cubes in their best rotation.
struct FacePair {
  double score = 0;  // eq. 5 over four mean cell sizes: 0 is perfect; lower is better
  int cube_a = 0;
  int cube_b = 0;
  uint8_t direction_a = 0;
  uint8_t direction_b = 0;
  uint8_t rotation = 0;  // corner q of face a meets corner (rotation + 4 - q) % 4 of face b
};

// Eq. 5: the summed distance of the paired corners, times 1 for facing normals up to 2 for equal
// ones; for the best of the four rotations. Units: edge lengths.
struct MatchScore {
  double value = 0;
  int rotation = 0;
};
MatchScore ScoreFaces(const Cubes& cubes, int cube_a, int direction_a, int cube_b, int direction_b);

CornerPairs CornersToMerge(const FacePair& pair);

// All plausible pairs, ascending by (score, cubes, directions). Pairs that the fields link are
// preferred. O(n log n) for bounded density. On `device`, unless it is null, with the same bits.
// Fails only with the run's status and with RunOnCuda's.
absl::StatusOr<std::vector<FacePair>> CollectFacePairs(const Cubes& cubes,
                                                       const std::vector<FaceLink>& links,
                                                       const RunContext& run,
                                                       DeviceUse* device = nullptr);

}  // namespace amhex
