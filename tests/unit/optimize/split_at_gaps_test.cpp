// Laws of putting vertices into the boundary: what no vertex could reach is reached, cells stay
// good, and where nothing is far away nothing changes.
#include "optimize/split_at_gaps.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "optimize/hull_deviation.h"
#include "optimize/raise_quality.h"
#include "output/validate.h"
#include "support/grid_complex.h"
#include "support/grid_hull.h"
#include "support/hull_of_mesh.h"
#include "support/largest_distance.h"

namespace amhex {
namespace {

using testing_support::GridComplex;
using testing_support::GridHull;
using testing_support::GridSize;
using testing_support::LargestDistance;

constexpr GridSize kSplitSize = {7, 7, 4};

// A box of unit cubes with a point above, or below, the middle of some faces of its top.
struct Studs {
  std::vector<std::array<int, 2>> at;  // the faces' least corners
  double height = 0;
  double height_of_first = height;
};

Hull HullWith(const Studs& studs) {
  TriangleMesh mesh;
  const int nx = kSplitSize.nx, ny = kSplitSize.ny;
  const auto id = [&](int x, int y, int layer) { return (layer * (ny + 1) + y) * (nx + 1) + x; };
  for (const int z : {0, kSplitSize.nz}) {
    for (int y = 0; y <= ny; ++y) {
      for (int x = 0; x <= nx; ++x) mesh.vertices.push_back({double(x), double(y), double(z)});
    }
  }
  const auto add_quad = [&](int32_t a, int32_t b, int32_t c, int32_t d) {
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({a, c, d});
  };
  for (int y = 0; y < ny; ++y) {
    for (int x = 0; x < nx; ++x) {
      add_quad(id(x, y, 0), id(x, y + 1, 0), id(x + 1, y + 1, 0), id(x + 1, y, 0));
      const int32_t loop[] = {id(x, y, 1), id(x + 1, y, 1), id(x + 1, y + 1, 1), id(x, y + 1, 1)};
      if (std::find(studs.at.begin(), studs.at.end(), std::array{x, y}) == studs.at.end()) {
        add_quad(loop[0], loop[1], loop[2], loop[3]);
        continue;
      }
      const auto tip = static_cast<int32_t>(mesh.vertices.size());
      const bool is_first = studs.at.front() == std::array{x, y};
      const double height = is_first ? studs.height_of_first : studs.height;
      mesh.vertices.push_back({x + 0.5, y + 0.5, kSplitSize.nz + height});
      for (int j = 0; j < 4; ++j) mesh.triangles.push_back({loop[j], loop[(j + 1) % 4], tip});
    }
  }
  for (int x = 0; x < nx; ++x) {
    add_quad(id(x, 0, 0), id(x + 1, 0, 0), id(x + 1, 0, 1), id(x, 0, 1));
    add_quad(id(x, ny, 0), id(x, ny, 1), id(x + 1, ny, 1), id(x + 1, ny, 0));
  }
  for (int y = 0; y < ny; ++y) {
    add_quad(id(0, y, 0), id(0, y, 1), id(0, y + 1, 1), id(0, y + 1, 0));
    add_quad(id(nx, y, 0), id(nx, y + 1, 0), id(nx, y + 1, 1), id(nx, y, 1));
  }
  return testing_support::HullOfMesh(mesh);
}

CellComplex Split(const CellComplex& complex, const Hull& hull) {
  const RunContext run;
  auto split = SplitAtGaps(complex, hull, HullFeatures(hull), run);
  EXPECT_TRUE(split.ok()) << split.status().ToString();
  return *split;
}

TEST(SplitAtGaps, OfNothingIsNothing) {
  EXPECT_TRUE(Split(CellComplex{}, HullWith({})).cells.empty());
}

TEST(SplitAtGaps, LeavesABoundaryOnTheHullAsItIs) {
  const CellComplex complex = GridComplex(kSplitSize);
  const CellComplex split = Split(complex, GridHull(kSplitSize, 0.5));
  EXPECT_EQ(split.vertices, complex.vertices);
  EXPECT_EQ(split.cells, complex.cells);
}

TEST(SplitAtGaps, ReachesTipsAndPitsThatLieAmidFaces) {
  for (const double height : {0.5, -0.4}) {
    const Hull hull = HullWith({{{3, 3}, {1, 5}}, height});
    const CellComplex complex = GridComplex(kSplitSize);
    const double limit = LimitsFor(hull).limit;
    ASSERT_GT(LargestDistance(complex, hull), limit);
    const CellComplex split = Split(complex, hull);
    EXPECT_LE(LargestDistance(split, hull), limit) << height;
    EXPECT_EQ(split.vertices.size(), complex.vertices.size() + 2) << height;
    EXPECT_LE(split.cells.size(), complex.cells.size() + 16) << height;
    EXPECT_GE(SummarizeQuality(split).minimum, 0.31) << height;
    const ValidationReport report = ValidateMesh(testing_support::MeshOf(split));
    EXPECT_TRUE(report.valid()) << height << report.Summary();
  }
}

TEST(SplitAtGaps, ReachesATipThatIsMoreThanAnEdgeLengthAway) {
  const Hull hull = HullWith({{{3, 3}}, 1.1});
  const CellComplex complex = GridComplex(kSplitSize);
  ASSERT_GT(LargestDistance(complex, hull), 1);
  const CellComplex split = Split(complex, hull);
  EXPECT_LE(LargestDistance(split, hull), 0.5);
  EXPECT_GE(SummarizeQuality(split).minimum, 0.31);
  const ValidationReport report = ValidateMesh(testing_support::MeshOf(split));
  EXPECT_TRUE(report.valid()) << report.Summary();
}

TEST(SplitAtGaps, ReachesWhatStandsOutOfARoughHull) {
  Studs studs{{}, 0.25, 0.6};
  for (int x = 0; x < kSplitSize.nx; x += 2) {
    for (int y = 0; y < kSplitSize.ny; y += 2) studs.at.push_back({x, y});
  }
  std::swap(studs.at.front(), studs.at[5]);  // away from the box's edges
  const Hull hull = HullWith(studs);
  const CellComplex complex = GridComplex(kSplitSize);
  const CellComplex split = Split(complex, hull);
  EXPECT_GT(LargestDistance(complex, hull), 0.5);
  EXPECT_LT(LargestDistance(split, hull), 0.3);
  EXPECT_EQ(split.vertices.size(), complex.vertices.size() + 1);
}

TEST(SplitAtGaps, LeavesAHullThatIsRoughAllOverAsItIs) {
  Studs studs{{}, 0.5};
  for (int x = 0; x < kSplitSize.nx; x += 2) {
    for (int y = 0; y < kSplitSize.ny; y += 2) studs.at.push_back({x, y});
  }
  const CellComplex complex = GridComplex(kSplitSize);
  const CellComplex split = Split(complex, HullWith(studs));
  EXPECT_EQ(split.vertices, complex.vertices);
  EXPECT_EQ(split.cells, complex.cells);
}

TEST(SplitAtGaps, ReachesForNoPointOfTheInputThatIsOffTheHull) {
  Hull hull = HullWith({});
  hull.input_points.push_back({3.5, 3.5, kSplitSize.nz + 0.6});
  hull.input_points.push_back({5.5, 3.5, kSplitSize.nz + 5.0});
  const CellComplex complex = GridComplex(kSplitSize);
  EXPECT_EQ(Split(complex, hull).cells, complex.cells);
}

TEST(SplitAtGaps, IsTheSameAtAnyThreadCount) {
  const Hull hull = HullWith({{{3, 3}, {1, 5}, {5, 1}}, 0.5});
  CellComplex complex = GridComplex(kSplitSize);
  std::vector<CellComplex> results;
  for (const size_t threads : {1, 2, 7}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    results.push_back(Split(complex, hull));
  }
  EXPECT_NE(results[0].cells, complex.cells);
  for (const CellComplex& other : results) {
    EXPECT_EQ(results[0].vertices, other.vertices);
    EXPECT_EQ(results[0].cells, other.cells);
  }
}

TEST(SplitAtGaps, StopsWhenAsked) {
  const Hull hull = HullWith({{{3, 3}}, 0.5});
  RunContext run;
  run.RequestStop();
  const auto split = SplitAtGaps(GridComplex(kSplitSize), hull, HullFeatures(hull), run);
  EXPECT_EQ(split.status().code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace amhex
