// Cubes (cubes.h) as plain arrays; usable where bodies run.
#pragma once

#include <cstdint>

#include "amhex/vec3.h"
#include "base/array_view.h"
#include "input/hull_view.h"
#include "relax/sites.h"

namespace amhex {

// Views do not own: the arrays must outlive them.
struct CubesView {
  ArrayView<const Vec3d> centre;       // [cube_count] edge lengths
  ArrayView<const AxisFrame> frame;    // [cube_count]
  ArrayView<const Vec3d> half_extent;  // [cube_count] along the cube's own axes
  ArrayView<const double> mean_half;   // [cube_count] mean of the three half extents
  // Of the solid, where it is known; made where bodies run.
  HullView hull = {};

  template <class Visit>
  void VisitArrays(const Visit& visit) {
    visit(centre), visit(frame), visit(half_extent), visit(mean_half);
  }

  AMHEX_HD Vec3d VirtualVertex(int id) const {
    // Bit c of a mask: corner c lies on the positive side of that axis.
    constexpr unsigned kPositiveX = 0x66, kPositiveY = 0xCC, kPositiveZ = 0xF0;
    const int cube = id / 8, corner = id % 8;
    const Vec3d& half = half_extent[cube];
    const auto& axis = frame[cube].axis;
    Vec3d p = centre[cube];
    p += axis[0] * ((kPositiveX >> corner & 1) != 0 ? half.x : -half.x);
    p += axis[1] * ((kPositiveY >> corner & 1) != 0 ? half.y : -half.y);
    p += axis[2] * ((kPositiveZ >> corner & 1) != 0 ? half.z : -half.z);
    return p;
  }
  AMHEX_HD Vec3d FaceNormal(int cube, int direction) const {
    return frame[cube].axis[direction / 2] * (direction % 2 == 1 ? 1.0 : -1.0);
  }
  // Whether the way from one cube's centre to the other's leaves the solid: however well their
  // faces fit, there is a gap between them. Not in the paper.
  AMHEX_HD bool AreApart(int cube_a, int cube_b) const {
    const Vec3d way = centre[cube_b] - centre[cube_a];
    const double length = Norm(way);
    return length > 0 && hull.ExitDistance(centre[cube_a], way / length, 0, length) >= 0;
  }
  AMHEX_HD Vec3d FaceCentre(int cube, int direction) const {
    return centre[cube] + FaceNormal(cube, direction) * half_extent[cube][direction / 2];
  }
};

// Corner of a cube at the q-th place of its face, as kCubeFaces (primitives.h) lists them.
AMHEX_HD inline int CornerOfFace(int direction, int q) {
  // One digit per corner.
  constexpr uint16_t kFaces[kDirectionCount] = {0x3740, 0x5621, 0x4510, 0x2673, 0x1230, 0x7654};
  return kFaces[direction] >> (4 * q) & 7;
}

}  // namespace amhex
