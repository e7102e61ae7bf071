// Unit quaternions of plain floats, usable in host and device code.
#pragma once

#include <cmath>

#include "amhex/vec3.h"
#include "base/platform.h"

namespace amhex {

// w + xi + yj + zk. Rotations are unit quaternions; q and -q are the same rotation.
struct Quatf {
  float w = 1, x = 0, y = 0, z = 0;
};

AMHEX_HD constexpr Quatf operator*(const Quatf& a, const Quatf& b) {
  return {
      a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
      a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}
AMHEX_HD constexpr Quatf operator+(const Quatf& a, const Quatf& b) {
  return {a.w + b.w, a.x + b.x, a.y + b.y, a.z + b.z};
}
AMHEX_HD constexpr Quatf operator*(const Quatf& a, float s) {
  return {a.w * s, a.x * s, a.y * s, a.z * s};
}
AMHEX_HD constexpr Quatf operator-(const Quatf& a) { return {-a.w, -a.x, -a.y, -a.z}; }

AMHEX_HD constexpr Quatf Conjugate(const Quatf& a) { return {a.w, -a.x, -a.y, -a.z}; }

AMHEX_HD constexpr float Dot(const Quatf& a, const Quatf& b) {
  return a.w * b.w + a.x * b.x + a.y * b.y + a.z * b.z;
}

// The identity for the zero quaternion.
AMHEX_HD inline Quatf Normalized(const Quatf& a) {
  const float length = sqrtf(Dot(a, a));
  return length > 0.0f ? a * (1.0f / length) : Quatf{};
}

// Column `axis` of the rotation matrix of unit `q`: where the axis of that number is turned to.
AMHEX_HD constexpr Vec3f AxisOf(const Quatf& q, int axis) {
  if (axis == 0) {
    return {1 - 2 * (q.y * q.y + q.z * q.z), 2 * (q.x * q.y + q.w * q.z),
            2 * (q.x * q.z - q.w * q.y)};
  }
  if (axis == 1) {
    return {2 * (q.x * q.y - q.w * q.z), 1 - 2 * (q.x * q.x + q.z * q.z),
            2 * (q.y * q.z + q.w * q.x)};
  }
  return {2 * (q.x * q.z + q.w * q.y), 2 * (q.y * q.z - q.w * q.x),
          1 - 2 * (q.x * q.x + q.y * q.y)};
}

// Direction -x +x -y +y -z +z of the rotated frame, numbered 0..5 as in relax/sites.h.
AMHEX_HD constexpr Vec3f DirectionOf(const Quatf& q, int direction) {
  const Vec3f axis = AxisOf(q, direction / 2);
  return (direction & 1) != 0 ? axis : -axis;
}

}  // namespace amhex
