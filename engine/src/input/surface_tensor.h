// Tensors of a surface's curvature; usable where bodies run, with the same bits everywhere.
#pragma once

#include <cmath>

#include "amhex/vec3.h"

namespace amhex {

// A symmetric tensor in space: xx, yy, zz, xy, yz, zx.
struct SymmetricTensor {
  double xx = 0, yy = 0, zz = 0, xy = 0, yz = 0, zx = 0;

  AMHEX_HD void Add(const SymmetricTensor& t, double weight) {
    xx += weight * t.xx, yy += weight * t.yy, zz += weight * t.zz;
    xy += weight * t.xy, yz += weight * t.yz, zx += weight * t.zx;
  }
  AMHEX_HD double Between(const Vec3d& a, const Vec3d& b) const {
    return a.x * (xx * b.x + xy * b.y + zx * b.z) + a.y * (xy * b.x + yy * b.y + yz * b.z) +
           a.z * (zx * b.x + yz * b.y + zz * b.z);
  }
};

struct PrincipalDirections {
  Vec3d largest;             // unit, tangent to `normal`: direction of the largest |curvature|
  double curvature_max = 0;  // signed, along `largest`
  double curvature_min = 0;  // signed, across it
};

// Unit vector orthogonal to the unit vector `normal`; always the same one.
AMHEX_HD inline Vec3d AnyTangent(const Vec3d& normal) {
  const double x = std::abs(normal.x), y = std::abs(normal.y), z = std::abs(normal.z);
  const Vec3d axis = x <= y && x <= z ? Vec3d{1, 0, 0} : (y <= z ? Vec3d{0, 1, 0} : Vec3d{0, 0, 1});
  return Normalized(Cross(normal, axis));
}

// Principal directions of a tensor seen in the plane with the unit normal `normal`.
AMHEX_HD inline PrincipalDirections PrincipalDirectionsOf(const SymmetricTensor& tensor,
                                                          const Vec3d& normal) {
  const Vec3d u = AnyTangent(normal), v = Cross(normal, u);
  const double a = tensor.Between(u, u), b = tensor.Between(u, v), c = tensor.Between(v, v);
  const double mean = (a + c) / 2, half = (a - c) / 2;
  const double radius = std::sqrt(half * half + b * b);
  // Of half the angle of (half, b): of sine and cosine the larger one by a square root, the other
  // by their product.
  double cosine = 1, sine = 0;
  if (radius > 0) {
    const double larger = std::sqrt((1 + std::abs(half) / radius) / 2);
    const double smaller = std::abs(b) / radius / (2 * larger);
    cosine = half >= 0 ? larger : smaller;
    sine = half >= 0 ? smaller : larger;
    if (b < 0) sine = -sine;
  }
  const Vec3d along_upper = u * cosine + v * sine;
  const double upper = mean + radius, lower = mean - radius;
  if (std::abs(upper) >= std::abs(lower)) return {along_upper, upper, lower};
  return {Cross(normal, along_upper), lower, upper};
}

}  // namespace amhex
