// Normals for clouds that come without: planes through neighbours, oriented consistently.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "amhex/run_context.h"
#include "amhex/vec3.h"

namespace amhex {

// Nearest neighbours of a point that count as its neighbours in the graph.
inline constexpr int kLinkedNeighbours = 10;

// Unit normals by principal components of 16 neighbours, oriented along a minimum spanning tree of
// the neighbour graph (Hoppe et al. 1992) and outward in each connected part: the points farthest
// out along many directions decide together, for each alone may be noise. Where they differ as
// noise makes them, they are then averaged with those around that look about the same way.
// O(n log n).
absl::StatusOr<std::vector<Vec3d>> EstimateNormals(const std::vector<Vec3d>& points,
                                                   RunContext& run);

}  // namespace amhex
