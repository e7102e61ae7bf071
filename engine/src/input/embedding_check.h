// Does a closed surface bound a solid, or does it cut through itself?
#pragma once

#include "amhex/input_hull.h"
#include "input/hull_queries.h"

namespace amhex {

// Share of the surface's area, [0, 1], that does not have winding number 1 on its inner side and 0
// on its outer side. Looks at no more than 20,000 triangles, evenly spread over their indices, and
// at fewer, 200 at least, where triangles across the whole surface make each of them dear. Throws
// RunStopped when `poll` does.
double MisboundedAreaRatio(const TriangleMesh& mesh, const HullQueries& queries,
                           const StopPoll& poll);

}  // namespace amhex
