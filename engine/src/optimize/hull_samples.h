// Where a hull is looked at to tell how far it is from a boundary.
#pragma once

#include <vector>

#include "base/stop_poll.h"
#include "input/hull.h"
#include "input/hull_queries.h"
#include "optimize/feature_view.h"

namespace amhex {

// Whether the input's points lie off the hull by more than does not count as noise makes them, a
// tenth of them or more. Then the hull tells where the solid is, not they.
bool PointsScatter(const Hull& hull, const StopPoll& poll);

// Spread evenly over the hull, points of the input where it has some: of those near one another the
// one farthest from `boundary`, and all that are farther than is wanted; none off the hull where
// points scatter.
std::vector<Vec3d> HullPoints(const Hull& hull, const HullQueries& boundary, bool points_scatter,
                              const StopPoll& poll);

// Spread evenly along the creases.
std::vector<Vec3d> CreasePoints(const FeatureView& features);

}  // namespace amhex
