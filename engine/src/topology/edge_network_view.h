// The neighbours of vertices (edge_network.h) as plain arrays; usable where bodies run.
#pragma once

#include <array>
#include <cstdint>

#include "amhex/vec3.h"
#include "base/array_view.h"

namespace amhex {

// An undirected edge, smaller vertex first.
using VertexPair = std::array<int32_t, 2>;

// Views do not own: the arrays must outlive them.
struct EdgeNetworkView {
  ArrayView<const int32_t> first;       // [vertex_count + 1] rows of the neighbours
  ArrayView<const int32_t> neighbours;  // ascending in every row

  AMHEX_HD int32_t vertex_count() const { return static_cast<int32_t>(first.size) - 1; }
  AMHEX_HD ArrayView<const int32_t> NeighboursOf(int32_t vertex) const {
    return {neighbours.data + first[vertex], first[vertex + 1] - first[vertex]};
  }

  // Where `b` is among the neighbours of `a`, or where it would be.
  AMHEX_HD int32_t PlaceOf(int32_t a, int32_t b) const {
    int32_t place = first[a], end = first[a + 1];
    while (place < end) {
      const int32_t middle = place + (end - place) / 2;
      if (neighbours[middle] < b) {
        place = middle + 1;
      } else {
        end = middle;
      }
    }
    return place;
  }
  // In either order. Logarithmic in the degree.
  AMHEX_HD bool AreConnected(int32_t a, int32_t b) const {
    const int32_t place = PlaceOf(a, b);
    return place < first[a + 1] && neighbours[place] == b;
  }

  // Calls visit(vertex, later) for the neighbours of `a` that are larger, ascending; `later` are
  // those that follow.
  template <class Visit>
  AMHEX_HD void ForEachLargerNeighbour(int32_t a, const Visit& visit) const {
    const int32_t end = first[a + 1];
    for (int32_t i = PlaceOf(a, a); i < end; ++i) {
      const int64_t later_count = end - i - 1;
      visit(neighbours[i], ArrayView<const int32_t>{neighbours.data + i + 1, later_count});
    }
  }

  // Calls visit(vertex) for the neighbours of both, ascending.
  template <class Visit>
  AMHEX_HD void ForEachCommonNeighbour(int32_t a, int32_t b, const Visit& visit) const {
    int32_t of_a = first[a], of_b = first[b];
    while (of_a < first[a + 1] && of_b < first[b + 1]) {
      const int32_t next_of_a = neighbours[of_a], next_of_b = neighbours[of_b];
      if (next_of_a == next_of_b) visit(next_of_a);
      of_a += next_of_a <= next_of_b ? 1 : 0;
      of_b += next_of_b <= next_of_a ? 1 : 0;
    }
  }
};

}  // namespace amhex
