#include "optimize/raise_quality.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <functional>
#include <vector>

#include "absl/container/inlined_vector.h"
#include "base/array_view_of.h"
#include "base/status_macros.h"
#include "cuda/device_use.h"
#include "optimize/cell_quality.h"
#include "optimize/lane_cells.h"
#include "optimize/sweep_task.h"
#include "optimize/visit_by_colour.h"
#include "optimize/worth_device.h"

namespace amhex {
namespace {

constexpr size_t kCellsPerBlock = 1024;
constexpr size_t kActivePerBlock = 2048;

SweepVisits VisitsOf(Placement& placement, const SweepRules& rules, SweepMemory& memory,
                     std::vector<uint8_t>& moved) {
  return {ViewOf(placement), rules, WritableViewOf(memory.active.flags()),
          WritableViewOf(memory.step), WritableViewOf(moved)};
}

// Vertices that the next sweep will visit.
int64_t CountWanted(Placement& placement, const SweepRules& rules, SweepMemory& memory) {
  std::vector<uint8_t> none;
  const SweepVisits sweep = VisitsOf(placement, rules, memory, none);
  const std::vector<int32_t>& active = memory.active.list();
  return tbb::parallel_reduce(
      tbb::blocked_range<size_t>(0, active.size(), kActivePerBlock), int64_t{0},
      [&](const tbb::blocked_range<size_t>& range, int64_t wanted) {
        for (size_t i = range.begin(); i < range.end(); ++i) {
          wanted += sweep.Wants(active[i]) ? 1 : 0;
        }
        return wanted;
      },
      std::plus<>());
}

}  // namespace

absl::StatusOr<int64_t> SweepQuality(Placement& placement, const SweepRules& rules,
                                     SweepMemory& memory, const RunContext& run) {
  std::vector<uint8_t> has_moved(static_cast<size_t>(memory.active.count()), 0);
  const SweepVisits sweep = VisitsOf(placement, rules, memory, has_moved);
  const absl::Status status = VisitByColour(
      placement.neighbourhoods, memory.active.list(), run,
      [&](int32_t v) { return sweep.Wants(v); },
      [&](int32_t v) {
        LocalRoom room(static_cast<size_t>(placement.neighbourhoods.cells[v].size()));
        sweep.Visit<LaneCells>(v, room.data());
      },
      memory.scratch);
  if (!status.ok()) return status;
  const std::vector<int32_t> moved = Marked(memory.active.list(), has_moved);
  memory.active.Clear();
  NoteMoves(moved, placement, memory, StopPoll(run));
  return static_cast<int64_t>(moved.size());
}

absl::Status RunSweeps(Placement& placement, const SweepRules& rules, int32_t count,
                       SweepMemory& memory, const RunContext& run) {
  SweepTask task = TaskFor(placement, memory, run);
  task.rules = rules;
  task.most_sweeps = count;
  const auto is_over = [&] {
    return task.sweeps_done >= count ||
           (task.sweeps_done > 0 &&
            HasSettled(task.moved_last, task.placement.vertices.size, rules.aim));
  };
  const auto on_cpu = [&]() -> absl::StatusOr<bool> {
    for (; !is_over(); ++task.sweeps_done) {
      AMHEX_ASSIGN_OR_RETURN(task.moved_last, SweepQuality(placement, rules, memory, run));
    }
    return true;
  };
  if (placement.device != nullptr) {
    const int64_t fewest = FewestVisitsOnDevice(placement.neighbourhoods);
    task.fewest_moved = fewest / kVisitsPerMove;
    if (CountWanted(placement, rules, memory) >= fewest) {
      AMHEX_RETURN_IF_ERROR(placement.device->Run(&task, on_cpu).status());
      AMHEX_RETURN_IF_ERROR(run.CheckStop());
      memory.active.ListAnew();
    }
  }
  AMHEX_RETURN_IF_ERROR(on_cpu().status());
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
