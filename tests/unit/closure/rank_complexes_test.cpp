#include "closure/rank_complexes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "closure/working_mesh.h"
#include "fixtures/solids.h"
#include "input/wanted_cells.h"
#include "support/grid_complex.h"
#include "support/hull_of_mesh.h"

namespace amhex {
namespace {

using ::testing::ElementsAre;
using testing_support::GridComplex;

// The box [0, 6]^3 as a hull; 216 cells are wanted.
Hull BoxOfSix() {
  TriangleMesh box = fixtures::MakeBox({6, 6, 6}, 1.0);
  Box3d bounds;
  for (const Vec3d& p : box.vertices) bounds.Extend(p);
  for (Vec3d& p : box.vertices) p -= bounds.low;
  Hull hull = testing_support::HullOfMesh(box);
  hull.volume = 216;
  return hull;
}

CellComplex WithoutCells(int first, int count) {
  WorkingMesh mesh(GridComplex({6, 6, 6}));
  for (int cell = first; cell < first + count; ++cell) mesh.RemoveCell(cell);
  return mesh.ToComplex();
}

std::vector<size_t> RankOf(const std::vector<CellComplex>& complexes) {
  const RunContext run;
  const auto ranked = RankComplexes(complexes, BoxOfSix(), run);
  EXPECT_TRUE(ranked.ok());
  std::vector<size_t> order;
  if (!ranked.ok()) return order;
  for (const RankedComplex& next : *ranked) order.push_back(next.index);
  return order;
}

TEST(RankComplexes, PutsTheOneWithFewestOpenFacesFirst) {
  // Cell 86 and its neighbours lie in the middle of the box.
  EXPECT_THAT(RankOf({WithoutCells(86, 3), WithoutCells(86, 0), WithoutCells(86, 1)}),
              ElementsAre(1, 2, 0));
}

TEST(RankComplexes, KeepsTheOrderOfEquals) {
  EXPECT_THAT(RankOf({WithoutCells(86, 1), WithoutCells(86, 1), WithoutCells(86, 1)}),
              ElementsAre(0, 1, 2));
}

TEST(RankComplexes, PutsAWrongNumberOfCellsLast) {
  EXPECT_THAT(RankOf({GridComplex({6, 6, 3}), WithoutCells(86, 1)}), ElementsAre(1, 0));
}

TEST(RankComplexes, TellsTheFacesThatClosingWillFind) {
  const RunContext run;
  const auto ranked = RankComplexes({WithoutCells(86, 3), WithoutCells(86, 0)}, BoxOfSix(), run);
  ASSERT_TRUE(ranked.ok());
  EXPECT_EQ(ranked->at(0).open_faces, 0);
  EXPECT_EQ(ranked->at(1).open_faces, 3 * 6 - 2 * 2);  // a bar of three cells
  EXPECT_LT(ranked->at(0).loss, ranked->at(1).loss);
}

TEST(RankComplexes, OfNoneIsNone) { EXPECT_TRUE(RankOf({}).empty()); }

TEST(RankComplexes, StopsWhenAsked) {
  RunContext run;
  run.RequestStop();
  const std::vector<CellComplex> two = {WithoutCells(86, 0), WithoutCells(86, 1)};
  EXPECT_EQ(RankComplexes(two, BoxOfSix(), run).status().code(), absl::StatusCode::kCancelled);
}

TEST(WantedCells, AreTheVolumeButForWallsOfOneLayer) {
  EXPECT_DOUBLE_EQ(WantedCells(BoxOfSix(), {}), 216);
  const Hull plate = testing_support::HullOfMesh(fixtures::MakeBox({12, 9, 0.7}, 1.0));
  EXPECT_NEAR(WantedCells(plate, {}), 12 * 9, 1);
}

TEST(DeviationLoss, IsNothingNearTheWantedNumberAndGrowsBeyond) {
  EXPECT_EQ(DeviationLoss(216, 216), 0);
  EXPECT_EQ(DeviationLoss(216 * 1.1, 216), 0);
  EXPECT_GT(DeviationLoss(216 * 1.2, 216), 0);
  EXPECT_GT(DeviationLoss(216 * 0.7, 216), DeviationLoss(216 * 0.8, 216));
}

}  // namespace
}  // namespace amhex
