// The Chebyshev metric of a site (section 4.1, "Distance Metric") in the form the labelling reads.
#pragma once

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
// 1 this is the paper's L-infinity norm in the site's frame.
// Aligned so that a device reads it in words of 16 bytes.
struct alignas(16) SiteMetric {
  float x = 0, y = 0, z = 0;  // edge lengths, domain frame
  float row[9] = {};          // axis a divided by the size along it: row[3 * a + component]
  float reach[3] = {};        // L1 norm of each row: its growth per unit step along all world axes
  float size = 1;             // largest of the cell along its axes, edge lengths
  int32_t is_inside = 0;
};

// The three components of the distance before the maximum is taken.
struct MetricComponents {
  float a = 0, b = 0, c = 0;
};

AMHEX_HD inline MetricComponents ComponentsOf(const SiteMetric& site, const Vec3f& p) {
  const float x = p.x - site.x;
  const float y = p.y - site.y;
  const float z = p.z - site.z;
  const float* r = site.row;
  return {AbsoluteValue(FusedMultiplyAdd(r[0], x, FusedMultiplyAdd(r[1], y, r[2] * z))),
          AbsoluteValue(FusedMultiplyAdd(r[3], x, FusedMultiplyAdd(r[4], y, r[5] * z))),
          AbsoluteValue(FusedMultiplyAdd(r[6], x, FusedMultiplyAdd(r[7], y, r[8] * z)))};
}

// The L-infinity distance from `site` to `p`, in cell sizes.
AMHEX_HD inline float ChebyshevDistance(const SiteMetric& site, const Vec3f& p) {
  const MetricComponents d = ComponentsOf(site, p);
  return Larger(Larger(d.a, d.b), d.c);
}

// Lower and upper bound of a site's distance over the cube around `centre`: each component grows
// by at most half_width * reach.
struct DistanceBounds {
  float lower = 0;
  float upper = 0;
};

AMHEX_HD inline DistanceBounds BoundsOverCube(const SiteMetric& site, const Vec3f& centre,
                                              float half_width) {
  const MetricComponents d = ComponentsOf(site, centre);
  const float* growth = site.reach;
  return {Larger(Larger(FusedMultiplyAdd(-half_width, growth[0], d.a),
                        FusedMultiplyAdd(-half_width, growth[1], d.b)),
                 FusedMultiplyAdd(-half_width, growth[2], d.c)),
          Larger(Larger(FusedMultiplyAdd(half_width, growth[0], d.a),
                        FusedMultiplyAdd(half_width, growth[1], d.b)),
                 FusedMultiplyAdd(half_width, growth[2], d.c))};
}

// Computes the metric of every site, stored in the order of the bins (graph/bin_grid.h), so that
// neighbours in space are neighbours in memory.
struct SiteMetricBody {
  ArrayView<const int32_t> ids;        // [site_count] site of each slot
  ArrayView<const Vec3d> position;     // [site_count]
  ArrayView<const Quatf> orientation;  // [site_count]
  ArrayView<const Vec3f> size;         // [site_count]
  ArrayView<const int32_t> is_inside;  // [site_count]
  ArrayView<SiteMetric> metric;        // [site_count] by slot

  AMHEX_HD void operator()(int64_t slot) const {
    const int32_t site = ids[slot];
    SiteMetric result;
    const Vec3f p = ToFloat(position[site]);
    result.x = p.x;
    result.y = p.y;
    result.z = p.z;
    for (int axis = 0; axis < 3; ++axis) {
      const Vec3f row = AxisOf(orientation[site], axis) / size[site][axis];
      const int first = 3 * axis;
      result.row[first] = row.x;
      result.row[first + 1] = row.y;
      result.row[first + 2] = row.z;
      result.reach[axis] = AbsoluteValue(row.x) + AbsoluteValue(row.y) + AbsoluteValue(row.z);
    }
    result.size = Larger(size[site].x, Larger(size[site].y, size[site].z));
    result.is_inside = is_inside[site];
    metric[slot] = result;
  }
};

}  // namespace amhex
