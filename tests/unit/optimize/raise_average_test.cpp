// Laws of the last sweeps for the average, on perturbed grids.
#include "optimize/raise_average.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "optimize/placement.h"
#include "optimize/raise_quality.h"
#include "support/grid_complex.h"
#include "support/grid_hull.h"

namespace amhex {
namespace {

using testing_support::GridComplex;
using testing_support::GridHull;
using testing_support::GridSize;
using testing_support::Shake;

constexpr GridSize kSize{6, 5, 4};

CellComplex Raised(const CellComplex& complex, const HullFeatures& features) {
  RunContext run;
  absl::StatusOr<CellComplex> raised = RaiseAverage(complex, features, run, nullptr);
  EXPECT_TRUE(raised.ok()) << raised.status().ToString();
  return *std::move(raised);
}

TEST(RaiseAverage, RaisesItAndKeepsTheMinimum) {
  CellComplex complex = GridComplex(kSize);
  Shake(complex, 0.25);
  const Hull hull = GridHull(kSize, 0.5);
  const HullFeatures features(hull);
  const CellComplex raised = Raised(complex, features);
  const QualitySummary before = SummarizeQuality(complex), after = SummarizeQuality(raised);
  EXPECT_GT(after.average, before.average + 0.1);
  EXPECT_GE(after.minimum, std::min(before.minimum, 0.5) - 1e-12);
  EXPECT_EQ(raised.cells, complex.cells);
  EXPECT_EQ(raised.hull_faces.size(), complex.hull_faces.size());
}

TEST(RaiseAverage, GoesBeyondWhatSweepsOfCandidatesReach) {
  CellComplex complex = GridComplex(kSize);
  Shake(complex, 0.3);
  const Hull hull = GridHull(kSize, 0.5);
  const HullFeatures features(hull);
  const RunContext run;
  Placement placement = PreparePlacement(complex, features);
  SweepMemory memory = StartSweeps(static_cast<int64_t>(complex.vertices.size()));
  const SweepRules rules = RulesForAverage(complex, kLooseBound, StopPoll(run));
  ASSERT_TRUE(RunSweeps(placement, rules, 40, memory, run).ok());
  const QualitySummary settled = SummarizeQuality(complex);
  EXPECT_GT(SummarizeQuality(Raised(complex, features)).average, settled.average);
}

TEST(RaiseAverage, StopsWhenAsked) {
  CellComplex complex = GridComplex(kSize);
  Shake(complex, 0.25);
  const Hull hull = GridHull(kSize, 0.5);
  const HullFeatures features(hull);
  RunContext run;
  run.RequestStop();
  EXPECT_EQ(RaiseAverage(complex, features, run, nullptr).status().code(),
            absl::StatusCode::kCancelled);
}

TEST(RulesForAverage, NeverAskMoreOfACellThanTheMinimumOrLessThanItsFloor) {
  CellComplex complex = GridComplex(kSize);
  const RunContext run;
  EXPECT_EQ(RulesForAverage(complex, kLooseBound, StopPoll(run)).floor, 0.8) << "all are cubes";
  Shake(complex, 0.3);
  const double minimum = SummarizeQuality(complex).min_scaled_jacobian;
  ASSERT_LT(minimum, 0.31);
  EXPECT_EQ(RulesForAverage(complex, kLooseBound, StopPoll(run)).floor, 0.31);
}

}  // namespace
}  // namespace amhex
