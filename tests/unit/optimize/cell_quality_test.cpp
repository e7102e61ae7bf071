#include "optimize/cell_quality.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "output/cell_law.h"
#include "support/grid_complex.h"
#include "topology/primitives.h"

namespace amhex {
namespace {

using testing_support::kSinglePatterns;
using testing_support::SingleCell;

TEST(CellQuality, OfAUnitCubeIsOne) {
  const CellComplex cube = SingleCell(kSinglePatterns[0].cube_corners);
  EXPECT_DOUBLE_EQ(CellQuality(cube.cells[0], cube.vertices), 1);
}

TEST(CellQuality, IsTheMinimumScaledJacobianOfAValidCell) {
  for (const auto& pattern : kSinglePatterns) {
    CellComplex complex = SingleCell(pattern.cube_corners);
    testing_support::Shake(complex, 0.1);
    const double quality = CellQuality(complex.cells[0], complex.vertices);
    EXPECT_GT(quality, 0) << pattern.name;
    EXPECT_NEAR(quality, ScaledJacobian(complex.cells[0], complex.vertices), 1e-12);
  }
}

TEST(CellQuality, IsUnchangedByTurningAndScaling) {
  for (const auto& pattern : kSinglePatterns) {
    CellComplex complex = SingleCell(pattern.cube_corners);
    testing_support::Shake(complex, 0.15);
    const double quality = CellQuality(complex.cells[0], complex.vertices);
    for (Vec3d& p : complex.vertices) p = Vec3d{p.y, p.z, p.x} * 1e-3 + Vec3d{5, -2, 1};
    EXPECT_NEAR(CellQuality(complex.cells[0], complex.vertices), quality, 1e-9) << pattern.name;
  }
}

TEST(CellQuality, IsNegativeForMirroredCells) {
  for (const auto& pattern : kSinglePatterns) {
    CellComplex complex = SingleCell(pattern.cube_corners);
    for (Vec3d& p : complex.vertices) p.x = -p.x;
    EXPECT_LT(CellQuality(complex.cells[0], complex.vertices), 0) << pattern.name;
  }
}

TEST(CellQuality, IsNotPositiveForFlatCells) {
  for (const auto& pattern : kSinglePatterns) {
    CellComplex complex = SingleCell(pattern.cube_corners);
    for (Vec3d& p : complex.vertices) p.z = 0;
    EXPECT_LE(CellQuality(complex.cells[0], complex.vertices), 0) << pattern.name;
  }
}

TEST(CellQuality, IsMinusOneForNoCellAndForNonFiniteCorners) {
  CellComplex cube = SingleCell(kSinglePatterns[0].cube_corners);
  EXPECT_EQ(CellQuality({0, 1, 2, 3, 4, 5, 0, 7}, cube.vertices), -1) << "a collapsed diagonal";
  EXPECT_EQ(CellQuality({0, 1, 1, 2, 3, 4, 5, 2}, cube.vertices), -1) << "a prysm";
  for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity(), 1e200}) {
    cube.vertices[6].y = bad;
    EXPECT_LE(CellQuality(cube.cells[0], cube.vertices), 0) << bad;
  }
}

TEST(CellQuality, PositiveImpliesEverythingTheValidatorAsks) {
  std::minstd_rand random(7);
  const auto next = [&] {
    return 1.4 * random() / static_cast<double>(std::minstd_rand::max()) - 0.7;
  };
  int positive = 0, folded = 0;
  for (int round = 0; round < 20000; ++round) {
    const auto& pattern = kSinglePatterns[round % std::size(kSinglePatterns)];
    CellComplex complex = SingleCell(pattern.cube_corners);
    for (Vec3d& p : complex.vertices) p += Vec3d{next(), next(), next()};
    const CellMeasures measures = MeasureCell(complex.cells[0], complex.vertices);
    const double quality = CellQuality(complex.cells[0], complex.vertices);
    folded += quality <= 0 && measures.min_scaled_jacobian > 0;
    if (quality <= 0) continue;
    ++positive;
    EXPECT_GT(measures.volume, 0);
    EXPECT_GT(measures.min_map_jacobian, 0) << pattern.name;
    EXPECT_NEAR(measures.min_scaled_jacobian, quality, 1e-12);
  }
  EXPECT_GT(positive, 1000);
  EXPECT_GT(folded, 100) << "the test must meet cells whose corners alone look right";
}

}  // namespace
}  // namespace amhex
