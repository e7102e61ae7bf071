// Notches of the boundary: where a layer of cells ends at the hull, a row of prisms ends it.
#pragma once

#include "base/stop_poll.h"
#include "closure/working_mesh.h"
#include "input/hull.h"

namespace amhex {

// Two open quads that share an edge and end on one side of the hull bound a notch of triangular
// section: it becomes a prism, whose third side lies on the hull. Cavity by cavity, where that
// leaves fewer faces open. Returns the number of new cells.
int FillNotches(const Hull& hull, WorkingMesh* mesh, const StopPoll& poll = {});

}  // namespace amhex
