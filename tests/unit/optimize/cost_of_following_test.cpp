#include "cost_of_following.h"

#include <gtest/gtest.h>

namespace amhex {
namespace {

PlacedLoss Loss(double cells, double distance) {
  PlacedLoss loss;
  loss.cells = cells;
  loss.distance = distance;
  return loss;
}

TEST(CostOfFollowing, AShareOfTheDistanceIsExpectedToBeMendedAtFirst) {
  const CostOfFollowing cost;
  EXPECT_NEAR(cost.LikelyTotal(Loss(0.1, 0.2)), 0.1 + (1 - kMendedShare) * 0.2, 1e-12);
}

TEST(CostOfFollowing, WhereTheCellsPaidMoreThanItMendedTheNextOnesAreExpectedTo) {
  CostOfFollowing cost;
  cost.Learn(Loss(0.1, 0.2), Loss(0.4, 0.1));
  EXPECT_NEAR(cost.LikelyTotal(Loss(0.2, 0.1)), 0.3 + 0.1, 1e-12);
}

TEST(CostOfFollowing, TheOneThatGainedMostCounts) {
  CostOfFollowing cost;
  cost.Learn(Loss(0.1, 0.2), Loss(0.1, 0.15));
  cost.Learn(Loss(0.1, 0.2), Loss(0.4, 0.1));
  EXPECT_NEAR(cost.LikelyTotal(Loss(0.2, 0.1)), 0.3 - 0.025, 1e-12);
}

TEST(CostOfFollowing, NeverMoreIsExpectedThanAtFirst) {
  CostOfFollowing cost;
  cost.Learn(Loss(0.1, 0.2), Loss(0.1, 0));
  const PlacedLoss next = Loss(0.2, 0.1);
  EXPECT_EQ(cost.LikelyTotal(next), CostOfFollowing().LikelyTotal(next));
}

TEST(CostOfFollowing, NothingIsLearntFromOneThatWasNearEverywhere) {
  CostOfFollowing cost;
  cost.Learn(Loss(0.1, 0), Loss(0.2, 0));
  const PlacedLoss next = Loss(0.2, 0.1);
  EXPECT_EQ(cost.LikelyTotal(next), CostOfFollowing().LikelyTotal(next));
}

}  // namespace
}  // namespace amhex
