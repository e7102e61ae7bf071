// Removes from a triangle soup what carries no shape: repeated vertices, faces and empty faces.
#pragma once

#include <cstdint>

#include "amhex/input_hull.h"
#include "base/stop_poll.h"

namespace amhex {

struct CleanCounts {
  int64_t merged_vertices = 0;
  int64_t empty_triangles = 0;     // two equal corners
  int64_t repeated_triangles = 0;  // the same three corners, in any order
};

// Drops triangles with two equal corners, and all but the first of those with the same corners.
CleanCounts DropEmptyAndRepeatedTriangles(TriangleMesh& mesh, const StopPoll& poll = {});

// Joins vertices that are nearer to each other than `tolerance` (0 joins equal ones only), then
// drops what became empty or repeated. O(n log n).
CleanCounts MergeVertices(double tolerance, TriangleMesh& mesh, const StopPoll& poll = {});

}  // namespace amhex
