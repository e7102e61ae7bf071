// The nodes of a grid numbered anew, those of even cells first: where the sum of a cell's
// coordinates is even. Every edge of the grid leads from an even node to an odd one, so what a
// matrix says of the odd ones follows from the even ones alone (linear_operators.h).
#pragma once

#include <array>
#include <cstdint>

#include "base/array_view.h"
#include "fields/grid_keys.h"
#include "fields/linear_operators.h"

namespace amhex::fields {

struct NodeOrder {
  ArrayView<const int32_t> node_of;    // [number]
  ArrayView<const int32_t> number_of;  // [node]
  int64_t even_count = 0;
};

AMHEX_HD inline bool IsOfEvenCell(uint64_t key) {
  const std::array<int32_t, 3> cell = CellOfKey(key);
  return ((cell[0] ^ cell[1] ^ cell[2]) & 1) == 0;
}

// Links between nodes as links between their numbers; one element per number.
struct RenumberLinksBody {
  NodeLinks links;  // between nodes
  NodeOrder order;
  ArrayView<int32_t> neighbours;  // as NodeLinks', between numbers
  ArrayView<uint8_t> codes;       // likewise
  AMHEX_HD void operator()(int64_t number) const {
    const int64_t node = order.node_of[number];
    for (int k = 0; k < 6; ++k) {
      const int32_t other = links.neighbours[6 * node + k];
      neighbours[6 * number + k] = other < 0 ? -1 : order.number_of[other];
    }
    for (int d = 0; d < 3; ++d) codes[3 * number + d] = links.codes[3 * node + d];
  }
};

// Six numbers per node, from their places in the order to those of the nodes; one element per
// number.
struct OfNodesBody {
  NodeOrder order;
  ArrayView<const float> by_number;
  ArrayView<float> by_node;
  AMHEX_HD void operator()(int64_t number) const {
    const int64_t node = order.node_of[number];
    for (int u = 0; u < 6; ++u) by_node[6 * node + u] = by_number[6 * number + u];
  }
};

}  // namespace amhex::fields
