// How often a surface without boundary winds around a point, told by the triangles that a ray from
// there passes: an integer, far cheaper than solid angles. Told only where rounding cannot change
// it.
#pragma once

#include <cstdint>

#include "amhex/vec3.h"
#include "base/platform.h"

namespace amhex {

class CrossingRay {
 public:
  // From `origin` on, to the nearest side of the box around the surface: few triangles are on the
  // way. `slack` is more than coordinates in the box are rounded by.
  AMHEX_HD CrossingRay(const Vec3d& origin, const Vec3d& low, const Vec3d& high, double slack)
      : origin_(origin), slack_(slack) {
    // Any small slopes will do. Ones that nobody builds with meet no edges of what is aligned.
    constexpr double kFirstSlope = 0.013763819, kSecondSlope = 0.0078961703;
    int axis = 0;
    double nearest = origin.x - low.x, sign = -1;
    for (int a = 0; a < 3; ++a) {
      if (origin[a] - low[a] < nearest) nearest = origin[a] - low[a], axis = a, sign = -1;
      if (high[a] - origin[a] < nearest) nearest = high[a] - origin[a], axis = a, sign = 1;
    }
    direction_[axis] = sign;
    direction_[axis == 2 ? 0 : axis + 1] = kFirstSlope;
    direction_[axis == 0 ? 2 : axis - 1] = kSecondSlope;
    inverse_ = {1 / direction_.x, 1 / direction_.y, 1 / direction_.z};
  }

  // False only if nothing in the box is on the way.
  AMHEX_HD bool MayMeet(const Vec3d& low, const Vec3d& high) const {
    double enter = 0, leave = 1e300;
    for (int a = 0; a < 3; ++a) {
      const double to_low = (low[a] - slack_ - origin_[a]) * inverse_[a];
      const double to_high = (high[a] + slack_ - origin_[a]) * inverse_[a];
      enter = Larger(enter, Smaller(to_low, to_high));
      leave = Smaller(leave, Larger(to_low, to_high));
    }
    return enter <= leave;
  }

  // False if rounding leaves open whether the ray passes triangle abc, and it must be told by other
  // means.
  AMHEX_HD bool Pass(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
    const Vec3d u = a - origin_, v = b - origin_, w = c - origin_;
    const double u_size = SizeOf(u), v_size = SizeOf(v), w_size = SizeOf(w);
    const Vec3d v_w = Cross(v, w);
    // On which side of the three edges the ray passes.
    const int first = SignOf(Dot(direction_, Cross(u, v)), u_size * v_size);
    const int second = SignOf(Dot(direction_, v_w), v_size * w_size);
    const int third = SignOf(Dot(direction_, Cross(w, u)), w_size * u_size);
    if (first * second < 0 || second * third < 0 || third * first < 0) return true;
    if (first == 0 || second == 0 || third == 0) return false;
    const int side = SignOf(Dot(u, v_w), u_size * v_size * w_size);  // positive behind the triangle
    if (side == first) number_ += first;
    return side != 0;
  }

  // Of those that were passed: how often the surface winds around the origin.
  AMHEX_HD int32_t number() const { return number_; }

 private:
  // The sum of absolute coordinates.
  AMHEX_HD static double SizeOf(const Vec3d& a) {
    return Larger(a.x, -a.x) + Larger(a.y, -a.y) + Larger(a.z, -a.z);
  }
  // Zero where it is not sure. Nine roundings at most lie between differences of coordinates and a
  // determinant, of which all terms together are at most the product of their sizes.
  AMHEX_HD static int SignOf(double determinant, double sizes) {
    constexpr double kRounding = 0x1p-48;
    const double least = kRounding * sizes;
    return determinant > least ? 1 : (-determinant > least ? -1 : 0);
  }

  Vec3d origin_, direction_, inverse_;
  double slack_;
  int32_t number_ = 0;
};

}  // namespace amhex
