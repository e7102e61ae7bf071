// Points sorted into the cells of a uniform grid, for queries within a radius.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "amhex/vec3.h"

namespace amhex {

class PointBins {
 public:
  // `bin_size` in the points' units, about the distance of neighbours. Memory O(n): only occupied
  // bins are kept, sorted by their coordinates.
  PointBins(const std::vector<Vec3d>& points, double bin_size)
      : points_(points), bin_size_(bin_size), order_(points.size()) {
    Box3d box;
    for (const Vec3d& p : points) box.Extend(p);
    if (!points.empty()) low_ = box.low;
    std::vector<std::pair<int64_t, int>> keyed(points.size());
    for (size_t i = 0; i < points.size(); ++i) {
      keyed[i] = {KeyOf(BinOf(points[i], 0), BinOf(points[i], 1), BinOf(points[i], 2)),
                  static_cast<int>(i)};
    }
    std::sort(keyed.begin(), keyed.end());
    for (size_t i = 0; i < keyed.size(); ++i) {
      if (i == 0 || keyed[i].first != keyed[i - 1].first) {
        keys_.push_back(keyed[i].first);
        begin_.push_back(static_cast<int>(i));
      }
      order_[i] = keyed[i].second;
    }
    begin_.push_back(static_cast<int>(keyed.size()));
  }

  // Calls visit(index) for every point within `radius` of `centre`, in an order that depends only
  // on the points.
  template <class Visitor>
  void ForEachWithin(const Vec3d& centre, double radius, Visitor&& visit) const {
    int64_t low[3], high[3];
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = BinCoordinate(centre[axis] - radius, axis);
      high[axis] = BinCoordinate(centre[axis] + radius, axis);
    }
    for (int64_t z = low[2]; z <= high[2]; ++z) {
      for (int64_t y = low[1]; y <= high[1]; ++y) {
        // The bins of one row have consecutive keys.
        const auto first =
            std::lower_bound(keys_.begin(), keys_.end(), KeyOf(low[0], y, z)) - keys_.begin();
        const auto last =
            std::upper_bound(keys_.begin(), keys_.end(), KeyOf(high[0], y, z)) - keys_.begin();
        for (int k = begin_[first]; k < begin_[last]; ++k) {
          if (SquaredNorm(points_[order_[k]] - centre) <= radius * radius) visit(order_[k]);
        }
      }
    }
  }

 private:
  // Keys hold 21 bits per axis; farther bins than that saturate, which costs time, never results.
  static constexpr int64_t kMaxBin = (int64_t{1} << 20) - 1;

  int64_t BinCoordinate(double value, int axis) const {
    const double bin = std::floor((value - low_[axis]) / bin_size_);
    return static_cast<int64_t>(std::clamp(bin, 0.0, static_cast<double>(kMaxBin)));
  }
  int64_t BinOf(const Vec3d& p, int axis) const { return BinCoordinate(p[axis], axis); }
  static int64_t KeyOf(int64_t x, int64_t y, int64_t z) { return (z << 42) | (y << 21) | x; }

  const std::vector<Vec3d>& points_;
  double bin_size_;
  Vec3d low_;
  std::vector<int64_t> keys_;
  std::vector<int> begin_;
  std::vector<int> order_;
};

}  // namespace amhex
