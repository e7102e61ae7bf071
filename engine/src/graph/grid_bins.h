// Builds a BinGrid on an executor.
#pragma once

#include <cmath>
#include <cstdint>

#include "amhex/vec3.h"
#include "exec/executor.h"
#include "graph/bin_grid.h"

namespace amhex {

// Owns the arrays behind a BinGrid and reuses them from build to build.
template <class E>
class GridBins {
 public:
  // Bins of `bin_size` over [0, extent]; points are expected there (others land in the rim).
  GridBins(E& executor, const Vec3d& extent, float bin_size) : executor_(executor) {
    grid_.bin_size = bin_size;
    grid_.count_x = CountAlong(extent.x, bin_size);
    grid_.count_y = CountAlong(extent.y, bin_size);
    grid_.count_z = CountAlong(extent.z, bin_size);
    starts_ = executor.template Alloc<int32_t>(grid_.bin_count() + 1);
  }

  // Memory for `count` points, where bodies run.
  static int64_t Bytes(const Vec3d& extent, float bin_size, int64_t count) {
    BinGrid grid;
    grid.count_x = CountAlong(extent.x, bin_size);
    grid.count_y = CountAlong(extent.y, bin_size);
    grid.count_z = CountAlong(extent.z, bin_size);
    constexpr int64_t kPairBytes = sizeof(uint32_t) + sizeof(int32_t);
    return (grid.bin_count() + 1) * static_cast<int64_t>(sizeof(int32_t)) + 2 * kPairBytes * count;
  }

  // Sorts the first `count` points into the bins. O(n log n).
  const BinGrid& Build(ArrayView<const Vec3f> position, int64_t count) {
    return Build(position, count, {});
  }

  // Sorts as many points as `actual_count`, at most `count`, says when its turn comes.
  const BinGrid& Build(ArrayView<const Vec3f> position, int64_t count,
                       ArrayView<const int64_t> actual_count) {
    if (sorted_.id.size() != count) {
      for (KeyedIds<E>* pairs : {&unsorted_, &sorted_}) {
        pairs->key = executor_.template Alloc<uint32_t>(count);
        pairs->id = executor_.template Alloc<int32_t>(count);
      }
    }
    executor_.ForEach(
        "key points by bin", count,
        BinKeyBody{grid_, position, actual_count, unsorted_.key.View(), unsorted_.id.View()});
    executor_.SortByKey(unsorted_, count, static_cast<uint32_t>(grid_.bin_count()), sorted_);
    executor_.ForEach("find bin starts", grid_.bin_count() + 1,
                      BinStartBody{ReadOnly(sorted_.key.View()), starts_.View()});
    grid_.starts = ReadOnly(starts_.View());
    grid_.ids = ReadOnly(sorted_.id.View());
    return grid_;
  }

  const BinGrid& grid() const { return grid_; }

 private:
  static int32_t CountAlong(double extent, float bin_size) {
    return static_cast<int32_t>(std::fmax(1.0, std::ceil(extent / bin_size)));
  }

  E& executor_;
  BinGrid grid_;
  KeyedIds<E> unsorted_;
  KeyedIds<E> sorted_;
  Buffer<E, int32_t> starts_;
};

}  // namespace amhex
