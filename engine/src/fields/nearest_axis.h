// Which axis of a frame a surface follows; usable where bodies run.
#pragma once

#include <cmath>

#include "amhex/vec3.h"
#include "relax/sites.h"

namespace amhex::fields {

// The axis of `frame` nearest to the unit `normal`, and on which side of it.
struct NearestAxis {
  int axis = 0;
  double sign = 1;
  double cosine = 1;  // >= 1 / sqrt(3)
};
// The hull counts for an axis within about 35 degrees of its normal.
inline constexpr double kAlignedCosine = 0.82;

AMHEX_HD inline NearestAxis FindNearestAxis(const AxisFrame& frame, const Vec3d& normal) {
  NearestAxis nearest{0, 1, -1};
  for (int axis = 0; axis < 3; ++axis) {
    const double c = Dot(frame.axis[axis], normal);
    if (std::abs(c) > nearest.cosine) nearest = {axis, c < 0 ? -1.0 : 1.0, std::abs(c)};
  }
  return nearest;
}

}  // namespace amhex::fields
