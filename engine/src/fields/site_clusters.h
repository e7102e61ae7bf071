// Sites are the places on which the nodes of the background grid agree.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "fields/background_grid.h"
#include "fields/lattice_form.h"
#include "input/hull.h"
#include "relax/sites.h"

namespace amhex::fields {

// positions[node] = the lattice point nearest to the node (phase_field.h). Returns sites with
// position, frame and size; no links. Each is the centre of a dense cluster of positions, inside
// the hull, and no other site stands within 0.6 of its cell. O(nodes log nodes).
absl::StatusOr<Sites> ClusterSites(const Hull& hull, const BackgroundGrid& grid,
                                   const LatticeForm& form, const std::vector<Vec3d>& positions,
                                   const ProgressSlice& slice);

// `d` in cells of the given frame and size.
inline Vec3d InCells(const AxisFrame& frame, const Vec3d& size, const Vec3d& d) {
  return {Dot(frame.axis[0], d) / size.x, Dot(frame.axis[1], d) / size.y,
          Dot(frame.axis[2], d) / size.z};
}

}  // namespace amhex::fields
