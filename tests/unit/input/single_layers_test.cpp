#include "input/single_layers.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fixtures/solids.h"

namespace amhex {
namespace {

struct Solid {
  TriangleMesh mesh;
  double volume = 0;
  SurfaceOfSolid surface() const { return {mesh.vertices, mesh.triangles, volume}; }
  SingleLayers WallsFor(double edge_length) const {
    const HullQueries queries(mesh.vertices, mesh.triangles);
    return FindSingleLayers(surface(), queries, edge_length, {});
  }
  double CubesFor(double cells) const { return std::cbrt(volume / cells); }
};

Solid Plate(double thickness) {
  return {fixtures::MakeBox({20, 20, thickness}, 2), 400 * thickness};
}

TEST(SingleLayers, OfAPlateAreItsFaces) {
  const SingleLayers walls = Plate(0.7).WallsFor(1);
  EXPECT_NEAR(walls.area, 400, 2);
  EXPECT_NEAR(walls.volume, 280, 2);
  EXPECT_NEAR(walls.thinnest, 0.7, 1e-9);
  EXPECT_NEAR(walls.thickest, 0.7, 1e-9);
  EXPECT_NEAR(walls.ExcessCells(1), 120, 2);
}

TEST(SingleLayers, AreFewerCellsWhereTheWallIsThicker) {
  EXPECT_NEAR(Plate(1.25).WallsFor(1).ExcessCells(1), -100, 2);
}

TEST(SingleLayers, AreNoneWhereWallsHoldTwoLayersOrNone) {
  EXPECT_EQ(Plate(1.6).WallsFor(1).area, 0);
  EXPECT_EQ(Plate(0.4).WallsFor(1).area, 0);
}

TEST(SingleLayers, ThickSolidsAreNotAsked) {
  const Solid cube{fixtures::MakeBox({8, 8, 8}, 2), 512};
  EXPECT_FALSE(MayHaveSingleLayers(cube.surface(), 1));
  EXPECT_EQ(cube.WallsFor(1).area, 0);
  EXPECT_TRUE(MayHaveSingleLayers(Plate(0.7).surface(), 1));
}

TEST(SingleLayers, SidesThatAreNotParallelAreNoWall) {
  Solid ball{fixtures::MakeSphere(1, 0.2), 4.0};
  EXPECT_TRUE(MayHaveSingleLayers(ball.surface(), 1.8));
  const double shell = ball.WallsFor(1.8).area;
  for (Vec3d& p : ball.mesh.vertices) p.z *= 0.9 + 0.3 * p.x;  // a wedge of a kind
  EXPECT_LT(ball.WallsFor(1.8).area, shell);
}

TEST(ThinPart, OfAPlateIsItsFaces) {
  const Solid plate = Plate(0.3);
  const HullQueries queries(plate.mesh.vertices, plate.mesh.triangles);
  const ThinPart thin = FindThinPart(plate.surface(), queries, 1, {});
  EXPECT_NEAR(thin.area_ratio, 800 / (800 + 80 * 0.3), 0.01);
  EXPECT_NEAR(thin.thickness, 0.3, 1e-9);
  EXPECT_NEAR(thin.thinnest, 0.3, 1e-9);
  EXPECT_NEAR(thin.place.z, 0.15, 1e-9);
  EXPECT_GE(plate.WallsFor(0.99 * LongestEdgeFor(thin.thinnest)).area, 399);
}

TEST(ThinPart, IsNothingOfWhatHoldsALayer) {
  const Solid plate = Plate(0.6);
  const HullQueries queries(plate.mesh.vertices, plate.mesh.triangles);
  EXPECT_EQ(FindThinPart(plate.surface(), queries, 1, {}).area_ratio, 0);
}

TEST(EdgeLengthWithLayers, MakesTheWantedNumberOfCells) {
  constexpr double kCells = 400;
  for (const double thickness : {0.586, 0.784, 1.315}) {  // 0.7, 0.85 and 1.2 of a cube's edge
    SCOPED_TRACE(thickness);
    const Solid plate = Plate(thickness);
    const double cubes = plate.CubesFor(kCells);
    const double h = EdgeLengthWithLayers(plate.WallsFor(cubes), plate.volume, cubes);
    EXPECT_NEAR(400 / (h * h), kCells, 0.01 * kCells);
  }
}

TEST(EdgeLengthWithLayers, LeavesEachWallItsLayer) {
  constexpr double kCells = 400;
  for (const double thickness : {0.4, 1.7}) {  // 0.54 and 1.42 of a cube's edge
    SCOPED_TRACE(thickness);
    const Solid plate = Plate(thickness);
    const double cubes = plate.CubesFor(kCells);
    const double h = EdgeLengthWithLayers(plate.WallsFor(cubes), plate.volume, cubes);
    EXPECT_GT(thickness / h, 0.53);
    EXPECT_LT(thickness / h, 1.46);
    EXPECT_LE(std::abs(400 / (h * h) - kCells), std::abs(400 / (cubes * cubes) - kCells));
  }
}

TEST(EdgeLengthWithLayers, KeepsWhatIsNearEnough) {
  const Solid plate = Plate(0.95);
  const double cubes = plate.CubesFor(400);
  ASSERT_GT(plate.WallsFor(cubes).area, 0);
  EXPECT_EQ(EdgeLengthWithLayers(plate.WallsFor(cubes), plate.volume, cubes), cubes);
}

}  // namespace
}  // namespace amhex
