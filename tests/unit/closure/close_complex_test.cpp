#include "closure/close_complex.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "closure/boundary_defects.h"
#include "closure/cavities.h"
#include "closure/extrude_layer.h"
#include "closure/improve_closure.h"
#include "closure/star_geometry.h"
#include "closure/working_mesh.h"
#include "fixtures/solids.h"
#include "optimize/cell_quality.h"
#include "optimize/hull_features.h"
#include "optimize/place_vertices.h"
#include "support/grid_complex.h"
#include "support/grid_hull.h"
#include "support/hull_of_mesh.h"

namespace amhex {
namespace {

using testing_support::GridComplex;
using testing_support::GridHull;
using testing_support::GridSize;

// The box [0, n] as a hull in the grid's own units.
double Volume(const CellComplex& complex) {
  double volume = 0;
  for (const CellCorners& cell : complex.cells) volume += CellVolume(cell, complex.vertices);
  return volume;
}

// Removes cells at random; their neighbours' faces open, their hull faces vanish.
CellComplex WithHoles(const CellComplex& complex, double share, unsigned seed) {
  WorkingMesh mesh(complex);
  std::minstd_rand random(seed);
  for (int cell = 0; cell < mesh.cell_slots(); ++cell) {
    if (random() < share * double(std::minstd_rand::max())) mesh.RemoveCell(cell);
  }
  return mesh.ToComplex();
}

void ExpectClosedAndPositive(const CellComplex& complex) {
  const WorkingMesh mesh(complex);
  EXPECT_TRUE(mesh.OpenFaces().empty());
  for (const CellCorners& cell : complex.cells) {
    EXPECT_GT(CellVolume(cell, complex.vertices), 0);
    EXPECT_GT(ScaledJacobian(cell, complex.vertices), 0);
  }
}

TEST(HasEdge, IsTrueOfTheListedEdgesAndNoOthers) {
  const CellCorners hexahedron = {7, 3, 9, 1, 4, 0, 8, 2};
  const CellCorners prism = {7, 3, 9, 9, 4, 0, 8, 8};
  const CellCorners pyramid = {7, 3, 9, 1, 4, 4, 4, 4};
  for (const CellCorners& corners : {hexahedron, prism, pyramid}) {
    const CellEdges edges = EdgesOf(corners);
    ASSERT_GE(edges.count, 8);
    for (int32_t a = 0; a < 11; ++a) {
      for (int32_t b = 0; b < a; ++b) {
        const bool is_listed =
            std::find(edges.begin(), edges.end(), std::array<int32_t, 2>{b, a}) != edges.end();
        EXPECT_EQ(HasEdge(corners, a, b), is_listed) << a << " " << b;
        EXPECT_EQ(HasEdge(corners, b, a), is_listed) << a << " " << b;
      }
    }
  }
}

TEST(WorkingMesh, RefusesASecondCellOnTheSameSideOfAFace) {
  WorkingMesh mesh(GridComplex({1, 1, 1}));
  EXPECT_EQ(mesh.AddCell(mesh.corners(0)), -1);
}

TEST(WorkingMesh, RemovingACellOpensItsNeighboursAndTakesItsHullFaces) {
  WorkingMesh mesh(GridComplex({2, 1, 1}));
  EXPECT_TRUE(mesh.OpenFaces().empty());
  mesh.RemoveCell(0);
  EXPECT_EQ(mesh.OpenFaces().size(), 1u);
  EXPECT_EQ(mesh.ToComplex().hull_faces.size(), 5u);
}

TEST(WorkingMesh, OpenFacesAreThoseWithNothingBehindAfterAnyChanges) {
  WorkingMesh mesh(GridComplex({5, 5, 5}));
  std::minstd_rand random(7);
  for (int change = 0; change < 200; ++change) {
    const int cell = static_cast<int>(random() % mesh.cell_slots());
    const CellFaces faces = FacesOf(mesh.corners(cell));
    if (!mesh.alive(cell)) {
      mesh.AddCell(mesh.corners(cell));
    } else if (random() % 3 == 0) {
      mesh.RemoveCell(cell);
    } else if (random() % 2 == 0) {
      mesh.MarkHull(faces.face[random() % 6]);
    } else {
      mesh.UnmarkHull(faces.face[random() % 6]);
    }
    std::vector<std::array<int32_t, 4>> expected, found;
    for (int c = 0; c < mesh.cell_slots(); ++c) {
      if (!mesh.alive(c)) continue;
      for (const CellFace& face : FacesOf(mesh.corners(c))) {
        if (mesh.Across(face) == WorkingMesh::kOpen) expected.push_back(face.v);
      }
    }
    for (const CellFace& face : mesh.OpenFaces()) found.push_back(face.v);
    EXPECT_EQ(found, expected);
    EXPECT_EQ(mesh.HasOpenFaces(), !expected.empty());
  }
}

TEST(Star, ApexSearchNeverLowersTheLeastQualityAndReturnsIt) {
  const CellComplex grid = GridComplex({4, 4, 4});
  for (unsigned seed = 1; seed <= 40; ++seed) {
    CellComplex complex = WithHoles(grid, 0.1, seed);
    testing_support::Shake(complex, 0.2);
    const WorkingMesh mesh(complex);
    for (const auto& faces : CollectCavities(mesh).faces) {
      Vec3d apex = FaceCentroid(faces.front(), mesh.vertices()) +
                   FaceUnitNormal(faces.front(), mesh.vertices()) * 0.3;
      const double before = MinStarQuality(faces, apex, mesh.vertices());
      const double quality = ImproveApex(faces, mesh.vertices(), 0.25, &apex);
      EXPECT_GE(quality, before);
      // Stars that have no hope are not judged to the end.
      if (quality > -0.9) {
        EXPECT_EQ(quality, MinStarQuality(faces, apex, mesh.vertices()));
      }
    }
  }
}

TEST(Cavities, EachHoleOfAGridIsOneCavity) {
  WorkingMesh mesh(GridComplex({5, 5, 5}));
  mesh.RemoveCell(31);  // (1, 1, 1)
  mesh.RemoveCell(93);  // (3, 3, 3)
  const Cavities cavities = CollectCavities(mesh);
  ASSERT_EQ(cavities.count(), 2);
  EXPECT_EQ(cavities.faces[0].size(), 6u);
  EXPECT_TRUE(BoundaryLoops(cavities.faces[0]).empty());
}

TEST(BoundaryLoops, AHoleAtTheHullHasOneLoop) {
  WorkingMesh mesh(GridComplex({3, 3, 3}));
  mesh.RemoveCell(4);  // the middle of the bottom
  const Cavities cavities = CollectCavities(mesh);
  ASSERT_EQ(cavities.count(), 1);
  const auto loops = BoundaryLoops(cavities.faces[0]);
  ASSERT_EQ(loops.size(), 1u);
  EXPECT_EQ(loops[0].size(), 4u);
}

// A loop runs against the faces that it closes, from its first vertex, which is its least.
std::vector<int32_t> LoopOf(const CellFace& face) {
  std::vector<int32_t> loop(face.v.begin(), face.v.begin() + face.count);
  std::reverse(loop.begin(), loop.end());
  std::rotate(loop.begin(), std::min_element(loop.begin(), loop.end()), loop.end());
  return loop;
}

TEST(BoundaryLoops, FacesThatMeetAtAVertexHaveALoopEach) {
  const CellFace quad{4, {0, 1, 2, 3}}, triangle{3, {2, 5, 4, -1}}, apart{3, {6, 7, 8, -1}};
  std::vector<std::vector<int32_t>> loops = BoundaryLoops({quad, triangle, apart});
  for (std::vector<int32_t>& loop : loops) {
    std::rotate(loop.begin(), std::min_element(loop.begin(), loop.end()), loop.end());
  }
  std::sort(loops.begin(), loops.end());
  EXPECT_EQ(loops,
            (std::vector<std::vector<int32_t>>{LoopOf(quad), LoopOf(triangle), LoopOf(apart)}));
}

TEST(BoundaryLoops, FacesThatShareAnEdgeHaveOneAroundBoth) {
  const CellFace quad{4, {0, 1, 2, 3}}, next{4, {1, 4, 5, 2}};
  const std::vector<int32_t> around = {0, 3, 2, 5, 4, 1};
  const auto loops = BoundaryLoops({quad, next});
  ASSERT_EQ(loops.size(), 1u);
  EXPECT_EQ(loops[0], around);
}

TEST(Star, KernelOfACubeIsItsCentre) {
  WorkingMesh mesh(GridComplex({3, 3, 3}));
  mesh.RemoveCell(13);
  const Cavities cavities = CollectCavities(mesh);
  std::vector<KernelPlane> planes;
  for (const CellFace& face : cavities.faces[0]) {
    AppendKernelPlanes(face, mesh.vertices(), &planes);
  }
  const KernelPoint kernel = FindKernel(planes, {1.2, 1.3, 1.6});
  EXPECT_NEAR(kernel.depth, 0.5, 0.02);
  EXPECT_NEAR(SolidAngle(cavities.faces[0], {1.5, 1.5, 1.5}, mesh.vertices()), 4 * std::numbers::pi,
              1e-9);
}

TEST(CloseComplex, AFinishedGridComesBackUnchanged) {
  const GridSize n{4, 3, 2};
  RunContext run;
  const auto closed = CloseComplex(GridComplex(n), GridHull(n, 1.0), {}, run);
  ASSERT_TRUE(closed.ok()) << closed.status();
  EXPECT_EQ(closed->cells.size(), 24u);
}

TEST(CloseComplex, LeavesNoOpenFaceOnHundredsOfRandomHoles) {
  const GridSize n{6, 6, 6};
  const Hull hull = GridHull(n, 1.0);
  for (unsigned seed = 1; seed <= 12; ++seed) {
    SCOPED_TRACE(seed);
    RunContext run;
    const double share = 0.02 * seed;  // up to a quarter of the cells
    const auto closed = CloseComplex(WithHoles(GridComplex(n), share, seed), hull, {}, run);
    ASSERT_TRUE(closed.ok()) << closed.status();
    const WorkingMesh mesh(*closed);
    EXPECT_TRUE(mesh.OpenFaces().empty());
    EXPECT_TRUE(FindBoundaryDefects(mesh, hull).vertices.empty());
    // Corners of the box may be cut where all cells at them are gone.
    EXPECT_NEAR(Volume(*closed), 216.0, 216.0 * 0.03);
  }
}

TEST(CloseComplex, LosesNoMoreOfAPartThatNoCellReachesInto) {
  for (const GridSize cells : {GridSize{3, 6, 6}, GridSize{3, 6, 3}}) {
    SCOPED_TRACE(::testing::Message() << cells.nx << " x " << cells.ny << " x " << cells.nz);
    RunContext run;
    // Three layers are missing at one end, and no cell borders on a cavity.
    const Hull hull = GridHull({cells.nx + 3, cells.ny, cells.nz}, 1.0);
    const auto closed = CloseComplex(GridComplex(cells), hull, {}, run);
    ASSERT_TRUE(closed.ok()) << closed.status();
    EXPECT_GE(Volume(*closed), cells.nx * cells.ny * cells.nz - 1e-9);
    EXPECT_TRUE(WorkingMesh(*closed).OpenFaces().empty());
  }
}

// A grid of n cells along each axis whose vertices inside are moved by up to half of `range`.
CellComplex ShakenInside(int n, double range, unsigned seed) {
  CellComplex grid = GridComplex({n, n, n});
  std::minstd_rand random(seed);
  for (Vec3d& p : grid.vertices) {
    for (int axis = 0; axis < 3; ++axis) {
      const double offset = double(random()) / double(std::minstd_rand::max()) - 0.5;
      const bool interior = p[axis] > 0.5 && p[axis] < n - 0.5;
      if (interior) p[axis] += range * offset;
    }
  }
  return grid;
}

TEST(CloseComplex, ShakenVerticesStillClose) {
  const Hull hull = GridHull({5, 5, 5}, 1.0);
  for (unsigned seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    RunContext run;
    const auto closed =
        CloseComplex(WithHoles(ShakenInside(5, 0.25, seed), 0.1, seed), hull, {}, run);
    ASSERT_TRUE(closed.ok()) << closed.status();
    EXPECT_TRUE(WorkingMesh(*closed).OpenFaces().empty());
  }
}

// Cavities that resist cost the cells around them, not those of the whole mesh.
TEST(CloseComplex, KeepsMostHexahedraWhereCavitiesResist) {
  const Hull hull = GridHull({6, 6, 6}, 1.0);
  for (const unsigned seed : {1u, 10u}) {
    SCOPED_TRACE(seed);
    const CellComplex open = WithHoles(ShakenInside(6, 0.8, seed), 0.3, seed);
    RunContext run;
    const auto closed = CloseComplex(open, hull, {}, run);
    ASSERT_TRUE(closed.ok()) << closed.status();
    const WorkingMesh mesh(*closed);
    EXPECT_TRUE(mesh.OpenFaces().empty());
    int hexahedra = 0;
    for (int cell = 0; cell < mesh.cell_slots(); ++cell) hexahedra += mesh.is_hexahedron(cell);
    EXPECT_GT(2 * hexahedra, static_cast<int>(open.cells.size()));
  }
}

int OthersOf(const CellComplex& complex) {
  const WorkingMesh mesh(complex);
  int others = 0;
  for (int cell = 0; cell < mesh.cell_slots(); ++cell) others += !mesh.is_hexahedron(cell);
  return others;
}

// Where a better mesh is known, no time is spent on one that has become worse.
TEST(CloseComplex, GivesUpOnceMoreCellsAreNoHexahedraThanPermitted) {
  const Hull hull = GridHull({5, 5, 5}, 1.0);
  const CellComplex open = WithHoles(ShakenInside(5, 0.25, 1), 0.25, 1);
  RunContext run;
  const auto closed = CloseComplex(open, hull, {}, run);
  ASSERT_TRUE(closed.ok()) << closed.status();
  const int others = OthersOf(*closed);
  ASSERT_GT(others, 0);

  const auto permitted = CloseComplex(open, hull, {}, run, {.most_others = double(others)});
  ASSERT_TRUE(permitted.ok()) << permitted.status();
  EXPECT_EQ(permitted->cells, closed->cells);
  EXPECT_TRUE(permitted->vertices == closed->vertices);

  const auto refused = CloseComplex(open, hull, {}, run, {.most_others = 0.0});
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kInternal);
  EXPECT_THAT(refused.status().message(), ::testing::HasSubstr("no hexahedra, more than 0"));
}

// Two grids a fifth of a cell apart, whose vertices at the gap have not reached their places.
CellComplex GridsRunningThroughEachOther() {
  constexpr int kSide = 4;
  constexpr double kGap = 0.2, kAstray = 0.17;
  const CellComplex grid = GridComplex({kSide, kSide, kSide});
  CellComplex both = grid;
  for (Vec3d& p : both.vertices) {
    const bool is_inside = std::min(p.y, p.z) > 0 && std::max(p.y, p.z) < kSide;
    if (p.x == kSide && is_inside) p.x += kAstray;
  }
  const auto offset = static_cast<int32_t>(grid.vertices.size());
  for (const Vec3d& p : grid.vertices) {
    const bool is_inside = std::min(p.y, p.z) > 0 && std::max(p.y, p.z) < kSide;
    const double astray = p.x == 0 && is_inside ? kAstray : 0;
    both.vertices.push_back(p + Vec3d{kSide + kGap - astray, 0, 0});
  }
  for (CellCorners corners : grid.cells) {
    for (int32_t& v : corners) v += offset;
    both.cells.push_back(corners);
  }
  testing_support::ListHullFaces(both);
  return both;
}

TEST(CloseComplex, MovesVerticesBeforeItOpensCellsThatNothingIsWrongWith) {
  const TriangleMesh box = fixtures::MakeBox({4, 4, 4}, 1);
  const Hull hull =
      testing_support::HullOfMesh(fixtures::Joined(box, fixtures::Translated(box, {4.2, 0, 0})));
  const CellComplex grids = GridsRunningThroughEachOther();
  ASSERT_FALSE(FindBoundaryDefects(WorkingMesh(grids), hull).vertices.empty());
  const HullFeatures features(hull);
  const RunContext run;
  const auto place = [&](CellComplex complex) {
    return PlacePart(std::move(complex), {}, features, run, PlacementEffort::kValid);
  };
  const auto closed = CloseUnwatched(grids, hull, {}, run, {.place = place});
  ASSERT_TRUE(closed.ok()) << closed.status();
  EXPECT_EQ(closed->cells.size(), grids.cells.size());
  EXPECT_TRUE(FindBoundaryDefects(WorkingMesh(*closed), hull).vertices.empty());
}

TEST(CloseComplex, StopsWhenAsked) {
  const GridSize n{4, 4, 4};
  RunContext run;
  run.RequestStop();
  const auto closed = CloseComplex(WithHoles(GridComplex(n), 0.2, 3), GridHull(n, 1.0), {}, run);
  EXPECT_EQ(closed.status().code(), absl::StatusCode::kCancelled);
}

TEST(CloseComplex, IsTheSameEveryTime) {
  const GridSize n{5, 5, 5};
  const Hull hull = GridHull(n, 1.0);
  RunContext first, second;
  const auto a = CloseComplex(WithHoles(GridComplex(n), 0.15, 9), hull, {}, first);
  const auto b = CloseComplex(WithHoles(GridComplex(n), 0.15, 9), hull, {}, second);
  ASSERT_TRUE(a.ok() && b.ok());
  EXPECT_EQ(a->cells, b->cells);
  EXPECT_TRUE(a->vertices == b->vertices);
}

TEST(ExtrudeToHull, RestoresAMissingLayerAsHexahedra) {
  const GridSize n{4, 4, 4};
  const Hull hull = GridHull(n, 1.0);
  WorkingMesh mesh(GridComplex(n));
  for (int cell = 0; cell < 16; ++cell) mesh.RemoveCell(cell);  // the whole bottom layer
  EXPECT_EQ(ExtrudeToHull(hull, &mesh), 16);
  EXPECT_TRUE(mesh.OpenFaces().empty());
  const CellComplex complex = mesh.ToComplex();
  EXPECT_EQ(complex.cells.size(), 64u);
  EXPECT_NEAR(Volume(complex), 64.0, 1e-9);
  ExpectClosedAndPositive(complex);
}

TEST(BoundaryDefects, CubesThatTouchAtAnEdgeAreFound) {
  const GridSize n{2, 2, 1};
  WorkingMesh mesh(GridComplex(n));
  mesh.RemoveCell(0);
  mesh.RemoveCell(3);
  for (const CellFace& face : mesh.OpenFaces()) mesh.MarkHull(face);
  EXPECT_FALSE(FindBoundaryDefects(mesh, GridHull(n, 1.0)).vertices.empty());
}

TEST(RepairCells, NeverLeavesAClosedComplexOpen) {
  const GridSize n{5, 5, 5};
  const Hull hull = GridHull(n, 1.0);
  RunContext run;
  const auto closed = CloseComplex(WithHoles(GridComplex(n), 0.15, 4), hull, {}, run);
  ASSERT_TRUE(closed.ok());
  const auto joined = JoinStars(*closed, hull, run);
  ASSERT_TRUE(joined.ok());
  EXPECT_LE(joined->cells.size(), closed->cells.size());
  const auto repaired = RepairCells(*joined, hull, {.quality = 0.3, .depth = 4}, run);
  ASSERT_TRUE(repaired.ok());
  EXPECT_TRUE(WorkingMesh(*repaired).OpenFaces().empty());
}

}  // namespace
}  // namespace amhex
