#include "fields/thin_walls.h"

#include <cmath>
#include <vector>

#include "input/hull_queries.h"

namespace amhex::fields {
namespace {

// Thinner walls (in grid spacings) may have no node between their sides.
constexpr double kThinnest = 1.0;
// Walls this near to a cell's size, as a share of it, are none too thin.
constexpr double kThickEnough = 0.97;
// Sides within some 14 degrees are parallel; the tip of a wedge is not a wall.
constexpr double kParallelCosine = 0.97;
// Rays start this far below the hull, in edge lengths.
constexpr double kRayStart = 1e-3;
// The side a ray ends on is looked for this far around, in edge lengths.
constexpr double kEndReach = 1e-2;

// Thickness of the wall below the hull there; negative where it has no parallel other side.
double WallThickness(const HullQueries& queries, const HullConstraint& hull) {
  const double thickness = queries.ExitDistance(hull.point, -hull.normal, kRayStart);
  if (!(thickness > 0)) return -1;
  const HullPoint end = queries.Closest(hull.point - hull.normal * thickness, kEndReach);
  const bool is_parallel = end.triangle >= 0 && Dot(end.normal, hull.normal) < -kParallelCosine;
  return is_parallel ? thickness : -1;
}

// How much lower the cells must become, per axis; 1 where they fit.
Vec3d LoweringAt(const HullQueries& queries, const BackgroundGrid& grid, const LatticeForm& form,
                 int64_t node) {
  Vec3d lowering{1, 1, 1};
  const HullConstraints* constraints = grid.fine().ConstraintsOf(node);
  if (constraints == nullptr) return lowering;
  const AxisFrame frame = ToFrame(form.frames[node]);
  for (const HullConstraint& c : *constraints) {
    const NearestAxis nearest = FindNearestAxis(frame, c.normal);
    if (nearest.cosine <= kAlignedCosine) continue;
    const double size = form.sizes[node][nearest.axis];
    const double thickness = WallThickness(queries, c);
    if (thickness < kThinnest * grid.spacing || thickness >= kThickEnough * size) continue;
    lowering[nearest.axis] = size / thickness;
  }
  return lowering;
}

}  // namespace

void FitThinWalls(const Hull& hull, const BackgroundGrid& grid, const ForwardCodes& codes,
                  const RunContext& run, LatticeForm* form) {
  std::vector<Vec3d> lowering(static_cast<size_t>(grid.count()), Vec3d{1, 1, 1});
  ForEach(run, grid.count(),
          [&](int64_t i) { lowering[i] = LoweringAt(*hull.queries, grid, *form, i); });
  ForEach(run, grid.count(), [&](int64_t i) {
    for (int d = 0; d < 3; ++d) {
      const int32_t j = grid.fine().neighbours[i][d];
      if (j < 0) continue;
      const AxisRotation& rotation = kAxisRotations[codes[i][d]];
      for (int a = 0; a < 3; ++a) {
        const double mean = (lowering[i][a] + lowering[j][rotation.source[a]]) / 2;
        form->increments[i][d][a] *= static_cast<float>(mean);
      }
    }
    for (int a = 0; a < 3; ++a) {
      form->steps[i][a] /= lowering[i][a];
      form->sizes[i][a] /= lowering[i][a];
    }
  });
}

}  // namespace amhex::fields
