#include "placed_loss.h"

#include <gtest/gtest.h>

#include "closure/working_mesh.h"
#include "cuda/device_use.h"
#include "support/grid_complex.h"
#include "support/grid_hull.h"

namespace amhex {
namespace {

using testing_support::GridComplex;
using testing_support::GridHull;

PlacedLoss LossOfGrid(int length, const Hull& hull) {
  const HullFeatures features(hull, StopPoll());
  const MeshingParams params;
  return LossOf(GridComplex({length, 3, 3}), {hull, features, params, nullptr}, kGoodMinimum,
                StopPoll());
}

TEST(PlacedLoss, AGridThatFillsItsHullHasNone) {
  EXPECT_NEAR(LossOfGrid(8, GridHull({8, 3, 3}, 1.0)).total(), 0, 1e-9);
}

TEST(PlacedLoss, AMissingEndCountsMoreThanAnyCellsCouldMakeGood) {
  const PlacedLoss loss = LossOfGrid(6, GridHull({8, 3, 3}, 1.0));
  EXPECT_GT(loss.lost, 0.5);
  EXPECT_GT(loss.faults(), 0.5);
}

TEST(PlacedLoss, NothingIsLostThatIsNearEnoughForSoLargeASolid) {
  // 0.5 % of its diagonal are 1.25 edge lengths.
  const Hull hull = GridHull({250, 3, 3}, 1.0);
  EXPECT_EQ(LossOfGrid(249, hull).faults(), 0);
  EXPECT_GT(LossOfGrid(248, hull).lost, 0.3);
}

TEST(PlacedLoss, NothingIsLostThatOnlyNoiseReaches) {
  Hull hull = GridHull({8, 3, 3}, 1.0);
  for (int i = 0; i < 100; ++i) hull.input_points.push_back({0.08 * i, 1.5, 3.5});
  hull.input_points.push_back({4, 1.5, 6});
  EXPECT_EQ(LossOfGrid(8, hull).lost, 0);
  EXPECT_EQ(LossOfGrid(6, hull).lost, 0);
}

// Of a block of 5 x 5 x 3, without the cells along its middle.
CellComplex BlockWithTunnel() {
  WorkingMesh mesh(GridComplex({5, 5, 3}));
  for (int layer = 0; layer < 3; ++layer) mesh.RemoveCell(12 + 25 * layer);
  return mesh.ToComplex();
}

PlacedLoss LossOfTunnel(bool is_given, int64_t genus) {
  Hull hull = GridHull({5, 5, 3}, 1.0);
  hull.is_given = is_given;
  hull.genus = genus;
  hull.component_count = 1;
  const HullFeatures features(hull, StopPoll());
  const MeshingParams params;
  return LossOf(BlockWithTunnel(), {hull, features, params, nullptr}, kGoodMinimum, StopPoll());
}

TEST(PlacedLoss, ATunnelThatTheInputDoesNotHaveCounts) {
  EXPECT_GT(LossOfTunnel(true, 0).handles, 0);
  EXPECT_GT(LossOfTunnel(true, 0).faults(), LossOfTunnel(true, 1).faults());
  EXPECT_EQ(LossOfTunnel(true, 1).handles, 0);
}

TEST(PlacedLoss, HandlesThatTheMeshLacksOrThatARebuiltSurfaceIsSaidToHaveDoNotCount) {
  EXPECT_EQ(LossOfTunnel(true, 2).handles, 0);
  EXPECT_EQ(LossOfTunnel(false, 0).handles, 0);
  EXPECT_EQ(LossOfTunnel(true, -1).handles, 0);
}

TEST(PlacedLoss, WhatDrawingMayMendIsNotLost) {
  const Hull hull = GridHull({8, 3, 3}, 1.0);
  CellComplex complex = GridComplex({8, 3, 3});
  for (Vec3d& p : complex.vertices) {
    if (p.x == 8) p.x -= 0.6;
  }
  const HullFeatures features(hull, StopPoll());
  const MeshingParams params;
  const PlacedLoss loss =
      LossOf(complex, {hull, features, params, nullptr}, kGoodMinimum, StopPoll());
  EXPECT_EQ(loss.lost, 0);
  EXPECT_GT(loss.distance, 0);
}

}  // namespace
}  // namespace amhex
