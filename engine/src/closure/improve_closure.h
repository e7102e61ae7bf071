// After closing: poor cells are absorbed and starred anew, neighbouring stars are joined.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "amhex/params.h"
#include "amhex/run_context.h"
#include "assembly/cell_complex.h"
#include "input/hull.h"

namespace amhex {

// Joins neighbouring stars where that saves cells. A closed complex stays closed.
// Errors: CANCELLED, DEADLINE_EXCEEDED.
absl::StatusOr<CellComplex> JoinStars(const CellComplex& complex, const Hull& hull,
                                      const RunContext& run);

struct RepairEffort {
  double quality = 0;  // cells below this are replaced
  int depth = 7;       // neighbours absorbed at most
  int beam_width = 5;
  // What is asked of new cells, and what each unit below it costs, in cells.
  double good_quality = 0.3;
  double poor_quality = 200;
  std::vector<int32_t> only = {};  // ascending; if there are any, no other cells are replaced
};
// Replaces cells of poor quality, worst first, by stars that absorb some neighbours. A closed
// complex stays closed. Errors: CANCELLED, DEADLINE_EXCEEDED.
absl::StatusOr<CellComplex> RepairCells(const CellComplex& complex, const Hull& hull,
                                        const RepairEffort& effort, const RunContext& run);

}  // namespace amhex
