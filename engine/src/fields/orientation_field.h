// A frame at every node of the background grid: one axis along the hull's normal next to the hull,
// as smooth as possible elsewhere.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "fields/background_grid.h"
#include "fields/match_code.h"
#include "fields/nearest_axis.h"
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
  double normal_fading = 0;  // share of that weight lost on the way to kHullReach below the hull
  DeviceUse* device =
      nullptr;  // where the sweeps run; null: on the CPU. The same frames, to the bit
  ResidentSlot* frames_there = nullptr;  // of the frames on it; null: none stays
};

// Of the finest level.
struct OrientationField {
  std::vector<Quaternion> frames;  // [node_count] unit quaternions
  ForwardCodes codes;              // [node_count] how neighbours' frames match (match_code.h)
};

// `samples` (may be empty) tell how much the hull turns around each node. Coarse to fine; sweeps
// run colour by colour, so the result does not depend on the number of threads.
// O(nodes * sweeps).
absl::StatusOr<OrientationField> SolveOrientationField(const BackgroundGrid& grid,
                                                       const HullSamples& samples,
                                                       const OrientationSettings& settings,
                                                       const ProgressSlice& slice);

// The rotation from neighbour k of `node` to `node`, for neighbours along the grid's axes.
inline const AxisRotation& RotationFrom(const GridLevel& level, const ForwardCodes& codes,
                                        int64_t node, int k) {
  if (k < kForwardCount) return kAxisRotations[codes[node][k]];
  const int32_t neighbour = level.neighbours[node][k];
  return kAxisRotations[kInverseCodes[codes[neighbour][k - kForwardCount]]];
}

}  // namespace amhex::fields
