#include "cells/cells.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "cells/boundary.h"
#include "cells/mesh_check.h"
#include "test_cells.h"

namespace amhex::client {
namespace {

using ::testing::HasSubstr;

TEST(Cells, EveryTypeIsRecognisedFromItsFaces) {
  for (PrimitiveType type : kPrimitiveTypes) {
    EXPECT_EQ(TypeOfCell(OneCell(type).corners[0]), type) << PrimitiveName(type);
  }
  EXPECT_EQ(TypeOfCell({0, 1, 1, 2, 3, 1, 1, 4}), PrimitiveType::kPyramid) << "the other form";
}

TEST(Cells, ShapesOutsideFigureTwoAreRefused) {
  EXPECT_EQ(TypeOfCell({0, 1, 1, 2, 3, 4, 5, 2}), std::nullopt) << "prysm";
  EXPECT_EQ(TypeOfCell({0, 1, 2, 3, 4, 1, 5, 3}), std::nullopt) << "tie";
  EXPECT_EQ(TypeOfCell({0, 0, 1, 1, 2, 2, 3, 3}), std::nullopt) << "pillow";
  EXPECT_EQ(TypeOfCell({5, 5, 5, 5, 5, 5, 5, 5}), std::nullopt) << "a point";
}

TEST(Cells, VolumesAreThoseOfTheSolids) {
  const auto volume = [](PrimitiveType type) {
    const AtMostHexaMesh mesh = OneCell(type);
    return VolumeOfCell(mesh.corners[0], mesh.vertices);
  };
  EXPECT_NEAR(volume(PrimitiveType::kHexahedron), 1, 1e-12);
  EXPECT_NEAR(volume(PrimitiveType::kPrism), 1.0 / 2, 1e-12);
  EXPECT_NEAR(volume(PrimitiveType::kPyramid), 1.0 / 3, 1e-12);
  EXPECT_NEAR(volume(PrimitiveType::kTetrahedron), 1.0 / 6, 1e-12);
  EXPECT_GT(volume(PrimitiveType::kHexprism), 0.5);
  EXPECT_GT(volume(PrimitiveType::kSlice), 1.0 / 6);
}

TEST(Cells, VolumeFarFromTheOriginKeepsItsDigits) {
  AtMostHexaMesh mesh = OneCell(PrimitiveType::kTetrahedron);
  for (Vec3d& v : mesh.vertices) v += Vec3d{1e6, -1e6, 1e6};
  EXPECT_NEAR(VolumeOfCell(mesh.corners[0], mesh.vertices), 1.0 / 6, 1e-9);
}

TEST(Cells, ScaledJacobianIsOneForACubeAndNegativeForAMirroredOne) {
  AtMostHexaMesh mesh = OneCell(PrimitiveType::kHexahedron);
  EXPECT_NEAR(ScaledJacobianOfCell(mesh.corners[0], mesh.vertices), 1, 1e-12);
  for (Vec3d& v : mesh.vertices) v.x = -v.x;
  EXPECT_NEAR(ScaledJacobianOfCell(mesh.corners[0], mesh.vertices), -1, 1e-12);
}

TEST(Cells, ScaledJacobianOfARegularTetrahedronIsHalfTheRootOfTwo) {
  AtMostHexaMesh mesh = OneCell(PrimitiveType::kTetrahedron);
  mesh.vertices = {{1, 1, 1}, {-1, 1, -1}, {1, -1, -1}, {-1, -1, 1}};
  EXPECT_NEAR(std::abs(ScaledJacobianOfCell(mesh.corners[0], mesh.vertices)), std::sqrt(0.5),
              1e-12);
}

TEST(Cells, EveryTestCellHasPositiveQuality) {
  for (PrimitiveType type : kPrimitiveTypes) {
    EXPECT_GT(OneCell(type).quality[0], 0) << PrimitiveName(type);
  }
}

TEST(Boundary, InnerFacesOfABlockVanish) {
  const AtMostHexaMesh block = Block(3, 0);
  const auto boundary = BoundaryOf(block, {});
  ASSERT_TRUE(boundary.ok()) << boundary.status();
  EXPECT_EQ(boundary->size(), 6u * 9u);
}

TEST(MeshCheck, AcceptsOneCellOfEachTypeAndABlock) {
  EXPECT_TRUE(CheckMesh(OneOfEach()).ok()) << CheckMesh(OneOfEach());
  EXPECT_TRUE(CheckMesh(Block(4, 3)).ok()) << CheckMesh(Block(4, 3));
}

TEST(MeshCheck, RefusesNothing) { EXPECT_EQ(CheckMesh({}).code(), absl::StatusCode::kDataLoss); }

TEST(MeshCheck, RefusesArraysOfDifferentLengths) {
  AtMostHexaMesh mesh = Block(2, 0);
  mesh.types.pop_back();
  EXPECT_THAT(std::string(CheckMesh(mesh).message()), HasSubstr("8 cells, but 7 types"));
}

TEST(MeshCheck, RefusesCornersThatAreNoVertices) {
  AtMostHexaMesh mesh = Block(2, 0);
  mesh.corners[3][5] = 27;
  EXPECT_THAT(std::string(CheckMesh(mesh).message()), HasSubstr("cell 3 names vertex 27 of 27"));
  mesh.corners[3][5] = -1;
  EXPECT_FALSE(CheckMesh(mesh).ok());
}

TEST(MeshCheck, RefusesInvertedCells) {
  AtMostHexaMesh mesh = OneCell(PrimitiveType::kPrism);
  for (Vec3d& v : mesh.vertices) v.y = -v.y;
  EXPECT_THAT(std::string(CheckMesh(mesh).message()), HasSubstr("cell 0 (prism) has volume -0.5"));
}

TEST(MeshCheck, RefusesWrongTypeNames) {
  AtMostHexaMesh mesh = OneCell(PrimitiveType::kPyramid);
  mesh.types[0] = PrimitiveType::kSlice;
  EXPECT_THAT(std::string(CheckMesh(mesh).message()), HasSubstr("called slice, but is a pyramid"));
}

TEST(MeshCheck, RefusesVerticesThatAreNotFinite) {
  AtMostHexaMesh mesh = Block(2, 0);
  mesh.vertices[7].z = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(std::string(CheckMesh(mesh).message()), HasSubstr("vertex 7 is not finite"));
}

TEST(MeshCheck, RefusesCellsThatOverlap) {
  AtMostHexaMesh mesh = OneCell(PrimitiveType::kHexahedron);
  mesh.corners.push_back(mesh.corners[0]);
  mesh.types.push_back(mesh.types[0]);
  mesh.quality.push_back(mesh.quality[0]);
  EXPECT_THAT(std::string(CheckMesh(mesh).message()), HasSubstr("overlap"));
}

}  // namespace
}  // namespace amhex::client
