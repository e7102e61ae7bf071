#include "topology/face_table.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "topology/primitive_catalog.h"
#include "unit/topology/cube_grid.h"

namespace amhex {
namespace {

TEST(HalfFace, TheCanonicalFormStartsAtTheSmallestVertexAndKeepsTheDirection) {
  EXPECT_EQ(CanonicalHalfFace(Quad(7, 3, 9, 5)), Quad(3, 9, 5, 7));
  EXPECT_EQ(CanonicalHalfFace(Triangle(8, 2, 4)), Triangle(2, 4, 8));
}

TEST(HalfFace, TheOppositeOfTheOppositeIsTheHalfFace) {
  const CellFace face = Quad(3, 9, 5, 7);
  EXPECT_EQ(OppositeHalfFace(face), Quad(3, 7, 5, 9));
  EXPECT_EQ(OppositeHalfFace(OppositeHalfFace(face)), face);
  EXPECT_NE(StandsForFace(face), StandsForFace(OppositeHalfFace(face)));
}

TEST(FaceTable, OfNoFacesFindsNone) {
  const FaceTable table = FaceTable::Build(0, {});
  EXPECT_EQ(table.count(), 0);
  EXPECT_EQ(table.Find(Triangle(0, 1, 2)), kNoHalfFace);
}

TEST(FaceTable, BothSidesOfAFaceAreOneEntryWithTwoIds) {
  const FaceTable table = FaceTable::Build(4, {Quad(0, 3, 2, 1), Quad(1, 2, 3, 0)});
  ASSERT_EQ(table.count(), 1);
  const HalfFaceId front = table.Find(Quad(0, 1, 2, 3));
  const HalfFaceId back = table.Find(Quad(3, 2, 1, 0));
  EXPECT_EQ(back, OppositeOf(front));
  EXPECT_EQ(table.half_face(front), Quad(0, 1, 2, 3));
  EXPECT_EQ(table.half_face(back), Quad(0, 3, 2, 1));
}

TEST(FaceTable, QuadsOverTheSameVerticesInAnotherOrderDiffer) {
  const FaceTable table =
      FaceTable::Build(4, {Quad(0, 1, 2, 3), Quad(0, 2, 1, 3), Triangle(0, 1, 2)});
  EXPECT_EQ(table.count(), 3);
  EXPECT_EQ(table.Find(Quad(0, 1, 3, 2)), kNoHalfFace);
}

TEST(FaceTable, DoesNotDependOnTheOrderOfItsInput) {
  std::vector<CellFace> faces;
  for (const CellCorners& corners : testing::MakeCubeGrid(3, 3, 3).corners) {
    for (const CellFace& face : FacesOf(corners)) faces.push_back(face);
  }
  const FaceTable first = FaceTable::Build(64, faces);
  std::shuffle(faces.begin(), faces.end(), std::mt19937(3));
  const FaceTable second = FaceTable::Build(64, faces);
  EXPECT_EQ(first.count(), 3 * 4 * 3 * 3);
  ASSERT_EQ(first.count(), second.count());
  for (int32_t f = 0; f < first.count(); ++f) EXPECT_EQ(first.face(f), second.face(f));
}

TEST(FaceTable, EveryHalfFaceFindsItself) {
  std::vector<CellFace> faces;
  for (const CellCorners& corners : testing::MakeCubeGrid(2, 2, 2).corners) {
    for (const CellFace& face : FacesOf(corners)) faces.push_back(face);
  }
  const FaceTable table = FaceTable::Build(27, faces);
  for (HalfFaceId h = 0; h < table.half_face_count(); ++h) {
    EXPECT_EQ(table.Find(table.half_face(h)), h);
  }
}

}  // namespace
}  // namespace amhex
