// Who is next to whom in a level of the background grid, from its cells alone: where bodies run.
// The host finds the same from the level above (grid_pyramid.cpp).
#pragma once

#include <array>
#include <cstdint>

#include "base/array_view.h"
#include "fields/grid_keys.h"
#include "fields/grid_neighbours.h"

namespace amhex::fields {

// The node of a cell among sorted Morton codes; -1 if the cell is none of them.
AMHEX_HD inline int32_t NodeOfCell(ArrayView<const uint64_t> keys,
                                   const std::array<int32_t, 3>& cell) {
  const uint64_t key = KeyOfCell(cell);
  int64_t begin = 0, end = keys.size;
  while (begin < end) {
    const int64_t middle = begin + (end - begin) / 2;
    if (keys[middle] < key) {
      begin = middle + 1;
    } else {
      end = middle;
    }
  }
  return begin < keys.size && keys[begin] == key ? static_cast<int32_t>(begin) : -1;
}

AMHEX_HD inline int32_t NeighbourOfNode(ArrayView<const uint64_t> keys, int64_t node, int k) {
  std::array<int32_t, 3> cell = CellOfKey(keys[node]);
  for (int axis = 0; axis < 3; ++axis) cell[axis] += NeighbourOffset(k, axis);
  return NodeOfCell(keys, cell);
}

struct FindNeighboursBody {
  ArrayView<const uint64_t> keys;
  ArrayView<int32_t> neighbours;  // [node][18]
  AMHEX_HD void operator()(int64_t node) const {
    for (int k = 0; k < kNeighbourCount; ++k) {
      neighbours[node * kNeighbourCount + k] = NeighbourOfNode(keys, node, k);
    }
  }
};

// Along +x +y +z -x -y -z only.
struct FindAxisNeighboursBody {
  ArrayView<const uint64_t> keys;
  ArrayView<int32_t> neighbours;  // [node][6]
  AMHEX_HD void operator()(int64_t node) const {
    for (int d = 0; d < 3; ++d) {
      neighbours[6 * node + d] = NeighbourOfNode(keys, node, d);
      neighbours[6 * node + 3 + d] = NeighbourOfNode(keys, node, Opposite(d));
    }
  }
};

}  // namespace amhex::fields
