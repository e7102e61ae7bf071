// Closed meshes with poor cells.
#pragma once

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "closure/close_complex.h"
#include "closure/working_mesh.h"
#include "optimize/raise_quality.h"
#include "output/validate.h"
#include "support/grid_complex.h"
#include "support/grid_hull.h"

namespace amhex::testing_support {

// The hexahedron around each of `places` becomes six pyramids whose apex all but lies in one of
// their bases.
inline CellComplex WithPoorStars(const GridSize& n, const std::vector<Vec3d>& places) {
  const CellComplex grid = GridComplex(n);
  WorkingMesh mesh(grid);
  for (const Vec3d& place : places) {
    for (int cell = 0; cell < static_cast<int>(grid.cells.size()); ++cell) {
      Vec3d centre;
      for (const int32_t v : grid.cells[cell]) centre += grid.vertices[v] / 8.0;
      if (Norm(centre - place) > 0.1) continue;
      const CellFaces faces = FacesOf(grid.cells[cell]);
      mesh.RemoveCell(cell);
      const int apex = mesh.AddVertex(centre + Vec3d{0, 0.1, 0.46});
      for (const CellFace& face : faces) mesh.AddCell(MakePyramid(face.v, apex));
    }
  }
  for (const CellFace& face : mesh.OpenFaces()) mesh.MarkHull(face);
  return mesh.ToComplex();
}

// What mending poor cells must not do: mend(complex, hull).
template <class Mend>
void ExpectLeavesGoodCellsAsTheyAre(const Mend& mend) {
  const GridSize n{4, 4, 4};
  CellComplex complex = GridComplex(n);
  Shake(complex, 0.1);
  const CellComplex mended = mend(complex, GridHull(n, 0.5));
  EXPECT_EQ(mended.cells, complex.cells);
  EXPECT_EQ(mended.vertices, complex.vertices);
  EXPECT_TRUE(mend(CellComplex{}, GridHull({1, 1, 1}, 0.5)).cells.empty());
}

template <class Mend>
void ExpectMendsAPlaceAndMovesNothingFarFromIt(const Mend& mend) {
  const GridSize n{14, 5, 5};
  const Vec3d place{2.5, 2.5, 2.5};
  const CellComplex complex = WithPoorStars(n, {place});
  ASSERT_LT(SummarizeQuality(complex).minimum, 0.1);
  const CellComplex mended = mend(complex, GridHull(n, 0.5));
  EXPECT_GT(SummarizeQuality(mended).minimum, 0.3);
  const ValidationReport report = ValidateMesh(MeshOf(mended));
  EXPECT_TRUE(report.valid()) << report.Summary();
  for (size_t v = 0; v < GridComplex(n).vertices.size(); ++v) {
    if (Norm(complex.vertices[v] - place) < 7) continue;
    EXPECT_EQ(mended.vertices[v], complex.vertices[v]);
  }
}

// A grid with every third cell left out, more or less, and what closing puts there.
inline CellComplex ClosedWithGaps(const GridSize& n, const Hull& hull, unsigned seed) {
  WorkingMesh mesh(GridComplex(n));
  std::minstd_rand random(seed);
  for (int cell = 0; cell < mesh.cell_slots(); ++cell) {
    if (random() % 3 == 0) mesh.RemoveCell(cell);
  }
  RunContext run;
  auto closed = CloseComplex(mesh.ToComplex(), hull, MeshingParams{}, run);
  EXPECT_TRUE(closed.ok()) << closed.status().ToString();
  return *std::move(closed);
}

}  // namespace amhex::testing_support
