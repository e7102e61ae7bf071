// Finds the points near a place: bins in rows along x, so that one search serves a whole row.
#pragma once

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "amhex/vec3.h"

namespace amhex::fields {

// Memory: points plus rows of the bounding box (its y and z extents over the bin size).
class PointIndex {
 public:
  // `points` must outlive the index. Bins grow where the box would need too many rows.
  PointIndex(const std::vector<Vec3d>& points, double bin_size) : bin_size_(bin_size) {
    for (const Vec3d& p : points) box_.Extend(p);
    if (points.empty()) box_.Extend(Vec3d{});
    const Vec3d extent = box_.Extent();
    while (RowCount(extent) > 4.0 * static_cast<double>(points.size()) + 1024) bin_size_ *= 2;
    columns_ = static_cast<int64_t>(extent.y / bin_size_) + 1;
    rows_ = columns_ * (static_cast<int64_t>(extent.z / bin_size_) + 1);
    row_start_.assign(rows_ + 1, 0);
    for (const Vec3d& p : points) ++row_start_[RowOf(p) + 1];
    for (int64_t r = 0; r < rows_; ++r) row_start_[r + 1] += row_start_[r];
    items_.resize(points.size());
    std::vector<int32_t> cursor(row_start_.begin(), row_start_.end() - 1);
    for (size_t i = 0; i < points.size(); ++i) {
      items_[cursor[RowOf(points[i])]++] = {points[i].x, static_cast<int32_t>(i)};
    }
    oneapi::tbb::parallel_for(int64_t{0}, rows_, [this](int64_t r) {
      std::sort(items_.begin() + row_start_[r], items_.begin() + row_start_[r + 1]);
    });
  }

  // visit(index) for every point within `radius` of `p` along each axis, and for some beyond, in
  // an order that depends on the points alone.
  template <class Visit>
  void VisitNear(const Vec3d& p, double radius, const Visit& visit) const {
    const int64_t z_last = rows_ / columns_ - 1;
    const int64_t z1 = std::min(z_last, Bin(p.z + radius - box_.low.z));
    const int64_t y1 = std::min(columns_ - 1, Bin(p.y + radius - box_.low.y));
    for (int64_t z = std::max<int64_t>(0, Bin(p.z - radius - box_.low.z)); z <= z1; ++z) {
      for (int64_t y = std::max<int64_t>(0, Bin(p.y - radius - box_.low.y)); y <= y1; ++y) {
        const int64_t row = z * columns_ + y;
        const auto end = items_.begin() + row_start_[row + 1];
        auto item = std::lower_bound(items_.begin() + row_start_[row], end, Item{p.x - radius, -1});
        for (; item != end && item->x <= p.x + radius; ++item) visit(item->index);
      }
    }
  }

 private:
  struct Item {
    double x = 0;
    int32_t index = 0;
    bool operator<(const Item& other) const {
      return x != other.x ? x < other.x : index < other.index;
    }
  };

  double RowCount(const Vec3d& extent) const {
    return (extent.y / bin_size_ + 1) * (extent.z / bin_size_ + 1);
  }
  int64_t Bin(double offset) const { return static_cast<int64_t>(std::floor(offset / bin_size_)); }
  int64_t RowOf(const Vec3d& p) const {
    return Bin(p.z - box_.low.z) * columns_ + Bin(p.y - box_.low.y);
  }

  double bin_size_;
  Box3d box_;
  int64_t columns_ = 1, rows_ = 1;
  std::vector<int32_t> row_start_;
  std::vector<Item> items_;
};

}  // namespace amhex::fields
