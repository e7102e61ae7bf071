// Which open faces of a cube lie on the hull, as a question (hull_batch.h): usable where bodies
// run.
#pragma once

#include <array>
#include <cstdint>

#include "amhex/volume_mesh.h"
#include "base/array_view.h"
#include "geometry/cubes_view.h"
#include "geometry/own_side_of_gap.h"
#include "input/hull_view.h"

namespace amhex {

// Cubes and what has been merged of them (merged_cubes.h). Views do not own.
struct OpenCubes {
  CubesView cubes;
  ArrayView<const Vec3d> vertices;
  ArrayView<const CellCorners> corners;             // [cube_count]
  ArrayView<const std::array<int32_t, 6>> matches;  // [cube_count]

  int64_t count() const { return cubes.centre.size; }
};

// Bit d set: the face in direction d is open and lies on the hull.
struct HullFacesOf {
  using Answer = uint8_t;
  OpenCubes points;

  AMHEX_HD uint8_t operator()(const HullView& hull, int64_t i) const {
    const int cube = static_cast<int>(i);
    int faces = 0;
    for (int direction = 0; direction < kDirectionCount; ++direction) {
      if (points.matches[cube][direction] >= 0) continue;
      if (IsHullFace(hull, cube, direction)) faces |= 1 << direction;
    }
    return static_cast<uint8_t>(faces);
  }

 private:
  AMHEX_HD bool IsHullFace(const HullView& hull, int cube, int direction) const {
    // In extents of the cube along the face's axis; measured: looser tests reject more good cells.
    constexpr double kMaxCornerDepth = 0.45;
    // Nearer than this the face need not prove that its far side is outside.
    constexpr double kCertainDepth = 0.15;
    const double extent = 2 * points.cubes.half_extent[cube][direction / 2];
    const Vec3d centre = points.cubes.FaceCentre(cube, direction);
    const Vec3d normal = points.cubes.FaceNormal(cube, direction);
    const HullPoint nearest = hull.Closest(centre, OwnSideOfGap::kMaxDepth * extent);
    if (nearest.triangle < 0) return false;
    const bool is_other_side = Dot(nearest.normal, normal) <= OwnSideOfGap::kOtherSide;
    if (is_other_side) {
      const HullPoint own = OwnSideOfGap::ClosestTo(hull, centre, normal, extent);
      if (own.triangle < 0) return false;
    } else if (Dot(nearest.normal, normal) < OwnSideOfGap::kMinNormalCosine) {
      return false;
    }
    for (int q = 0; q < 4; ++q) {
      const int32_t vertex = points.corners[cube][CornerOfFace(direction, q)];
      if (!hull.IsWithin(points.vertices[vertex], kMaxCornerDepth * extent)) return false;
    }
    if (is_other_side || nearest.distance < kCertainDepth * extent) return true;
    const Vec3d beyond = centre + normal * (0.5 * extent);
    // What is inside there may be beyond a gap.
    return !hull.IsInside(beyond) ||
           Dot(hull.Closest(beyond).normal, normal) <= OwnSideOfGap::kOtherSide;
  }
};

}  // namespace amhex
