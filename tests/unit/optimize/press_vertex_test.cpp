// Laws of pressing a vertex of the boundary: those inside make room, all others stay, and what
// cannot be had leaves everything as it was.
#include "optimize/press_vertex.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "optimize/raise_quality.h"
#include "support/grid_complex.h"
#include "support/grid_hull.h"

namespace amhex {
namespace {

using testing_support::GridComplex;
using testing_support::GridHull;
using testing_support::GridSize;
using testing_support::GridVertex;

constexpr GridSize kSize{4, 4, 4};
constexpr double kFloor = 0.31;
constexpr double kAnyLoss = 1e9;

// Cubes, the middle vertex of their top face, and the one inside below it, which is high up to one
// side.
struct Block {
  Block() : hull(GridHull(kSize, 0.5)), features(hull), complex(GridComplex(kSize)) {
    complex.vertices[GridVertex(kSize, 2, 2, 3)] += Vec3d{0.2, 0.2, 0.4};
  }

  Vec3d Below(double depth) const { return complex.vertices[top] - Vec3d{0, 0, depth}; }

  Hull hull;
  HullFeatures features;
  CellComplex complex;
  int32_t top = GridVertex(kSize, 2, 2, 4);
};

// As deep as this the vertex is as low as the one inside, and cells between turn over.
constexpr double kDepth = 0.6;

TEST(VertexPress, MakesRoomInside) {
  Block block;
  CellComplex moved = block.complex;
  moved.vertices[block.top] = block.Below(kDepth);
  ASSERT_LT(SummarizeQuality(moved).minimum, kFloor) << "or there is no need for room";
  const Vec3d place = block.Below(kDepth);
  Placement placement = PreparePlacement(block.complex, block.features);
  VertexPress press(placement, kFloor);
  ASSERT_TRUE(press.Run(block.top, place, kAnyLoss));
  EXPECT_EQ(block.complex.vertices[block.top], place);
  EXPECT_GE(SummarizeQuality(block.complex).minimum, kFloor);
}

TEST(VertexPress, LeavesAllOtherVerticesOfTheBoundaryWhereTheyAre) {
  Block block;
  const CellComplex before = block.complex;
  Placement placement = PreparePlacement(block.complex, block.features);
  ASSERT_TRUE(VertexPress(placement, kFloor).Run(block.top, block.Below(kDepth), kAnyLoss));
  for (const CellFace& face : before.hull_faces) {
    for (int j = 0; j < face.count; ++j) {
      if (face.v[j] == block.top) continue;
      EXPECT_EQ(block.complex.vertices[face.v[j]], before.vertices[face.v[j]]);
    }
  }
}

TEST(VertexPress, SurveysWhatItHasMoved) {
  Block block;
  Placement placement = PreparePlacement(block.complex, block.features);
  ASSERT_TRUE(VertexPress(placement, kFloor).Run(block.top, block.Below(kDepth), kAnyLoss));
  const std::vector<float> kept = placement.survey.min_scaled_jacobian;
  SurveyAllCells(placement);
  EXPECT_EQ(placement.survey.min_scaled_jacobian, kept);
}

void ExpectRefused(
    double depth, double most_loss, const std::function<bool()>& accepts = [] { return true; }) {
  Block block;
  const CellComplex before = block.complex;
  Placement placement = PreparePlacement(block.complex, block.features);
  const CellSurvey survey = placement.survey;
  EXPECT_FALSE(
      VertexPress(placement, kFloor).Run(block.top, block.Below(depth), most_loss, accepts));
  EXPECT_EQ(block.complex.vertices, before.vertices);
  EXPECT_EQ(placement.survey.min_scaled_jacobian, survey.min_scaled_jacobian);
  EXPECT_EQ(placement.survey.near_folding, survey.near_folding);
}

TEST(VertexPress, TakesBackWhatCostsTooMuch) {
  // A gain of so many cells of scaled Jacobian 0 that become perfect is not to be had.
  ExpectRefused(kDepth, -8);
}

TEST(VertexPress, TakesBackWhatNoPlaceInsideMendsOrTurnsTheBoundary) {
  ExpectRefused(kSize.nz + 0.5, kAnyLoss);
}

TEST(VertexPress, TakesBackWhatIsNotAcceptedWhenAllHasMoved) {
  ExpectRefused(kDepth, kAnyLoss, [] { return false; });
}

TEST(VertexPress, MovesAVertexThatNobodyMinds) {
  Block block;
  const Vec3d place = block.Below(-0.2);
  Placement placement = PreparePlacement(block.complex, block.features);
  EXPECT_TRUE(VertexPress(placement, kFloor).Run(block.top, place, kAnyLoss));
  EXPECT_EQ(block.complex.vertices[block.top], place);
}

}  // namespace
}  // namespace amhex
