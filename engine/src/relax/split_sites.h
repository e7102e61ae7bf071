// Split Cells of section 4.4: a site that too many others take for their neighbour becomes two.
//
// Three steps over the sites: flag those that must and can be split, number the flags (a scan), and
// split. New sites are appended in the order of the old ones; existing ids stay.
#pragma once

#include <cmath>
#include <cstdint>

#include "base/quat.h"
#include "relax/barrier_view.h"
#include "relax/cell_moments.h"
#include "relax/relaxation_state.h"

namespace amhex {

// A cell below this many times its wanted volume has no room for two.
inline constexpr double kLeastSplitVolume = 1.3;
// The two new sites end up half a cell apart.
inline constexpr double kSplitShift = 0.25;
// Jacobi sweeps after which a symmetric 3 x 3 matrix is diagonal to rounding.
inline constexpr int kJacobiSweeps = 8;

// Whether a cluster is split: claimed by at least `split_limit` sites, and large enough.
struct SplitCriterion {
  int32_t split_limit = 10;
  double point_volume = 0;

  AMHEX_HD bool operator()(int32_t claim_count, int64_t point_count, const Vec3f& size) const {
    return claim_count >= split_limit &&
           static_cast<double>(point_count) * point_volume >
               kLeastSplitVolume * static_cast<double>(size.x * size.y * size.z);
  }
};

// A symmetric matrix on its way to diagonal form, and the turn that takes it there.
struct JacobiMatrix {
  double a[3][3];
  double turn[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};

  // Turns the plane of axes p and q until a[p][q] vanishes.
  AMHEX_HD void Annihilate(int p, int q) {
    if (a[p][q] == 0) return;
    const double theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
    const double t = (theta < 0 ? -1.0 : 1.0) / (fabs(theta) + sqrt(theta * theta + 1));
    const double c = 1 / sqrt(t * t + 1);
    const double s = t * c;
    for (int k = 0; k < 3; ++k) {
      const double left = a[k][p], right = a[k][q];
      a[k][p] = c * left - s * right;
      a[k][q] = s * left + c * right;
    }
    for (int k = 0; k < 3; ++k) {
      const double upper = a[p][k], lower = a[q][k];
      a[p][k] = c * upper - s * lower;
      a[q][k] = s * upper + c * lower;
      const double left = turn[k][p], right = turn[k][q];
      turn[k][p] = c * left - s * right;
      turn[k][q] = s * left + c * right;
    }
  }
};

// Unit direction in which the points of a cell spread most; its largest component is positive.
// Needs second moments and at least one point.
AMHEX_HD inline Vec3d PrincipalDirection(const CellMoments& m) {
  const auto n = static_cast<double>(m.count);
  const Vec3d mean = {static_cast<double>(m.x) / n, static_cast<double>(m.y) / n,
                      static_cast<double>(m.z) / n};
  const auto spread = [&](int64_t product, double mean_product) {
    return static_cast<double>(product) / n - mean_product;
  };
  JacobiMatrix matrix;
  matrix.a[0][0] = spread(m.xx, mean.x * mean.x);
  matrix.a[1][1] = spread(m.yy, mean.y * mean.y);
  matrix.a[2][2] = spread(m.zz, mean.z * mean.z);
  matrix.a[0][1] = matrix.a[1][0] = spread(m.xy, mean.x * mean.y);
  matrix.a[1][2] = matrix.a[2][1] = spread(m.yz, mean.y * mean.z);
  matrix.a[0][2] = matrix.a[2][0] = spread(m.zx, mean.z * mean.x);
  for (int sweep = 0; sweep < kJacobiSweeps; ++sweep) {
    matrix.Annihilate(0, 1);
    matrix.Annihilate(0, 2);
    matrix.Annihilate(1, 2);
  }
  int widest = 0;
  for (int axis = 1; axis < 3; ++axis) {
    if (matrix.a[axis][axis] > matrix.a[widest][widest]) widest = axis;
  }
  const Vec3d direction = {matrix.turn[0][widest], matrix.turn[1][widest], matrix.turn[2][widest]};
  int largest = 0;
  for (int axis = 1; axis < 3; ++axis) {
    if (fabs(direction[axis]) > fabs(direction[largest])) largest = axis;
  }
  return direction[largest] < 0 ? -direction : direction;
}

// Everything that splitting looks at, after the sites have moved.
struct SplitView {
  BarrierView barrier;
  SplitCriterion criterion;
  RelaxationState state;
  int64_t capacity = 0;                  // of all arrays; never exceeded
  ArrayView<const int32_t> claim_count;  // [capacity]
  ArrayView<const CellMoments> moments;  // [capacity] second moments of clusters
  ArrayView<Vec3d> position;             // [capacity] domain frame
  ArrayView<Quatf> orientation;          // [capacity]
  ArrayView<Vec3f> size;                 // [capacity]
  ArrayView<int32_t> is_inside;          // [capacity]
  ArrayView<int32_t> rank;               // [capacity + 1] flags, then how many come before

  // From the site to one of its halves; the other lies opposite.
  AMHEX_HD Vec3d Shift(int64_t site) const {
    const Vec3d extent = ToDouble(size[site]);
    return PrincipalDirection(moments[site]) *
           (kSplitShift * ((extent.x + extent.y + extent.z) / 3.0));
  }

  AMHEX_HD bool IsSplit(int64_t site) const {
    if (is_inside[site] == 0) return false;
    if (!criterion(claim_count[site], moments[site].count, size[site])) return false;
    const Vec3d shift = Shift(site);
    return barrier.IsInside(position[site] + shift) && barrier.IsInside(position[site] - shift);
  }
};

// Sets the rank of every site to 1 or 0; one element more than sites have room, for the total.
struct FlagSplitsBody {
  SplitView view;
  AMHEX_HD void operator()(int64_t site) const {
    const bool may_split = site < view.state.SiteCount() && view.state.ClusterCount() > 0;
    view.rank[site] = may_split && view.IsSplit(site) ? 1 : 0;
  }
};

// Replaces flagged sites once the flags have become ranks; without room the last ones stay whole.
struct SplitBody {
  SplitView view;
  AMHEX_HD void operator()(int64_t site) const {
    const int64_t rank = view.rank[site];
    const int64_t added = view.state.SiteCount() + rank;
    if (view.rank[site + 1] == rank || added >= view.capacity) return;
    const Vec3d shift = view.Shift(site);
    const Vec3d centre = view.position[site];
    view.position[site] = centre + shift;
    view.position[added] = centre - shift;
    view.orientation[added] = view.orientation[site];
    view.size[added] = view.size[site];
    view.is_inside[added] = 1;
  }
};

// Ends an iteration: counts the new sites. One element.
struct AdvanceBody {
  SplitView view;
  AMHEX_HD void operator()(int64_t /*index*/) const {
    const int64_t before = view.state.SiteCount();
    const int64_t added =
        Smaller(static_cast<int64_t>(view.rank[view.capacity]), view.capacity - before);
    view.state.Set(kMovedCount, before);
    view.state.Set(kSiteCount, before + added);
    view.state.Set(kSplitCount, view.state.value[kSplitCount] + added);
    view.state.Set(kIteration, view.state.Iteration() + 1);
  }
};

}  // namespace amhex
