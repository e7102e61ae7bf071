#include "optimize/project_to_hull.h"

#include <algorithm>

namespace amhex {
namespace {

// Offsets below this many edge lengths are on the hull but for rounding.
constexpr double kOnHull = 1e-9;
constexpr int kFractionCount = 4;

void ProjectVertex(Placement& placement, int32_t v, double quality_floor) {
  const VertexConstraint& constraint = placement.constraints.vertex[v];
  if (constraint.kind == Constraint::kFree) return;
  const Vec3d start = placement.complex.vertices[v];
  const Vec3d target = Constrain(constraint, start, placement.features).point;
  if (Norm(target - start) < kOnHull) return;
  MoveJudge judge(placement, v);
  for (int quarters = kFractionCount; quarters > 0; --quarters) {
    const double fraction = static_cast<double>(quarters) / kFractionCount;
    const Vec3d place = quarters == kFractionCount ? target : start + (target - start) * fraction;
    if (judge.Permits(judge.Try(place), quality_floor)) {
      placement.complex.vertices[v] = place;
      return;
    }
  }
}

double OffsetOf(const Placement& placement, size_t v) {
  const VertexConstraint& constraint = placement.constraints.vertex[v];
  if (constraint.kind == Constraint::kFree) return 0;
  const Vec3d& p = placement.complex.vertices[v];
  return Norm(Constrain(constraint, p, placement.features).point - p);
}

}  // namespace

absl::Status ProjectToHull(Placement& placement, double quality_floor, const RunContext& run) {
  return VisitByColour(placement.neighbourhoods, run,
                       [&](int32_t v) { ProjectVertex(placement, v, quality_floor); });
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
  double largest = 0;
  for (size_t v = 0; v < placement.constraints.vertex.size(); ++v) {
    largest = std::max(largest, OffsetOf(placement, v));
  }
  return largest;
}

}  // namespace amhex
