// What the hull demands of the grid's nodes next to it, as plain arrays: what crosses the border to
// the executors, and to the CUDA library that is loaded at run time.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "exec/resident_slot.h"
#include "fields/hull_nodes.h"
#include "input/hull_view.h"

namespace amhex::fields {

// Views are on host arrays that outlive the task.
struct HullNodesTask {
  CellCentres cells;  // of the grid
  HullView hull;
  ResidentSlot* resident = nullptr;  // the hull's, never null
  ResidentSlot* there = nullptr;     // of what is found, as of HullNodes; never null
  // Out, as those of HullNodes; as they were unless it was done.
  std::vector<int32_t> nodes, first;
  std::vector<HullConstraint> constraints;
  std::function<bool()> should_stop;  // may be empty; asked from several threads
};

}  // namespace amhex::fields
