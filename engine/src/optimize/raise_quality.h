// Moves vertices to raise the minimum scaled Jacobian, or the average without losing the minimum.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "amhex/run_context.h"
#include "optimize/placement.h"
#include "optimize/vertex_search.h"

namespace amhex {

// One sweep over the active vertices. Free vertices move freely, those of patches and creases slide
// along them, corners stay. Returns the number of vertices moved; updates who is active next.
absl::StatusOr<int64_t> SweepQuality(Placement& placement, const SweepRules& rules,
                                     SweepMemory& memory, const RunContext& run);

// Up to `count` such sweeps, fewer when nothing moves any more or, raising the average, hardly
// anything. On the placement's device, if it has one, as long as there is enough to do for it
// (worth_device.h), with the same bits: one upload, one download.
absl::Status RunSweeps(Placement& placement, const SweepRules& rules, int32_t count,
                       SweepMemory& memory, const RunContext& run);

struct QualitySummary {
  double minimum = 1;  // of CellQuality: not positive if any cell is invalid
  double average = 0;  // of CellQuality
  // Whether or not cells fold.
  double min_scaled_jacobian = 1;
  double average_scaled_jacobian = 0;
};
// Over all cells. Throws RunStopped when `poll` does.
QualitySummary SummarizeQuality(const CellComplex& complex, const StopPoll& poll = {});

}  // namespace amhex
