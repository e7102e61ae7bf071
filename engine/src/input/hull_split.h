// How a node of the hull's hierarchy is split, and what it adds up to: the same arithmetic for the
// host's recursion (hull_queries.cpp) and for bodies, level by level (hull_tree_impl.h).
#pragma once

#include <array>
#include <cstdint>

#include "base/array_view.h"
#include "base/platform.h"
#include "input/hull_view.h"
#include "input/triangle_math.h"

namespace amhex {

inline constexpr int32_t kHullLeafTriangles = 4;
inline constexpr int kHullBinCount = 16;
// Sums over triangles are taken in parts of so many, so that threads can share the large ones.
inline constexpr int32_t kTrianglesPerSum = 1024;

// Twice the centre of the triangle's box.
AMHEX_HD inline Vec3d BoxCentre(const HullTriangle& t) {
  return ComponentMin(ComponentMin(t.a, t.b), t.c) + ComponentMax(ComponentMax(t.a, t.b), t.c);
}

// A box that need not hold anything yet.
struct HullBox {
  Vec3d low{1e300, 1e300, 1e300};
  Vec3d high{-1e300, -1e300, -1e300};

  AMHEX_HD void Extend(const Vec3d& p) {
    low = ComponentMin(low, p);
    high = ComponentMax(high, p);
  }
  AMHEX_HD void Extend(const HullTriangle& t) { Extend(t.a), Extend(t.b), Extend(t.c); }
  AMHEX_HD void Extend(const HullBox& other) {
    low = ComponentMin(low, other.low);
    high = ComponentMax(high, other.high);
  }
  AMHEX_HD double HalfArea() const {
    if (low.x > high.x) return 0;
    const Vec3d e = high - low;
    return e.x * e.y + e.y * e.z + e.z * e.x;
  }
};

// The triangles of a node by where their centres are along one axis.
struct HullBins {
  int axis = 0;
  double low = 0;
  double to_bin = 0;  // not positive where all centres are the same

  // `centres` is the box of all (BoxCentre).
  AMHEX_HD static HullBins Over(const HullBox& centres) {
    const Vec3d extent = centres.high - centres.low;
    HullBins bins;
    bins.axis =
        extent.x >= extent.y ? (extent.x >= extent.z ? 0 : 2) : (extent.y >= extent.z ? 1 : 2);
    bins.low = centres.low[bins.axis];
    if (extent[bins.axis] > 0) bins.to_bin = kHullBinCount / extent[bins.axis];
    return bins;
  }
  AMHEX_HD bool CanSplit() const { return to_bin > 0; }
  // Of a triangle, by where its BoxCentre is along the axis.
  AMHEX_HD int BinOf(const HullTriangle& t) const { return BinAt(BoxCentre(t)[axis]); }
  AMHEX_HD int BinAt(double centre) const {
    return Clamped(static_cast<int>((centre - low) * to_bin), 0, kHullBinCount - 1);
  }
};

struct HullBin {
  HullBox box;
  int32_t count = 0;
};

// The first bin of the right part by the surface area heuristic, or -1 where all are in one.
// `bin_at(i)` is the i-th HullBin; together they hold `count` triangles.
template <class BinAt>
AMHEX_HD inline int BestBin(int32_t count, const BinAt& bin_at) {
  double right_cost[kHullBinCount];
  HullBox right;
  int32_t right_count = 0;
  for (int bin = kHullBinCount - 1; bin > 0; --bin) {
    const HullBin next = bin_at(bin);
    right.Extend(next.box);
    right_count += next.count;
    right_cost[bin] = right_count * right.HalfArea();
  }
  HullBox left;
  int32_t left_count = 0;
  double best_cost = 1e300;
  int best_bin = -1;
  for (int bin = 1; bin < kHullBinCount; ++bin) {
    const HullBin next = bin_at(bin - 1);
    left.Extend(next.box);
    left_count += next.count;
    if (left_count == 0 || left_count == count) continue;
    const double cost = left_count * left.HalfArea() + right_cost[bin];
    if (cost < best_cost) best_cost = cost, best_bin = bin;
  }
  return best_bin;
}

// What a node's dipole is made of: sums over parts of its triangles, then over the parts in their
// order.
struct DipoleSums {
  Vec3d area_normal;
  Vec3d weighted;
  double area = 0;

  AMHEX_HD static DipoleSums Of(const HullTriangle* begin, const HullTriangle* end) {
    DipoleSums sums;
    for (const HullTriangle* t = begin; t < end; ++t) {
      const Vec3d area_vector = DoubleAreaVector(t->a, t->b, t->c) / 2.0;
      const double area = Norm(area_vector);
      sums.area_normal += area_vector;
      sums.weighted += (t->a + t->b + t->c) * (area / 3);
      sums.area += area;
    }
    return sums;
  }
  AMHEX_HD void Add(const DipoleSums& next) {
    area_normal += next.area_normal, weighted += next.weighted, area += next.area;
  }
  AMHEX_HD HullDipole Dipole(const HullNode& node) const {
    HullDipole dipole;
    dipole.area_normal = area_normal;
    dipole.centre = area > 0 ? weighted / area : (node.low + node.high) / 2.0;
    return dipole;
  }
};

// First moments about the dipole's centre and the farthest corner from there.
struct DipoleMoments {
  double xx = 0, yy = 0, zz = 0, xy = 0, yz = 0, zx = 0;
  double radius_squared = 0;

  AMHEX_HD static DipoleMoments Of(const HullTriangle* begin, const HullTriangle* end,
                                   const Vec3d& centre) {
    DipoleMoments m;
    for (const HullTriangle* t = begin; t < end; ++t) {
      m.Add(DoubleAreaVector(t->a, t->b, t->c) / 2.0, (t->a + t->b + t->c) / 3.0 - centre);
      m.Reach(*t, centre);
    }
    return m;
  }
  // Of a triangle: its area times its normal, and where its middle is from the centre.
  AMHEX_HD void Add(const Vec3d& a, const Vec3d& d) {
    xx += d.x * a.x, yy += d.y * a.y, zz += d.z * a.z;
    xy += (d.x * a.y + d.y * a.x) / 2;
    yz += (d.y * a.z + d.z * a.y) / 2;
    zx += (d.z * a.x + d.x * a.z) / 2;
  }
  AMHEX_HD void Reach(const HullTriangle& t, const Vec3d& centre) {
    for (const Vec3d* p : {&t.a, &t.b, &t.c}) {
      radius_squared = Larger(radius_squared, SquaredNorm(*p - centre));
    }
  }
  AMHEX_HD void Add(const DipoleMoments& next) {
    xx += next.xx, yy += next.yy, zz += next.zz;
    xy += next.xy, yz += next.yz, zx += next.zx;
    radius_squared = Larger(radius_squared, next.radius_squared);
  }
  AMHEX_HD void PutInto(HullDipole& dipole) const {
    // Barill et al. 2018: a node is far beyond this many of its radii.
    constexpr double kFarRatio = 2.3;
    dipole.xx = xx, dipole.yy = yy, dipole.zz = zz;
    dipole.xy = xy, dipole.yz = yz, dipole.zx = zx;
    dipole.far_squared = kFarRatio * kFarRatio * radius_squared;
  }
};

}  // namespace amhex
