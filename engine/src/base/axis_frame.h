// Three perpendicular directions.
#pragma once

#include <array>

#include "amhex/vec3.h"

namespace amhex {

// Columns are the axes of a site or of a frame: axis[0] x, axis[1] y, axis[2] z.
struct AxisFrame {
  std::array<Vec3d, 3> axis{Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}};
};

}  // namespace amhex
