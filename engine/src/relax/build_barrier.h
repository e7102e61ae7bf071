// Finds which side of the hull every lattice point lies on, once per relaxation.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "amhex/run_context.h"
#include "amhex/vec3.h"
#include "input/hull.h"
#include "relax/hull_barrier.h"

namespace amhex {

// Covers the hull's box and `margin` edge lengths around it with `points_per_site` lattice points
// per unit volume.
//
// deviates: instead of one winding number per lattice point (section 4.1), the signed crossings of
// the hull along every lattice row are summed: the same number for a closed hull, at the cost of
// the crossings alone. Rows whose crossings do not cancel (a crack in the hull) ask the winding
// number at each of their points.
//
// Errors: RESOURCE_EXHAUSTED (lattice too large), CANCELLED, DEADLINE_EXCEEDED.
// O(hull area / spacing^2 + box volume), parallel.
absl::StatusOr<HullBarrier> BuildHullBarrier(const Hull& hull, double points_per_site,
                                             double margin, const RunContext& run);

// The work of one labelling: every tile with inside points and, if there are outside sites, every
// tile with outside points within reach of one. `outside_positions` in the domain frame.
std::vector<LabelItem> ListLabelItems(const HullBarrier& barrier,
                                      const std::vector<Vec3d>& outside_positions);

}  // namespace amhex
