// Normals of points that scatter, averaged with those around that look about the same way.
#pragma once

#include <vector>

#include "absl/status/status.h"
#include "amhex/run_context.h"
#include "amhex/vec3.h"
#include "input/point_tree.h"

namespace amhex {

// Bilateral averaging, after Jones et al. 2003. `normals`: unit and oriented, one for each point;
// `tree`: of the points. As wide as normals usually differ, so that clean ones stay as they are.
// O(n log n).
absl::Status EvenOutNormals(const std::vector<Vec3d>& points, const PointTree& tree,
                            RunContext& run, std::vector<Vec3d>& normals);

}  // namespace amhex
