// The edges between real vertices and who is adjacent to whom. Section 5.2.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "geometry/merged_cubes.h"
#include "topology/edge_network_view.h"

namespace amhex {

inline constexpr int32_t kNoEdge = -1;

// Immutable. Edges are numbered in ascending order of their vertex pairs.
class EdgeNetwork {
 public:
  EdgeNetwork() = default;

  // `edges` in any order and direction, repeated or not, without loops; ids in [0, vertex_count).
  static EdgeNetwork Build(int32_t vertex_count, const std::vector<VertexPair>& edges);

  int32_t vertex_count() const { return static_cast<int32_t>(first_.size()) - 1; }
  int32_t edge_count() const { return static_cast<int32_t>(edges_.size()); }
  const VertexPair& edge(int32_t index) const { return edges_[index]; }
  const std::vector<VertexPair>& edges() const { return edges_; }

  // For as long as this.
  EdgeNetworkView view() const {
    return {{first_.data(), static_cast<int64_t>(first_.size())},
            {neighbours_.data(), static_cast<int64_t>(neighbours_.size())}};
  }

  // The edge between two vertices in either order, or kNoEdge. Logarithmic in the degree.
  int32_t FindEdge(int32_t a, int32_t b) const;

 private:
  std::vector<VertexPair> edges_;
  std::vector<int32_t> first_;          // [vertex_count + 1] rows of the two below
  std::vector<int32_t> neighbours_;     // [2 * edge_count]
  std::vector<int32_t> incident_edge_;  // [2 * edge_count] the edge towards that neighbour
};

// The edges of all cubes that have not collapsed; only those between two vertices of
// `region` ([vertex_count] flags) unless it is empty.
std::vector<VertexPair> CollectCubeEdges(const MergedCubes& cubes,
                                         const std::vector<uint8_t>& region);

}  // namespace amhex
