#include "optimize/project_to_hull.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <vector>

#include "base/array_view_of.h"
#include "base/status_macros.h"
#include "cuda/device_use.h"
#include "optimize/lane_cells.h"
#include "optimize/project_vertex.h"
#include "optimize/sweep_task.h"
#include "optimize/visit_by_colour.h"
#include "optimize/worth_device.h"

namespace amhex {
namespace {

constexpr size_t kVerticesPerBlock = 1024;

double OffsetOf(const PlacementView& placement, size_t v) {
  const auto vertex = static_cast<int64_t>(v);
  return Norm(FootOf(placement, vertex).point - placement.vertices[vertex]);
}

// As they are for these vertices; the others stay where they are.
std::vector<VertexConstraint> ConstraintsAmong(const ActiveVertices& among,
                                               const std::vector<VertexConstraint>& constraints) {
  std::vector<VertexConstraint> theirs = constraints;
  for (size_t v = 0; v < theirs.size(); ++v) {
    if (!among.Has(static_cast<int32_t>(v))) theirs[v].kind = Constraint::kFixed;
  }
  return theirs;
}

// Ascending.
std::vector<int32_t> VerticesOnHull(const PlacementView& placement) {
  std::vector<int32_t> on_hull;
  for (int32_t v = 0; v < placement.vertices.size; ++v) {
    if (IsOnHull(placement, v)) on_hull.push_back(v);
  }
  return on_hull;
}

}  // namespace

absl::StatusOr<int64_t> ProjectToHull(Placement& placement, const ActiveVertices& among,
                                      double quality_floor, SweepMemory& memory,
                                      const RunContext& run) {
  SweepTask task = TaskFor(placement, memory, run);
  std::vector<VertexConstraint> constraints;
  if (!among.AreAll()) {
    constraints = ConstraintsAmong(among, placement.constraints.vertex);
    task.placement.constraints = ArrayViewOf(constraints);
  }
  task.projection_floor = quality_floor;
  const std::vector<int32_t> on_hull = VerticesOnHull(task.placement);
  const auto on_cpu = [&]() -> absl::StatusOr<bool> {
    std::vector<uint8_t> has_moved(placement.complex.vertices.size(), 0);
    const absl::Status status = VisitByColour(
        placement.neighbourhoods, on_hull, run, [](int32_t) { return true; },
        [&](int32_t v) {
          LocalRoom room(static_cast<size_t>(task.placement.cells_at[v].size));
          has_moved[v] = ProjectVertex<LaneCells>(task.placement, v, quality_floor, room.data());
        },
        memory.scratch);
    if (!status.ok()) return status;
    const std::vector<int32_t> moved = Marked(on_hull, has_moved);
    NoteMoves(moved, placement, memory, StopPoll(run));
    task.projected_count = static_cast<int64_t>(moved.size());
    return true;
  };
  const bool is_worth_device =
      placement.device != nullptr &&
      static_cast<int64_t>(on_hull.size()) >= FewestVisitsOnDevice(placement.neighbourhoods);
  AMHEX_RETURN_IF_ERROR(
      RunWhereChosen(is_worth_device ? placement.device : nullptr, &task, on_cpu).status());
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  if (is_worth_device) memory.active.ListAnew();
  return task.projected_count;
}

void WeakenUnreached(Placement& placement, double tolerance, const StopPoll& poll) {
  const PlacementView view = ViewOf(placement);
  for (size_t v = 0; v < placement.constraints.vertex.size(); ++v) {
    poll.At(static_cast<int64_t>(v));
    VertexConstraint& constraint = placement.constraints.vertex[v];
    if (constraint.kind != Constraint::kCrease && constraint.kind != Constraint::kCorner) continue;
    if (OffsetOf(view, v) <= tolerance) continue;
    constraint = Weakened(constraint, placement.complex.vertices[v], placement.features);
  }
}

double LargestOffset(Placement& placement, const ActiveVertices& among, const StopPoll& poll) {
  const PlacementView view = ViewOf(placement);
  return tbb::parallel_reduce(
      tbb::blocked_range<size_t>(0, placement.constraints.vertex.size(), kVerticesPerBlock), 0.0,
      [&](const tbb::blocked_range<size_t>& range, double largest) {
        poll.Now();
        for (size_t v = range.begin(); v < range.end(); ++v) {
          if (!among.Has(static_cast<int32_t>(v))) continue;
          largest = std::max(largest, OffsetOf(view, v));
        }
        return largest;
      },
      [](double a, double b) { return std::max(a, b); });
}

}  // namespace amhex
