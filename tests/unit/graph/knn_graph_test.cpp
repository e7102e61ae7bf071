#include "graph/knn_graph.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "base/array_view_of.h"
#include "exec/cpu_executor.h"
#include "graph/grid_bins.h"
#include "graph/knn_exact_body.h"
#include "graph/knn_update_body.h"
#include "unit/graph/random_points.h"

namespace amhex {
namespace {

std::vector<int32_t> ExactGraph(const std::vector<Vec3f>& points, double extent) {
  CpuExecutor executor;
  GridBins<CpuExecutor> bins(executor, {extent, extent, extent}, 1.0f);
  const auto count = static_cast<int64_t>(points.size());
  std::vector<int32_t> graph(points.size() * kNeighbourCount);
  executor.ForEach("knn", count,
                   KnnExactBody{bins.Build(ArrayViewOf(points), count),
                                ArrayViewOf(points),
                                {graph.data(), static_cast<int64_t>(graph.size())}});
  return graph;
}

std::vector<int32_t> BruteForceGraph(const std::vector<Vec3f>& points) {
  std::vector<int32_t> graph;
  for (size_t i = 0; i < points.size(); ++i) {
    std::vector<std::pair<float, int32_t>> all;
    for (size_t j = 0; j < points.size(); ++j) {
      if (j != i) all.push_back({SquaredDistance(points[j], points[i]), static_cast<int32_t>(j)});
    }
    std::sort(all.begin(), all.end());
    for (size_t k = 0; k < kNeighbourCount; ++k) {
      graph.push_back(k < all.size() ? all[k].second : kNoNode);
    }
  }
  return graph;
}

TEST(KnnGraph, SmallGraphsListEveryOtherNodeAndFillUp) {
  EXPECT_EQ(ExactGraph({{0.5f, 0.5f, 0.5f}}, 1), std::vector<int32_t>(kNeighbourCount, kNoNode));
  const std::vector<Vec3f> three = {{0.1f, 0, 0}, {3.9f, 0, 0}, {2.5f, 0, 0}};
  EXPECT_EQ(ExactGraph(three, 4), BruteForceGraph(three));
}

TEST(KnnGraph, EqualsBruteForceOnRandomSites) {
  const std::vector<Vec3f> even = RandomPoints(1, 1500, 11);
  EXPECT_EQ(ExactGraph(even, 11), BruteForceGraph(even));
  // Far apart, crowded, and partly beyond the bins.
  const std::vector<Vec3f> sparse = RandomPoints(2, 60, 20);
  EXPECT_EQ(ExactGraph(sparse, 20), BruteForceGraph(sparse));
  const std::vector<Vec3f> crowded = RandomPoints(3, 400, 1.5);
  EXPECT_EQ(ExactGraph(crowded, 1), BruteForceGraph(crowded));
}

TEST(KnnGraph, RegularGridGivesThe26SurroundingSites) {
  const std::vector<Vec3f> grid = GridPoints(5);
  const std::vector<int32_t> graph = ExactGraph(grid, 5);
  constexpr int kMiddle = (2 * 5 + 2) * 5 + 2;
  std::vector<int32_t> expected;
  for (int dz = -1; dz <= 1; ++dz) {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        if (dx != 0 || dy != 0 || dz != 0) expected.push_back(kMiddle + (dz * 5 + dy) * 5 + dx);
      }
    }
  }
  std::vector<int32_t> found(graph.begin() + kMiddle * kNeighbourCount,
                             graph.begin() + (kMiddle + 1) * kNeighbourCount);
  std::sort(found.begin(), found.end());
  EXPECT_EQ(found, expected);
}

TEST(KnnGraph, SevenUpdatesFromRandomLinksFindAlmostAllNeighbours) {
  const std::vector<Vec3f> points = RandomPoints(4, 2000, 12.6);
  const auto count = static_cast<int64_t>(points.size());
  std::vector<int32_t> before(points.size() * kNeighbourCount), after(before.size());
  const auto view = [](std::vector<int32_t>& v) {
    return ArrayView<int32_t>{v.data(), static_cast<int64_t>(v.size())};
  };
  CpuExecutor executor;
  executor.ForEach("start", count, KnnRandomBody{1, count, ArrayViewOf(points), view(before)});
  for (int update = 0; update < kKnnUpdatesFromRandom; ++update) {
    executor.ForEach("update", count,
                     KnnUpdateBody{ArrayViewOf(points), ReadOnly(view(before)), view(after)});
    before.swap(after);
  }
  const std::vector<int32_t> exact = ExactGraph(points, 12.6);
  int64_t found = 0;
  for (size_t i = 0; i < points.size(); ++i) {
    const auto row = exact.begin() + static_cast<int64_t>(i) * kNeighbourCount;
    const auto end = row + kNeighbourCount;
    for (int k = 0; k < kNeighbourCount; ++k) {
      found += std::find(row, end, before[i * kNeighbourCount + static_cast<size_t>(k)]) != end;
    }
  }
  EXPECT_GT(static_cast<double>(found) / static_cast<double>(exact.size()), 0.98);
}

TEST(KnnGraph, AnUpdateLeavesThePerfectGraphAsItIs) {
  const std::vector<Vec3f> points = RandomPoints(5, 500, 8);
  const std::vector<int32_t> exact = ExactGraph(points, 8);
  std::vector<int32_t> after(exact.size());
  CpuExecutor executor;
  executor.ForEach("update", 500,
                   KnnUpdateBody{ArrayViewOf(points),
                                 {exact.data(), static_cast<int64_t>(exact.size())},
                                 {after.data(), static_cast<int64_t>(after.size())}});
  EXPECT_EQ(after, exact);
}

}  // namespace
}  // namespace amhex
