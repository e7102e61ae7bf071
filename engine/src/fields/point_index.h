// Finds the points near a place: bins in rows along x, so that one search serves a whole row.
#pragma once

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cstdint>
#include <vector>

#include "amhex/vec3.h"
#include "fields/point_rows.h"

namespace amhex::fields {

inline RowShape ShapeOfRows(const std::vector<Vec3d>& points, double bin_size) {
  Box3d box;
  for (const Vec3d& p : points) box.Extend(p);
  if (points.empty()) box.Extend(Vec3d{});
  return ShapeOfRows(box, static_cast<int64_t>(points.size()), bin_size);
}

// Memory: points plus rows of the bounding box (its y and z extents over the bin size).
class PointIndex {
 public:
  PointIndex(const std::vector<Vec3d>& points, double bin_size)
      : PointIndex(points, ShapeOfRows(points, bin_size)) {}
  PointIndex(const std::vector<Vec3d>& points, const RowShape& shape) : shape_(shape) {
    row_start_.assign(shape_.rows + 1, 0);
    for (const Vec3d& p : points) ++row_start_[shape_.RowOf(p) + 1];
    for (int64_t r = 0; r < shape_.rows; ++r) row_start_[r + 1] += row_start_[r];
    items_.resize(points.size());
    std::vector<int32_t> cursor(row_start_.begin(), row_start_.end() - 1);
    for (size_t i = 0; i < points.size(); ++i) {
      items_[cursor[shape_.RowOf(points[i])]++] = {points[i].x, static_cast<int32_t>(i)};
    }
    oneapi::tbb::parallel_for(int64_t{0}, shape_.rows, [this](int64_t r) {
      std::sort(items_.begin() + row_start_[r], items_.begin() + row_start_[r + 1]);
    });
  }

  // visit(index) for every point within `radius` of `p` along each axis, and for some beyond, in
  // an order that depends on the points alone.
  template <class Visit>
  void VisitNear(const Vec3d& p, double radius, const Visit& visit) const {
    view().VisitNear(p, radius, visit);
  }

  // Must not outlive this.
  PointRowsView view() const {
    return {shape_,
            {row_start_.data(), static_cast<int64_t>(row_start_.size())},
            {items_.data(), static_cast<int64_t>(items_.size())}};
  }

 private:
  RowShape shape_;
  std::vector<int32_t> row_start_;
  std::vector<RowItem> items_;
};

}  // namespace amhex::fields
