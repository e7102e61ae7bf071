// The rows of point_rows.h built where bodies run, in the same order as point_index.h's.
#pragma once

#include <cstdint>
#include <limits>
#include <stdexcept>
#include <utility>

#include "base/ordered_bits.h"
#include "exec/executor.h"
#include "fields/point_rows.h"

namespace amhex::fields {

// Numbers x by 32 of their ordered bits.
struct KeyByXBody {
  ArrayView<const Vec3d> points;
  ArrayView<const int32_t> order;  // empty: as they come
  int shift = 0;
  ArrayView<uint32_t> key;
  ArrayView<int32_t> id;
  AMHEX_HD void operator()(int64_t i) const {
    id[i] = order.empty() ? static_cast<int32_t>(i) : order[i];
    key[i] = static_cast<uint32_t>(OrderedBits(points[id[i]].x) >> shift);
  }
};
struct KeyByRowBody {
  RowShape shape;
  ArrayView<const Vec3d> points;
  ArrayView<const int32_t> order;
  ArrayView<uint32_t> key;
  ArrayView<int32_t> id;
  AMHEX_HD void operator()(int64_t i) const {
    id[i] = order[i];
    key[i] = static_cast<uint32_t>(shape.RowOf(points[id[i]]));
  }
};
struct PutItemBody {
  ArrayView<const Vec3d> points;
  ArrayView<const int32_t> order;
  ArrayView<RowItem> items;
  AMHEX_HD void operator()(int64_t i) const { items[i] = {points[order[i]].x, order[i]}; }
};
// One element per row and one more.
struct FindRowStartBody {
  ArrayView<const uint32_t> key;  // ascending
  ArrayView<int32_t> row_start;
  AMHEX_HD void operator()(int64_t row) const {
    int64_t begin = 0, end = key.size;
    while (begin < end) {
      const int64_t middle = (begin + end) / 2;
      if (key[middle] < row) {
        begin = middle + 1;
      } else {
        end = middle;
      }
    }
    row_start[row] = static_cast<int32_t>(begin);
  }
};

template <class E>
struct BuiltRows {
  RowShape shape;
  Buffer<E, int32_t> row_start;
  Buffer<E, RowItem> items;
  PointRowsView View() { return {shape, ReadOnly(row_start.View()), ReadOnly(items.View())}; }
};

// Memory of the rows, and what building them takes besides.
inline int64_t RowsBytes(int64_t point_count, const RowShape& shape) {
  return point_count * static_cast<int64_t>(sizeof(RowItem)) +
         (shape.rows + 1) * static_cast<int64_t>(sizeof(int32_t));
}
inline int64_t RowsScratchBytes(int64_t point_count) {
  return 2 * point_count * static_cast<int64_t>(sizeof(uint32_t) + sizeof(int32_t));
}

// Throws std::length_error if there are more rows than 32 bits can number.
template <class E>
BuiltRows<E> BuildRows(E& executor, const RowShape& shape, ArrayView<const Vec3d> points) {
  constexpr uint32_t kAnyKey = std::numeric_limits<uint32_t>::max();
  constexpr int kKeyBits = 32;
  if (shape.rows > int64_t{kAnyKey}) throw std::length_error("there are too many rows of points");
  const int64_t count = points.size;
  const auto new_pairs = [&] {
    return KeyedIds<E>{executor.template Alloc<uint32_t>(count),
                       executor.template Alloc<int32_t>(count)};
  };
  BuiltRows<E> built{shape, executor.template Alloc<int32_t>(shape.rows + 1),
                     executor.template Alloc<RowItem>(count)};
  KeyedIds<E> pairs = new_pairs(), sorted = new_pairs();
  executor.ForEach("key points by x", count,
                   KeyByXBody{points, {}, 0, pairs.key.View(), pairs.id.View()});
  executor.SortByKey(pairs, count, kAnyKey, sorted);
  executor.ForEach(
      "key points by x", count,
      KeyByXBody{points, ReadOnly(sorted.id.View()), kKeyBits, pairs.key.View(), pairs.id.View()});
  executor.SortByKey(pairs, count, kAnyKey, sorted);
  executor.ForEach(
      "key points by row", count,
      KeyByRowBody{shape, points, ReadOnly(sorted.id.View()), pairs.key.View(), pairs.id.View()});
  executor.SortByKey(pairs, count, static_cast<uint32_t>(shape.rows - 1), sorted);
  executor.ForEach("put points into rows", count,
                   PutItemBody{points, ReadOnly(sorted.id.View()), built.items.View()});
  executor.ForEach("find the rows' starts", shape.rows + 1,
                   FindRowStartBody{ReadOnly(sorted.key.View()), built.row_start.View()});
  return built;
}

}  // namespace amhex::fields
