// Where sides of the hull meet so sharply that layers of cells must end between them.
#pragma once

#include "base/stop_poll.h"
#include "closure/working_mesh.h"
#include "input/hull.h"

namespace amhex {

// In solids with acute ridges (closure/ridges): layers that end at the hull do so in rows of prisms
// (closure/fill_notches), and the rows go on to the ridges (closure/extend_to_ridge), as they do to
// acute tips of any solid. Others are left as they are: their few notches are as well filled by
// stars. Throws RunStopped when `poll` does.
void FillWedges(const Hull& hull, WorkingMesh* mesh, const StopPoll& poll = {});

}  // namespace amhex
