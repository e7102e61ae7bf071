#include "closure/fill_notches.h"

#include <gtest/gtest.h>

#include "fixtures/wedges.h"
#include "support/grid_hull.h"

namespace amhex {
namespace {

using testing_support::GridComplex;
using testing_support::GridHull;
using testing_support::GridSize;
using testing_support::HullOfMesh;

constexpr GridSize kNotchSize = {4, 3, 2};

// Two layers, of which the upper one begins at x = 2.
WorkingMesh StepMesh() {
  WorkingMesh mesh(GridComplex(kNotchSize));
  for (int y = 0; y < kNotchSize.ny; ++y) {
    for (int x = 0; x < 2; ++x) mesh.RemoveCell((kNotchSize.ny + y) * kNotchSize.nx + x);
  }
  for (const CellFace& face : mesh.OpenFaces()) {
    if (FaceCentroid(face, mesh.vertices()).x < 1) mesh.MarkHull(face);
  }
  return mesh;
}

TEST(FillNotches, EndsALayerInARowOfPrisms) {
  // It rises from (1, 1) to (2, 2).
  const Hull hull = HullOfMesh(
      fixtures::MakeExtruded({{1, 1}, {0, 1}, {0, 0}, {4, 0}, {4, 2}, {2, 2}}, kNotchSize.ny));
  ASSERT_NEAR(hull.volume, 3 * 6.5, 1e-12);
  WorkingMesh mesh = StepMesh();
  EXPECT_EQ(mesh.OpenFaces().size(), 6u);
  const int before = mesh.cell_slots();
  EXPECT_EQ(FillNotches(hull, &mesh), kNotchSize.ny);
  EXPECT_FALSE(mesh.HasOpenFaces());
  for (int cell = before; cell < mesh.cell_slots(); ++cell) {
    EXPECT_EQ(mesh.type(cell), PrimitiveType::kPrism);
    EXPECT_NEAR(CellVolume(mesh.corners(cell), mesh.vertices()), 0.5, 1e-12);
  }
}

TEST(FillNotches, LeavesThoseBelowTheHullAlone) {
  const Hull hull = GridHull(kNotchSize, 0.5);
  WorkingMesh mesh = StepMesh();
  EXPECT_EQ(FillNotches(hull, &mesh), 0);
  EXPECT_EQ(mesh.OpenFaces().size(), 6u);
}

TEST(FillNotches, LeavesRowsAloneThatWouldOpenAsManyFaces) {
  const Hull hull = HullOfMesh(
      fixtures::MakeExtruded({{1, 1}, {0, 1}, {0, 0}, {4, 0}, {4, 2}, {2, 2}}, kNotchSize.ny));
  WorkingMesh mesh = StepMesh();
  // Only the middle of three notches is left, and its prism would stand alone.
  for (const CellFace& face : mesh.OpenFaces()) {
    const double y = FaceCentroid(face, mesh.vertices()).y;
    if (y < 1 || y > 2) mesh.MarkHull(face);
  }
  EXPECT_EQ(mesh.OpenFaces().size(), 2u);
  EXPECT_EQ(FillNotches(hull, &mesh), 0);
  EXPECT_EQ(mesh.OpenFaces().size(), 2u);
}

}  // namespace
}  // namespace amhex
