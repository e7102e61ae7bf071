// Parts of a surface that were given more than once, as programs do that join files.
#pragma once

#include <cstdint>

#include "amhex/input_hull.h"
#include "base/stop_poll.h"
#include "input/surface_topology.h"

namespace amhex {

// Drops the triangles of every component whose triangles are at the very places of an earlier
// one's, whichever way they face; returns how many components those were. Components are compared
// where they have the same number of triangles and the same box. O(n log n) of these.
int64_t DropRepeatedComponents(const Components& components, TriangleMesh& mesh,
                               const StopPoll& poll = {});

}  // namespace amhex
