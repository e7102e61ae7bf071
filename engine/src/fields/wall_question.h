// How thick the walls below the hull are, as a question (hull_batch.h): usable where bodies run.
#pragma once

#include <cstdint>

#include "base/array_view.h"
#include "fields/frame_math.h"
#include "fields/hull_nodes.h"
#include "fields/nearest_axis.h"
#include "input/hull_view.h"

namespace amhex::fields {

// How much lower the cells must become, per axis; 1 where they fit.
struct WallLoweringOf {
  using Answer = Vec3d;
  HullNodes at_hull;
  // The lattice that was found, by node.
  ArrayView<const Quaternion> frames;
  ArrayView<const Vec3d> sizes;  // of cells along the frames' axes
  double spacing = 0;            // of the grid

  AMHEX_HD Vec3d operator()(const HullView& hull, int64_t i) const {
    // Thinner walls (in grid spacings) may have no node between their sides.
    constexpr double kThinnest = 1.0;
    // Walls this near to a cell's size, as a share of it, are none too thin.
    constexpr double kThickEnough = 0.97;
    Vec3d lowering{1, 1, 1};
    const int32_t node = at_hull.nodes[i];
    const AxisFrame frame = ToFrame(frames[node]);
    for (int32_t k = at_hull.first[i]; k < at_hull.first[i + 1]; ++k) {
      const HullConstraint& c = at_hull.constraints[k];
      const NearestAxis nearest = FindNearestAxis(frame, c.normal);
      if (nearest.cosine <= kAlignedCosine) continue;
      const double size = sizes[node][nearest.axis];
      const double thickness = WallThickness(hull, c);
      if (thickness < kThinnest * spacing || thickness >= kThickEnough * size) continue;
      lowering[nearest.axis] = size / thickness;
    }
    return lowering;
  }

 private:
  // Thickness of the wall below the hull there; negative where it has no parallel other side.
  AMHEX_HD static double WallThickness(const HullView& hull, const HullConstraint& at) {
    // Rays start this far below the hull, in edge lengths.
    constexpr double kRayStart = 1e-3;
    // The side a ray ends on is looked for this far around, in edge lengths.
    constexpr double kEndReach = 1e-2;
    // Sides within some 14 degrees are parallel; the tip of a wedge is not a wall.
    constexpr double kParallelCosine = 0.97;
    const double thickness = hull.ExitDistance(at.point, -at.normal, kRayStart);
    if (!(thickness > 0)) return -1;
    const HullPoint end = hull.Closest(at.point - at.normal * thickness, kEndReach);
    const bool is_parallel = end.triangle >= 0 && Dot(end.normal, at.normal) < -kParallelCosine;
    return is_parallel ? thickness : -1;
  }
};

}  // namespace amhex::fields
