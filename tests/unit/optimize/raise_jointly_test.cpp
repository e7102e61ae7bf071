// Laws of raising cells jointly: poor ones get better, nothing leaves the hull, and what may not
// move or need not stays where it is.
#include "optimize/raise_jointly.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include "optimize/raise_quality.h"
#include "support/grid_complex.h"
#include "support/grid_hull.h"

namespace amhex {
namespace {

using testing_support::GridComplex;
using testing_support::GridHull;
using testing_support::GridSize;
using testing_support::GridVertex;

constexpr GridSize kBlockSize{4, 4, 4};
// Levels end a little below what they aim at.
constexpr double kNearlyWanted = kJointlyWanted - 0.005;

// Cubes; two vertices next to each other have been moved, one inside and one on the top.
struct Block {
  Block() : hull(GridHull(kBlockSize, 0.5)), features(hull), complex(GridComplex(kBlockSize)) {
    complex.vertices[inside] += Vec3d{0.5, 0.4, 0.3};
    complex.vertices[top] += Vec3d{-0.5, 0.3, 0};
  }

  Hull hull;
  HullFeatures features;
  CellComplex complex;
  int32_t inside = GridVertex(kBlockSize, 2, 2, 3);
  int32_t top = GridVertex(kBlockSize, 2, 2, 4);
};

double Minimum(const CellComplex& complex) { return SummarizeQuality(complex).minimum; }

void Raise(Placement& placement) {
  RunContext run;
  RaiseJointly(placement, kJointlyWanted, run);
}

TEST(RaiseJointly, RaisesPoorCells) {
  Block block;
  ASSERT_LT(Minimum(block.complex), 0.25) << "or there is little to raise";
  Placement placement = PreparePlacement(block.complex, block.features);
  Raise(placement);
  EXPECT_GE(Minimum(block.complex), kNearlyWanted);
}

TEST(RaiseJointly, KeepsTheBoundaryOnTheHull) {
  Block block;
  const CellComplex before = block.complex;
  Placement placement = PreparePlacement(block.complex, block.features);
  Raise(placement);
  ASSERT_NE(block.complex.vertices, before.vertices);
  for (const CellFace& face : block.complex.hull_faces) {
    for (int j = 0; j < face.count; ++j) {
      const Vec3d& p = block.complex.vertices[face.v[j]];
      EXPECT_LT(block.features.Closest(p).distance, 1e-9);
    }
  }
}

TEST(RaiseJointly, LeavesFixedVerticesWhereTheyAre) {
  Block block;
  const CellComplex before = block.complex;
  Placement placement = PreparePlacement(block.complex, block.features);
  placement.constraints.vertex[block.top] = {Constraint::kFixed, -1, -1, -1};
  Raise(placement);
  EXPECT_EQ(block.complex.vertices[block.top], before.vertices[block.top]);
  EXPECT_GT(Minimum(block.complex), Minimum(before));
}

TEST(RaiseJointly, LeavesAMeshWithoutPoorCellsAsItIs) {
  Block block;
  block.complex = GridComplex(kBlockSize);
  const CellComplex before = block.complex;
  Placement placement = PreparePlacement(block.complex, block.features);
  Raise(placement);
  EXPECT_EQ(block.complex.vertices, before.vertices);
}

// All but the cells at those two and what is next to them.
TEST(RaiseJointly, LeavesWhatIsFarFromPoorCellsAsItIs) {
  Block block;
  const CellComplex before = block.complex;
  Placement placement = PreparePlacement(block.complex, block.features);
  Raise(placement);
  for (int y = 0; y <= kBlockSize.ny; ++y) {
    for (int x = 0; x <= kBlockSize.nx; ++x) {
      const int32_t v = GridVertex(kBlockSize, x, y, 0);
      EXPECT_EQ(block.complex.vertices[v], before.vertices[v]);
    }
  }
}

TEST(RaiseJointly, SurveysWhatItHasMoved) {
  Block block;
  Placement placement = PreparePlacement(block.complex, block.features);
  Raise(placement);
  const std::vector<float> kept = placement.survey.min_scaled_jacobian;
  SurveyAllCells(placement);
  EXPECT_EQ(placement.survey.min_scaled_jacobian, kept);
}

// Many places, some of which see each other move.
TEST(RaiseJointly, ComesToTheSameOnAnyNumberOfThreads) {
  using oneapi::tbb::global_control;
  constexpr GridSize kLarge{24, 6, 4};
  const Hull hull = GridHull(kLarge, 0.5);
  const HullFeatures features(hull);
  const auto raised = [&](int threads) {
    const global_control limit(global_control::max_allowed_parallelism, threads);
    CellComplex complex = GridComplex(kLarge);
    for (const int x : {2, 5, 11, 16, 17, 21}) {
      complex.vertices[GridVertex(kLarge, x, 3, 3)] += Vec3d{0.5, 0.4, 0.02 * x};
      complex.vertices[GridVertex(kLarge, x, 3, 4)] += Vec3d{-0.5, 0.3, 0};
    }
    EXPECT_LT(Minimum(complex), 0.25);
    Placement placement = PreparePlacement(complex, features);
    Raise(placement);
    EXPECT_GT(Minimum(complex), 0.25) << "or there is nothing to compare";
    return complex.vertices;
  };
  const std::vector<Vec3d> single = raised(1);
  EXPECT_EQ(raised(4), single);
  EXPECT_EQ(raised(7), single);
}

TEST(RaiseJointly, MovesNothingInARunThatIsToStop) {
  Block block;
  const CellComplex before = block.complex;
  Placement placement = PreparePlacement(block.complex, block.features);
  RunContext run;
  run.RequestStop();
  RaiseJointly(placement, kJointlyWanted, run);
  EXPECT_EQ(block.complex.vertices, before.vertices);
}

}  // namespace
}  // namespace amhex
