#include "topology/primitives.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "topology/primitive_catalog.h"

namespace amhex {
namespace {

constexpr int kUnitCorner[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                   {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};

std::vector<Vec3d> UnitCube() {
  std::vector<Vec3d> vertices;
  for (const auto& c : kUnitCorner) vertices.push_back({double(c[0]), double(c[1]), double(c[2])});
  return vertices;
}

int CornerAt(const std::array<int, 3>& position) {
  for (int c = 0; c < 8; ++c) {
    if (std::equal(position.begin(), position.end(), kUnitCorner[c])) return c;
  }
  return -1;
}

// The 48 ways to lay a cube on itself, as corner permutations; the first 24 keep the handedness.
std::vector<std::array<int, 8>> CubeSymmetries() {
  std::vector<std::array<int, 8>> rotations, reflections;
  std::array<int, 3> axes = {0, 1, 2};
  do {
    const int inversions = (axes[0] > axes[1]) + (axes[0] > axes[2]) + (axes[1] > axes[2]);
    for (int flips = 0; flips < 8; ++flips) {
      std::array<int, 8> permutation;
      for (int c = 0; c < 8; ++c) {
        std::array<int, 3> position;
        for (int a = 0; a < 3; ++a) position[a] = kUnitCorner[c][axes[a]] ^ (flips >> a & 1);
        permutation[c] = CornerAt(position);
      }
      const int mirrors = inversions + (flips & 1) + (flips >> 1 & 1) + (flips >> 2 & 1);
      (mirrors % 2 == 0 ? rotations : reflections).push_back(permutation);
    }
  } while (std::next_permutation(axes.begin(), axes.end()));
  rotations.insert(rotations.end(), reflections.begin(), reflections.end());
  return rotations;
}

CellCorners Permuted(const CellCorners& corners, const std::array<int, 8>& permutation) {
  CellCorners permuted;
  for (int c = 0; c < 8; ++c) permuted[c] = corners[permutation[c]];
  return permuted;
}

TEST(Primitives, TheUnitCubeHasVolumeAndScaledJacobianOne) {
  const CellCorners cube = {0, 1, 2, 3, 4, 5, 6, 7};
  EXPECT_DOUBLE_EQ(CellVolume(cube, UnitCube()), 1.0);
  EXPECT_DOUBLE_EQ(ScaledJacobian(cube, UnitCube()), 1.0);
  EXPECT_TRUE(IsStarShaped(cube, UnitCube()));
}

TEST(Primitives, AnInvertedCubeIsNegativeInEveryMeasure) {
  const CellCorners inverted = {4, 5, 6, 7, 0, 1, 2, 3};
  EXPECT_DOUBLE_EQ(CellVolume(inverted, UnitCube()), -1.0);
  EXPECT_DOUBLE_EQ(ScaledJacobian(inverted, UnitCube()), -1.0);
  EXPECT_FALSE(IsStarShaped(inverted, UnitCube()));
}

TEST(Primitives, ARegularTetrahedronScoresTheRootOfOneHalf) {
  const std::vector<Vec3d> vertices = {{0, 0, 0}, {1, 0, 1}, {1, 1, 0}, {0, 1, 1}};
  const CellCorners tetrahedron = MakeTetrahedron(0, 1, 2, 3);
  EXPECT_NEAR(std::abs(ScaledJacobian(tetrahedron, vertices)), std::sqrt(0.5), 1e-12);
  EXPECT_NEAR(std::abs(CellVolume(tetrahedron, vertices)), 1.0 / 3, 1e-12);
}

TEST(Primitives, EveryPatternIsRecognisedUnderThe48Symmetries) {
  for (const PrimitiveShape& shape : kPrimitiveCatalog) {
    for (const auto& symmetry : CubeSymmetries()) {
      EXPECT_EQ(RecognizeCell(Permuted(shape.pattern, symmetry)), shape.type) << shape.name;
    }
  }
}

TEST(Primitives, RotationsKeepAndReflectionsInvertTheVolume) {
  // Collapsing an edge of the unit cube to its mid point gives every pattern a solid shape.
  for (const PrimitiveShape& shape : kPrimitiveCatalog) {
    std::vector<Vec3d> vertices(static_cast<size_t>(shape.vertex_count));
    std::vector<int> uses(vertices.size(), 0);
    for (int c = 0; c < 8; ++c) {
      vertices[shape.pattern[c]] += UnitCube()[c];
      ++uses[shape.pattern[c]];
    }
    for (size_t v = 0; v < vertices.size(); ++v) vertices[v] /= uses[v];
    const double volume = CellVolume(shape.pattern, vertices);
    EXPECT_GT(volume, 0) << shape.name;
    const auto symmetries = CubeSymmetries();
    for (size_t i = 0; i < symmetries.size(); ++i) {
      EXPECT_NEAR(CellVolume(Permuted(shape.pattern, symmetries[i]), vertices),
                  i < 24 ? volume : -volume, 1e-12)
          << shape.name;
    }
  }
}

TEST(Primitives, UnusedCollapsesOfFigure2AreNoCells) {
  EXPECT_FALSE(RecognizeCell({0, 1, 1, 2, 3, 4, 5, 2}).has_value()) << "prysm";
  EXPECT_FALSE(RecognizeCell({0, 1, 2, 3, 4, 1, 5, 3}).has_value()) << "tie";
  EXPECT_FALSE(RecognizeCell({0, 0, 1, 2, 3, 4, 1, 3}).has_value()) << "bipyramid";
  EXPECT_FALSE(RecognizeCell({0, 0, 1, 1, 2, 2, 3, 3}).has_value()) << "pillow";
  EXPECT_FALSE(RecognizeCell({0, 0, 0, 0, 0, 0, 0, 0}).has_value()) << "point";
}

TEST(Primitives, FacesAreOutwardAndCloseTheCell) {
  const std::vector<Vec3d> vertices = UnitCube();
  const Vec3d centre = {0.5, 0.5, 0.5};
  for (const CellFace& face : FacesOf({0, 1, 2, 3, 4, 5, 6, 7})) {
    const Vec3d a = vertices[face.v[0]];
    const Vec3d normal = Cross(vertices[face.v[1]] - a, vertices[face.v[2]] - a);
    EXPECT_GT(Dot(normal, a - centre), 0);
  }
}

TEST(Primitives, ACollapsedFaceHasNoCorners) {
  const CellCorners prism = {0, 1, 1, 2, 3, 4, 4, 5};
  EXPECT_EQ(FaceInDirection(prism, 1).count, 0);  // between the two collapsed edges
  EXPECT_EQ(FaceInDirection(prism, 0).count, 4);
  EXPECT_EQ(FaceInDirection(prism, 4).count, 3);
}

TEST(Primitives, BuildersTakeOutwardBases) {
  const std::vector<Vec3d> vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.5, 0.5, 1}};
  const CellCorners pyramid = MakePyramid({0, 3, 2, 1}, 4);
  EXPECT_EQ(RecognizeCell(pyramid), PrimitiveType::kPyramid);
  EXPECT_NEAR(CellVolume(pyramid, vertices), 1.0 / 3, 1e-12);
  EXPECT_GT(ScaledJacobian(pyramid, vertices), 0);
  const CellCorners tetrahedron = MakeTetrahedronOn({0, 3, 1}, 4);
  EXPECT_EQ(RecognizeCell(tetrahedron), PrimitiveType::kTetrahedron);
  EXPECT_NEAR(CellVolume(tetrahedron, vertices), 1.0 / 6, 1e-12);
  EXPECT_GT(ScaledJacobian(tetrahedron, vertices), 0);
}

}  // namespace
}  // namespace amhex
