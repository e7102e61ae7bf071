#include <gtest/gtest.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "base/array_view_of.h"
#include "exec/cpu_executor.h"
#include "graph/grid_bins.h"
#include "graph/hop_distance.h"
#include "graph/knn_exact_body.h"
#include "graph/n6_body.h"
#include "unit/graph/random_points.h"

namespace amhex {
namespace {

// A graph of nodes of which the first `site_count` are volume sites, the rest hull samples.
struct Graph {
  std::vector<Vec3f> nodes;
  std::vector<int32_t> neighbours;
  int64_t site_count = 0;

  Graph(std::vector<Vec3f> points, int64_t sites, double extent)
      : nodes(std::move(points)), site_count(sites) {
    CpuExecutor executor;
    GridBins<CpuExecutor> bins(executor, {extent, extent, extent}, 1.0f);
    neighbours.resize(static_cast<size_t>(sites) * kNeighbourCount);
    executor.ForEach(
        "knn", sites,
        KnnExactBody{bins.Build(ArrayViewOf(nodes), static_cast<int64_t>(nodes.size())),
                     ArrayViewOf(nodes),
                     {neighbours.data(), static_cast<int64_t>(neighbours.size())}});
  }

  std::vector<int32_t> AxisNeighbours(const Quatf& orientation) const {
    const std::vector<Quatf> orientations(static_cast<size_t>(site_count), orientation);
    const std::vector<Vec3f> sizes(static_cast<size_t>(site_count), Vec3f{1, 1, 1});
    std::vector<int32_t> result(static_cast<size_t>(site_count) * kAxisDirectionCount);
    CpuExecutor().ForEach("n6", site_count,
                          AxisNeighbourBody{ArrayViewOf(nodes),
                                            ArrayViewOf(orientations),
                                            ArrayViewOf(sizes),
                                            {},
                                            ArrayViewOf(neighbours),
                                            site_count,
                                            {result.data(), static_cast<int64_t>(result.size())}});
    return result;
  }
};

Graph SitesAndSamples() {
  std::vector<Vec3f> nodes = RandomPoints(1, 300, 7);
  const std::vector<Vec3f> samples = RandomPoints(2, 300, 7);
  nodes.insert(nodes.end(), samples.begin(), samples.end());
  return {nodes, 300, 7};
}

constexpr Quatf kTilted = {0.9f, 0.3f, -0.1f, 0.3f};

TEST(AxisNeighbours, NeverContainHullSamples) {
  const Graph graph = SitesAndSamples();
  ASSERT_GT(*std::max_element(graph.neighbours.begin(), graph.neighbours.end()), 300);
  for (const int32_t neighbour : graph.AxisNeighbours(Normalized(kTilted))) {
    EXPECT_LT(neighbour, 300);
  }
}

TEST(AxisNeighbours, AreIndependentOfTheSignOfTheOrientation) {
  const Graph graph = SitesAndSamples();
  const Quatf q = Normalized(kTilted);
  EXPECT_EQ(graph.AxisNeighbours(q), graph.AxisNeighbours(-q));
}

TEST(AxisNeighbours, OfAnAlignedGridAreTheSitesAcrossItsFaces) {
  const Graph graph(GridPoints(3), 27, 3);
  const std::vector<int32_t> found = graph.AxisNeighbours(Quatf{});
  const std::vector<int32_t> of_middle(found.begin() + 13 * kAxisDirectionCount,
                                       found.begin() + 14 * kAxisDirectionCount);
  EXPECT_EQ(of_middle, (std::vector<int32_t>{12, 14, 10, 16, 4, 22}));
}

TEST(AxisNeighbours, StayOnTheirSideOfTheHullWhenSidesAreGiven) {
  const Graph graph(GridPoints(3), 27, 3);
  const std::vector<Quatf> orientations(27);
  const std::vector<Vec3f> sizes(27, Vec3f{1, 1, 1});
  std::vector<int32_t> is_inside(27, 1);
  for (size_t i = 0; i < 9; ++i) is_inside[i] = 0;  // the lowest layer
  std::vector<int32_t> found(27 * kAxisDirectionCount);
  CpuExecutor().ForEach("n6", 27,
                        AxisNeighbourBody{ArrayViewOf(graph.nodes),
                                          ArrayViewOf(orientations),
                                          ArrayViewOf(sizes),
                                          ArrayViewOf(is_inside),
                                          ArrayViewOf(graph.neighbours),
                                          27,
                                          {found.data(), 27 * kAxisDirectionCount}});
  for (size_t slot = 0; slot < found.size(); ++slot) {
    if (found[slot] == kNoNode) continue;
    EXPECT_EQ(is_inside[static_cast<size_t>(found[slot])], is_inside[slot / kAxisDirectionCount]);
  }
}

TEST(Claims, SumToAllChosenNeighbours) {
  const Graph graph = SitesAndSamples();
  const std::vector<int32_t> chosen = graph.AxisNeighbours(Quatf{});
  std::vector<int32_t> claims(300, 0);
  CpuExecutor().ForEach("claims", static_cast<int64_t>(chosen.size()) / kAxisDirectionCount,
                        CountClaimsBody{ArrayViewOf(chosen), {claims.data(), 300}});
  for (int32_t site = 0; site < 300; ++site) {
    EXPECT_EQ(claims[static_cast<size_t>(site)], std::count(chosen.begin(), chosen.end(), site));
  }
}

TEST(HopDistance, IsTheShortestPathToASample) {
  // Samples under the floor of a 7^3 grid.
  std::vector<Vec3f> nodes = GridPoints(7);
  for (int i = 0; i < 49; ++i) nodes.push_back(ToFloat(Vec3d{i % 7 + 0.5, i / 7 + 0.5, 0.01}));
  const Graph graph(nodes, 343, 7);
  std::vector<int32_t> expected(nodes.size(), kUnreached);
  std::fill(expected.begin() + 343, expected.end(), 0);
  for (int32_t length = 1; length < 20; ++length) {
    for (size_t slot = 0; slot < graph.neighbours.size(); ++slot) {
      int32_t& hops = expected[slot / kNeighbourCount];
      const auto neighbour = static_cast<size_t>(graph.neighbours[slot]);
      if (hops == kUnreached && expected[neighbour] == length - 1) hops = length;
    }
  }
  CpuExecutor executor;
  const HostBuffer<int32_t> hops = ComputeHopDistance(executor, ArrayViewOf(graph.neighbours), 343,
                                                      static_cast<int64_t>(nodes.size()));
  for (size_t node = 0; node < nodes.size(); ++node) {
    EXPECT_EQ(hops.View()[static_cast<int64_t>(node)], expected[node]) << node;
  }
  EXPECT_GT(hops.View()[(6 * 7 + 3) * 7 + 3], hops.View()[(1 * 7 + 3) * 7 + 3]);
}

TEST(HopDistance, IsUnreachedWithoutSamples) {
  const Graph graph(GridPoints(3), 27, 3);
  CpuExecutor executor;
  const HostBuffer<int32_t> hops =
      ComputeHopDistance(executor, ArrayViewOf(graph.neighbours), 27, 27);
  for (int64_t node = 0; node < 27; ++node) EXPECT_EQ(hops.View()[node], kUnreached);
}

}  // namespace
}  // namespace amhex
