// Which of several complexes will make the best mesh, told before it is made.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "amhex/run_context.h"
#include "assembly/cell_complex.h"
#include "input/hull.h"

namespace amhex {

// What a mesh of so many cells costs beyond its quality, because another number was wanted: 0 up to
// 12 % away, then rising.
double DeviationLoss(double cell_count, double wanted_cells);

struct RankedComplex {
  size_t index = 0;        // in the complexes given
  double loss = 0;         // less is better
  int64_t open_faces = 0;  // left when those next to the hull have reached it: the work of closing
};

// `complexes`, which may have open faces, best first; equals keep their order. Judged by what their
// cells of each type, and those that closing will add, usually lack to the scaled Jacobian 1, and
// by their number. A single one is not judged.
// Errors: CANCELLED, DEADLINE_EXCEEDED. O(cells).
absl::StatusOr<std::vector<RankedComplex>> RankComplexes(const std::vector<CellComplex>& complexes,
                                                         const Hull& hull, const RunContext& run);

}  // namespace amhex
