// Laws of what is done about distances at last: the boundary comes near enough, for little.
#include "split_where_paid.h"

#include <gtest/gtest.h>

#include "optimize/hull_deviation.h"
#include "optimize/raise_quality.h"
#include "optimize/split_at_gaps.h"
#include "output/validate.h"
#include "placed_loss.h"
#include "support/grid_complex.h"
#include "support/largest_distance.h"
#include "support/studded_hull.h"

namespace amhex {
namespace {

using testing_support::GridComplex;
using testing_support::HullWith;
using testing_support::kStuddedSize;
using testing_support::LargestDistance;
using testing_support::StudsAllOver;

CellComplex RestOf(const CellComplex& complex, const Hull& hull) {
  const HullFeatures features(hull);
  const MeshingParams params;
  const RunContext run;
  auto split = SplitRest(complex, {hull, features, params, nullptr}, run);
  EXPECT_TRUE(split.ok()) << split.status().ToString();
  return *split;
}

TEST(SplitRest, BringsTheWholeBoundaryNearEnough) {
  const Hull hull = HullWith({{{4, 4}}, 0.4, 0.4});
  const CellComplex complex = GridComplex(kStuddedSize);
  const double limit = LimitsFor(hull).limit;
  ASSERT_GT(LargestDistance(complex, hull), limit);
  const CellComplex split = RestOf(complex, hull);
  EXPECT_LE(LargestDistance(split, hull), limit);
  EXPECT_GE(SummarizeQuality(split).minimum, 0.31);
  const ValidationReport report = ValidateMesh(testing_support::MeshOf(split));
  EXPECT_TRUE(report.valid()) << report.Summary();
}

TEST(SplitRest, PaysNoMoreForItThanItIsWorth) {
  const Hull hull = HullWith(StudsAllOver(0.4, 1, 3));
  const CellComplex complex = GridComplex(kStuddedSize);
  const auto split = SplitAtGaps(complex, hull, HullFeatures(hull), {}, SplitTurn::kLast, {});
  ASSERT_TRUE(split.ok());
  ASSERT_LE(LargestDistance(*split, hull), LimitsFor(hull).limit);
  ASSERT_LT(SummarizeQuality(*split).average, SummarizeQuality(complex).average - 0.05);
  EXPECT_TRUE(RestOf(complex, hull).cells == complex.cells);
}

TEST(SplitRest, LeavesWhatIsNearEnoughAsItIs) {
  const CellComplex complex = GridComplex(kStuddedSize);
  const CellComplex split = RestOf(complex, HullWith(StudsAllOver(0.1, 0, 2)));
  EXPECT_TRUE(split.vertices == complex.vertices);
  EXPECT_TRUE(split.cells == complex.cells);
}

TEST(SplitRest, FollowsNoNoise) {
  Hull hull = HullWith(StudsAllOver(0.4, 1, 3));
  for (int i = 0; i < 200; ++i) {
    hull.input_points.push_back({0.035 * i, 3.5, kStuddedSize.nz + (i % 2 == 0 ? 0.4 : -0.4)});
  }
  const CellComplex complex = GridComplex(kStuddedSize);
  EXPECT_TRUE(RestOf(complex, hull).cells == complex.cells);
}

TEST(SplitRest, StopsWhenAsked) {
  const Hull hull = HullWith(StudsAllOver(0.4, 1, 3));
  const HullFeatures features(hull);
  const MeshingParams params;
  RunContext run;
  run.RequestStop();
  const auto split = SplitRest(GridComplex(kStuddedSize), {hull, features, params, nullptr}, run);
  EXPECT_EQ(split.status().code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace amhex
