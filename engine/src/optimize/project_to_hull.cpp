#include "optimize/project_to_hull.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <array>
#include <vector>

#include "optimize/move_judge.h"

namespace amhex {
namespace {

// Offsets below this many edge lengths are on the hull but for rounding.
constexpr double kOnHull = 1e-9;
constexpr size_t kVerticesPerBlock = 1024;
// Shares of the way to the hull that are tried, in this order.
constexpr std::array<double, 4> kFractions = {1.0, 0.7, 0.4, 0.15};
// A move may cost a neighbourhood this share of its worst quality at once, even below the round's
// floor, but never lead below kLowestFloor; the sweeps between the rounds regain it.
constexpr double kAllowedShare = 0.75;
constexpr double kLowestFloor = 0.25;

bool ProjectVertex(const PlacementView& placement, int32_t v, double quality_floor) {
  const VertexConstraint& constraint = placement.constraints[v];
  if (constraint.kind == Constraint::kFree || constraint.kind == Constraint::kFixed) return false;
  const Vec3d start = placement.vertices[v];
  const Vec3d target = Constrain(constraint, start, placement.features).point;
  if (Norm(target - start) < kOnHull) return false;
  LocalRoom room(static_cast<size_t>(placement.cells_at[v].size));
  MoveJudge judge(placement, v, CornerPenalty{}, FoldWatch::kNone, room.data());
  const double floor =
      std::min(quality_floor, std::max(kLowestFloor, kAllowedShare * judge.score().minimum));
  for (const double fraction : kFractions) {
    const Vec3d place = fraction == 1.0 ? target : start + (target - start) * fraction;
    if (judge.Permits(judge.Try(place), floor)) {
      placement.vertices[v] = place;
      return true;
    }
  }
  return false;
}

double OffsetOf(const Placement& placement, size_t v) {
  const VertexConstraint& constraint = placement.constraints.vertex[v];
  if (constraint.kind == Constraint::kFree || constraint.kind == Constraint::kFixed) return 0;
  const Vec3d& p = placement.complex.vertices[v];
  return Norm(Constrain(constraint, p, placement.features.view()).point - p);
}

}  // namespace

absl::StatusOr<int64_t> ProjectToHull(Placement& placement, double quality_floor,
                                      SweepMemory& memory, const RunContext& run) {
  std::vector<uint8_t> moved(placement.complex.vertices.size(), 0);
  const PlacementView view = ViewOf(placement);
  const absl::Status status = VisitByColour(placement.neighbourhoods, run, [&](int32_t v) {
    moved[v] = ProjectVertex(view, v, quality_floor);
  });
  if (!status.ok()) return status;
  NoteMoves(moved, placement, memory);
  return std::count(moved.begin(), moved.end(), 1);
}

void WeakenUnreached(Placement& placement, double tolerance) {
  for (size_t v = 0; v < placement.constraints.vertex.size(); ++v) {
    VertexConstraint& constraint = placement.constraints.vertex[v];
    if (constraint.kind != Constraint::kCrease && constraint.kind != Constraint::kCorner) continue;
    if (OffsetOf(placement, v) <= tolerance) continue;
    constraint = Weakened(constraint, placement.complex.vertices[v], placement.features);
  }
}

double LargestOffset(const Placement& placement) {
  return tbb::parallel_reduce(
      tbb::blocked_range<size_t>(0, placement.constraints.vertex.size(), kVerticesPerBlock), 0.0,
      [&](const tbb::blocked_range<size_t>& range, double largest) {
        for (size_t v = range.begin(); v < range.end(); ++v) {
          largest = std::max(largest, OffsetOf(placement, v));
        }
        return largest;
      },
      [](double a, double b) { return std::max(a, b); });
}

}  // namespace amhex
