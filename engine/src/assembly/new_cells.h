// What is new in a complex that an earlier one did not have.
#pragma once

#include <cstdint>
#include <vector>

#include "assembly/cell_complex.h"
#include "base/stop_poll.h"

namespace amhex {

// [vertex] 1: of a cell that `before` does not have with its vertices in the very same places.
// Indices, and the order of cells and corners, may be others there. O(n log n). Throws RunStopped
// when `poll` does.
std::vector<uint8_t> VerticesOfNewCells(const CellComplex& complex, const CellComplex& before,
                                        const StopPoll& poll = {});

}  // namespace amhex
