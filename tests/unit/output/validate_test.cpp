// The validator accepts what is right and rejects every kind of damage.
#include "output/validate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "output/cell_law.h"
#include "support/grid_complex.h"
#include "topology/primitives.h"

namespace amhex {
namespace {

using testing_support::GridCell;
using testing_support::GridComplex;
using testing_support::GridSize;
using testing_support::GridVertex;
using testing_support::kSinglePatterns;
using testing_support::ListHullFaces;
using testing_support::MeshOf;
using testing_support::NotchedGrid;
using testing_support::Shake;
using testing_support::SingleCell;
using testing_support::StellatedCell;

AtMostHexaMesh GridMesh(int nx, int ny, int nz) { return MeshOf(GridComplex({nx, ny, nz})); }

void RefreshQuality(AtMostHexaMesh& mesh) {
  for (size_t c = 0; c < mesh.corners.size(); ++c) {
    mesh.quality[c] =
        static_cast<float>(MeasureCell(mesh.corners[c], mesh.vertices).min_scaled_jacobian);
  }
}

// Splits grid cell (x, y, z) into two prisms whose triangles lie on its -x and +x faces.
void SplitCellAcrossX(const GridSize& n, int x, int y, int z, CellComplex& complex) {
  const CellCorners hexahedron = GridCell(n, x, y, z);
  const auto at = std::find(complex.cells.begin(), complex.cells.end(), hexahedron);
  ASSERT_NE(at, complex.cells.end());
  const auto& h = hexahedron;
  // Prism 0 1 1 2 3 4 4 5: rings (0 1 2) and (3 4 5); here the rings lie at low and high x.
  *at = {h[0], h[3], h[3], h[7], h[1], h[2], h[2], h[6]};
  complex.cells.push_back({h[0], h[7], h[7], h[4], h[1], h[6], h[6], h[5]});
}

TEST(Validator, AcceptsGridsOfHexahedra) {
  for (const GridSize n : {GridSize{1, 1, 1}, GridSize{2, 1, 1}, GridSize{4, 3, 5}}) {
    const ValidationReport report = ValidateMesh(MeshOf(GridComplex(n)));
    EXPECT_TRUE(report.valid()) << report.Summary();
    EXPECT_DOUBLE_EQ(report.volume, n.nx * n.ny * n.nz);
    EXPECT_EQ(report.boundary_face_count, 2 * (n.nx * n.ny + n.ny * n.nz + n.nz * n.nx));
    EXPECT_EQ(report.boundary.genus, 0);
    EXPECT_EQ(report.boundary.component_count, 1);
  }
}

TEST(Validator, AcceptsShakenGrids) {
  CellComplex complex = GridComplex({6, 6, 6});
  Shake(complex, 0.12);
  const ValidationReport report = ValidateMesh(MeshOf(complex));
  EXPECT_TRUE(report.valid()) << report.Summary();
  EXPECT_LT(report.volume_mismatch, 1e-12);
}

TEST(Validator, AcceptsEveryPatternAlone) {
  for (const auto& pattern : kSinglePatterns) {
    const AtMostHexaMesh mesh = MeshOf(SingleCell(pattern.cube_corners));
    const ValidationReport report = ValidateMesh(mesh);
    EXPECT_TRUE(report.valid()) << pattern.name << ": " << report.Summary();
    EXPECT_EQ(mesh.types[0], pattern.type) << pattern.name;
  }
}

TEST(Validator, AcceptsEveryPatternWithCellsOnAllItsFaces) {
  for (const auto& pattern : kSinglePatterns) {
    const ValidationReport report = ValidateMesh(MeshOf(StellatedCell(pattern.cube_corners)));
    EXPECT_TRUE(report.valid()) << pattern.name << ": " << report.Summary();
    EXPECT_GT(report.interior_face_count, 3);
  }
}

TEST(Validator, CountsTheGenusOfARing) {
  CellComplex complex = GridComplex({3, 3, 1});
  complex.cells.erase(complex.cells.begin() + 4);
  const ValidationReport report = ValidateMesh(MeshOf(complex));
  EXPECT_TRUE(report.valid()) << report.Summary();
  EXPECT_EQ(report.boundary.genus, 1);
}

TEST(Validator, AcceptsACavityAsASecondBoundary) {
  CellComplex complex = GridComplex({3, 3, 3});
  complex.cells.erase(complex.cells.begin() + 13);
  const ValidationReport report = ValidateMesh(MeshOf(complex));
  EXPECT_TRUE(report.valid()) << report.Summary();
  EXPECT_EQ(report.boundary.component_count, 2);
  EXPECT_DOUBLE_EQ(report.volume, 26);
}

TEST(Validator, RejectsAMeshWithoutCells) { EXPECT_FALSE(ValidateMesh({}).valid()); }

TEST(Validator, RejectsIndicesOutOfRangeAndMissingArrays) {
  AtMostHexaMesh mesh = GridMesh(2, 2, 2);
  mesh.corners[3][5] = 1000;
  EXPECT_EQ(ValidateMesh(mesh).index_out_of_range_count, 1);
  EXPECT_FALSE(ValidateMesh(mesh).valid());
  mesh = GridMesh(2, 2, 2);
  mesh.types.pop_back();
  EXPECT_EQ(ValidateMesh(mesh).array_size_mismatches, 1);
  EXPECT_FALSE(ValidateMesh(mesh).valid());
}

TEST(Validator, RejectsVerticesThatAreNotFinite) {
  AtMostHexaMesh mesh = GridMesh(2, 2, 2);
  mesh.vertices[4].y = std::nan("");
  EXPECT_EQ(ValidateMesh(mesh).non_finite_vertex_count, 1);
  EXPECT_FALSE(ValidateMesh(mesh).valid());
}

TEST(Validator, RejectsAnInvertedCell) {
  AtMostHexaMesh mesh = GridMesh(3, 3, 3);
  mesh.vertices[GridVertex({3, 3, 3}, 1, 1, 1)] += Vec3d{1.5, 0, 0};
  RefreshQuality(mesh);
  const ValidationReport report = ValidateMesh(mesh);
  EXPECT_FALSE(report.valid());
  EXPECT_GT(report.non_positive_scaled_jacobian_count, 0);
  EXPECT_GE(report.first_bad_cell, 0);
}

TEST(Validator, RejectsAMapThatFoldsThoughAllCornersArePositive) {
  CellComplex complex = SingleCell(kSinglePatterns[0].cube_corners);
  complex.vertices = {{-0.02, 0.36, -0.75}, {1.26, -0.89, 0.79},  {1.27, 0.12, 0.62},
                      {0.70, 1.79, -0.71},  {-0.76, -0.80, 1.80}, {1.39, 0.79, 1.01},
                      {0.77, 0.20, 0.20},   {0.21, 1.36, 0.81}};
  const ValidationReport report = ValidateMesh(MeshOf(complex));
  EXPECT_EQ(report.non_positive_scaled_jacobian_count, 0);
  EXPECT_EQ(report.non_positive_map_jacobian_count, 1);
  EXPECT_FALSE(report.valid());
}

TEST(Validator, RejectsARemovedNeighbourWhoseFaceCountsAsOpen) {
  // Removing a cell is no fault by itself; claiming the same faces from a shifted copy is.
  CellComplex complex = GridComplex({2, 1, 1});
  const std::array<int32_t, 8> right = complex.cells[1];
  const int32_t copy = static_cast<int32_t>(complex.vertices.size());
  complex.vertices.push_back(complex.vertices[right[0]]);
  for (int32_t& v : complex.cells[1]) {
    if (v == right[0]) v = copy;
  }
  const ValidationReport report = ValidateMesh(MeshOf(complex));
  EXPECT_FALSE(report.valid()) << "one of four shared vertices was doubled";
}

TEST(Validator, RejectsADuplicatedCell) {
  AtMostHexaMesh mesh = GridMesh(2, 2, 2);
  mesh.corners.push_back(mesh.corners[5]);
  mesh.types.push_back(mesh.types[5]);
  mesh.quality.push_back(mesh.quality[5]);
  const ValidationReport report = ValidateMesh(mesh);
  EXPECT_FALSE(report.valid());
  EXPECT_EQ(report.duplicate_cell_count, 1);
}

TEST(Validator, RejectsAThirdCellOnAFace) {
  CellComplex complex = GridComplex({2, 1, 1});
  const CellCorners& left = complex.cells[0];
  const int32_t apex = static_cast<int32_t>(complex.vertices.size());
  complex.vertices.push_back({1.5, 0.5, 0.5});
  complex.cells.push_back(MakePyramid({left[1], left[5], left[6], left[2]}, apex));
  const ValidationReport report = ValidateMesh(MeshOf(complex));
  EXPECT_FALSE(report.valid());
  EXPECT_EQ(report.overused_face_count, 1);
}

TEST(Validator, RejectsAWrongType) {
  AtMostHexaMesh mesh = GridMesh(2, 2, 2);
  mesh.types[3] = PrimitiveType::kPrism;
  const ValidationReport report = ValidateMesh(mesh);
  EXPECT_FALSE(report.valid());
  EXPECT_EQ(report.wrong_type_count, 1);
  EXPECT_EQ(report.first_bad_cell, 3);
}

TEST(Validator, RejectsPatternsOutsideFigure2) {
  for (const CellCorners& corners :
       {CellCorners{0, 1, 1, 2, 3, 4, 5, 2}, CellCorners{0, 1, 2, 3, 4, 1, 5, 3},
        CellCorners{0, 0, 1, 2, 3, 4, 1, 3}, CellCorners{0, 0, 1, 1, 2, 2, 3, 3}}) {
    EXPECT_FALSE(TypeByPattern(corners).has_value());
  }
}

TEST(Validator, RejectsAQualityThatIsNotTheCells) {
  AtMostHexaMesh mesh = GridMesh(2, 2, 2);
  mesh.quality[0] = 0.5F;
  EXPECT_EQ(ValidateMesh(mesh).wrong_quality_count, 1);
  EXPECT_FALSE(ValidateMesh(mesh).valid());
}

TEST(Validator, RejectsAnUnusedVertex) {
  AtMostHexaMesh mesh = GridMesh(2, 2, 2);
  mesh.vertices.push_back({9, 9, 9});
  const ValidationReport report = ValidateMesh(mesh);
  EXPECT_FALSE(report.valid());
  EXPECT_EQ(report.unused_vertex_count, 1);
}

TEST(Validator, RejectsAQuadAgainstTwoTrianglesAtTheHull) {
  const GridSize n{2, 1, 1};
  CellComplex complex = GridComplex(n);
  SplitCellAcrossX(n, 1, 0, 0, complex);
  EXPECT_FALSE(ValidateMesh(MeshOf(complex)).valid());
}

TEST(Validator, RejectsAQuadAgainstTwoTrianglesInside) {
  // The slit is a closed manifold pocket of its own: only its flatness gives it away.
  const GridSize n{5, 3, 3};
  for (const double shake : {0.0, 0.1}) {
    CellComplex complex = GridComplex(n);
    SplitCellAcrossX(n, 2, 1, 1, complex);
    Shake(complex, shake);
    const ValidationReport report = ValidateMesh(MeshOf(complex));
    EXPECT_TRUE(report.boundary.IsClosedManifold()) << report.Summary();
    EXPECT_FALSE(report.valid()) << "shaken by " << shake;
    EXPECT_EQ(report.boundary.component_count, 3);
  }
}

TEST(Validator, AcceptsANotchBetweenTwoQuadsAndRejectsASlit) {
  for (const double width : {0.15, 0.6}) {
    const ValidationReport report = ValidateMesh(MeshOf(NotchedGrid(width)));
    EXPECT_TRUE(report.valid()) << report.Summary();
    EXPECT_EQ(report.boundary.genus, 0);
  }
  for (const double width : {0.0, 0.07}) {
    const ValidationReport report = ValidateMesh(MeshOf(NotchedGrid(width)));
    EXPECT_TRUE(report.boundary.IsClosedManifold()) << report.Summary();
    EXPECT_GT(report.boundary.hanging_face_count, 0);
    EXPECT_FALSE(report.valid());
  }
}

TEST(Validator, RejectsCellsThatTouchInAnEdgeOrAVertexOnly) {
  const GridSize n{2, 2, 2};
  CellComplex edge = GridComplex(n);
  edge.cells = {GridCell(n, 0, 0, 0), GridCell(n, 1, 1, 0)};
  EXPECT_EQ(ValidateMesh(MeshOf(edge)).boundary.non_manifold_edge_count, 1);
  EXPECT_FALSE(ValidateMesh(MeshOf(edge)).valid());
  CellComplex vertex = GridComplex(n);
  vertex.cells = {GridCell(n, 0, 0, 0), GridCell(n, 1, 1, 1)};
  EXPECT_EQ(ValidateMesh(MeshOf(vertex)).boundary.non_manifold_vertex_count, 1);
  EXPECT_FALSE(ValidateMesh(MeshOf(vertex)).valid());
}

// A bar of `count` cells bent into an arc about the z axis, radius 2 to 3.
CellComplex BentBar(int count, double turn) {
  CellComplex complex = GridComplex({count, 1, 1});
  for (Vec3d& p : complex.vertices) {
    const double angle = turn * p.x / count;
    const double radius = 3 - p.y;
    p = {radius * std::cos(angle), radius * std::sin(angle), p.z};
  }
  return complex;
}

TEST(Validator, RejectsAMeshOfPositiveCellsThatOverlapsItself) {
  const double full = 2 * std::numbers::pi;
  const ValidationReport three_quarters = ValidateMesh(MeshOf(BentBar(24, 0.75 * full)));
  EXPECT_TRUE(three_quarters.valid()) << three_quarters.Summary();
  const ValidationReport overlapped = ValidateMesh(MeshOf(BentBar(40, 1.27 * full)));
  EXPECT_FALSE(overlapped.valid());
  EXPECT_GT(overlapped.min_scaled_jacobian, 0.5);
  EXPECT_TRUE(overlapped.boundary.IsClosedManifold());
  EXPECT_GT(overlapped.overlap.overlapped_cells, 0);
}

TEST(Validator, RejectsTwoSolidsInOnePlace) {
  CellComplex complex = GridComplex({2, 2, 2});
  const CellComplex other = GridComplex({1, 1, 1});
  const int32_t shift = static_cast<int32_t>(complex.vertices.size());
  for (const Vec3d& p : other.vertices) complex.vertices.push_back(p + Vec3d{1.6, 0.3, 0.4});
  CellCorners corners = other.cells[0];
  for (int32_t& v : corners) v += shift;
  complex.cells.push_back(corners);
  EXPECT_FALSE(ValidateMesh(MeshOf(complex)).valid());
}

std::vector<std::vector<int32_t>> SortedFaces(const CellCorners& corners) {
  std::vector<std::vector<int32_t>> faces;
  for (const CellFace& face : FacesOf(corners)) {
    std::vector<int32_t> ring(face.v.begin(), face.v.begin() + face.count);
    std::rotate(ring.begin(), std::min_element(ring.begin(), ring.end()), ring.end());
    faces.push_back(ring);
  }
  std::sort(faces.begin(), faces.end());
  return faces;
}

TEST(Validator, RejectsASolidWhoseEdgeOnlyDipsIntoAnother) {
  // No face centre and no cell centre lies inside the other solid.
  CellComplex complex = GridComplex({2, 2, 2});
  const CellComplex other = GridComplex({1, 1, 1});
  for (const double dip : {-0.1, 0.1}) {
    CellComplex both = complex;
    const int32_t shift = static_cast<int32_t>(both.vertices.size());
    for (const Vec3d& p : other.vertices) {
      both.vertices.push_back({2 - dip + (p.x + p.y) / 2, 1 + (p.y - p.x) / 2, p.z + 0.5});
    }
    CellCorners corners = other.cells[0];
    for (int32_t& v : corners) v += shift;
    both.cells.push_back(corners);
    const ValidationReport report = ValidateMesh(MeshOf(both));
    EXPECT_EQ(report.valid(), dip < 0) << report.Summary();
    EXPECT_EQ(report.overlap.overlapped_edges > 0, dip > 0);
  }
}

TEST(Validator, KnowsEveryCollapsedCubeThatConstructionRecognises) {
  int recognised = 0;
  for (int mask = 0; mask < 1 << 12; ++mask) {
    CellCorners corners = {0, 1, 2, 3, 4, 5, 6, 7};
    for (int e = 0; e < 12; ++e) {
      if (!(mask >> e & 1)) continue;
      const int32_t from = corners[kCubeEdges[e][0]], to = corners[kCubeEdges[e][1]];
      std::replace(corners.begin(), corners.end(), from, to);
    }
    const std::optional<PrimitiveType> type = RecognizeCell(corners);
    if (TypeByPattern(corners).has_value()) {
      EXPECT_EQ(TypeByPattern(corners), type);
    }
    if (!type.has_value()) continue;
    // Collapses that Figure 2 does not list are the same cells in another order of corners.
    const CellCorners listed = CanonicalCorners(corners);
    EXPECT_EQ(TypeByPattern(listed), type) << "mask " << mask;
    EXPECT_EQ(SortedFaces(listed), SortedFaces(corners)) << "mask " << mask;
    ++recognised;
  }
  EXPECT_GT(recognised, 100);
}

TEST(CellMeasures, AgreeWithTheConstructionsOwn) {
  for (const auto& pattern : kSinglePatterns) {
    CellComplex complex = SingleCell(pattern.cube_corners);
    Shake(complex, 0.1);
    const CellMeasures measures = MeasureCell(complex.cells[0], complex.vertices);
    EXPECT_NEAR(measures.volume, CellVolume(complex.cells[0], complex.vertices), 1e-12);
    EXPECT_NEAR(measures.min_scaled_jacobian, ScaledJacobian(complex.cells[0], complex.vertices),
                1e-12);
    EXPECT_GT(measures.min_map_jacobian, 0) << pattern.name;
  }
}

}  // namespace
}  // namespace amhex
