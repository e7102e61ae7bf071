// The Chebyshev metric of a site (section 4.1, "Distance Metric") in the form the labelling reads.
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/array_view.h"
#include "base/platform.h"
#include "base/quat.h"

namespace amhex {

// Outside cells end at the faces of their own cubes, in cell sizes: nothing else bounds the
// outermost ones, and any wider cells would push them outwards for ever.
inline constexpr float kOutsideReach = 0.5f;
inline constexpr float kUnboundedReach = 3e38f;

// Distances are measured in the site's own cell size: 0.5 on the faces of its cube. With all sizes
// 1 this is the paper's L-infinity norm in the site's frame. Lengths are in lattice coordinates, so
// that the lattice's points are whole numbers.
// 64 bytes: a line of a host's cache, two sectors of a device's, read in words of 16 bytes.
struct alignas(64) SiteMetric {
  float row[9] = {};          // axis a by the size along it: row[3 * a + component]; see RowNumber
  float x = 0, y = 0, z = 0;  // lattice coordinates
  float reach[3] = {};        // L1 norm of each row: its growth per unit step along all world axes
  float signed_size = -1;     // its sign tells the side

  // Of the two sides of the hull.
  AMHEX_HD bool IsOfSide(int32_t is_inside) const { return (signed_size > 0) == (is_inside != 0); }
  // No less than the largest of the cell along its axes.
  AMHEX_HD float Size() const { return AbsoluteValue(signed_size); }
};
static_assert(sizeof(SiteMetric) == 64, "no padding");

// Rows keep 16 bits, so that their products with the few halves between a point and a site that
// lies on the lattice are exact: points in the middle between two cells of an aligned grid are
// equally far from both then, and go to the first. It turns a distance by 1 part in 65,000.
inline constexpr uint32_t kDroppedRowBits = 8;
inline constexpr float kRowRounding = 1.0f / 65536.0f;

AMHEX_HD inline float RowNumber(float value) {
  constexpr float kSplit = static_cast<float>((1u << kDroppedRowBits) + 1u);
  const float scaled = kSplit * value;
  return scaled - (scaled - value);
}

// The three components of the distance from a site, with their signs.
struct MetricComponents {
  float a = 0, b = 0, c = 0;
};

// At a point; of a block's points, at its centre.
AMHEX_HD inline MetricComponents ComponentsAt(const SiteMetric& site, const Vec3f& p) {
  const float x = p.x - site.x;
  const float y = p.y - site.y;
  const float z = p.z - site.z;
  const float* r = site.row;
  return {FusedMultiplyAdd(r[0], x, FusedMultiplyAdd(r[1], y, r[2] * z)),
          FusedMultiplyAdd(r[3], x, FusedMultiplyAdd(r[4], y, r[5] * z)),
          FusedMultiplyAdd(r[6], x, FusedMultiplyAdd(r[7], y, r[8] * z))};
}

// What a step changes them by: the same from whatever point.
AMHEX_HD inline MetricComponents ChangeOf(const float (&r)[9], const Vec3f& step) {
  return {FusedMultiplyAdd(r[0], step.x, FusedMultiplyAdd(r[1], step.y, r[2] * step.z)),
          FusedMultiplyAdd(r[3], step.x, FusedMultiplyAdd(r[4], step.y, r[5] * step.z)),
          FusedMultiplyAdd(r[6], step.x, FusedMultiplyAdd(r[7], step.y, r[8] * step.z))};
}

// The L-infinity distance, in cell sizes.
AMHEX_HD inline float DistanceOf(const MetricComponents& d) {
  return Larger(Larger(AbsoluteValue(d.a), AbsoluteValue(d.b)), AbsoluteValue(d.c));
}

// The distance of a block's point from a site: that of the block's centre and what the step from
// there changes, which is the same in all blocks. All labelling goes this way, as another would
// round differently.
AMHEX_HD inline float DistanceBeside(const MetricComponents& centre,
                                     const MetricComponents& change) {
  return DistanceOf({centre.a + change.a, centre.b + change.b, centre.c + change.c});
}
AMHEX_HD inline float ChebyshevDistance(const SiteMetric& site, const Vec3f& centre,
                                        const Vec3f& step) {
  return DistanceBeside(ComponentsAt(site, centre), ChangeOf(site.row, step));
}

// Lower and upper bound of a site's distance over the cube around the point with these components:
// each grows by at most half_width * reach.
struct DistanceBounds {
  float lower = 0;
  float upper = 0;
};

AMHEX_HD inline DistanceBounds BoundsAround(const MetricComponents& at, const float (&reach)[3],
                                            float half_width) {
  const float a = AbsoluteValue(at.a), b = AbsoluteValue(at.b), c = AbsoluteValue(at.c);
  return {Larger(Larger(FusedMultiplyAdd(-half_width, reach[0], a),
                        FusedMultiplyAdd(-half_width, reach[1], b)),
                 FusedMultiplyAdd(-half_width, reach[2], c)),
          Larger(Larger(FusedMultiplyAdd(half_width, reach[0], a),
                        FusedMultiplyAdd(half_width, reach[1], b)),
                 FusedMultiplyAdd(half_width, reach[2], c))};
}

AMHEX_HD inline DistanceBounds BoundsOverCube(const SiteMetric& site, const Vec3f& centre,
                                              float half_width) {
  return BoundsAround(ComponentsAt(site, centre), site.reach, half_width);
}

// A cell's size in lattice coordinates, with what the rounding of its rows may add.
AMHEX_HD inline float CoveringSize(float size, float spacing) {
  return size / spacing * (1.0f + 2.0f * kRowRounding);
}

// Computes the metric of every site, stored in the order of the bins (graph/bin_grid.h), so that
// neighbours in space are neighbours in memory.
struct SiteMetricBody {
  double spacing = 1.0;                // of the lattice, edge lengths
  ArrayView<const int32_t> ids;        // [site_count] site of each slot
  ArrayView<const Vec3d> position;     // [site_count]
  ArrayView<const Quatf> orientation;  // [site_count]
  ArrayView<const Vec3f> size;         // [site_count]
  ArrayView<const int32_t> is_inside;  // [site_count]
  ArrayView<SiteMetric> metric;        // [site_count] by slot

  AMHEX_HD void operator()(int64_t slot) const {
    const int32_t site = ids[slot];
    SiteMetric result;
    const Vec3f p = ToFloat(position[site] / spacing);
    result.x = p.x;
    result.y = p.y;
    result.z = p.z;
    for (int axis = 0; axis < 3; ++axis) {
      const Vec3f axis_in_sizes =
          AxisOf(orientation[site], axis) * (static_cast<float>(spacing) / size[site][axis]);
      float* row = result.row + ptrdiff_t{3} * axis;
      for (int i = 0; i < 3; ++i) row[i] = RowNumber(axis_in_sizes[i]);
      result.reach[axis] = AbsoluteValue(row[0]) + AbsoluteValue(row[1]) + AbsoluteValue(row[2]);
    }
    const float covering = CoveringSize(Larger(size[site].x, Larger(size[site].y, size[site].z)),
                                        static_cast<float>(spacing));
    result.signed_size = is_inside[site] != 0 ? covering : -covering;
    metric[slot] = result;
  }
};

}  // namespace amhex
