// The bins of point_bins.h as plain data, and the search in them: the same on the host and where
// bodies run.
#pragma once

#include <cmath>
#include <cstdint>

#include "amhex/vec3.h"
#include "base/array_view.h"
#include "base/platform.h"

namespace amhex {

// Views do not own: the arrays must outlive them.
struct PointBinsView {
  ArrayView<const Vec3d> points;
  double bin_size = 1;
  Vec3d low;                       // of the points' box
  ArrayView<const int64_t> keys;   // of the occupied bins, ascending
  ArrayView<const int32_t> begin;  // [bin], and one more: into `order`
  ArrayView<const int32_t> order;  // points, bin by bin

  template <class Visit>
  void VisitArrays(const Visit& visit) {
    visit(points), visit(keys), visit(begin), visit(order);
  }

  // Calls visit(index) for every point within `radius` of `centre`, in an order that depends only
  // on the points.
  template <class Visitor>
  AMHEX_HD void ForEachWithin(const Vec3d& centre, double radius, const Visitor& visit) const {
    int64_t first[3], last[3];
    for (int axis = 0; axis < 3; ++axis) {
      first[axis] = BinCoordinate(centre[axis] - radius, axis);
      last[axis] = BinCoordinate(centre[axis] + radius, axis);
    }
    for (int64_t z = first[2]; z <= last[2]; ++z) {
      for (int64_t y = first[1]; y <= last[1]; ++y) {
        // The bins of one row have consecutive keys.
        const int32_t end = begin[BinsBelow(KeyOf(last[0], y, z) + 1)];
        for (int32_t k = begin[BinsBelow(KeyOf(first[0], y, z))]; k < end; ++k) {
          const int32_t point = order[k];
          if (SquaredNorm(points[point] - centre) <= radius * radius) visit(point);
        }
      }
    }
  }

  AMHEX_HD int64_t KeyAt(const Vec3d& p) const {
    return KeyOf(BinCoordinate(p.x, 0), BinCoordinate(p.y, 1), BinCoordinate(p.z, 2));
  }

 private:
  AMHEX_HD int64_t BinCoordinate(double value, int axis) const {
    // Keys hold 21 bits per axis; farther bins than that saturate, which costs time, never results.
    constexpr int64_t kMaxBin = (int64_t{1} << 20) - 1;
    const double bin = std::floor((value - low[axis]) / bin_size);
    return static_cast<int64_t>(Smaller(Larger(bin, 0.0), static_cast<double>(kMaxBin)));
  }
  AMHEX_HD static int64_t KeyOf(int64_t x, int64_t y, int64_t z) {
    return (z << 42) | (y << 21) | x;
  }
  // How many occupied bins have a smaller key.
  AMHEX_HD int64_t BinsBelow(int64_t key) const {
    int64_t first = 0, last = keys.size;
    while (first < last) {
      const int64_t middle = (first + last) / 2;
      if (keys[middle] < key) {
        first = middle + 1;
      } else {
        last = middle;
      }
    }
    return first;
  }
};

}  // namespace amhex
