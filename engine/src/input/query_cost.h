// What questions about a surface cost, counted instead of timed.
#pragma once

#include "input/hull_view.h"

namespace amhex {

// Nodes and triangles that a winding number by solid angles looks at, on average over the corners
// of some of the triangles: some hundreds for a scan of any size, but all triangles where each of
// them reaches across the whole surface. O(triangles) at worst; 0 without triangles.
double MeanWindingSteps(const HullView& view);

}  // namespace amhex
