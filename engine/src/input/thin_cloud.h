// Brings clouds far denser than the cells down to what the cells can use.
#pragma once

#include <cstdint>

#include "amhex/input_hull.h"
#include "base/stop_poll.h"

namespace amhex {

// Replaces the points of each cube of side `cell` that look to the same of the six main directions
// by their mean, position and normal; points without normals by the mean of the cube. The means of
// surfaces bend inward by about cell^2 / (12 radius). O(n log n). Returns the number of points
// taken away.
int64_t ThinCloud(double cell, PointCloud& cloud, const StopPoll& poll = {});

}  // namespace amhex
