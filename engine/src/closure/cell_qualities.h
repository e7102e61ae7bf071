// How good the cells of a mesh under repair are.
#pragma once

#include <vector>

#include "base/stop_poll.h"
#include "closure/working_mesh.h"

namespace amhex {

// [cell] CellQuality of the living ones that are meant, which are all where none are named; 1 of
// the others. `only` is ascending. On all threads; throws RunStopped when `poll` does.
std::vector<double> CellQualities(const WorkingMesh& mesh, const std::vector<int>& only,
                                  const StopPoll& poll);

}  // namespace amhex
