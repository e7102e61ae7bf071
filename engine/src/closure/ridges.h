// Edges where two sides of the hull meet so sharply that hexahedra have no room between them.
#pragma once

#include <vector>

#include "input/hull.h"
#include "optimize/segment_queries.h"

namespace amhex {

// The acute ones of hull.sharp_edges, in pieces that hang together and are at least three edge
// lengths long.
std::vector<SegmentQueries> AcuteRidges(const Hull& hull);

}  // namespace amhex
