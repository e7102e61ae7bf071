// How many cells a solid should have.
#pragma once

#include "base/stop_poll.h"
#include "input/hull.h"

namespace amhex {

// Of edge length 1: the hull's volume, but for walls of one layer (single_layers.h). Throws
// RunStopped when `poll` does.
double WantedCells(const Hull& hull, const StopPoll& poll);

}  // namespace amhex
