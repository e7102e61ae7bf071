// Points in bins that lie in rows along x, so that one search serves a whole row: as plain data,
// and the search in them, the same on the host and where bodies run. point_index.h builds and owns
// them.
#pragma once

#include <cmath>
#include <cstdint>

#include "amhex/vec3.h"
#include "base/array_view.h"
#include "base/platform.h"

namespace amhex::fields {

// Which row a point belongs to.
struct RowShape {
  double bin_size = 1;
  Vec3d low;  // of the points' box
  int64_t columns = 1, rows = 1;

  AMHEX_HD int64_t Bin(double offset) const {
    return static_cast<int64_t>(std::floor(offset / bin_size));
  }
  AMHEX_HD int64_t RowOf(const Vec3d& p) const {
    return Bin(p.z - low.z) * columns + Bin(p.y - low.y);
  }
};

// For points of which none lies outside `box`. Bins grow where the box would need too many rows.
inline RowShape ShapeOfRows(const Box3d& box, int64_t point_count, double bin_size) {
  RowShape shape{bin_size, box.low, 1, 1};
  const Vec3d extent = box.Extent();
  const auto row_count = [&] {
    return (extent.y / shape.bin_size + 1) * (extent.z / shape.bin_size + 1);
  };
  while (row_count() > 4.0 * static_cast<double>(point_count) + 1024) shape.bin_size *= 2;
  shape.columns = static_cast<int64_t>(extent.y / shape.bin_size) + 1;
  shape.rows = shape.columns * (static_cast<int64_t>(extent.z / shape.bin_size) + 1);
  return shape;
}

struct RowItem {
  double x = 0;
  int32_t index = 0;
  AMHEX_HD bool operator<(const RowItem& other) const {
    return x != other.x ? x < other.x : index < other.index;
  }
};

// Views do not own: the arrays must outlive them.
struct PointRowsView {
  RowShape shape;
  ArrayView<const int32_t> row_start;  // [row], and one more: into items
  ArrayView<const RowItem> items;      // row by row, ascending

  // visit(index) for every point within `radius` of `p` along each axis, and for some beyond, in
  // an order that depends on the points alone.
  template <class Visit>
  AMHEX_HD void VisitNear(const Vec3d& p, double radius, const Visit& visit) const {
    const int64_t z_end =
        Smaller(shape.rows / shape.columns - 1, shape.Bin(p.z + radius - shape.low.z));
    const int64_t y_end = Smaller(shape.columns - 1, shape.Bin(p.y + radius - shape.low.y));
    const int64_t z_begin = Larger(int64_t{0}, shape.Bin(p.z - radius - shape.low.z));
    const int64_t y_begin = Larger(int64_t{0}, shape.Bin(p.y - radius - shape.low.y));
    for (int64_t z = z_begin; z <= z_end; ++z) {
      for (int64_t y = y_begin; y <= y_end; ++y) {
        const int64_t row = z * shape.columns + y;
        const int32_t end = row_start[row + 1];
        for (int32_t i = FirstFrom(row, p.x - radius); i < end && items[i].x <= p.x + radius; ++i) {
          visit(items[i].index);
        }
      }
    }
  }

 private:
  // The first item of the row that is no less than `x`.
  AMHEX_HD int32_t FirstFrom(int64_t row, double x) const {
    const RowItem wanted{x, -1};
    int32_t begin = row_start[row], end = row_start[row + 1];
    while (begin < end) {
      const int32_t middle = begin + (end - begin) / 2;
      if (items[middle] < wanted) {
        begin = middle + 1;
      } else {
        end = middle;
      }
    }
    return begin;
  }
};

}  // namespace amhex::fields
