// Moves vertices to raise the minimum scaled Jacobian, or the average without losing the minimum.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "amhex/run_context.h"
#include "optimize/placement.h"

namespace amhex {

enum class QualityAim : uint8_t {
  kMinimum,  // lower the penalty that the worst corners dominate
  kAverage,  // raise the average of the cells' minima, with a penalty of EnergyKind::kMinima
};

struct SweepRules {
  QualityAim aim = QualityAim::kMinimum;
  double target = 0.5;  // only vertices with an incident cell below this are visited
  double floor = 0.5;   // no cell may fall below both this and its neighbourhood's old minimum
  CornerPenalty penalty = {};
};

// One sweep over the active vertices. Free vertices move freely, those of patches and creases slide
// along them, corners stay. Returns the number of vertices moved; updates who is active next.
absl::StatusOr<int64_t> SweepQuality(Placement& placement, const SweepRules& rules,
                                     SweepMemory& memory, const RunContext& run);

struct QualitySummary {
  double minimum = 1;  // of CellQuality: not positive if any cell is invalid
  double average = 0;  // of CellQuality
  // Whether or not cells fold.
  double min_scaled_jacobian = 1;
  double average_scaled_jacobian = 0;
};
// Over all cells.
QualitySummary SummarizeQuality(const CellComplex& complex);

}  // namespace amhex
