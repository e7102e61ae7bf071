#include "optimize/raise_average.h"

#include <algorithm>
#include <cstdint>

#include "base/status_macros.h"
#include "optimize/placement.h"
#include "optimize/raise_quality.h"

namespace amhex {
namespace {

// No cell that is better falls below this: above what is refilled (refill_places), or there would
// be work for it.
constexpr double kFloor = 0.31;
// Nor does the minimum fall, up to this.
constexpr double kGoodMinimum = 0.8;
// Six gain two thirds of what forty do (rocker-arm at 10,000 cells), in a seventh of their time.
constexpr int kSweepsPerBound = 6;
constexpr double kLeastGain = 1e-5;

}  // namespace

SweepRules RulesForAverage(const CellComplex& complex, const CornerPenalty& bound,
                           const StopPoll& poll) {
  const double minimum = SummarizeQuality(complex, poll).min_scaled_jacobian;
  return {.aim = QualityAim::kAverage,
          .target = kAverageTarget,
          .floor = std::clamp(minimum, kFloor, kGoodMinimum),
          .penalty = bound};
}

absl::StatusOr<CellComplex> RaiseAverage(CellComplex complex, const HullFeatures& features,
                                         const RunContext& run, DeviceUse* device) {
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  if (complex.cells.empty()) return complex;
  const StopPoll poll(run);
  Placement placement = PreparePlacement(complex, features, poll);
  placement.device = device;
  for (const CornerPenalty& bound : {kCloseBound, kClosestBound}) {
    SweepRules rules = RulesForAverage(complex, bound, poll);
    rules.least_gain = kLeastGain;
    SweepMemory memory = StartSweeps(static_cast<int64_t>(complex.vertices.size()));
    AMHEX_RETURN_IF_ERROR(RunSweeps(placement, rules, kSweepsPerBound, memory, run));
  }
  return complex;
}

}  // namespace amhex
