// The checker is itself checked: it accepts what is right and names what is wrong.
#include "support/mesh_invariants.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <utility>

namespace amhex::testing_support {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// A row of `count` unit cubes along x.
AtMostHexaMesh CubeRow(int32_t count) {
  AtMostHexaMesh mesh;
  for (int32_t x = 0; x <= count; ++x) {
    for (const auto& [y, z] : {std::pair{0, 0}, {1, 0}, {1, 1}, {0, 1}}) {
      mesh.vertices.push_back(Vec3d{double(x), double(y), double(z)});
    }
  }
  for (int32_t x = 0; x < count; ++x) {
    const int32_t a = 4 * x, b = a + 4;
    mesh.corners.push_back({a, b, b + 1, a + 1, a + 3, b + 3, b + 2, a + 2});
    mesh.types.push_back(PrimitiveType::kHexahedron);
    mesh.quality.push_back(1);
  }
  return mesh;
}

// One cell of every kind, on positions that make it well shaped.
struct CellCase {
  PrimitiveType type;
  CellCorners corners;
  std::vector<Vec3d> vertices;
  double volume;
};

std::vector<CellCase> OneOfEachKind() {
  return {
      {PrimitiveType::kHexprism,
       {0, 1, 1, 2, 3, 4, 5, 6},
       {{0, 0, 0}, {1, 0.5, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}},
       // The unit cube, whose section at height z has a side of length z at x = 1.
       0.75},
      {PrimitiveType::kPrism,
       {0, 1, 1, 2, 3, 4, 4, 5},
       {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}},
       0.5},
      {PrimitiveType::kSlice,
       {0, 1, 1, 2, 3, 4, 4, 3},
       // Vertex 4 on the edge 1-3 of the tetrahedron 0 1 2 3.
       {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0.5, 0, 0.5}},
       1.0 / 6},
      {PrimitiveType::kPyramid,
       {0, 1, 1, 2, 0, 3, 3, 4},
       {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 0, 1}, {0, 1, 1}},
       1.0 / 3},
      {PrimitiveType::kPyramid,
       {0, 1, 1, 2, 3, 1, 1, 4},
       {{0, 0, 0}, {1, 0.5, 0.5}, {0, 1, 0}, {0, 0, 1}, {0, 1, 1}},
       1.0 / 3},
      {PrimitiveType::kTetrahedron,
       {0, 1, 1, 2, 0, 3, 3, 2},
       {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
       1.0 / 6},
  };
}

// The base outward for the pyramid: pattern 0 1 1 2 0 3 3 4 with its face 1243 outward.
CellCorners PyramidOn(const std::array<int32_t, 4>& base, int32_t apex) {
  return {apex, base[0], base[0], base[3], apex, base[1], base[1], base[2]};
}

AtMostHexaMesh Alone(const CellCase& cell) {
  return {cell.vertices, {cell.corners}, {cell.type}, {1}};
}

TEST(BrokenLaws, AcceptARowOfCubes) {
  const AtMostHexaMesh row = CubeRow(3);
  EXPECT_THAT(BrokenLaws(row), IsEmpty());
  EXPECT_NEAR(TotalVolume(row), 3, 1e-12);
  const BoundaryMeasures boundary = MeasureBoundary(row);
  EXPECT_EQ(boundary.face_count, 14);
  EXPECT_EQ(boundary.component_count, 1);
  EXPECT_EQ(boundary.euler_number, 2);
}

TEST(BrokenLaws, AcceptEveryCellOfFigure2) {
  for (const CellCase& cell : OneOfEachKind()) {
    EXPECT_THAT(BrokenLaws(Alone(cell)), IsEmpty()) << "type " << static_cast<int>(cell.type);
    EXPECT_NEAR(TotalVolume(Alone(cell)), cell.volume, 1e-12)
        << "type " << static_cast<int>(cell.type);
  }
}

TEST(BrokenLaws, NameAMirroredCellOfEveryKind) {
  for (CellCase cell : OneOfEachKind()) {
    for (Vec3d& p : cell.vertices) p.x = -p.x;
    EXPECT_THAT(BrokenLaws(Alone(cell)),
                ElementsAre(HasSubstr("a volume that is not positive at cell 0")))
        << "type " << static_cast<int>(cell.type);
  }
}

TEST(BrokenLaws, NameAWrongType) {
  AtMostHexaMesh row = CubeRow(2);
  row.types[1] = PrimitiveType::kPrism;
  EXPECT_THAT(BrokenLaws(row), ElementsAre("a wrong type at cell 1"));
}

TEST(BrokenLaws, NameACellThatIsNotInFigure2) {
  AtMostHexaMesh tie = CubeRow(1);
  tie.corners[0] = {0, 1, 2, 3, 4, 1, 5, 3};
  EXPECT_THAT(BrokenLaws(tie), Contains("no cell of Figure 2: cell 0"));
}

TEST(BrokenLaws, NameAFaceSeenTwiceFromTheSameSide) {
  AtMostHexaMesh row = CubeRow(1);
  row.corners.push_back(row.corners[0]);
  row.types.push_back(row.types[0]);
  row.quality.push_back(1);
  EXPECT_THAT(BrokenLaws(row),
              Contains("a shared face not seen from opposite sides, last by cell 1"));
}

TEST(BrokenLaws, NameAFaceSeenThreeTimes) {
  AtMostHexaMesh row = CubeRow(2);
  row.vertices.push_back({1.5, 0.5, 0.5});
  row.corners.push_back(PyramidOn({4, 7, 6, 5}, 12));
  row.types.push_back(PrimitiveType::kPyramid);
  row.quality.push_back(1);
  EXPECT_THAT(BrokenLaws(row), Contains("a face seen more than twice, last by cell 2"));
}

TEST(BrokenLaws, NameAHoleInTheBoundary) {
  // Two cubes along one edge: four boundary faces meet there.
  AtMostHexaMesh row = CubeRow(2);
  row.vertices.push_back({1, 2, 1});
  row.vertices.push_back({1, 2, 0});
  row.vertices.push_back({2, 2, 1});
  row.vertices.push_back({2, 2, 0});
  row.corners.erase(row.corners.begin() + 1);
  row.corners.push_back({5, 9, 15, 13, 6, 10, 14, 12});
  EXPECT_THAT(BrokenLaws(row),
              Contains(HasSubstr("a boundary edge not used once from each side: 5-6")));
}

TEST(BrokenLaws, NameAWallCutDifferentlyFromBothSides) {
  // A cube, and on its face x = 1 two tetrahedra instead of a pyramid.
  AtMostHexaMesh mesh = CubeRow(1);
  mesh.vertices.push_back({1.5, 0.5, 0.5});
  for (const CellCorners& corners :
       {CellCorners{4, 5, 5, 6, 4, 8, 8, 6}, CellCorners{4, 6, 6, 7, 4, 8, 8, 7}}) {
    mesh.corners.push_back(corners);
    mesh.types.push_back(PrimitiveType::kTetrahedron);
    mesh.quality.push_back(1);
  }
  EXPECT_THAT(BrokenLaws(mesh), Contains(HasSubstr("a boundary quad on a boundary triangle")));
}

TEST(BrokenLaws, NameAnUnusedVertexAndAPositionThatIsNotFinite) {
  AtMostHexaMesh row = CubeRow(1);
  row.vertices.push_back({5, 5, 5});
  EXPECT_THAT(BrokenLaws(row), ElementsAre("a vertex of no cell: 8"));
  row.vertices[8].y = std::nan("");
  EXPECT_THAT(BrokenLaws(row), ElementsAre("a position that is not finite at vertex 8"));
}

TEST(LeastScaledJacobian, IsOneInACubeAndTheRegularTetrahedronsInOne) {
  const AtMostHexaMesh cube = CubeRow(1);
  EXPECT_NEAR(LeastScaledJacobian(cube.corners[0], cube.vertices), 1, 1e-12);
  const std::vector<Vec3d> regular = {{1, 1, 1}, {1, -1, -1}, {-1, -1, 1}, {-1, 1, -1}};
  EXPECT_NEAR(LeastScaledJacobian({0, 1, 1, 2, 0, 3, 3, 2}, regular), std::sqrt(0.5), 1e-12);
}

}  // namespace
}  // namespace amhex::testing_support
