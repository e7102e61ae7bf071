#include "closure/hull_apex.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "closure/cavities.h"
#include "closure/close_complex.h"
#include "closure/star_geometry.h"
#include "optimize/cell_quality.h"
#include "support/grid_complex.h"
#include "support/grid_hull.h"

namespace amhex {
namespace {

using testing_support::GridComplex;
using testing_support::GridHull;
using testing_support::GridSize;

// A grid without the cells whose centres lie in the box.
CellComplex GridWithout(const GridSize& n, const Vec3d& low, const Vec3d& high) {
  const CellComplex grid = GridComplex(n);
  WorkingMesh mesh(grid);
  for (int cell = 0; cell < mesh.cell_slots(); ++cell) {
    Vec3d centre;
    for (const int32_t v : mesh.corners(cell)) centre += grid.vertices[v] / 8.0;
    if (ComponentMax(low, centre) == centre && ComponentMin(high, centre) == centre) {
      mesh.RemoveCell(cell);
    }
  }
  return mesh.ToComplex();
}

struct Bowl {
  WorkingMesh mesh;
  std::vector<CellFace> walls;
  std::vector<int32_t> loop;
};

// 2 x 2 x 1 cells missing in the middle of the upper side of 4 x 4 x 3.
Bowl MakeBowl() {
  Bowl bowl{WorkingMesh(GridWithout({4, 4, 3}, {1, 1, 2}, {3, 3, 3})), {}, {}};
  const Cavities cavities = CollectCavities(bowl.mesh);
  EXPECT_EQ(cavities.count(), 1);
  bowl.walls = cavities.faces.front();
  const auto loops = BoundaryLoops(bowl.walls);
  EXPECT_EQ(loops.size(), 1u);
  bowl.loop = loops.front();
  return bowl;
}

TEST(HullApex, IsTheBestPointOfTheHullOverABowl) {
  const Bowl bowl = MakeBowl();
  const Hull hull = GridHull({4, 4, 3}, 0.5);
  const auto apex = FindHullApex(bowl.mesh, hull, bowl.walls, bowl.loop, {1.7, 2.2, 2.5});
  ASSERT_TRUE(apex.has_value());
  EXPECT_NEAR(apex->point.z, 3, 1e-9);
  EXPECT_EQ(apex->quality, MinStarQuality(bowl.walls, apex->point, bowl.mesh.vertices()));
  double best = -1;
  for (double x = 1; x <= 3; x += 0.02) {
    for (double y = 1; y <= 3; y += 0.02) {
      best = std::max(best, MinStarQuality(bowl.walls, {x, y, 3}, bowl.mesh.vertices()));
    }
  }
  EXPECT_GE(apex->quality, best - 0.02);
  EXPECT_GT(best, 0.5);
}

TEST(HullApex, IsRefusedWhereTheLoopRunsTheOtherWay) {
  Bowl bowl = MakeBowl();
  const Hull hull = GridHull({4, 4, 3}, 0.5);
  std::reverse(bowl.loop.begin(), bowl.loop.end());
  EXPECT_FALSE(FindHullApex(bowl.mesh, hull, bowl.walls, bowl.loop, {2, 2, 2.5}).has_value());
}

TEST(HullApex, IsRefusedWhereTheHullCannotSeeTheWalls) {
  // A closed cavity far from the hull, of which one wall is taken for open.
  WorkingMesh mesh(GridWithout({7, 7, 7}, {3, 3, 3}, {4, 4, 4}));
  std::vector<CellFace> walls = CollectCavities(mesh).faces.front();
  walls.pop_back();
  const auto loops = BoundaryLoops(walls);
  ASSERT_EQ(loops.size(), 1u);
  const Hull hull = GridHull({7, 7, 7}, 0.5);
  EXPECT_FALSE(FindHullApex(mesh, hull, walls, loops[0], {3.5, 3.5, 3.5}).has_value());
}

TEST(HullApex, ClosesABowlWithOneCellPerWall) {
  const CellComplex open = GridWithout({4, 4, 3}, {1, 1, 2}, {3, 3, 3});
  const Hull hull = GridHull({4, 4, 3}, 0.5);
  RunContext run;
  const auto closed = CloseComplex(open, hull, MeshingParams{}, run);
  ASSERT_TRUE(closed.ok()) << closed.status().ToString();
  EXPECT_FALSE(WorkingMesh(*closed).HasOpenFaces());
  // 4 walls below and 8 around.
  EXPECT_LE(closed->cells.size(), open.cells.size() + 12);
  double volume = 0, worst = 1;
  for (const CellCorners& cell : closed->cells) {
    volume += CellVolume(cell, closed->vertices);
    worst = std::min(worst, CellQuality(cell, closed->vertices));
  }
  EXPECT_NEAR(volume, 48, 1e-9);
  EXPECT_GT(worst, 0.4);
}

}  // namespace
}  // namespace amhex
