// Laws of vertex placement on perturbed grids in the hulls they should fill.
#include "optimize/place_vertices.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>

#include "fixtures/solids.h"
#include "optimize/cell_quality.h"
#include "optimize/hull_features.h"
#include "optimize/placement.h"
#include "optimize/project_to_hull.h"
#include "optimize/raise_quality.h"
#include "output/mesh_statistics.h"
#include "output/validate.h"
#include "support/grid_complex.h"
#include "support/grid_hull.h"
#include "support/hull_of_mesh.h"

namespace amhex {
namespace {

using testing_support::GridComplex;
using testing_support::GridHull;
using testing_support::GridSize;
using testing_support::HullOfMesh;
using testing_support::MeshOf;
using testing_support::Shake;

CellComplex Shaken(const GridSize& n, double by) {
  CellComplex complex = GridComplex(n);
  Shake(complex, by);
  return complex;
}

CellComplex Placed(const CellComplex& complex, const Hull& hull) {
  RunContext run;
  absl::StatusOr<CellComplex> placed = PlaceVertices(complex, HullFeatures(hull), run);
  EXPECT_TRUE(placed.ok()) << placed.status().ToString();
  return *placed;
}

TEST(PlaceVertices, MakesAShakenGridFillItsBoxExactly) {
  const GridSize n{5, 4, 6};
  CellComplex complex = Shaken(n, 0.2);
  const Hull hull = GridHull(n, 0.5);
  const AtMostHexaMesh mesh = MeshOf(Placed(complex, hull));
  const ValidationReport report = ValidateMesh(mesh);
  EXPECT_TRUE(report.valid()) << report.Summary();
  const MeshStatistics statistics = MeasureMesh(mesh, hull);
  EXPECT_NEAR(statistics.mesh_to_input_max, 0, 1e-9);
  EXPECT_NEAR(statistics.input_to_mesh_max, 0, 1e-9) << "corners and edges are covered too";
  EXPECT_GT(statistics.min_scaled_jacobian, 0.9);
  EXPECT_GT(statistics.average_scaled_jacobian, 0.97);
}

TEST(PlaceVertices, LeavesAPerfectGridAsItIs) {
  const GridSize n{4, 3, 2};
  const CellComplex complex = GridComplex(n);
  const CellComplex placed = Placed(complex, GridHull(n, 0.5));
  for (size_t v = 0; v < complex.vertices.size(); ++v) {
    EXPECT_NEAR(Norm(placed.vertices[v] - complex.vertices[v]), 0, 1e-9);
  }
  EXPECT_EQ(placed.cells, complex.cells);
}

TEST(PlaceVertices, GivesTheSameBitsAtAnyThreadCount) {
  const GridSize n{9, 9, 9};
  CellComplex complex = Shaken(n, 0.25);
  const Hull hull = GridHull(n, 0.5);
  std::vector<CellComplex> results;
  for (const size_t threads : {1, 2, 7}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    results.push_back(Placed(complex, hull));
  }
  EXPECT_EQ(results[0].vertices, results[1].vertices);
  EXPECT_EQ(results[0].vertices, results[2].vertices);
}

TEST(PlaceVertices, PutsACubeOfHexahedraOntoASphere) {
  // A grid blown up towards a ball: its edges and corners must come to lie on a smooth surface.
  const GridSize n{6, 6, 6};
  CellComplex complex = GridComplex(n);
  for (Vec3d& p : complex.vertices) {
    const Vec3d q = (p - Vec3d{3, 3, 3}) / 3.0;
    p = {3.2 * q.x * std::sqrt(1 - q.y * q.y / 2 - q.z * q.z / 2 + q.y * q.y * q.z * q.z / 3),
         3.2 * q.y * std::sqrt(1 - q.z * q.z / 2 - q.x * q.x / 2 + q.z * q.z * q.x * q.x / 3),
         3.2 * q.z * std::sqrt(1 - q.x * q.x / 2 - q.y * q.y / 2 + q.x * q.x * q.y * q.y / 3)};
  }
  const Hull hull = HullOfMesh(fixtures::MakeSphere(3.5, 0.3));
  const AtMostHexaMesh mesh = MeshOf(Placed(complex, hull));
  const ValidationReport report = ValidateMesh(mesh);
  EXPECT_TRUE(report.valid()) << report.Summary();
  const MeshStatistics statistics = MeasureMesh(mesh, hull);
  // A quad's centre sags by 0.07 where the quads are square with an edge of 1 on the radius of 3.5;
  // at the grid's eight corners, where three quads meet flatly, their long diagonals sag most.
  EXPECT_LT(statistics.mesh_to_input_max * hull.box.Diagonal(), 0.2);
  EXPECT_GT(statistics.min_scaled_jacobian, 0.3);
}

TEST(PlaceVertices, RaisingLowersNeitherMinimumNorAverageAndDrawsNothingToTheHull) {
  // A grid inside a larger box: placing would stretch it to the walls.
  const GridSize n{5, 5, 5};
  CellComplex complex = Shaken(n, 0.25);
  for (Vec3d& p : complex.vertices) p = p + Vec3d{0.5, 0.5, 0.5};
  const Hull hull = GridHull({6, 6, 6}, 0.5);
  const QualitySummary before = SummarizeQuality(complex);
  RunContext run;
  const HullFeatures features(hull);
  const auto raised = PlaceVertices(complex, features, run, PlacementEffort::kRaise);
  ASSERT_TRUE(raised.ok());
  const QualitySummary after = SummarizeQuality(*raised);
  EXPECT_GE(after.minimum, before.minimum - 1e-12);
  EXPECT_GT(after.average, before.average + 0.1);
  double nearest = 1;
  for (const Vec3d& p : raised->vertices) {
    for (const double coordinate : {p.x, p.y, p.z}) nearest = std::min(nearest, coordinate);
  }
  EXPECT_GT(nearest, 0.1);
  const CellComplex placed = Placed(complex, hull);
  for (const Vec3d& p : placed.vertices) nearest = std::min({nearest, p.x, p.y, p.z});
  EXPECT_LT(nearest, 1e-6);
}

TEST(PlacePart, RaisesPoorCellsUntilTheyAreBearable) {
  const GridSize n{6, 6, 6};
  CellComplex complex = Shaken(n, 0.3);
  const Hull hull = GridHull(n, 0.5);
  const HullFeatures features(hull);
  const RunContext run;
  ASSERT_LT(SummarizeQuality(complex).minimum, kBearable - 0.1);
  const auto bearable = PlacePart(complex, {}, features, run, PlacementEffort::kBearable);
  const auto raised = PlacePart(complex, {}, features, run, PlacementEffort::kRaise);
  ASSERT_TRUE(bearable.ok() && raised.ok());
  EXPECT_GE(SummarizeQuality(*bearable).minimum, kBearable);
  EXPECT_LT(SummarizeQuality(*bearable).average, SummarizeQuality(*raised).average);
}

TEST(PlacePart, LeavesNoCellPoorerWhereOneCannotBeMadeBearable) {
  const GridSize n{5, 5, 5};
  CellComplex complex = Shaken(n, 0.25);
  // One cell is flat and cannot change.
  std::vector<uint8_t> fixed(complex.vertices.size(), 0);
  for (const int32_t v : complex.cells[62]) fixed[v] = 1;
  for (int slot = 4; slot < 8; ++slot) {
    const Vec3d& below = complex.vertices[complex.cells[62][slot - 4]];
    Vec3d& above = complex.vertices[complex.cells[62][slot]];
    above = below + (above - below) * 0.2;
  }
  complex.vertices[complex.cells[62][4]] += Vec3d{0.5, 0.5, 0};
  const Hull hull = GridHull(n, 0.5);
  const double before = SummarizeQuality(complex).min_scaled_jacobian;
  const RunContext run;
  const auto placed =
      PlacePart(complex, fixed, HullFeatures(hull), run, PlacementEffort::kBearable);
  ASSERT_TRUE(placed.ok());
  EXPECT_GE(SummarizeQuality(*placed).min_scaled_jacobian, before);
  for (const int32_t v : complex.cells[62]) {
    EXPECT_EQ(placed->vertices[v], complex.vertices[v]);
  }
}

TEST(PlacePart, MovesOnlyTheVerticesThatAreNotFixed) {
  const GridSize n{6, 5, 5};
  CellComplex complex = Shaken(n, 0.25);
  const Hull hull = GridHull(n, 0.5);
  std::vector<uint8_t> fixed;
  for (const Vec3d& p : complex.vertices) fixed.push_back(p.x < 2.5 ? 1 : 0);
  const RunContext run;
  const auto placed = PlacePart(complex, fixed, HullFeatures(hull), run, PlacementEffort::kBest);
  ASSERT_TRUE(placed.ok());
  int moved = 0;
  for (size_t v = 0; v < fixed.size(); ++v) {
    if (fixed[v]) {
      EXPECT_EQ(placed->vertices[v], complex.vertices[v]);
    } else {
      moved += Norm(placed->vertices[v] - complex.vertices[v]) > 0.01 ? 1 : 0;
    }
  }
  EXPECT_GT(moved, 50);
  EXPECT_GT(SummarizeQuality(*placed).average, SummarizeQuality(complex).average + 0.05);
}

TEST(PlaceVertices, StopsWhenAsked) {
  const GridSize n{4, 4, 4};
  RunContext run;
  run.RequestStop();
  const Hull hull = GridHull(n, 0.5);
  const auto placed = PlaceVertices(GridComplex(n), HullFeatures(hull), run);
  EXPECT_EQ(placed.status().code(), absl::StatusCode::kCancelled);
}

TEST(PlaceVertices, RefusesCellsOutsideFigure2) {
  const GridSize n{2, 2, 2};
  CellComplex complex = GridComplex(n);
  complex.cells[3][0] = complex.cells[3][6];
  RunContext run;
  const Hull hull = GridHull(n, 0.5);
  const auto placed = PlaceVertices(complex, HullFeatures(hull), run);
  EXPECT_EQ(placed.status().code(), absl::StatusCode::kInternal);
}

TEST(ProjectToHull, NeverMakesACellInvalid) {
  // A hull much smaller than the grid: most vertices cannot get there.
  CellComplex complex = GridComplex({4, 4, 4});
  Shake(complex, 0.2);
  const Hull hull = HullOfMesh(fixtures::MakeBox({2, 2, 2}, 0.5));
  const HullFeatures features(hull);
  Placement placement = PreparePlacement(complex, features);
  const RunContext run;
  SweepMemory memory = StartSweeps(static_cast<int64_t>(complex.vertices.size()));
  for (int round = 0; round < 4; ++round) {
    ASSERT_TRUE(ProjectToHull(placement, AllVertices(placement), 0.1, memory, run).ok());
    EXPECT_GE(SummarizeQuality(complex).minimum, 0.1);
  }
  EXPECT_GT(LargestOffset(placement, AllVertices(placement)), 0.1);
}

TEST(Placement, KeepsItsSurveyOfTheCellsUpToDate) {
  const GridSize n{5, 4, 4};
  CellComplex complex = Shaken(n, 0.3);
  const Hull hull = GridHull(n, 0.5);
  const HullFeatures features(hull);
  Placement placement = PreparePlacement(complex, features);
  const RunContext run;
  SweepMemory memory = StartSweeps(static_cast<int64_t>(complex.vertices.size()));
  for (int round = 0; round < 3; ++round) {
    ASSERT_TRUE(ProjectToHull(placement, AllVertices(placement), 0.1, memory, run).ok());
    ASSERT_TRUE(SweepQuality(placement, {QualityAim::kMinimum, 0.9, 0.5}, memory, run).ok());
    const CellSurvey anew = PreparePlacement(complex, features).survey;
    EXPECT_EQ(placement.survey.min_scaled_jacobian, anew.min_scaled_jacobian);
    EXPECT_EQ(placement.survey.near_folding, anew.near_folding);
  }
}

TEST(SweepQuality, NeverLowersTheMinimum) {
  const GridSize n{6, 5, 4};
  CellComplex complex = Shaken(n, 0.3);
  const Hull hull = GridHull(n, 0.5);
  const HullFeatures features(hull);
  Placement placement = PreparePlacement(complex, features);
  const RunContext run;
  for (const QualityAim aim : {QualityAim::kMinimum, QualityAim::kAverage}) {
    SweepMemory memory = StartSweeps(static_cast<int64_t>(complex.vertices.size()));
    QualitySummary before = SummarizeQuality(complex);
    for (int sweep = 0; sweep < 6; ++sweep) {
      const CornerPenalty penalty = aim == QualityAim::kAverage
                                        ? CornerPenalty{.kind = EnergyKind::kMinima}
                                        : CornerPenalty{};
      ASSERT_TRUE(SweepQuality(placement, {aim, 1.1, 1.0, penalty}, memory, run).ok());
      const QualitySummary after = SummarizeQuality(complex);
      EXPECT_GE(after.minimum, before.minimum - 1e-12);
      if (aim == QualityAim::kAverage) {
        EXPECT_GE(after.average, before.average - 1e-12);
      }
      before = after;
    }
  }
  EXPECT_GT(SummarizeQuality(complex).minimum, 0.5);
}

TEST(SweepQuality, KeepsCornersInPlaceAndVerticesOnTheirEdgesAndFaces) {
  const GridSize n{4, 4, 4};
  CellComplex complex = Shaken(n, 0.25);
  const Hull hull = GridHull(n, 0.5);
  const HullFeatures features(hull);
  Placement placement = PreparePlacement(complex, features);
  const RunContext run;
  SweepMemory memory = StartSweeps(static_cast<int64_t>(complex.vertices.size()));
  for (int round = 0; round < 3; ++round) {
    ASSERT_TRUE(ProjectToHull(placement, AllVertices(placement), 0.1, memory, run).ok());
  }
  ASSERT_LT(LargestOffset(placement, AllVertices(placement)), 1e-9);
  const std::vector<Vec3d> start = complex.vertices;
  for (int sweep = 0; sweep < 5; ++sweep) {
    ASSERT_TRUE(SweepQuality(placement,
                             {QualityAim::kAverage, 1.1, 0.5, {.kind = EnergyKind::kMinima}},
                             memory, run)
                    .ok());
  }
  int moved = 0;
  for (size_t v = 0; v < start.size(); ++v) {
    const Vec3d move = complex.vertices[v] - start[v];
    moved += Norm(move) > 1e-3;
    for (int axis = 0; axis < 3; ++axis) {
      const double side = std::round(start[v][axis]);
      const bool on_side = std::abs(start[v][axis]) < 1e-9 || std::abs(start[v][axis] - 4) < 1e-9;
      if (on_side) {
        EXPECT_NEAR(complex.vertices[v][axis], side, 1e-9);
      }
    }
  }
  EXPECT_GT(moved, 50);
}

TEST(Constraints, GiveEveryCornerOneVertexAndEveryEdgeAChain) {
  const GridSize n{5, 4, 3};
  CellComplex complex = Shaken(n, 0.2);
  const Hull hull = GridHull(n, 0.5);
  const HullFeatures features(hull);
  ASSERT_EQ(features.corners().size(), 8u);
  ASSERT_EQ(features.patch_count(), 6);
  const Placement placement = PreparePlacement(complex, features);
  int corners = 0, creases = 0, patches = 0;
  for (const VertexConstraint& constraint : placement.constraints.vertex) {
    corners += constraint.kind == Constraint::kCorner;
    creases += constraint.kind == Constraint::kCrease;
    patches += constraint.kind == Constraint::kPatch;
  }
  EXPECT_EQ(corners, 8);
  EXPECT_EQ(creases, 4 * (4 + 3 + 2));
  EXPECT_EQ(patches, 2 * (4 * 3 + 3 * 2 + 4 * 2));
}

TEST(HullFeatures, DropShortSharpChainsAndJoinTheirPatches) {
  // A box with sides of 0.2 edge lengths: its sharp edges are 2.4 long together.
  const Hull speck = HullOfMesh(fixtures::MakeBox({0.2, 0.2, 0.2}, 0.1));
  const HullFeatures features(speck);
  EXPECT_EQ(features.patch_count(), 1);
  EXPECT_TRUE(features.corners().empty());
}

TEST(VertexNeighbourhoods, ColourNoTwoVerticesOfACellAlike) {
  const CellComplex complex = GridComplex({4, 5, 3});
  const VertexNeighbourhoods neighbourhoods = FindNeighbourhoods(complex);
  std::vector<int> colour_of(complex.vertices.size(), -1);
  size_t coloured = 0;
  for (size_t k = 0; k < neighbourhoods.colours.size(); ++k) {
    for (const int32_t v : neighbourhoods.colours[k]) colour_of[v] = static_cast<int>(k);
    coloured += neighbourhoods.colours[k].size();
  }
  EXPECT_EQ(coloured, complex.vertices.size());
  for (const CellCorners& corners : complex.cells) {
    for (int i = 0; i < 8; ++i) {
      for (int j = 0; j < i; ++j) EXPECT_NE(colour_of[corners[i]], colour_of[corners[j]]);
    }
  }
}

}  // namespace
}  // namespace amhex
