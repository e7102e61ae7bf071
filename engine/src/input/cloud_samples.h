// An oriented point cloud made ready for reconstruction: unique, weighted, without outliers.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "amhex/input_hull.h"
#include "amhex/run_context.h"

namespace amhex {

struct CloudSamples {
  std::vector<Vec3d> position;  // [sample_count]
  std::vector<Vec3d> normal;    // [sample_count] unit, outward
  std::vector<double> spacing;  // [sample_count] square root of the area the sample stands for
};

// Joins equal points, leaves out those without a direction and outliers, and
// measures how much surface each sample stands for: from the distance to the 12th neighbour that
// looks to the same side, the median of the neighbourhood taken. A cloud without normals, or with
// none that points anywhere, gets them from EstimateNormals, TurnInsideOutSamples and
// HollowNestedParts; given ones that look into the cloud are turned, and those that scatter more
// than the points do are evened out. One warning per thing repaired.
absl::StatusOr<CloudSamples> PrepareCloud(const PointCloud& cloud, RunContext& run,
                                          std::vector<std::string>& warnings);

// Small equilateral triangles with the samples' areas and normals: a soup whose winding number is
// the cloud's (Barill et al. 2018).
TriangleMesh DiscSoup(const CloudSamples& samples);

}  // namespace amhex
