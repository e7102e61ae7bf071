#include "input/surface_topology.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "fixtures/solids.h"
#include "input/cap_openings.h"
#include "input/clean_mesh.h"
#include "input/collapse_short_edges.h"
#include "support/surface_measures.h"

namespace amhex {
namespace {

TEST(FindEdgeAdjacency, OppositeHalfEdgesNameEachOtherAndTheSameEdge) {
  const TriangleMesh mesh = fixtures::MakeTorus(2, 0.5, 0.4);
  const EdgeAdjacency adjacency = FindEdgeAdjacency(mesh);
  EXPECT_TRUE(adjacency.IsClosedManifold());
  for (size_t e = 0; e < adjacency.opposite.size(); ++e) {
    const auto other = static_cast<size_t>(adjacency.opposite[e]);
    EXPECT_EQ(adjacency.opposite[other], static_cast<HalfEdgeId>(e));
    EXPECT_EQ(mesh.triangles[e / 3][e % 3], mesh.triangles[other / 3][(other + 1) % 3]);
  }
}

TEST(FindEdgeAdjacency, CountsOpenAndOverusedEdges) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, -1, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 1, 3}, {0, 1, 4}};
  const EdgeAdjacency adjacency = FindEdgeAdjacency(mesh);
  EXPECT_EQ(adjacency.edge_count, 7);
  EXPECT_EQ(adjacency.open_edge_count, 6);
  EXPECT_EQ(adjacency.non_manifold_edge_count, 1);
}

TEST(MakeOrientationConsistent, TurnsAsFewTrianglesAsPossible) {
  TriangleMesh mesh = fixtures::MakeBox({1, 1, 1}, 0.25);
  const auto wanted = mesh.triangles;
  for (const size_t t : {3, 50, 51}) std::swap(mesh.triangles[t][0], mesh.triangles[t][2]);
  const EdgeAdjacency adjacency = FindEdgeAdjacency(mesh);
  const Components components = FindComponents(adjacency);
  const OrientationResult result = MakeOrientationConsistent(adjacency, components, mesh);
  EXPECT_TRUE(result.is_orientable);
  EXPECT_EQ(result.turned_count, 3);
  EXPECT_TRUE(testing_support::IsClosedAndOriented(mesh));
  EXPECT_GT(testing_support::EnclosedVolume(mesh), 0);
}

TEST(MakeOrientationConsistent, AMoebiusStripHasNoTwoSides) {
  TriangleMesh mesh;
  constexpr int kParts = 12;
  for (int i = 0; i < kParts; ++i) {
    const double angle = 2 * 3.14159265358979 * i / kParts, tilt = angle / 2;
    for (const double across : {-0.3, 0.3}) {
      const double r = 1 + across * std::cos(tilt);
      mesh.vertices.push_back({r * std::cos(angle), r * std::sin(angle), across * std::sin(tilt)});
    }
  }
  for (int i = 0; i < kParts; ++i) {
    const bool last = i == kParts - 1;
    const int32_t a = 2 * i, b = 2 * i + 1, c = last ? 1 : a + 2, d = last ? 0 : b + 2;
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({b, d, c});
  }
  const EdgeAdjacency adjacency = FindEdgeAdjacency(mesh);
  const Components components = FindComponents(adjacency);
  EXPECT_FALSE(MakeOrientationConsistent(adjacency, components, mesh).is_orientable);
}

TEST(SplitFans, SurfacesThatTouchInAPointComeApart) {
  TriangleMesh mesh =
      fixtures::Joined(fixtures::MakeBox({1, 1, 1}, 1),
                       fixtures::Translated(fixtures::MakeBox({1, 1, 1}, 1), {1, 1, 1}));
  MergeVertices(0, mesh);
  const size_t merged = mesh.vertices.size();
  EXPECT_EQ(SplitFans(FindEdgeAdjacency(mesh), mesh), 1);
  EXPECT_EQ(mesh.vertices.size(), merged + 1);
  EXPECT_EQ(FindComponents(FindEdgeAdjacency(mesh)).count, 2);
  EXPECT_EQ(SplitFans(FindEdgeAdjacency(mesh), mesh), 0);
}

TEST(GenusOf, AddsTheHandlesOfAllComponents) {
  const TriangleMesh torus = fixtures::MakeTorus(2, 0.5, 0.4);
  const TriangleMesh mesh =
      fixtures::Joined(fixtures::Joined(torus, fixtures::Translated(torus, {9, 0, 0})),
                       fixtures::MakeSphere(1, 0.5));
  const EdgeAdjacency adjacency = FindEdgeAdjacency(mesh);
  EXPECT_EQ(GenusOf(mesh, adjacency, FindComponents(adjacency)), 2);
}

TEST(CapOpenings, RemovedFacesAreReplacedByPatchesOfTheSameArea) {
  TriangleMesh mesh = fixtures::MakeBox({1, 1, 1}, 0.2);
  std::erase_if(mesh.triangles, [&](const auto& t) {
    for (const int32_t v : t) {
      if (mesh.vertices[static_cast<size_t>(v)].z < 1 - 1e-9) return false;
    }
    return true;
  });
  const auto loops = FindOpenings(FindEdgeAdjacency(mesh), mesh);
  ASSERT_EQ(loops.size(), 1u);
  EXPECT_EQ(loops[0].size(), 20u);
  RunContext run;
  ASSERT_TRUE(CapOpenings(loops, run, mesh).ok());
  EXPECT_TRUE(testing_support::IsClosedAndOriented(mesh));
  EXPECT_NEAR(testing_support::EnclosedVolume(mesh), 1, 1e-9);
  EXPECT_NEAR(testing_support::SurfaceArea(mesh), 6, 1e-9);
}

TEST(CapOpenings, LongLoopsAreClosedToo) {
  TriangleMesh mesh = fixtures::MakeCylinder(1, 0.1, 0.02);
  std::erase_if(mesh.triangles, [&](const auto& t) {
    for (const int32_t v : t) {
      if (mesh.vertices[static_cast<size_t>(v)].z > 1e-9) return false;
    }
    return true;
  });
  DropUnusedVertices(mesh);
  const auto loops = FindOpenings(FindEdgeAdjacency(mesh), mesh);
  ASSERT_EQ(loops.size(), 1u);
  EXPECT_GT(loops[0].size(), 300u);
  RunContext run;
  ASSERT_TRUE(CapOpenings(loops, run, mesh).ok());
  EXPECT_TRUE(testing_support::IsClosedAndOriented(mesh));
  EXPECT_NEAR(testing_support::EnclosedVolume(mesh), 3.14159 * 0.1, 1e-3);
}

TEST(CollapseShortEdges, TopologyAndShapeStayAndShortEdgesGo) {
  TriangleMesh mesh = fixtures::MakeTorus(2, 0.6, 0.1);
  const double volume = testing_support::EnclosedVolume(mesh);
  const size_t before = mesh.vertices.size();
  std::vector<uint8_t> rank(mesh.vertices.size(), 1);
  const int64_t collapses = CollapseShortEdges(0.12, mesh, rank);
  EXPECT_GT(collapses, 0);
  EXPECT_EQ(mesh.vertices.size(), before - static_cast<size_t>(collapses));
  EXPECT_EQ(rank.size(), mesh.vertices.size());
  EXPECT_TRUE(testing_support::IsClosedAndOriented(mesh));
  EXPECT_EQ(testing_support::EulerNumber(mesh), 0);
  EXPECT_NEAR(testing_support::EnclosedVolume(mesh), volume, 0.03 * volume);
}

TEST(CollapseShortEdges, ATetrahedronIsNeverTakenAway) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};
  std::vector<uint8_t> rank(4, 1);
  EXPECT_EQ(CollapseShortEdges(10, mesh, rank), 0);
  EXPECT_EQ(mesh.triangles.size(), 4u);
}

}  // namespace
}  // namespace amhex
