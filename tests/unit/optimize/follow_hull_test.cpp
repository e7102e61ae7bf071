// Laws of following the hull: distances fall to what is wanted, no cell pays too much for it, and
// what is near the hull already stays.
#include "optimize/follow_hull.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>

#include "optimize/hull_deviation.h"
#include "optimize/placement.h"
#include "optimize/raise_quality.h"
#include "output/mesh_statistics.h"
#include "output/validate.h"
#include "support/grid_complex.h"
#include "support/grid_hull.h"
#include "support/largest_distance.h"
#include "support/roof.h"

namespace amhex {
namespace {

using testing_support::CubesUnder;
using testing_support::GridComplex;
using testing_support::GridHull;
using testing_support::GridSize;
using testing_support::HullUnder;
using testing_support::LargestDistance;
using testing_support::Roof;

constexpr GridSize kSize = Roof().size;

CellComplex Followed(const CellComplex& complex, const Hull& hull) {
  const RunContext run;
  auto followed = FollowHull(complex, hull, HullFeatures(hull), run);
  EXPECT_TRUE(followed.ok()) << followed.status().ToString();
  return *followed;
}

MeshStatistics Measured(const CellComplex& complex, const Hull& hull) {
  return MeasureMesh(testing_support::MeshOf(complex), hull);
}

// Of samples of the hull only.
TEST(VertexDeviation, HasTheDistancesThatQueriesOfTheWholeBoundaryHave) {
  const Roof roof{2.65, 0.6};
  const Hull hull = HullUnder(roof);
  CellComplex complex = CubesUnder(roof);
  const HullFeatures features(hull);
  Placement placement = PreparePlacement(complex, features);
  const HullSampling sampling(hull, placement);
  const DeviationLimits limits = LimitsFor(hull);
  std::vector<Gap> gaps = sampling.GapsBeyond(limits.free, StopPoll());
  const std::vector<Vec3d>& points = sampling.points();
  std::erase_if(gaps, [&](const Gap& gap) {
    return std::find(points.begin(), points.end(), gap.sample) == points.end();
  });
  ASSERT_FALSE(gaps.empty());
  double largest = 0;
  for (int32_t v = 0; v < static_cast<int32_t>(complex.vertices.size()); ++v) {
    VertexDeviation deviation(sampling, placement, limits, v);
    deviation.At(complex.vertices[v]);
    const Gap& worst = deviation.worst_of_hull();
    if (worst.distance <= limits.free || placement.neighbourhoods.hull_faces[v].size() == 0) {
      continue;
    }
    const auto known = std::find_if(gaps.begin(), gaps.end(),
                                    [&](const Gap& gap) { return gap.sample == worst.sample; });
    ASSERT_NE(known, gaps.end()) << v;
    EXPECT_NEAR(worst.distance, known->distance, 1e-12) << v;
    largest = std::max(largest, worst.distance);
  }
  EXPECT_NEAR(largest, gaps.front().distance, 1e-12);
}

TEST(FollowHull, OfNothingIsNothing) {
  const Hull hull = HullUnder({2.5, 0.45});
  EXPECT_TRUE(Followed(CellComplex{}, hull).cells.empty());
}

TEST(FollowHull, LeavesABoundaryOnTheHullAsItIs) {
  const CellComplex complex = GridComplex(kSize);
  const CellComplex followed = Followed(complex, GridHull(kSize, 0.5));
  EXPECT_EQ(followed.vertices, complex.vertices);
  EXPECT_EQ(followed.cells, complex.cells);
}

TEST(FollowHull, PutsVerticesOntoARidgeThatRunsBetweenThem) {
  for (const double ridge_x : {2.4, 2.5, 2.65, 3.5}) {
    const Roof roof{ridge_x, 0.5};
    const Hull hull = HullUnder(roof);
    const CellComplex complex = CubesUnder(roof);
    const double limit = LimitsFor(hull).limit;
    ASSERT_GT(LargestDistance(complex, hull), limit);
    const CellComplex followed = Followed(complex, hull);
    EXPECT_LT(LargestDistance(followed, hull), limit) << ridge_x;
    EXPECT_LT(Measured(followed, hull).sharp_edge_deviation_rms, 0.1) << ridge_x;
    EXPECT_EQ(followed.cells, complex.cells);
    const ValidationReport report = ValidateMesh(testing_support::MeshOf(followed));
    EXPECT_TRUE(report.valid()) << report.Summary();
  }
}

TEST(FollowHullAround, SeesToThePlacesNamedAlone) {
  const Roof roof{2.5, 0.5, {6, 24, 3}};
  const Hull hull = HullUnder(roof);
  const CellComplex complex = CubesUnder(roof);
  const Vec3d place{2.5, 2, 3.5};  // on the ridge, near one end
  const RunContext run;
  const auto followed = FollowHullAround({place}, complex, hull, HullFeatures(hull), run);
  ASSERT_TRUE(followed.ok()) << followed.status().ToString();
  bool any = false;
  for (size_t v = 0; v < complex.vertices.size(); ++v) {
    const bool moved = followed->vertices[v] != complex.vertices[v];
    any = any || moved;
    // Sweeps carry what the place does some cells on.
    if (complex.vertices[v].y > 18) EXPECT_FALSE(moved) << "far from the place: " << v;
  }
  EXPECT_TRUE(any);
}

TEST(FollowHull, LeavesVerticesBeforeALostPartWhereTheyAre) {
  const Hull hull = HullUnder({2.5, 3.0});
  const CellComplex complex = GridComplex(kSize);
  ASSERT_GT(LargestDistance(complex, hull), 1);
  const CellComplex followed = Followed(complex, hull);
  for (size_t v = 0; v < complex.vertices.size(); ++v) {
    const Vec3d& p = complex.vertices[v];
    if (p.x != 2 && p.x != 3) continue;
    EXPECT_EQ(followed.vertices[v], p);
  }
}

TEST(FollowHull, NeverLowersTheMinimumOfAPoorMesh) {
  int moved = 0;
  for (const double ridge_x : {2.3, 2.5, 3.4}) {
    const Roof roof{ridge_x, 0.5};
    const Hull hull = HullUnder(roof);
    CellComplex complex = CubesUnder(roof);
    testing_support::Shake(complex, 0.25);
    const double before = SummarizeQuality(complex).minimum;
    ASSERT_GT(before, 0);
    ASSERT_LT(before, 0.5);
    const CellComplex followed = Followed(complex, hull);
    moved += followed.vertices != complex.vertices ? 1 : 0;
    EXPECT_GE(SummarizeQuality(followed).minimum, std::min(before, 0.31)) << ridge_x;
  }
  EXPECT_GT(moved, 0) << "or the test shows nothing";
}

// Long enough for gaps that are looked at side by side and do not see each other.
TEST(FollowHull, IsTheSameAtAnyThreadCount) {
  const Roof roof{2.5, 0.5, {6, 30, 3}};
  const Hull hull = HullUnder(roof);
  CellComplex complex = CubesUnder(roof);
  testing_support::Shake(complex, 0.1);
  std::vector<CellComplex> results;
  for (const size_t threads : {1, 2, 7}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    results.push_back(Followed(complex, hull));
  }
  EXPECT_NE(results[0].vertices, complex.vertices);
  for (const CellComplex& other : results) EXPECT_EQ(results[0].vertices, other.vertices);
}

TEST(FollowHull, StopsWhenAsked) {
  const Roof roof{2.5, 0.5};
  const Hull hull = HullUnder(roof);
  RunContext run;
  run.RequestStop();
  const auto followed = FollowHull(CubesUnder(roof), hull, HullFeatures(hull), run);
  EXPECT_EQ(followed.status().code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace amhex
