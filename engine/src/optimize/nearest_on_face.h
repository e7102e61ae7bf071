// The point of a face of the boundary that is nearest to another one: of a quad's four triangles
// around its middle side by side, which give the bits of ClosestPointOnTriangle one by one.
#pragma once

#include <array>

#include "amhex/vec3.h"
#include "base/vector_lanes.h"

namespace amhex {

struct NearestOnFace {
  Vec3d point;
  double squared = 1e300;  // distance
  int side = 0;            // of the triangle it is on; the first of equally near ones
};

// The triangles of a face: side, next corner, middle. Of a triangle it is the same one four times.
class FaceInLanes {
 public:
  FaceInLanes() = default;
  FaceInLanes(const Vec3d* corner, int count, const Vec3d& middle) {
    for (int side = 0; side < kHalfLanes; ++side) {
      const int first = count == 4 ? side : 0;
      from_.Set(side, corner[first]);
      next_.Set(side, corner[(first + 1) % count]);
      third_.Set(side, count == 4 ? middle : corner[2]);
    }
  }

  AMHEX_LANES_INLINE NearestOnFace Nearest(const Vec3d& p) const {
    const Lanes3 along = next_ - from_, across = third_ - from_;
    const Lanes3 ap = from_.Towards(p), bp = next_.Towards(p), cp = third_.Towards(p);
    const HalfLanes d1 = along.Dot(ap), d2 = across.Dot(ap);
    const HalfLanes d3 = along.Dot(bp), d4 = across.Dot(bp);
    const HalfLanes d5 = along.Dot(cp), d6 = across.Dot(cp);
    const HalfLanes region_a = d3 * d6 - d5 * d4;
    const HalfLanes region_b = d5 * d2 - d1 * d6;
    const HalfLanes region_c = d1 * d4 - d3 * d2;
    const HalfLanes toward_b = d4 - d3, toward_c = d5 - d6;
    // Inside; what is taken there with which share is replaced by what comes first there.
    const HalfLanes zero = {}, one = zero + 1.0;
    const HalfLanes sum = region_a + region_b + region_c;
    Lanes3 base = from_, way = along;
    HalfLanes share = region_b, other_share = region_c, of = sum;
    {  // no area: on the first side
      const HalfMask is_flat = ~(sum > 0);
      const HalfLanes length = along.Dot(along);
      const HalfMask is_point = ~(length > 0);
      const HalfLanes within = d1 < 0 ? zero : (d1 > length ? length : d1);
      share = is_flat ? (is_point ? zero : within) : share;
      other_share = is_flat ? zero : other_share;
      of = is_flat ? (is_point ? one : length) : of;
    }
    const auto take = [&](const HalfMask& where, const Lanes3& new_base, const Lanes3& new_way,
                          const HalfLanes& new_share, const HalfLanes& whole) {
      const HalfMask is_proper = whole > 0;
      base = Chosen(where, new_base, base);
      way = Chosen(where, new_way, way);
      share = where ? (is_proper ? new_share : zero) : share;
      other_share = where ? zero : other_share;
      of = where ? (is_proper ? whole : one) : of;
    };
    take((region_a <= 0) & (toward_b >= 0) & (toward_c >= 0), next_, third_ - next_, toward_b,
         toward_b + toward_c);
    take((region_b <= 0) & (d2 >= 0) & (d6 <= 0), from_, across, d2, d2 - d6);
    take((d6 >= 0) & (d5 <= d6), third_, along, zero, zero);
    take((region_c <= 0) & (d1 >= 0) & (d3 <= 0), from_, along, d1, d1 - d3);
    take((d3 >= 0) & (d4 <= d3), next_, along, zero, zero);
    take((d1 <= 0) & (d2 <= 0), from_, along, zero, zero);
    const Lanes3 nearest = base + way * (share / of) + across * (other_share / of);
    const Lanes3 away = nearest.From(p);
    const HalfLanes squared = away.Dot(away);
    NearestOnFace result;
    for (int side = 0; side < kHalfLanes; ++side) {
      if (squared[side] < result.squared) result.squared = squared[side], result.side = side;
    }
    result.point = nearest.At(result.side);
    return result;
  }

 private:
  using Lanes3 = VectorsOf<kHalfLanes>;
  static AMHEX_LANES_INLINE Lanes3 Chosen(const HalfMask& where, const Lanes3& a, const Lanes3& b) {
    return {where ? a.x : b.x, where ? a.y : b.y, where ? a.z : b.z};
  }

  Lanes3 from_, next_, third_;
};

}  // namespace amhex
