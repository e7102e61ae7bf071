// Laws of putting vertices into the boundary: what no vertex could reach is reached, cells stay
// good, and where nothing is far away nothing changes.
#include "optimize/split_at_gaps.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <utility>
#include <vector>

#include "closure/working_mesh.h"
#include "optimize/hull_deviation.h"
#include "optimize/raise_quality.h"
#include "output/validate.h"
#include "support/grid_complex.h"
#include "support/grid_hull.h"
#include "support/largest_distance.h"
#include "support/studded_hull.h"

namespace amhex {
namespace {

using testing_support::GridComplex;
using testing_support::GridHull;
using testing_support::HullWith;
using testing_support::kStuddedSize;
using testing_support::LargestDistance;
using testing_support::Studs;
using testing_support::StudsAllOver;

CellComplex Split(const CellComplex& complex, const Hull& hull,
                  SplitTurn turn = SplitTurn::kFirst) {
  const RunContext run;
  auto split = SplitAtGaps(complex, hull, HullFeatures(hull), {}, turn, run);
  EXPECT_TRUE(split.ok()) << split.status().ToString();
  return *split;
}

TEST(SplitAtGaps, OfNothingIsNothing) {
  EXPECT_TRUE(Split(CellComplex{}, HullWith({})).cells.empty());
}

TEST(SplitAtGaps, LeavesABoundaryOnTheHullAsItIs) {
  const CellComplex complex = GridComplex(kStuddedSize);
  const CellComplex split = Split(complex, GridHull(kStuddedSize, 0.5));
  EXPECT_TRUE(split.vertices == complex.vertices);
  EXPECT_TRUE(split.cells == complex.cells);
}

TEST(SplitAtGaps, ReachesTipsAndPitsThatLieAmidFaces) {
  for (const double height : {0.5, -0.4}) {
    const Hull hull = HullWith({{{3, 3}, {1, 5}}, height});
    const CellComplex complex = GridComplex(kStuddedSize);
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
  const CellComplex complex = GridComplex(kStuddedSize);
  ASSERT_GT(LargestDistance(complex, hull), 1);
  const CellComplex split = Split(complex, hull);
  EXPECT_LE(LargestDistance(split, hull), 0.5);
  EXPECT_GE(SummarizeQuality(split).minimum, 0.31);
  const ValidationReport report = ValidateMesh(testing_support::MeshOf(split));
  EXPECT_TRUE(report.valid()) << report.Summary();
}

TEST(SplitAtGaps, ReachesWhatStandsOutOfARoughHull) {
  Studs studs = StudsAllOver(0.25, 0, 2);
  studs.height_of_first = 0.6;
  std::swap(studs.at.front(), studs.at[5]);  // away from the box's edges
  const Hull hull = HullWith(studs);
  const CellComplex complex = GridComplex(kStuddedSize);
  const CellComplex split = Split(complex, hull);
  EXPECT_GT(LargestDistance(complex, hull), 0.5);
  EXPECT_LT(LargestDistance(split, hull), 0.3);
  EXPECT_EQ(split.vertices.size(), complex.vertices.size() + 1);
}

TEST(SplitAtGaps, LeavesAHullThatIsRoughAllOverAsItIs) {
  const CellComplex complex = GridComplex(kStuddedSize);
  const CellComplex split = Split(complex, HullWith(StudsAllOver(0.5, 0, 2)));
  EXPECT_TRUE(split.vertices == complex.vertices);
  EXPECT_TRUE(split.cells == complex.cells);
}

TEST(SplitAtGaps, ReachesMorePlacesWhereTheyAreTheLast) {
  const Hull hull = HullWith(StudsAllOver(0.4, 1, 3));
  const CellComplex complex = GridComplex(kStuddedSize);
  ASSERT_GT(LargestDistance(complex, hull), LimitsFor(hull).limit);
  const CellComplex split = Split(complex, hull, SplitTurn::kLast);
  EXPECT_LE(LargestDistance(split, hull), LimitsFor(hull).limit);
  EXPECT_GE(SummarizeQuality(split).minimum, 0.31);
  const ValidationReport report = ValidateMesh(testing_support::MeshOf(split));
  EXPECT_TRUE(report.valid()) << report.Summary();
}

TEST(SplitAtGaps, LeavesTheLastPlacesAsTheyAreOnceSomeResist) {
  const CellComplex complex = GridComplex(kStuddedSize);
  const CellComplex split = Split(complex, HullWith(StudsAllOver(0.5, 1, 2)), SplitTurn::kLast);
  EXPECT_TRUE(split.vertices == complex.vertices);
  EXPECT_TRUE(split.cells == complex.cells);
}

TEST(SplitAtGaps, ReachesForNoPointOfTheInputThatIsOffTheHull) {
  Hull hull = HullWith({});
  hull.input_points.push_back({3.5, 3.5, kStuddedSize.nz + 0.6});
  hull.input_points.push_back({5.5, 3.5, kStuddedSize.nz + 5.0});
  const CellComplex complex = GridComplex(kStuddedSize);
  EXPECT_EQ(Split(complex, hull).cells, complex.cells);
}

TEST(SplitAtGaps, TakesOffWhatStandsOutOfTheHull) {
  const Hull hull = HullWith({});
  const CellComplex grid = GridComplex(kStuddedSize);
  CellComplex complex = grid;
  const CellFace base = complex.hull_faces.back();
  complex.hull_faces.pop_back();
  Vec3d middle;
  for (int j = 0; j < 4; ++j) middle += complex.vertices[base.v[j]] / 4.0;
  const auto apex = static_cast<int32_t>(complex.vertices.size());
  complex.vertices.push_back(middle + FaceUnitNormal(base, complex.vertices) * 0.8);
  complex.cells.push_back(MakePyramid(Reversed(base).v, apex));
  for (int j = 0; j < 4; ++j) {
    complex.hull_faces.push_back({3, {base.v[j], base.v[(j + 1) % 4], apex, -1}});
  }
  ASSERT_GT(LargestDistance(complex, hull), 0.5);
  const CellComplex split = Split(complex, hull, SplitTurn::kLast);
  EXPECT_LE(LargestDistance(split, hull), LimitsFor(hull).limit);
  EXPECT_EQ(split.cells.size(), grid.cells.size());
  const ValidationReport report = ValidateMesh(testing_support::MeshOf(split));
  EXPECT_TRUE(report.valid()) << report.Summary();
}

TEST(SplitAtGaps, IsTheSameAtAnyThreadCount) {
  const Hull hull = HullWith({{{3, 3}, {1, 5}, {5, 1}}, 0.5});
  CellComplex complex = GridComplex(kStuddedSize);
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
  const auto split =
      SplitAtGaps(GridComplex(kStuddedSize), hull, HullFeatures(hull), {}, SplitTurn::kFirst, run);
  EXPECT_EQ(split.status().code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace amhex
