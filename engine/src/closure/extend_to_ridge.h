// Tips of wedges and spikes: where cells end before an acute edge of the hull, or before an acute
// tip, the rows go on to it.
#pragma once

#include <vector>

#include "base/stop_poll.h"
#include "closure/working_mesh.h"
#include "input/acute_tips.h"
#include "input/hull.h"
#include "optimize/segment_queries.h"

namespace amhex {

// Where two sides of the hull meet at less than 50 degrees, hexahedra have no room between them
// and the cells of the last rows end anyhow. The open faces that look at such an edge are extended
// to just before it, every row as hexahedra that become as thin as the wedge does, and end on a
// narrow face along it: a cell that reached into the edge itself could have no better scaled
// Jacobian than the sine of the angle. The nearest cells are taken away first where that leaves
// fewer faces open and fewer cells that are no hexahedra; notches there are filled. A tip
// that would be filled in part only stays as it is. Returns the number of edges (of those that hang
// together) whose cells have changed. Throws RunStopped when `poll` does.
int ExtendToRidges(const Hull& hull, const std::vector<SegmentQueries>& ridges, WorkingMesh* mesh,
                   const StopPoll& poll = {});

// The same where the solid tapers off to a point: columns that become as narrow as it does, and end
// on narrow faces just before it. Notches are left to stars.
int ExtendToTips(const Hull& hull, const std::vector<AcuteTip>& tips, WorkingMesh* mesh,
                 const StopPoll& poll = {});

}  // namespace amhex
