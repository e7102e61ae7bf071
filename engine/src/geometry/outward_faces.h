// Which faces of cubes look out of the solid, as a question (hull_batch.h): usable where bodies
// run. Not in the paper, whose cubes on both sides of a gap thinner than they are would be glued.
#pragma once

#include <cstdint>

#include "amhex/vec3.h"
#include "base/array_view.h"
#include "geometry/cubes_view.h"
#include "input/hull_view.h"

namespace amhex {

// Across a gap that is thinner than a cell the hull's other side may be the nearer one to a place
// on this side that lies beyond it. What is some way within the solid is nearer to its own.
struct OwnSideOfGap {
  // How far from its own side a place may be, in extents of the cube along the face's axis.
  static constexpr double kMaxDepth = 0.35;
  static constexpr double kMinNormalCosine = 0.5;
  // A side that looks against a face (cosine) is not its own.
  static constexpr double kOtherSide = -0.5;

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
};

// Bit d set: the face in direction d is near the hull, which looks the same way. Two faces that
// look at each other and both do so have a gap between them.
struct FacesLookingOut {
  using Answer = uint8_t;
  CubesView cubes;

  AMHEX_HD uint8_t operator()(const HullView& hull, int64_t i) const {
    const int cube = static_cast<int>(i);
    const Vec3d& half = cubes.half_extent[cube];
    const double largest = Larger(half.x, Larger(half.y, half.z));
    if (!hull.IsWithin(cubes.centre[cube], (1 + 2 * OwnSideOfGap::kMaxDepth) * largest)) return 0;
    int faces = 0;
    for (int direction = 0; direction < kDirectionCount; ++direction) {
      const HullPoint own =
          OwnSideOfGap::ClosestTo(hull, cubes.FaceCentre(cube, direction),
                                  cubes.FaceNormal(cube, direction), 2 * half[direction / 2]);
      if (own.triangle >= 0) faces |= 1 << direction;
    }
    return static_cast<uint8_t>(faces);
  }
};

}  // namespace amhex
