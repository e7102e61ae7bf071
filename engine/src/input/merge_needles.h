// Surfaces of needles: triangles that are far thinner than the cells and reach across many of them.
#pragma once

#include <cstdint>

#include "amhex/input_hull.h"
#include "base/stop_poll.h"

namespace amhex {

// Where needles are so many that whatever is asked of a place would have to look at all of them,
// joins the ends of neighbouring ones: no point moves by a tenth of `edge_length`, sharp edges
// (whose triangles' normals differ by more than `sharp_angle_degrees`) and corners stay where they
// are but for that. Other surfaces stay as they are. `mesh` is closed and outward oriented, and is
// so afterwards. Returns how many ends were joined. O(n log n).
int64_t MergeNeedles(double edge_length, double sharp_angle_degrees, TriangleMesh& mesh,
                     const StopPoll& poll);

}  // namespace amhex
