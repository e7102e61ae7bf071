#include "topology/collect_faces.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "topology/face_loops.h"
#include "topology/penta_loops.h"
#include "topology/primitive_catalog.h"
#include "unit/topology/cube_grid.h"

namespace amhex {
namespace {

std::vector<CellFace> Collected(const std::vector<Vec3d>& vertices,
                                const std::vector<VertexPair>& edges) {
  RunContext context;
  const auto faces = CollectFaces(vertices, edges, context);
  EXPECT_TRUE(faces.ok());
  return *faces;
}

std::vector<PentaLoop> Loops(int32_t vertex_count, const std::vector<VertexPair>& edges) {
  RunContext context;
  std::vector<PentaLoop> loops;
  EXPECT_TRUE(FindPentaLoops(EdgeNetwork::Build(vertex_count, edges), context, &loops).ok());
  return loops;
}

const std::vector<VertexPair> kPentagon = {{0, 1}, {1, 2}, {2, 3}, {3, 4}, {4, 0}};

std::vector<Vec3d> RegularPentagon() {
  std::vector<Vec3d> vertices;
  for (int i = 0; i < 5; ++i) {
    vertices.push_back({std::cos(2 * M_PI * i / 5), std::sin(2 * M_PI * i / 5), 0});
  }
  return vertices;
}

bool Uses(const CellFace& face, int32_t a, int32_t b) {
  for (int i = 0; i < face.count; ++i) {
    const int32_t from = face.v[i], to = face.v[(i + 1) % face.count];
    if ((from == a && to == b) || (from == b && to == a)) return true;
  }
  return false;
}

TEST(CollectFaces, OfNothingIsNothing) { EXPECT_TRUE(Collected({}, {}).empty()); }

TEST(CollectFaces, AGridHasExactlyTheFacesOfItsCubes) {
  const MergedCubes grid = testing::MakeCubeGrid(3, 2, 4);
  const auto faces = Collected(grid.vertices, CollectCubeEdges(grid, {}));
  EXPECT_EQ(faces.size(), 4u * 2 * 4 + 3u * 3 * 4 + 3u * 2 * 5);
  for (const CellFace& face : faces) EXPECT_EQ(face.count, 4);
}

TEST(CollectFaces, AnEdgeAcrossAQuadMakesTwoTriangles) {
  const std::vector<Vec3d> square = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  const auto faces = Collected(square, {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {0, 2}});
  ASSERT_EQ(faces.size(), 2u);
  EXPECT_EQ(faces[0], Triangle(0, 1, 2));
  EXPECT_EQ(faces[1], Triangle(0, 2, 3));
}

TEST(CollectFaces, ASkewedQuadIsSplitByItsShortestDiagonal) {
  // Corner angles of 30 and 150 degrees.
  const double c = std::cos(M_PI / 6), s = std::sin(M_PI / 6);
  const std::vector<Vec3d> rhombus = {{0, 0, 0}, {1, 0, 0}, {1 + c, s, 0}, {c, s, 0}};
  const auto faces = Collected(rhombus, {{0, 1}, {1, 2}, {2, 3}, {3, 0}});
  ASSERT_EQ(faces.size(), 2u);
  for (const CellFace& face : faces) EXPECT_TRUE(face.count == 3 && Uses(face, 1, 3));
}

TEST(CollectFaces, AFoldedQuadIsBadlyShapedAndASquareIsNot) {
  std::vector<Vec3d> quad = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  EXPECT_TRUE(IsWellShapedQuad(Quad(0, 1, 2, 3), quad));
  quad[2] = {0.1, 0.1, 1};  // folded along the diagonal 1-3
  EXPECT_FALSE(IsWellShapedQuad(Quad(0, 1, 2, 3), quad));
}

TEST(PentaLoops, ARegularGridHasNone) {
  const MergedCubes grid = testing::MakeCubeGrid(3, 3, 3);
  EXPECT_TRUE(Loops(64, CollectCubeEdges(grid, {})).empty());
}

TEST(PentaLoops, APentagonIsFoundOnceAndAnEdgeAcrossResolvesIt) {
  ASSERT_EQ(Loops(5, kPentagon).size(), 1u);
  EXPECT_EQ(Loops(5, kPentagon)[0], (PentaLoop{0, 1, 2, 3, 4}));
  for (const VertexPair& across : InteriorEdges({0, 1, 2, 3, 4})) {
    std::vector<VertexPair> edges = kPentagon;
    edges.push_back(across);
    EXPECT_TRUE(Loops(5, edges).empty());
  }
}

TEST(PentaLoops, SpiralBecomesTriAndQuadrangulatable) {
  // A pentagonal hole without a single face turns into a network where every edge of the loop
  // has triangles to fill the hole with.
  const auto faces = Collected(RegularPentagon(), kPentagon);
  for (const auto& [a, b] : kPentagon) {
    EXPECT_TRUE(std::any_of(faces.begin(), faces.end(), [a = a, b = b](const CellFace& face) {
      return face.count == 3 && Uses(face, a, b);
    }));
  }
}

TEST(PentaLoops, APentagonalPrismHasItsTwoEnds) {
  // A prism over a pentagon has the two pentagons; its five quads connect them.
  std::vector<VertexPair> edges = kPentagon;
  for (const auto& [a, b] : kPentagon) edges.push_back({a + 5, b + 5});
  for (int32_t v = 0; v < 5; ++v) edges.push_back({v, v + 5});
  EXPECT_EQ(Loops(10, edges).size(), 2u);
}

}  // namespace
}  // namespace amhex
