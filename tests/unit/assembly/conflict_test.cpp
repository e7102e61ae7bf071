#include "assembly/conflict.h"

#include <gtest/gtest.h>

#include <vector>

#include "assembly/overlap.h"
#include "topology/direct_cells.h"
#include "topology/primitives.h"
#include "unit/topology/cube_grid.h"

namespace amhex {
namespace {

using ::amhex::testing::MakeCubeGrid;

bool Overlapping(const CellCorners& a, const CellCorners& b, const std::vector<Vec3d>& vertices) {
  const CellBody body_a(a, vertices), body_b(b, vertices);
  EXPECT_EQ(Overlap(body_a, body_b), Overlap(body_b, body_a));
  return Overlap(body_a, body_b);
}

PrimitiveTable TableOf(const std::vector<CellCorners>& cells, int32_t vertex_count) {
  PrimitiveTable table;
  std::vector<CellFace> faces;
  for (const CellCorners& cell : cells) {
    Primitive primitive;
    primitive.corners = cell;
    primitive.type = RecognizeCell(cell).value();
    table.primitives.push_back(primitive);
    for (const CellFace& face : FacesOf(cell)) faces.push_back(face);
  }
  table.faces = FaceTable::Build(vertex_count, faces);
  for (Primitive& primitive : table.primitives) LookUpHalfFaces(table.faces, &primitive);
  table.on_hull.assign(static_cast<size_t>(table.faces.half_face_count()), 0);
  return table;
}

const CellCorners kCube = {0, 1, 2, 3, 4, 5, 6, 7};
const CellCorners kPrism = {0, 1, 1, 2, 4, 5, 5, 6};       // one half of the cube
const CellCorners kOtherPrism = {0, 2, 2, 3, 4, 6, 6, 7};  // the other half

std::vector<Vec3d> CubeVertices() {
  return {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
}

TEST(Overlap, NeighboursInAGridDoNot) {
  const MergedCubes grid = MakeCubeGrid(2, 2, 2);
  for (size_t i = 0; i < 8; ++i) {
    for (size_t j = 0; j < i; ++j) {
      EXPECT_FALSE(Overlapping(grid.corners[i], grid.corners[j], grid.vertices));
    }
  }
}

TEST(Overlap, EveryCellOverlapsItself) {
  EXPECT_TRUE(Overlapping(kCube, kCube, CubeVertices()));
  EXPECT_TRUE(Overlapping(kPrism, kPrism, CubeVertices()));
  // A slice: the tetrahedron 0 1 2 3 with vertex 4 on edge 1-3.
  const std::vector<Vec3d> slice = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0.5, 0, 0.5}};
  EXPECT_TRUE(Overlapping({0, 1, 1, 2, 3, 4, 4, 3}, {0, 1, 1, 2, 3, 4, 4, 3}, slice));
}

TEST(Overlap, ShiftedCubesDoUnlessTheyBarelyTouch) {
  for (const auto& [shift, expected] : {std::pair(0.5, true), std::pair(0.97, false)}) {
    MergedCubes grid = MakeCubeGrid(1, 1, 1);
    CellCorners shifted;
    for (int32_t c = 0; c < 8; ++c) {
      grid.vertices.push_back(grid.vertices[grid.corners[0][c]] + Vec3d{shift, 0.3, 0.2});
      shifted[c] = c + 8;
    }
    EXPECT_EQ(Overlapping(grid.corners[0], shifted, grid.vertices), expected);
  }
}

TEST(Conflict, TwoPrismsInsideAHexahedronConflict) {
  const auto vertices = CubeVertices();
  const PrimitiveTable table = TableOf({kCube, kPrism, kOtherPrism}, 8);
  ConflictFinder finder(table, vertices, {0, 1, 2});
  finder.Add(0);
  EXPECT_EQ(finder.ConflictsOf(1), std::vector<int32_t>{0});
  EXPECT_EQ(finder.ConflictsOf(2), std::vector<int32_t>{0});
  EXPECT_FALSE(finder.IsInConflict(0)) << "a primitive is not in conflict with itself";
}

TEST(Conflict, TheTwoPrismsThatHalveACubeDoNotConflict) {
  const auto vertices = CubeVertices();
  const PrimitiveTable table = TableOf({kPrism, kOtherPrism}, 8);
  ConflictFinder finder(table, vertices, {0, 1});
  finder.Add(0);
  EXPECT_FALSE(finder.IsInConflict(1));
}

TEST(Conflict, EndsWhenThePrimitiveIsRemoved) {
  const auto vertices = CubeVertices();
  const PrimitiveTable table = TableOf({kCube, kPrism}, 8);
  ConflictFinder finder(table, vertices, {1});
  finder.Add(0);
  EXPECT_TRUE(finder.IsInConflict(1));
  finder.Remove(0);
  EXPECT_FALSE(finder.IsInConflict(1));
}

}  // namespace
}  // namespace amhex
