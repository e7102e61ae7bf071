// Plain geometry of one triangle: closest point, solid angle, area.
#pragma once

#include <cmath>

#include "amhex/vec3.h"
#include "base/arc_tangent.h"
#include "base/platform.h"

namespace amhex {

// Twice the area times the unit normal.
AMHEX_HD inline Vec3d DoubleAreaVector(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  return Cross(b - a, c - a);
}

// True if the triangle is a point or a line for all that doubles can tell: its height is below
// 1e-8 of its longest side, so that its normal would be noise.
AMHEX_HD inline bool IsDegenerate(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  constexpr double kSmallestHeightRatio = 1e-8;
  const double longest_squared =
      Larger(Larger(SquaredNorm(b - a), SquaredNorm(c - b)), SquaredNorm(a - c));
  return !(Norm(DoubleAreaVector(a, b, c)) > kSmallestHeightRatio * longest_squared);
}

// Closest point of segment ab to p; a segment of length zero is its point a.
AMHEX_HD inline Vec3d ClosestPointOnSegment(const Vec3d& p, const Vec3d& a, const Vec3d& b) {
  const Vec3d along = b - a;
  const double length_squared = SquaredNorm(along);
  if (!(length_squared > 0)) return a;
  const double t = Dot(p - a, along) / length_squared;
  return a + along * (t < 0 ? 0 : (t > 1 ? 1 : t));
}

// Closest point of triangle abc to p, by the Voronoi regions of its corners and edges
// (Ericson, Real-Time Collision Detection, 5.1.5).
AMHEX_HD inline Vec3d ClosestPointOnTriangle(const Vec3d& p, const Vec3d& a, const Vec3d& b,
                                             const Vec3d& c) {
  const Vec3d ab = b - a, ac = c - a, ap = p - a;
  const double d1 = Dot(ab, ap), d2 = Dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return a;
  const Vec3d bp = p - b;
  const double d3 = Dot(ab, bp), d4 = Dot(ac, bp);
  if (d3 >= 0 && d4 <= d3) return b;
  const double region_c = d1 * d4 - d3 * d2;
  if (region_c <= 0 && d1 >= 0 && d3 <= 0) return a + ab * (d1 > d3 ? d1 / (d1 - d3) : 0);
  const Vec3d cp = p - c;
  const double d5 = Dot(ab, cp), d6 = Dot(ac, cp);
  if (d6 >= 0 && d5 <= d6) return c;
  const double region_b = d5 * d2 - d1 * d6;
  if (region_b <= 0 && d2 >= 0 && d6 <= 0) return a + ac * (d2 > d6 ? d2 / (d2 - d6) : 0);
  const double region_a = d3 * d6 - d5 * d4;
  const double toward_b = d4 - d3, toward_c = d5 - d6;
  if (region_a <= 0 && toward_b >= 0 && toward_c >= 0) {
    return b + (c - b) * (toward_b + toward_c > 0 ? toward_b / (toward_b + toward_c) : 0);
  }
  const double sum = region_a + region_b + region_c;
  if (!(sum > 0)) return ClosestPointOnSegment(p, a, b);
  return a + ab * (region_b / sum) + ac * (region_c / sum);
}

// Solid angle under which p sees triangle abc, positive when the normal looks away from p, in
// [-2 pi, 2 pi] (van Oosterom and Strackee 1983).
AMHEX_HD inline double SolidAngle(const Vec3d& p, const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  const Vec3d u = a - p, v = b - p, w = c - p;
  const double lu = Norm(u), lv = Norm(v), lw = Norm(w);
  const double volume = Determinant(u, v, w);
  const double cosine = lu * lv * lw + Dot(u, v) * lw + Dot(v, w) * lu + Dot(w, u) * lv;
  return 2 * ArcTangent2(volume, cosine);
}

}  // namespace amhex
