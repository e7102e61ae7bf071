// Undoes what moving vertices did to a boundary that was an embedding.
#pragma once

#include <vector>

#include "assembly/cell_complex.h"
#include "base/stop_poll.h"
#include "input/hull.h"

namespace amhex {

// Vertices near places where the boundary has become defective (closure/boundary_defects) return to
// where they were `before`, until there are no such places. Throws RunStopped when `poll` does.
void TakeBackDefects(const Hull& hull, const std::vector<Vec3d>& before, const StopPoll& poll,
                     CellComplex* complex);

}  // namespace amhex
