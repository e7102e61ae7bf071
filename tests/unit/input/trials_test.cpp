#include "trials.h"

#include <gtest/gtest.h>

namespace amhex {
namespace {

Hull OfVolume(double volume) {
  Hull hull;
  hull.volume = volume;
  return hull;
}

TEST(PlanTrials, TriesMoreOnSmallerSolids) {
  const MeshingParams params;
  const int small = PlanTrials(OfVolume(1e3), params).started;
  const int medium = PlanTrials(OfVolume(1e4), params).started;
  EXPECT_GT(small, medium);
  EXPECT_GT(medium, 1);
  EXPECT_EQ(PlanTrials(OfVolume(1e6), params).started, 1);
}

TEST(PlanTrials, DoesWhatIsAskedForAtAnySize) {
  MeshingParams params;
  for (const int asked : {1, 2, 12}) {
    params.sizing.trial_count = asked;
    for (const double volume : {1e2, 1e4, 1e6}) {
      const TrialPlan plan = PlanTrials(OfVolume(volume), params);
      EXPECT_EQ(plan.started, asked);
      EXPECT_LE(plan.placed, plan.closed);
      EXPECT_LE(plan.closed, plan.started);
    }
  }
}

TEST(PlanTrials, HasOnlyOneWithTheGridsOfThePaper) {
  MeshingParams params;
  params.sizing.trial_count = 5;
  params.relaxation.initialization = Initialization::kGrid;
  EXPECT_EQ(PlanTrials(OfVolume(1e3), params).started, 1);
}

}  // namespace
}  // namespace amhex
