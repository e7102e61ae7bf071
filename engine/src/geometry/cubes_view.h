// Cubes (cubes.h) as plain arrays; usable where bodies run.
#pragma once

#include <cstdint>

#include "amhex/vec3.h"
#include "base/array_view.h"
#include "relax/sites.h"

namespace amhex {

// Views do not own: the arrays must outlive them.
struct CubesView {
  ArrayView<const Vec3d> centre;       // [cube_count] edge lengths
  ArrayView<const AxisFrame> frame;    // [cube_count]
  ArrayView<const Vec3d> half_extent;  // [cube_count] along the cube's own axes
  ArrayView<const double> mean_half;   // [cube_count] mean of the three half extents
  // [cube_count] bit per direction: the face looks out of the solid (outward_faces.h); none is
  // known to where there are none. Made where bodies run.
  ArrayView<const uint8_t> outward = {};

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
  AMHEX_HD bool LooksOut(int cube, int direction) const {
    return !outward.empty() && (outward[cube] >> direction & 1) != 0;
  }
  // Whether there is a gap of the solid between two faces that look at each other.
  AMHEX_HD bool AreApart(int cube_a, int direction_a, int cube_b, int direction_b) const {
    return LooksOut(cube_a, direction_a) && LooksOut(cube_b, direction_b);
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
