// Points sorted into the cells of a uniform grid, for queries within a radius.
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "base/array_view_of.h"
#include "geometry/point_bins_view.h"

namespace amhex {

class PointBins {
 public:
  // `bin_size` in the points' units, about the distance of neighbours. Memory O(n): only occupied
  // bins are kept, sorted by their coordinates. The points must outlive the bins.
  PointBins(const std::vector<Vec3d>& points, double bin_size) : order_(points.size()) {
    Box3d box;
    for (const Vec3d& p : points) box.Extend(p);
    if (!points.empty()) view_.low = box.low;
    view_.bin_size = bin_size;
    view_.points = ArrayViewOf(points);
    std::vector<std::pair<int64_t, int32_t>> keyed(points.size());
    for (size_t i = 0; i < points.size(); ++i) {
      keyed[i] = {view_.KeyAt(points[i]), static_cast<int32_t>(i)};
    }
    std::sort(keyed.begin(), keyed.end());
    for (size_t i = 0; i < keyed.size(); ++i) {
      if (i == 0 || keyed[i].first != keyed[i - 1].first) {
        keys_.push_back(keyed[i].first);
        begin_.push_back(static_cast<int32_t>(i));
      }
      order_[i] = keyed[i].second;
    }
    begin_.push_back(static_cast<int32_t>(keyed.size()));
    view_.keys = ArrayViewOf(keys_), view_.begin = ArrayViewOf(begin_),
    view_.order = ArrayViewOf(order_);
  }
  PointBins(const PointBins&) = delete;
  PointBins& operator=(const PointBins&) = delete;

  // Calls visit(index) for every point within `radius` of `centre`, in an order that depends only
  // on the points.
  template <class Visitor>
  void ForEachWithin(const Vec3d& centre, double radius, const Visitor& visit) const {
    view_.ForEachWithin(centre, radius, visit);
  }

  // The same where bodies run; must not outlive this.
  const PointBinsView& view() const { return view_; }

 private:
  std::vector<int64_t> keys_;
  std::vector<int32_t> begin_;
  std::vector<int32_t> order_;
  PointBinsView view_;  // of all of them
};

}  // namespace amhex
