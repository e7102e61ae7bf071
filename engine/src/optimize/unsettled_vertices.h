// Which vertices have work left for them when only some cells have changed since a placement.
#pragma once

#include "assembly/cell_complex.h"
#include "base/stop_poll.h"
#include "optimize/placement.h"

namespace amhex {

// Vertices of cells that `settled` does not have with their vertices in the very same places, and
// of the cells next to those; indices may be others there. O(n log n). Throws RunStopped when
// `poll` does.
ActiveVertices UnsettledVertices(const Placement& placement, const CellComplex& settled,
                                 const StopPoll& poll = {});

}  // namespace amhex
