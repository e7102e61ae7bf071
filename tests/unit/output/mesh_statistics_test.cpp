#include "output/mesh_statistics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "fixtures/solids.h"
#include "output/finalize_mesh.h"
#include "support/grid_complex.h"
#include "support/hull_of_mesh.h"

namespace amhex {
namespace {

using testing_support::GridComplex;
using testing_support::GridVertex;
using testing_support::HullOfMesh;
using testing_support::kSinglePatterns;
using testing_support::MeshOf;
using testing_support::Shake;
using testing_support::SingleCell;

TEST(MeshStatistics, OfAGridInItsOwnBoxArePerfect) {
  const Hull hull = HullOfMesh(fixtures::MakeBox({4, 3, 2}, 0.7));
  const MeshStatistics statistics = MeasureMesh(MeshOf(GridComplex({4, 3, 2})), hull);
  EXPECT_EQ(statistics.cell_count, 24);
  EXPECT_EQ(statistics.vertex_count, 60);
  EXPECT_EQ(statistics.boundary_face_count, 52);
  EXPECT_EQ(statistics.cells_by_type[8], 24);
  EXPECT_DOUBLE_EQ(statistics.hexahedra_ratio, 1);
  EXPECT_DOUBLE_EQ(statistics.hexahedra_volume_ratio, 1);
  EXPECT_DOUBLE_EQ(statistics.min_scaled_jacobian, 1);
  EXPECT_DOUBLE_EQ(statistics.average_scaled_jacobian, 1);
  EXPECT_DOUBLE_EQ(statistics.volume, 24);
  EXPECT_NEAR(statistics.hull_volume, 24, 1e-9);
  EXPECT_NEAR(statistics.mesh_to_input_max, 0, 1e-12);
  EXPECT_NEAR(statistics.input_to_mesh_max, 0, 1e-12);
  EXPECT_DOUBLE_EQ(statistics.shortest_edge, 1);
  EXPECT_EQ(statistics.genus, 0);
  EXPECT_EQ(statistics.boundary_component_count, 1);
  EXPECT_FALSE(statistics.distance_exceeds_cell);
}

TEST(MeshStatistics, MeasureBothDistancesAsFractionsOfTheDiagonal) {
  // The mesh ends 0.5 below the roof of a box with diagonal 13.
  const Hull hull = HullOfMesh(fixtures::MakeBox({3, 4, 12.5}, 1));
  const double diagonal = hull.box.Diagonal();
  const MeshStatistics low = MeasureMesh(MeshOf(GridComplex({3, 4, 12})), hull);
  EXPECT_NEAR(low.input_to_mesh_max, 0.5 / diagonal, 1e-9);
  EXPECT_NEAR(low.mesh_to_input_max, 0.5 / diagonal, 1e-9);
  EXPECT_FALSE(low.distance_exceeds_cell);
  const MeshStatistics lower = MeasureMesh(MeshOf(GridComplex({3, 4, 11})), hull);
  EXPECT_TRUE(lower.distance_exceeds_cell);
}

TEST(MeshStatistics, OfTheBoundaryAloneTellTheSameFaults) {
  const Hull hull = HullOfMesh(fixtures::MakeBox({3, 4, 12.5}, 1));
  const AtMostHexaMesh mesh = MeshOf(GridComplex({3, 4, 12}));
  const MeshStatistics all = MeasureMesh(mesh, hull);
  const BoundaryMeasures exact = MeasureBoundary(mesh, hull, 0.0);
  EXPECT_NEAR(exact.farthest, 0.5, 1e-9);
  EXPECT_EQ(exact.genus, all.genus);
  EXPECT_EQ(exact.component_count, all.boundary_component_count);
  EXPECT_EQ(MeasureBoundary(mesh, hull, 0.4).farthest, exact.farthest);
  EXPECT_LE(MeasureBoundary(mesh, hull, 0.6).farthest, 0.6);
  EXPECT_EQ(MeasureBoundary({}, hull, 0.1).farthest, 0);
}

TEST(MeshStatistics, TellTheShortestEdgeOfAnyCellAndNoneThatIsCollapsed) {
  const Hull hull = HullOfMesh(fixtures::MakeBox({4, 3, 2}, 0.7));
  CellComplex complex = GridComplex({4, 3, 2});
  complex.vertices[GridVertex({4, 3, 2}, 2, 1, 1)].x -= 0.75;
  EXPECT_DOUBLE_EQ(MeasureMesh(MeshOf(complex), hull).shortest_edge, 0.25);
  for (const auto& pattern : kSinglePatterns) {
    const AtMostHexaMesh single = MeshOf(SingleCell(pattern.cube_corners));
    EXPECT_GE(MeasureMesh(single, hull).shortest_edge, 1) << pattern.name;
  }
}

TEST(MeshStatistics, SayHowFarTheBoundaryLeavesSharpEdges) {
  const MeshStatistics exact =
      MeasureMesh(MeshOf(GridComplex({4, 3, 2})), HullOfMesh(fixtures::MakeBox({4, 3, 2}, 1)));
  EXPECT_NEAR(exact.sharp_edge_deviation_rms, 0, 1e-12);
  EXPECT_NEAR(exact.sharp_edge_deviation_max, 0, 1e-12);
  // A box with the same corner at the origin and 0.2 longer each way: of its edges a quarter lies
  // on the mesh's, half 0.2 away and a quarter 0.2 * sqrt 2, its far corner 0.2 * sqrt 3.
  const Hull larger = HullOfMesh(fixtures::MakeBox({4.2, 3.2, 2.2}, 1));
  const MeshStatistics near = MeasureMesh(MeshOf(GridComplex({4, 3, 2})), larger);
  EXPECT_NEAR(near.sharp_edge_deviation_rms, 0.2, 0.002);
  EXPECT_LT(near.sharp_edge_deviation_max, 0.2 * std::sqrt(3.0) + 1e-9);
}

TEST(MeshStatistics, DoNotCountSharpEdgesThatAreNoise) {
  // All twelve edges of the box together are shorter than what is followed.
  const Hull tiny = HullOfMesh(fixtures::MakeBox({0.2, 0.2, 0.2}, 1));
  const MeshStatistics statistics = MeasureMesh(MeshOf(GridComplex({1, 1, 1})), tiny);
  EXPECT_EQ(statistics.sharp_edge_deviation_rms, 0);
  EXPECT_GT(statistics.mesh_to_input_max, 0);
}

TEST(MeshStatistics, DoNotChangeWithTheUsersUnits) {
  Hull hull = HullOfMesh(fixtures::MakeBox({4, 3, 2}, 0.7));
  CellComplex complex = GridComplex({4, 3, 2});
  Shake(complex, 0.1);
  const MeshStatistics plain = MeasureMesh(FinalizeMesh(complex, hull.frame), hull);
  hull.frame = {{100, -20, 3}, 0.25};
  const MeshStatistics scaled = MeasureMesh(FinalizeMesh(complex, hull.frame), hull);
  EXPECT_NEAR(scaled.volume, plain.volume / 64, 1e-9);
  EXPECT_NEAR(scaled.hull_volume, plain.hull_volume / 64, 1e-9);
  EXPECT_NEAR(scaled.input_to_mesh_max, plain.input_to_mesh_max, 1e-9);
  EXPECT_NEAR(scaled.mesh_to_input_max, plain.mesh_to_input_max, 1e-9);
  EXPECT_GT(plain.input_to_mesh_max, 0);
}

TEST(MeshStatistics, CountEveryTypeWithItsVolume) {
  for (const auto& pattern : kSinglePatterns) {
    const Hull hull = HullOfMesh(fixtures::MakeBox({1, 1, 1}, 1));
    const MeshStatistics statistics = MeasureMesh(MeshOf(SingleCell(pattern.cube_corners)), hull);
    EXPECT_EQ(statistics.cells_by_type[static_cast<size_t>(pattern.type)], 1) << pattern.name;
    const bool is_hexahedron = pattern.type == PrimitiveType::kHexahedron;
    EXPECT_EQ(statistics.hexahedra_ratio, is_hexahedron ? 1 : 0);
    EXPECT_GT(statistics.min_scaled_jacobian, 0.3);
  }
}

TEST(FinalizedMesh, DoesNotDependOnTheOrderOrTheTurningOfCells) {
  CellComplex complex = GridComplex({3, 2, 2});
  const AtMostHexaMesh mesh = MeshOf(complex);
  std::reverse(complex.cells.begin(), complex.cells.end());
  for (CellCorners& c : complex.cells) c = {c[3], c[0], c[1], c[2], c[7], c[4], c[5], c[6]};
  const AtMostHexaMesh again = MeshOf(complex);
  EXPECT_EQ(mesh.corners, again.corners);
  EXPECT_EQ(mesh.types, again.types);
  EXPECT_EQ(mesh.quality, again.quality);
}

TEST(FinalizedMesh, HasHexahedraFirstAndNoUnusedVertices) {
  CellComplex complex = testing_support::StellatedCell(kSinglePatterns[1].cube_corners);
  complex.vertices.insert(complex.vertices.begin(), Vec3d{7, 7, 7});
  for (CellCorners& corners : complex.cells) {
    for (int32_t& v : corners) ++v;
  }
  const AtMostHexaMesh mesh = MeshOf(complex);
  EXPECT_EQ(mesh.vertices.size() + 2, complex.vertices.size())
      << "the added vertex and the cube corner that the hexprism lacks";
  EXPECT_TRUE(std::is_sorted(mesh.types.rbegin(), mesh.types.rend()));
}

}  // namespace
}  // namespace amhex
