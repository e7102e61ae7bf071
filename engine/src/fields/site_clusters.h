// Sites are the places on which the nodes of the background grid agree.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "fields/background_grid.h"
#include "fields/cluster_view.h"
#include "fields/lattice_form.h"
#include "input/hull_queries.h"
#include "relax/sites.h"

namespace amhex::fields {

// positions[node] = the lattice point nearest to the node (phase_field.h). Returns sites with
// position, frame and size, and the links that the grid's edges vote for (face_links.h). Each is
// the centre of a dense cluster of positions, inside the hull, and no other site stands within 0.6
// of its cell. O(nodes log nodes).
// Errors: CANCELLED, DEADLINE_EXCEEDED.
absl::StatusOr<Sites> ClusterSites(const HullQueries& hull, const BackgroundGrid& grid,
                                   const LatticeForm& form, const std::vector<Vec3d>& positions,
                                   const ProgressSlice& slice);

}  // namespace amhex::fields
