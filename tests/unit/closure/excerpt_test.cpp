#include "closure/excerpt.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

#include "support/grid_complex.h"

namespace amhex {
namespace {

using testing_support::GridComplex;

std::multiset<CellCorners> CellsOf(const CellComplex& complex) {
  return {complex.cells.begin(), complex.cells.end()};
}

std::vector<int> CellsByCentre(const WorkingMesh& mesh, const Vec3d& centre, double reach) {
  std::vector<int> cells;
  for (int cell = 0; cell < mesh.cell_slots(); ++cell) {
    const CellVertices vertices = VerticesOf(mesh.corners(cell));
    Vec3d middle;
    for (const int32_t v : vertices) middle += mesh.vertices()[v] / double(vertices.count);
    if (Norm(middle - centre) < reach) cells.push_back(cell);
  }
  return cells;
}

TEST(Excerpt, OfNothingIsEmptyAndFitsBack) {
  WorkingMesh mesh(GridComplex({2, 2, 2}));
  const Excerpt excerpt(mesh, {});
  CellComplex unchanged = excerpt.Closed();
  EXPECT_TRUE(unchanged.cells.empty());
  EXPECT_TRUE(excerpt.TakeBack(&unchanged));
  EXPECT_TRUE(excerpt.PutInto(unchanged, &mesh));
  EXPECT_EQ(mesh.ToComplex().cells.size(), 8u);
}

TEST(Excerpt, PutBackUnchangedLeavesTheMeshAsItWas) {
  std::minstd_rand random(3);
  const CellComplex grid = GridComplex({5, 4, 3});
  for (int trial = 0; trial < 50; ++trial) {
    WorkingMesh mesh(grid);
    std::vector<int> cells;
    for (int cell = 0; cell < mesh.cell_slots(); ++cell) {
      if (random() % 3 != 0) cells.push_back(cell);
    }
    const Excerpt excerpt(mesh, cells);
    CellComplex part = excerpt.Closed();
    EXPECT_FALSE(WorkingMesh(part).HasOpenFaces());
    ASSERT_TRUE(excerpt.TakeBack(&part));
    ASSERT_TRUE(excerpt.PutInto(part, &mesh));
    EXPECT_FALSE(mesh.HasOpenFaces());
    EXPECT_EQ(CellsOf(mesh.ToComplex()), CellsOf(grid));
    EXPECT_EQ(mesh.ToComplex().hull_faces.size(), grid.hull_faces.size());
    EXPECT_EQ(mesh.vertices(), grid.vertices);
  }
}

TEST(Excerpt, BringsNewCellsAndMovedVerticesIntoTheMesh) {
  const CellComplex grid = GridComplex({7, 7, 7});
  WorkingMesh mesh(grid);
  const Excerpt excerpt(mesh, CellsByCentre(mesh, {3.5, 3.5, 3.5}, 2.6));
  WorkingMesh part(excerpt.Closed());
  const std::vector<int> middle = CellsByCentre(part, {3.5, 3.5, 3.5}, 0.1);
  ASSERT_EQ(middle.size(), 1u);
  const CellFaces faces = FacesOf(part.corners(middle[0]));
  part.RemoveCell(middle[0]);
  const int apex = part.AddVertex({3.5, 3.5, 3.6});
  for (const CellFace& face : faces) ASSERT_GE(part.AddCell(MakePyramid(face.v, apex)), 0);
  CellComplex changed = part.ToComplex();
  ASSERT_TRUE(excerpt.TakeBack(&changed));
  ASSERT_TRUE(excerpt.PutInto(changed, &mesh));
  EXPECT_FALSE(mesh.HasOpenFaces());
  const CellComplex whole = mesh.ToComplex();
  EXPECT_EQ(whole.cells.size(), grid.cells.size() + 5);
  EXPECT_EQ(whole.hull_faces.size(), grid.hull_faces.size());
  ASSERT_EQ(whole.vertices.size(), grid.vertices.size() + 1);
  EXPECT_EQ(whole.vertices.back(), (Vec3d{3.5, 3.5, 3.6}));
}

TEST(Excerpt, RefusesOpenFacesAndChangedCellsAtTheRestOfTheMesh) {
  const WorkingMesh mesh(GridComplex({7, 7, 7}));
  const Excerpt excerpt(mesh, CellsByCentre(mesh, {3.5, 3.5, 3.5}, 2.6));
  for (const double reach : {0.1, 4.0}) {
    WorkingMesh part(excerpt.Closed());
    part.RemoveCell(CellsByCentre(part, {3.5, 3.5, 3.5}, reach).front());
    CellComplex changed = part.ToComplex();
    EXPECT_FALSE(excerpt.TakeBack(&changed)) << reach;
  }
  // All closed, but one cell less at the cut: its faces are declared hull.
  WorkingMesh part(excerpt.Closed());
  part.RemoveCell(CellsByCentre(part, {3.5, 3.5, 3.5}, 4.0).front());
  for (const CellFace& face : part.OpenFaces()) part.MarkHull(face);
  CellComplex changed = part.ToComplex();
  EXPECT_FALSE(excerpt.TakeBack(&changed));
}

}  // namespace
}  // namespace amhex
