// Which directions the user's guidance asks of the nodes near it. Section 6.2, "Guidance".
//
// Guide samples act like hull samples: they pull an axis of the frames nearby, but bound nothing
// and fix no phase.
#include <cmath>

#include "fields/background_grid.h"
#include "input/point_tree.h"

namespace amhex::fields {
namespace {

// Guides act on nodes up to this far away, in edge lengths; the field carries on from there.
constexpr double kReach = 0.75;
// Samples that are looked at for directions other than the nearest one's.
constexpr int kNearSamples = 12;
// Lines count as different directions beyond some 37 degrees.
constexpr double kDistinctCosine = 0.8;

void AddIfDistinct(const Vec3d& direction, HullConstraints* directions) {
  if (direction == Vec3d{}) return;
  if (directions->count == static_cast<int>(directions->item.size())) return;
  for (const HullConstraint& known : *directions) {
    if (std::abs(Dot(known.normal, direction)) > kDistinctCosine) return;
  }
  directions->item[directions->count++] = {direction, {}};
}

HullConstraints DirectionsAt(const Vec3d& p, const Guidance& guidance, const PointTree& samples) {
  HullConstraints directions;
  std::vector<PointTree::Neighbour> near;
  if (!guidance.samples.empty()) samples.Nearest(p, kNearSamples, near);
  for (const auto& neighbour : near) {
    if (neighbour.squared_distance > kReach * kReach) break;
    const GuideSample& sample = guidance.samples[neighbour.index];
    AddIfDistinct(sample.axis, &directions);
    AddIfDistinct(sample.second_axis, &directions);
  }
  for (const GuidePlane& plane : guidance.planes) {
    if (std::abs(Dot(plane.normal, p - plane.point)) < kReach) {
      AddIfDistinct(plane.normal, &directions);
    }
  }
  return directions;
}

}  // namespace

absl::Status FindGuideDirections(const Guidance& guidance, BackgroundGrid* grid,
                                 const RunContext& run) {
  if (guidance.empty()) return absl::OkStatus();
  std::vector<Vec3d> positions;
  for (const GuideSample& sample : guidance.samples) positions.push_back(sample.position);
  const PointTree samples(positions);
  GridLevel& level = grid->levels.front();
  std::vector<HullConstraints> directions(level.count());
  ForEach(run, level.count(),
          [&](int64_t i) { directions[i] = DirectionsAt(grid->Position(i), guidance, samples); });
  level.guides_of_node.assign(level.count(), -1);
  for (int64_t i = 0; i < level.count(); ++i) {
    if (directions[i].count == 0) continue;
    level.guides_of_node[i] = static_cast<int32_t>(level.guides.size());
    level.guides.push_back(directions[i]);
  }
  return run.CheckStop();
}

}  // namespace amhex::fields
