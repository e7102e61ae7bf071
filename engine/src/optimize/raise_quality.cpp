#include "optimize/raise_quality.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <vector>

#include "absl/container/inlined_vector.h"
#include "base/status_macros.h"
#include "cuda/device_use.h"
#include "optimize/cell_quality.h"
#include "optimize/lane_cells.h"
#include "optimize/sweep_task.h"
#include "optimize/visit_by_colour.h"

namespace amhex {
namespace {

constexpr size_t kCellsPerBlock = 1024;
}  // namespace

absl::StatusOr<int64_t> SweepQuality(Placement& placement, const SweepRules& rules,
                                     SweepMemory& memory, const RunContext& run) {
  std::vector<uint8_t> moved(memory.active.size(), 0);
  const auto vertex_count = static_cast<int64_t>(moved.size());
  const SweepVisits sweep{ViewOf(placement),
                          rules,
                          {memory.active.data(), vertex_count},
                          {memory.step.data(), vertex_count},
                          {moved.data(), vertex_count}};
  const absl::Status status = VisitByColour(
      placement.neighbourhoods, run, [&](int32_t v) { return sweep.Wants(v); },
      [&](int32_t v) {
        LocalRoom room(static_cast<size_t>(placement.neighbourhoods.cells[v].size()));
        sweep.Visit<LaneCells>(v, room.data());
      });
  if (!status.ok()) return status;
  std::fill(memory.active.begin(), memory.active.end(), 0);
  NoteMoves(moved, placement, memory, StopPoll(run));
  return std::count(moved.begin(), moved.end(), 1);
}

absl::Status RunSweeps(Placement& placement, const SweepRules& rules, int32_t count,
                       SweepMemory& memory, const RunContext& run) {
  SweepTask task = TaskFor(placement, memory, run);
  task.rules = rules;
  task.most_sweeps = count;
  const auto on_cpu = [&]() -> absl::StatusOr<bool> {
    for (int32_t sweep = 0; sweep < count; ++sweep) {
      AMHEX_ASSIGN_OR_RETURN(const int64_t moved, SweepQuality(placement, rules, memory, run));
      if (HasSettled(moved, task.placement.vertices.size, rules.aim)) break;
    }
    return true;
  };
  AMHEX_RETURN_IF_ERROR(RunWhereChosen(placement.device, &task, on_cpu).status());
  return run.CheckStop();
}

QualitySummary SummarizeQuality(const CellComplex& complex, const StopPoll& poll) {
  // Deterministic: fixed blocks, joined in a fixed order.
  QualitySummary summary = tbb::parallel_deterministic_reduce(
      tbb::blocked_range<size_t>(0, complex.cells.size(), kCellsPerBlock), QualitySummary{},
      [&](const tbb::blocked_range<size_t>& range, QualitySummary part) {
        poll.Now();
        for (size_t c = range.begin(); c < range.end(); ++c) {
          const double quality = CellQuality(complex.cells[c], complex.vertices);
          part.minimum = std::min(part.minimum, quality);
          part.average += quality;
          // CellQuality is the least scaled Jacobian where it is positive.
          const double jacobian =
              quality > 0 ? quality : ScaledJacobian(complex.cells[c], complex.vertices);
          part.min_scaled_jacobian = std::min(part.min_scaled_jacobian, jacobian);
          part.average_scaled_jacobian += jacobian;
        }
        return part;
      },
      [](const QualitySummary& a, const QualitySummary& b) {
        return QualitySummary{std::min(a.minimum, b.minimum), a.average + b.average,
                              std::min(a.min_scaled_jacobian, b.min_scaled_jacobian),
                              a.average_scaled_jacobian + b.average_scaled_jacobian};
      });
  const auto cell_count = static_cast<double>(complex.cells.size());
  if (cell_count > 0) summary.average /= cell_count;
  if (cell_count > 0) summary.average_scaled_jacobian /= cell_count;
  return summary;
}

}  // namespace amhex
