// What the hull demands of the nodes next to it.
#include <cmath>

#include "fields/background_grid.h"
#include "input/hull_queries.h"

namespace amhex::fields {
namespace {

// A node is next to the hull when the hull is closer than this (in grid spacings).
constexpr double kReach = 1.0;
// Further normals are looked for from six offsets of this length; together with the slack on the
// reach this sees the other faces of sharp edges and corners.
constexpr double kOffset = 0.9;
constexpr double kOffsetReach = 1.9;
constexpr double kFurtherReach = 1.1;
// A further normal counts when it differs from those known by more than about 37 degrees.
constexpr double kDistinctCosine = 0.8;

void AddIfDistinct(const HullPoint& hit, HullConstraints* constraints) {
  if (constraints->count == static_cast<int>(constraints->item.size())) return;
  for (const HullConstraint& known : *constraints) {
    if (Dot(known.normal, hit.normal) > kDistinctCosine) return;
  }
  constraints->item[constraints->count++] = {hit.normal, hit.point};
}

HullConstraints ConstraintsAt(const HullQueries& queries, const Vec3d& position, double spacing) {
  HullConstraints constraints;
  const HullPoint nearest = queries.Closest(position, kReach * spacing);
  if (nearest.triangle < 0) return constraints;
  AddIfDistinct(nearest, &constraints);
  for (int direction = 0; direction < 6; ++direction) {
    Vec3d probe = position;
    probe[direction / 2] += ((direction & 1) != 0 ? -kOffset : kOffset) * spacing;
    const HullPoint hit = queries.Closest(probe, kOffsetReach * spacing);
    if (hit.triangle < 0 || Norm(hit.point - position) > kFurtherReach * spacing) continue;
    AddIfDistinct(hit, &constraints);
  }
  return constraints;
}

}  // namespace

absl::Status FindHullConstraints(const Hull& hull, BackgroundGrid* grid, const RunContext& run) {
  GridLevel& level = grid->levels.front();
  const int64_t count = level.count();
  std::vector<uint8_t> is_near(count, 0);
  ForEach(run, count, [&](int64_t i) {
    is_near[i] = hull.queries->IsWithin(grid->Position(i), kReach * grid->spacing) ? 1 : 0;
  });
  if (const absl::Status status = run.CheckStop(); !status.ok()) return status;
  std::vector<int32_t> near_nodes;
  level.constraint_of_node.assign(count, -1);
  for (int64_t i = 0; i < count; ++i) {
    if (is_near[i] == 0) continue;
    level.constraint_of_node[i] = static_cast<int32_t>(near_nodes.size());
    near_nodes.push_back(static_cast<int32_t>(i));
  }
  level.constraints.resize(near_nodes.size());
  ForEach(run, static_cast<int64_t>(near_nodes.size()), [&](int64_t k) {
    level.constraints[k] =
        ConstraintsAt(*hull.queries, grid->Position(near_nodes[k]), grid->spacing);
  });
  return run.CheckStop();
}

}  // namespace amhex::fields
