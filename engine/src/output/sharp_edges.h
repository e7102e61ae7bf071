// How closely a mesh's boundary follows the sharp edges of its input.
#pragma once

#include <vector>

#include "amhex/vec3.h"
#include "base/stop_poll.h"
#include "input/hull.h"
#include "output/mesh_faces.h"

namespace amhex {

struct SharpEdgeDeviation {
  double root_mean_square = 0;  // edge lengths
  double maximum = 0;           // edge lengths
};

// Distances from evenly spread points of the hull's sharp edges to the nearest edge of a boundary
// face, `vertices` in the hull's normalised frame. Only FollowedEdges (input/sharp_features) count;
// zeros without any. O(n log n). RunStopped is
// thrown when `poll` does.
SharpEdgeDeviation MeasureSharpEdges(const Hull& hull, const std::vector<BoundaryFace>& boundary,
                                     const std::vector<Vec3d>& vertices, const StopPoll& poll = {});

}  // namespace amhex
