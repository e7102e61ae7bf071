// A frame at every node of the background grid: one axis along the hull's normal next to the hull,
// as smooth as possible elsewhere.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "fields/background_grid.h"
#include "fields/octahedral_group.h"
#include "input/hull.h"

namespace amhex {
class DeviceUse;
}

namespace amhex::fields {

struct OrientationSettings {
  int fine_sweeps = 10;      // on the finest level; 100 give no fewer open faces
  int coarse_sweeps = 100;   // on each coarser one: cheap, and there the singularities are settled
  double hull_weight = 300;  // of "an axis along the normal" on a flat hull against one neighbour
  DeviceUse* device =
      nullptr;  // where the sweeps run; null: on the CPU. The same frames, to the bit
};

// [node_count] unit quaternions of the finest level; `samples` (may be empty) tell how much the
// hull turns around each node. Coarse to fine; sweeps run colour by colour, so the result does not
// depend on the number of threads. O(nodes * sweeps).
absl::StatusOr<std::vector<Quaternion>> SolveOrientationField(const BackgroundGrid& grid,
                                                              const HullSamples& samples,
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
// The hull counts for an axis within about 35 degrees of its normal.
inline constexpr double kAlignedCosine = 0.82;
NearestAxis FindNearestAxis(const AxisFrame& frame, const Vec3d& normal);

}  // namespace amhex::fields
