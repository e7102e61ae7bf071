#include "topology/edge_network.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "unit/topology/cube_grid.h"

namespace amhex {
namespace {

TEST(EdgeNetwork, OfNoEdgesIsEmpty) {
  const EdgeNetwork network = EdgeNetwork::Build(3, {});
  EXPECT_EQ(network.edge_count(), 0);
  EXPECT_TRUE(network.view().NeighboursOf(1).empty());
  EXPECT_FALSE(network.view().AreConnected(0, 2));
}

TEST(EdgeNetwork, KeepsEveryEdgeOnceWhateverItsDirection) {
  const EdgeNetwork network = EdgeNetwork::Build(4, {{2, 1}, {1, 2}, {3, 0}, {1, 2}});
  ASSERT_EQ(network.edge_count(), 2);
  EXPECT_EQ(network.edge(0), (VertexPair{0, 3}));
  EXPECT_EQ(network.edge(1), (VertexPair{1, 2}));
  EXPECT_EQ(network.FindEdge(2, 1), 1);
  EXPECT_EQ(network.FindEdge(1, 2), 1);
  EXPECT_EQ(network.FindEdge(0, 1), kNoEdge);
}

TEST(EdgeNetwork, NeighboursAreAscendingAndMutual) {
  const MergedCubes grid = testing::MakeCubeGrid(3, 3, 3);
  const auto vertex_count = static_cast<int32_t>(grid.vertices.size());
  const EdgeNetwork network = EdgeNetwork::Build(vertex_count, CollectCubeEdges(grid, {}));
  EXPECT_EQ(network.edge_count(), 3 * 3 * 4 * 4);
  for (int32_t v = 0; v < vertex_count; ++v) {
    const auto around = network.view().NeighboursOf(v);
    EXPECT_TRUE(std::is_sorted(around.data, around.data + around.size));
    for (int64_t i = 0; i < around.size; ++i) {
      EXPECT_TRUE(network.view().AreConnected(around[i], v));
    }
  }
}

TEST(EdgeNetwork, CollapsedCubeEdgesAreNoEdges) {
  MergedCubes prism;
  prism.vertices.resize(6);
  prism.corners = {{0, 1, 1, 2, 3, 4, 4, 5}};
  EXPECT_EQ(EdgeNetwork::Build(6, CollectCubeEdges(prism, {})).edge_count(), 9);
}

TEST(EdgeNetwork, ARegionKeepsTheEdgesBetweenItsVertices) {
  const MergedCubes cube = testing::MakeCubeGrid(1, 1, 1);
  const std::vector<uint8_t> bottom = {1, 1, 1, 1, 0, 0, 0, 0};
  EXPECT_EQ(EdgeNetwork::Build(8, CollectCubeEdges(cube, bottom)).edge_count(), 4);
}

TEST(EdgeNetwork, CommonNeighboursOfOppositeCornersAreTheOtherTwo) {
  const EdgeNetwork ring = EdgeNetwork::Build(4, {{0, 1}, {1, 2}, {2, 3}, {3, 0}});
  std::vector<int32_t> common;
  ring.view().ForEachCommonNeighbour(0, 2, [&](int32_t vertex) { common.push_back(vertex); });
  EXPECT_EQ(common, (std::vector<int32_t>{1, 3}));
}

}  // namespace
}  // namespace amhex
