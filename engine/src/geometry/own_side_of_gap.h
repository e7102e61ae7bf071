// Which side of a gap is a cube's own; usable where bodies run.
#pragma once

#include "amhex/vec3.h"
#include "input/hull_view.h"

namespace amhex {

// Across a gap that is thinner than a cell the hull's other side may be the nearer one to a place
// on this side that lies beyond it. What is some way within the solid is nearer to its own.
struct OwnSideOfGap {
  // How far from its own side a place may be, in extents of the cube along the face's axis.
  // Measured: looser tests of faces on the hull reject more good cells.
  static constexpr double kMaxDepth = 0.35;
  static constexpr double kMinNormalCosine = 0.5;
  // A side that looks against a face (cosine) is not its own.
  static constexpr double kOtherSide = -0.5;
  // How far a place beyond a gap is from where the way to it leaves the solid, at least, in extents
  // of the cube.
  static constexpr double kLeastGap = 0.15;

  // The point of the hull's side that looks along `normal`, if it is as near as that.
  AMHEX_HD static HullPoint ClosestTo(const HullView& hull, const Vec3d& place, const Vec3d& normal,
                                      double extent) {
    const double depth = kMaxDepth * extent;
    HullPoint own = hull.Closest(place - normal * depth, 2 * depth);
    if (own.triangle < 0 || Dot(own.normal, normal) < kMinNormalCosine) return {};
    own.distance = Norm(own.point - place);
    // Not where that side ends beside the place.
    return own.distance <= depth ? own : HullPoint{};
  }

  // Where the way from `within` the solid to a point of the hull leaves the solid before it comes
  // there, if that is a side that looks against the point's: of a pocket between a wall and a post
  // the other side need not look against a cube's face.
  AMHEX_HD static HullPoint OnTheWay(const HullView& hull, const Vec3d& within,
                                     const HullPoint& point, double extent) {
    const Vec3d way = point.point - within;
    const double length = Norm(way), farthest = length - kLeastGap * extent;
    if (!(farthest > 0)) return {};
    const double exit = hull.ExitDistance(within, way / length, 0, farthest);
    if (exit < 0) return {};
    const HullPoint own = hull.Closest(within + way * (exit / length));
    return Dot(own.normal, point.normal) <= kOtherSide ? own : HullPoint{};
  }
};

}  // namespace amhex
