// Whether a changed part of a mesh keeps to the hull.
#pragma once

#include "assembly/cell_complex.h"
#include "base/stop_poll.h"
#include "input/hull.h"

namespace amhex {

// For two versions of a part of a mesh, each with the boundary that it has there: true if around
// what differs no sample of the hull is farther from the boundary of `after`, and no middle of its
// faces farther from the hull, than half as much again as is wanted of a mesh (LimitsFor) or than
// it was `before`; of the middles, than the farthest was. O(hull triangles + faces log faces).
// Throws RunStopped when `poll` does.
bool StaysNear(const Hull& hull, const CellComplex& before, const CellComplex& after,
               const StopPoll& poll);

}  // namespace amhex
