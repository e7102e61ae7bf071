// Edge networks built where bodies run: both directions of every edge are sorted, and each kept
// once.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <utility>

#include "exec/executor.h"
#include "topology/edge_network_view.h"

namespace amhex {

// The edges of several lists, each twice: 2 * edge from its first vertex to its second, and back.
struct DirectedEdges {
  static constexpr int kListCount = 3;
  std::array<ArrayView<const VertexPair>, kListCount> lists;

  AMHEX_HD int64_t count() const {
    int64_t sum = 0;
    for (int list = 0; list < kListCount; ++list) sum += lists[list].size;
    return 2 * sum;
  }
  AMHEX_HD int32_t From(int64_t directed) const { return VertexOf(directed / 2, directed % 2); }
  AMHEX_HD int32_t To(int64_t directed) const { return VertexOf(directed / 2, 1 - directed % 2); }

 private:
  AMHEX_HD int32_t VertexOf(int64_t edge, int64_t end) const {
    int list = 0;
    for (; list + 1 < kListCount && edge >= lists[list].size; ++list) edge -= lists[list].size;
    return lists[list][edge][static_cast<size_t>(end)];
  }
};

struct KeyByTargetBody {
  DirectedEdges edges;
  ArrayView<uint32_t> key;
  ArrayView<int32_t> id;
  AMHEX_HD void operator()(int64_t i) const {
    key[i] = static_cast<uint32_t>(edges.To(i));
    id[i] = static_cast<int32_t>(i);
  }
};

struct KeyBySourceBody {
  DirectedEdges edges;
  ArrayView<const int32_t> by_target;
  ArrayView<uint32_t> key;
  ArrayView<int32_t> id;
  AMHEX_HD void operator()(int64_t i) const {
    key[i] = static_cast<uint32_t>(edges.From(by_target[i]));
    id[i] = by_target[i];
  }
};

// One element per directed edge and one more, which gets zero.
struct MarkFirstBody {
  DirectedEdges edges;
  ArrayView<const int32_t> sorted;
  ArrayView<int32_t> is_first;  // 1: of equal ones
  AMHEX_HD void operator()(int64_t i) const {
    const bool is_equal = i > 0 && i < sorted.size &&
                          edges.From(sorted[i]) == edges.From(sorted[i - 1]) &&
                          edges.To(sorted[i]) == edges.To(sorted[i - 1]);
    is_first[i] = i == sorted.size || is_equal ? 0 : 1;
  }
};

struct KeepFirstBody {
  DirectedEdges edges;
  ArrayView<const int32_t> sorted;
  ArrayView<const int32_t> place;  // of the first of equal ones; the number of places at the end
  ArrayView<int32_t> source, target;
  AMHEX_HD void operator()(int64_t i) const {
    if (place[i] == place[i + 1]) return;
    source[place[i]] = edges.From(sorted[i]);
    target[place[i]] = edges.To(sorted[i]);
  }
};

// One element per vertex and one more.
struct FindRowBody {
  ArrayView<const int32_t> source;  // ascending; of those that are kept
  ArrayView<const int32_t> place;
  ArrayView<int32_t> first;
  AMHEX_HD void operator()(int64_t vertex) const {
    int32_t begin = 0, end = place[place.size - 1];
    while (begin < end) {
      const int32_t middle = begin + (end - begin) / 2;
      if (source[middle] < vertex) {
        begin = middle + 1;
      } else {
        end = middle;
      }
    }
    first[vertex] = begin;
  }
};

template <class E>
struct BuiltNetwork {
  Buffer<E, int32_t> first, neighbours;  // the latter with room for repeated edges
  EdgeNetworkView View() const { return {first.View(), neighbours.View()}; }
};

// Memory that a network of so many directed edges takes while it is built, but for the scans.
template <class E>
int64_t NetworkBytes(int64_t vertex_count, int64_t directed_count) {
  // Pairs to sort and sorted ones; then the sorted ids, places, sources and targets.
  constexpr int64_t kPerEdge = 2 * (sizeof(uint32_t) + sizeof(int32_t));
  return kPerEdge * directed_count + E::SortBytes(directed_count) +
         (vertex_count + 1) * static_cast<int64_t>(sizeof(int32_t));
}

template <class E>
KeyedIds<E> NewPairs(E& executor, int64_t count) {
  return {executor.template Alloc<uint32_t>(count), executor.template Alloc<int32_t>(count)};
}

// The ids of all directed edges, by source, equal ones by target.
template <class E>
Buffer<E, int32_t> SortDirected(E& executor, int32_t vertex_count, const DirectedEdges& edges) {
  const int64_t count = edges.count();
  const uint32_t largest = static_cast<uint32_t>(Larger(vertex_count - 1, 0));
  KeyedIds<E> pairs = NewPairs(executor, count), sorted = NewPairs(executor, count);
  executor.ForEach("key edges by their targets", count,
                   KeyByTargetBody{edges, pairs.key.View(), pairs.id.View()});
  executor.SortByKey(pairs, count, largest, sorted);
  executor.ForEach(
      "key edges by their sources", count,
      KeyBySourceBody{edges, ReadOnly(sorted.id.View()), pairs.key.View(), pairs.id.View()});
  executor.SortByKey(pairs, count, largest, sorted);
  return std::move(sorted.id);
}

// The same rows as EdgeNetwork::Build's. Throws std::length_error if there are too many edges.
template <class E>
BuiltNetwork<E> BuildNetwork(E& executor, int32_t vertex_count, const DirectedEdges& edges) {
  const int64_t count = edges.count();
  if (count >= std::numeric_limits<int32_t>::max()) {
    throw std::length_error("an edge network has more edges than 32 bits can number");
  }
  const Buffer<E, int32_t> sorted = SortDirected(executor, vertex_count, edges);
  Buffer<E, int32_t> place = executor.template Alloc<int32_t>(count + 1);
  executor.ForEach("mark different edges", count + 1,
                   MarkFirstBody{edges, sorted.View(), place.View()});
  executor.ExclusiveScan(place, count + 1);
  Buffer<E, int32_t> source = executor.template Alloc<int32_t>(count);
  BuiltNetwork<E> network{executor.template Alloc<int32_t>(vertex_count + int64_t{1}),
                          executor.template Alloc<int32_t>(count)};
  executor.ForEach("keep different edges", count,
                   KeepFirstBody{edges, sorted.View(), ReadOnly(place.View()), source.View(),
                                 network.neighbours.View()});
  executor.ForEach(
      "find the rows of neighbours", vertex_count + int64_t{1},
      FindRowBody{ReadOnly(source.View()), ReadOnly(place.View()), network.first.View()});
  return network;
}

}  // namespace amhex
