// A frame at every node of the background grid: one axis along the hull's normal next to the hull,
// as smooth as possible elsewhere.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "fields/background_grid.h"
#include "fields/octahedral_group.h"
#include "input/hull.h"

namespace amhex::fields {

struct OrientationSettings {
  int fine_sweeps = 30;     // on the finest level
  int coarse_sweeps = 100;  // on each coarser one: cheap, and there the singularities are settled
  double normal_weight = 4.0;
  // Weight of the smoothed frame against the normals: with one normal, and with several.
  double smooth_weight_one = 0.3;
  double smooth_weight_several = 0.5;
};

// [node_count] unit quaternions of the finest level. Coarse to fine; sweeps run colour by colour,
// so the result does not depend on the number of threads. O(nodes * sweeps).
absl::StatusOr<std::vector<Quaternion>> SolveOrientationField(const BackgroundGrid& grid,
                                                              const OrientationSettings& settings,
                                                              const ProgressSlice& slice);

// For every node and its neighbours along +x +y +z the code of the rotation that carries the
// neighbour's lattice coordinates into the node's (octahedral_group.h); 0 without a neighbour.
using ForwardCodes = std::vector<std::array<uint8_t, 3>>;
ForwardCodes MatchNeighbours(const GridLevel& level, const std::vector<Quaternion>& frames,
                             const RunContext& run);

// The rotation from neighbour k of `node` to `node`, for neighbours along the grid's axes.
inline const AxisRotation& RotationFrom(const GridLevel& level, const ForwardCodes& codes,
                                        int64_t node, int k) {
  if (k < kForwardCount) return kAxisRotations[codes[node][k]];
  const int32_t neighbour = level.neighbours[node][k];
  return kAxisRotations[kInverseCodes[codes[neighbour][k - kForwardCount]]];
}

// The axis of `frame` nearest to the unit `normal`, and on which side of it.
struct NearestAxis {
  int axis = 0;
  double sign = 1;
  double cosine = 1;  // >= 1 / sqrt(3)
};
NearestAxis FindNearestAxis(const AxisFrame& frame, const Vec3d& normal);

}  // namespace amhex::fields
