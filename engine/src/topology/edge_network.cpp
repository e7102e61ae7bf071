#include "topology/edge_network.h"

#include <tbb/parallel_sort.h>

#include <algorithm>

#include "topology/primitives.h"

namespace amhex {

EdgeNetwork EdgeNetwork::Build(int32_t vertex_count, const std::vector<VertexPair>& edges) {
  EdgeNetwork network;
  network.edges_ = edges;
  for (VertexPair& edge : network.edges_) {
    if (edge[0] > edge[1]) std::swap(edge[0], edge[1]);
  }
  tbb::parallel_sort(network.edges_.begin(), network.edges_.end());
  network.edges_.erase(std::unique(network.edges_.begin(), network.edges_.end()),
                       network.edges_.end());
  network.first_.assign(static_cast<size_t>(vertex_count) + 1, 0);
  for (const VertexPair& edge : network.edges_) {
    ++network.first_[edge[0] + 1];
    ++network.first_[edge[1] + 1];
  }
  for (int32_t v = 0; v < vertex_count; ++v) network.first_[v + 1] += network.first_[v];
  network.neighbours_.resize(2 * network.edges_.size());
  network.incident_edge_.resize(2 * network.edges_.size());
  std::vector<int32_t> next(network.first_.begin(), network.first_.end() - 1);
  const auto append = [&](int32_t vertex, int32_t neighbour, int32_t edge) {
    network.neighbours_[next[vertex]] = neighbour;
    network.incident_edge_[next[vertex]++] = edge;
  };
  // A row lists its smaller neighbours first, and both passes visit the edges in ascending order.
  for (int32_t e = 0; e < network.edge_count(); ++e) {
    append(network.edges_[e][1], network.edges_[e][0], e);
  }
  for (int32_t e = 0; e < network.edge_count(); ++e) {
    append(network.edges_[e][0], network.edges_[e][1], e);
  }
  return network;
}

int32_t EdgeNetwork::FindEdge(int32_t a, int32_t b) const {
  const int32_t place = view().PlaceOf(a, b);
  if (place == first_[a + 1] || neighbours_[place] != b) return kNoEdge;
  return incident_edge_[place];
}

std::vector<VertexPair> CollectCubeEdges(const MergedCubes& cubes,
                                         const std::vector<uint8_t>& region) {
  std::vector<VertexPair> edges;
  for (const CellCorners& corners : cubes.corners) {
    for (const auto& [i, j] : kCubeEdges) {
      const int32_t a = corners[i], b = corners[j];
      if (a == b) continue;
      if (!region.empty() && (region[a] == 0 || region[b] == 0)) continue;
      edges.push_back({a, b});
    }
  }
  return edges;
}

}  // namespace amhex
