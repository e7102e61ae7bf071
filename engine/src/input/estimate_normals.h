// Normals for clouds that come without: planes through neighbours, oriented consistently.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "amhex/run_context.h"
#include "amhex/vec3.h"

namespace amhex {

// Nearest neighbours of a point that count as its neighbours in the graph.
inline constexpr int kLinkedNeighbours = 10;

// How far the points of `part` that are farthest out along the 26 directions to a cube's corners,
// edges and faces look out, added up: below 0 if the part is inside out, and about -20 if it is a
// closed one. `normals`: unit. O(n).
double OutwardVote(const std::vector<Vec3d>& points, const std::vector<Vec3d>& normals,
                   const std::vector<int32_t>& part);

// Unit normals by principal components of 16 neighbours, of fewer where those were more than half
// of all points, oriented along a minimum spanning tree of the neighbour graph (Hoppe et al. 1992)
// and outward in each connected part: the points farthest out along many directions decide
// together, for each alone may be noise. Where they differ as noise makes them, they are then
// averaged with those around that look about the same way. O(n log n).
absl::StatusOr<std::vector<Vec3d>> EstimateNormals(const std::vector<Vec3d>& points,
                                                   RunContext& run);

}  // namespace amhex
