// Frames as quaternions and as axes; usable where bodies run.
#pragma once

#include <cmath>

#include "amhex/vec3.h"
#include "relax/sites.h"

namespace amhex::fields {

AMHEX_HD inline double Dot(const Quaternion& a, const Quaternion& b) {
  return a.w * b.w + a.x * b.x + a.y * b.y + a.z * b.z;
}
AMHEX_HD inline Quaternion Scaled(const Quaternion& q, double s) {
  return {q.w * s, q.x * s, q.y * s, q.z * s};
}
AMHEX_HD inline Quaternion Normalized(const Quaternion& q) {
  return Scaled(q, 1 / std::sqrt(Dot(q, q)));
}

AMHEX_HD inline AxisFrame ToFrame(const Quaternion& q) {
  AxisFrame frame;
  frame.axis[0] = {1 - 2 * (q.y * q.y + q.z * q.z), 2 * (q.x * q.y + q.w * q.z),
                   2 * (q.x * q.z - q.w * q.y)};
  frame.axis[1] = {2 * (q.x * q.y - q.w * q.z), 1 - 2 * (q.x * q.x + q.z * q.z),
                   2 * (q.y * q.z + q.w * q.x)};
  frame.axis[2] = {2 * (q.x * q.z + q.w * q.y), 2 * (q.y * q.z - q.w * q.x),
                   1 - 2 * (q.x * q.x + q.y * q.y)};
  return frame;
}

// `frame` must be orthonormal and right-handed.
AMHEX_HD inline Quaternion FromFrame(const AxisFrame& frame) {
  const Vec3d &a = frame.axis[0], &b = frame.axis[1], &c = frame.axis[2];
  // The largest of 4w^2, 4x^2, 4y^2, 4z^2 is at least 1: divide by that one.
  const double square[4] = {1 + a.x + b.y + c.z, 1 + a.x - b.y - c.z, 1 - a.x + b.y - c.z,
                            1 - a.x - b.y + c.z};
  int largest = 0;
  for (int k = 1; k < 4; ++k) {
    if (square[k] > square[largest]) largest = k;
  }
  if (largest == 0) return Normalized({square[0], b.z - c.y, c.x - a.z, a.y - b.x});
  if (largest == 1) return Normalized({b.z - c.y, square[1], a.y + b.x, c.x + a.z});
  if (largest == 2) return Normalized({c.x - a.z, a.y + b.x, square[2], b.z + c.y});
  return Normalized({a.y - b.x, c.x + a.z, b.z + c.y, square[3]});
}

}  // namespace amhex::fields
