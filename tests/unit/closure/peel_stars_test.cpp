#include "closure/peel_stars.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <vector>

#include "closure/working_mesh.h"
#include "optimize/cell_quality.h"
#include "support/grid_complex.h"

namespace amhex {
namespace {

using testing_support::GridComplex;
using testing_support::GridVertex;

// Replaces connected cells of a closed mesh by one star around `apex`.
CellComplex WithStar(const CellComplex& complex, const std::vector<int>& cells, const Vec3d& apex) {
  WorkingMesh mesh(complex);
  std::vector<CellFace> walls, hull;
  for (const int cell : cells) {
    for (const CellFace& face : FacesOf(mesh.corners(cell))) {
      const int32_t behind = mesh.Across(face);
      if (std::find(cells.begin(), cells.end(), behind) != cells.end()) continue;
      walls.push_back(face);
      if (behind == WorkingMesh::kHull) hull.push_back(face);
    }
  }
  for (const int cell : cells) mesh.RemoveCell(cell);
  const int v = mesh.AddVertex(apex);
  for (const CellFace& face : walls) {
    mesh.AddCell(face.count == 4 ? MakePyramid(face.v, v)
                                 : MakeTetrahedronOn({face.v[0], face.v[1], face.v[2]}, v));
  }
  for (const CellFace& face : hull) mesh.MarkHull(face);
  return mesh.ToComplex();
}

double Volume(const CellComplex& complex) {
  double volume = 0;
  for (const CellCorners& cell : complex.cells) volume += CellVolume(cell, complex.vertices);
  return volume;
}

int CountOf(PrimitiveType type, const CellComplex& complex) {
  return static_cast<int>(
      std::count_if(complex.cells.begin(), complex.cells.end(),
                    [&](const CellCorners& cell) { return RecognizeCell(cell) == type; }));
}

// Two hexahedra of which one is cut into two prisms.
CellComplex HexahedronBesidePrisms() {
  CellComplex complex = GridComplex({2, 1, 1});
  const CellCorners c = complex.cells[1];
  complex.cells.pop_back();
  complex.cells.push_back({c[0], c[1], c[1], c[2], c[4], c[5], c[5], c[6]});
  complex.cells.push_back({c[0], c[2], c[2], c[3], c[4], c[6], c[6], c[7]});
  complex.hull_faces.clear();
  WorkingMesh mesh(complex);
  for (const CellFace& face : mesh.OpenFaces()) mesh.MarkHull(face);
  return mesh.ToComplex();
}

TEST(PeelStars, LeavesAMeshWithoutStarsAlone) {
  RunContext run;
  const CellComplex grid = GridComplex({2, 2, 2});
  const auto peeled = PeelStars(grid, StarFolds::kAllowed, run);
  ASSERT_TRUE(peeled.ok());
  EXPECT_EQ(peeled->cells, grid.cells);
}

TEST(PeelStars, AStarInACubeBecomesTheCube) {
  RunContext run;
  const CellComplex star = WithStar(GridComplex({3, 3, 3}), {13}, {1.5, 1.5, 1.5});
  ASSERT_EQ(star.cells.size(), 32u);
  const auto peeled = PeelStars(star, StarFolds::kAllowed, run);
  ASSERT_TRUE(peeled.ok());
  EXPECT_EQ(peeled->cells.size(), 27u);
  EXPECT_EQ(CountOf(PrimitiveType::kHexahedron, *peeled), 27);
}

TEST(PeelStars, LooksAtAStarOnceAndAgainWhenWhatIsAroundItHasChanged) {
  RunContext run;
  const CellComplex star = WithStar(GridComplex({5, 3, 3}), {21}, {1.5, 1.5, 1.5});
  const auto cells_after = [&](const CellComplex& known) {
    const auto peeled = PeelStars(star, StarFolds::kAllowed, run, known);
    EXPECT_TRUE(peeled.ok());
    return peeled->cells.size();
  };
  const size_t none = star.cells.size(), all = cells_after({});
  ASSERT_LT(all, none);
  EXPECT_EQ(cells_after(star), none);
  CellComplex known = star;
  known.vertices[GridVertex({5, 3, 3}, 5, 1, 1)].x += 0.1;  // far away
  EXPECT_EQ(cells_after(known), none);
  known.vertices[GridVertex({5, 3, 3}, 0, 1, 1)].x += 0.1;  // of a cell next to the star
  EXPECT_EQ(cells_after(known), all);
}

TEST(PeelStars, AStarOverAHexahedronAndAPrismBecomesBoth) {
  RunContext run;
  const CellComplex mixed = HexahedronBesidePrisms();
  const WorkingMesh mesh(mixed);
  // The prism that shares a quad with the hexahedron.
  const int prism = mesh.Across(FaceInDirection(mixed.cells[0], 1));
  ASSERT_GT(prism, 0);
  const CellComplex star = WithStar(mixed, {0, prism}, {1.0, 0.6, 0.5});
  const auto peeled = PeelStars(star, StarFolds::kAllowed, run);
  ASSERT_TRUE(peeled.ok());
  EXPECT_EQ(peeled->cells.size(), 3u);
  EXPECT_EQ(CountOf(PrimitiveType::kHexahedron, *peeled), 1);
  EXPECT_EQ(CountOf(PrimitiveType::kPrism, *peeled), 2);
}

TEST(PeelStars, KeepsSpaceHullAndClosedness) {
  RunContext run;
  // Bars of two to four cells at the hull and inside.
  const std::vector<std::vector<int>> bars = {{0, 1}, {21, 22, 37}, {42, 43, 26, 27}, {5, 6, 22}};
  for (const auto& bar : bars) {
    const CellComplex grid = GridComplex({4, 4, 4});
    Vec3d apex;
    for (const int cell : bar) {
      for (const int32_t v : grid.cells[cell]) apex += grid.vertices[v] / (8.0 * bar.size());
    }
    const CellComplex star = WithStar(grid, bar, apex);
    const auto peeled = PeelStars(star, StarFolds::kAllowed, run);
    ASSERT_TRUE(peeled.ok());
    EXPECT_LT(peeled->cells.size(), star.cells.size());
    EXPECT_NEAR(Volume(*peeled), 64.0, 1e-9);
    EXPECT_EQ(peeled->hull_faces.size(), star.hull_faces.size());
    EXPECT_TRUE(WorkingMesh(*peeled).OpenFaces().empty());
    for (const CellCorners& cell : peeled->cells) {
      EXPECT_GT(ScaledJacobian(cell, peeled->vertices), 0);
    }
  }
}

// Replaces cells of a closed mesh by one star around `apex`, which lies on their part of the hull.
CellComplex WithStarAtHull(const CellComplex& complex, const std::vector<int>& cells,
                           const Vec3d& apex) {
  WorkingMesh mesh(complex);
  std::vector<CellFace> walls;
  for (const int cell : cells) {
    for (const CellFace& face : FacesOf(mesh.corners(cell))) {
      const int32_t behind = mesh.Across(face);
      if (behind == WorkingMesh::kHull) continue;
      if (std::find(cells.begin(), cells.end(), behind) == cells.end()) walls.push_back(face);
    }
  }
  for (const int cell : cells) mesh.RemoveCell(cell);
  const int v = mesh.AddVertex(apex);
  for (const CellFace& face : walls) mesh.AddCell(MakePyramid(face.v, v));
  for (const CellFace& face : mesh.OpenFaces()) mesh.MarkHull(face);
  return mesh.ToComplex();
}

TEST(PeelStars, AStarWithItsApexOnTheHullBecomesTheCellsThatWereThere) {
  RunContext run;
  // One cell, and three in a row, in the middle of the upper side.
  const CellComplex grid = GridComplex({5, 3, 2});
  for (const std::vector<int>& cells : {std::vector<int>{22}, std::vector<int>{21, 22, 23}}) {
    const CellComplex star = WithStarAtHull(grid, cells, {2.5, 1.5, 2.0});
    ASSERT_EQ(star.cells.size(), 32 + 2 * cells.size());
    const auto peeled = PeelStars(star, StarFolds::kAllowed, run);
    ASSERT_TRUE(peeled.ok());
    EXPECT_EQ(peeled->cells.size(), 30U);
    EXPECT_EQ(CountOf(PrimitiveType::kHexahedron, *peeled), 30);
    EXPECT_EQ(peeled->hull_faces.size(), grid.hull_faces.size());
    EXPECT_NEAR(Volume(*peeled), 30, 1e-9);
    EXPECT_FALSE(WorkingMesh(*peeled).HasOpenFaces());
  }
}

double Loss(const CellComplex& complex) {
  double loss = 0;
  for (const CellCorners& cell : complex.cells) loss += 1 - CellQuality(cell, complex.vertices);
  return loss;
}

TEST(PeelStars, OfStarsAtTheHullLeavesNothingOpenAndNeverMoreToLack) {
  RunContext run;
  CellComplex grid = GridComplex({5, 5, 2});
  testing_support::Shake(grid, 0.08);
  // On the upper side: a cell, rows of two and three, a square.
  const std::vector<std::vector<int>> bowls = {{37}, {37, 38}, {36, 37, 38}, {36, 37, 41, 42}};
  for (const std::vector<int>& cells : bowls) {
    Vec3d middle;
    for (const int cell : cells) {
      for (int i = 4; i < 8; ++i) {
        middle += grid.vertices[grid.cells[cell][i]] / (4.0 * static_cast<double>(cells.size()));
      }
    }
    for (const double height : {-0.25, -0.1, 0.0, 0.1, 0.25}) {
      const CellComplex star = WithStarAtHull(grid, cells, middle + Vec3d{0, 0, height});
      const auto peeled = PeelStars(star, StarFolds::kRefused, run);
      ASSERT_TRUE(peeled.ok());
      EXPECT_FALSE(WorkingMesh(*peeled).HasOpenFaces());
      EXPECT_LE(Loss(*peeled), Loss(star));
      for (const CellCorners& cell : peeled->cells) {
        EXPECT_GT(CellQuality(cell, peeled->vertices), 0);
      }
    }
  }
}

TEST(PeelStars, KeepsAnApexThatHoldsTheHullUp) {
  RunContext run;
  const CellComplex star = WithStarAtHull(GridComplex({5, 3, 2}), {22}, {2.5, 1.5, 2.3});
  const auto peeled = PeelStars(star, StarFolds::kAllowed, run);
  ASSERT_TRUE(peeled.ok());
  EXPECT_EQ(peeled->cells, star.cells);
  EXPECT_EQ(peeled->hull_faces.size(), star.hull_faces.size());
}

TEST(PeelStars, StopsWhenAsked) {
  RunContext run;
  run.RequestStop();
  const CellComplex star = WithStar(GridComplex({3, 3, 3}), {13}, {1.5, 1.5, 1.5});
  EXPECT_EQ(PeelStars(star, StarFolds::kAllowed, run).status().code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace amhex
