// Tells whoever watches a run what cells there are so far, and how good they are.
#pragma once

#include "amhex/run_context.h"
#include "assembly/cell_complex.h"

namespace amhex {

// Cells by type; what is no cell of Figure 2 counts as none. O(cells).
CellCounts CountCells(const CellComplex& complex);

// Publishes counts and quality of all cells. Some 200 ns per cell.
void ReportCells(const CellComplex& complex, RunContext& run);

}  // namespace amhex
