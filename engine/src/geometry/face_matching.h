// Which cube faces could be glued, and how well they fit. Paper: section 5.1, "Matching Scores".
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "amhex/run_context.h"
#include "geometry/cubes.h"
#include "geometry/face_candidates.h"
#include "geometry/point_bins.h"
#include "relax/sites.h"

namespace amhex {

// Eq. 5: the summed distance of the paired corners, times 1 for facing normals up to 2 for equal
// ones; for the best of the four rotations. Units: edge lengths.
struct MatchScore {
  double value = 0;
  int rotation = 0;
};
MatchScore ScoreFaces(const Cubes& cubes, int cube_a, int direction_a, int cube_b, int direction_b);

// The search for all plausible pairs with the arrays that it needs; the cubes must outlive it.
class FaceSearch {
 public:
  FaceSearch(const Cubes& cubes, const std::vector<FaceLink>& links);
  CandidateSearch view() const;

 private:
  const Cubes& cubes_;
  PointBins bins_;
  std::vector<LinkedFaces> links_;
};

// All plausible pairs, ascending by (score, cubes, directions). Pairs that the fields link are
// preferred. O(n log n) for bounded density. Fails only with the run's status.
absl::StatusOr<std::vector<FacePair>> CollectFacePairs(const CandidateSearch& search,
                                                       const RunContext& run);

}  // namespace amhex
