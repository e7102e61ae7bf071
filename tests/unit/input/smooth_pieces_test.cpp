#include "input/smooth_pieces.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "input/thin_cloud.h"

namespace amhex {
namespace {

struct Patch {
  std::vector<Vec3d> position, normal;
  std::vector<double> weight;

  void Add(const Vec3d& p, const Vec3d& n) {
    position.push_back(p);
    normal.push_back(Normalized(n));
    weight.push_back(1);
  }
  SmoothPieces Find() const { return FindSmoothPieces(position, normal, weight); }
};

// Samples of the faces x = 0, y = 0 and (optionally) z = 0 around the corner at the origin, of the
// solid with all coordinates negative.
Patch CornerOfBox(bool with_third_face) {
  Patch patch;
  for (double u = 0.1; u < 1; u += 0.3) {
    for (double v = 0.1; v < 1; v += 0.3) {
      patch.Add({0, -u, -v}, {1, 0.05 * u, 0});
      patch.Add({-u, 0, -v}, {0, 1, 0.05 * v});
      if (with_third_face) patch.Add({-u, -v, 0}, {0, 0, 1});
    }
  }
  return patch;
}

TEST(SmoothPieces, ABendIsOnePieceHoweverFarItTurns) {
  Patch bend;
  for (double angle = 0; angle < 2; angle += 0.1) {
    bend.Add({std::cos(angle), std::sin(angle), 0}, {std::cos(angle), std::sin(angle), 0});
  }
  EXPECT_EQ(bend.Find().count, 1);
}

TEST(SmoothPieces, AConvexEdgeTakesTheLargerDistance) {
  const SmoothPieces pieces = CornerOfBox(false).Find();
  ASSERT_EQ(pieces.count, 2);
  EXPECT_TRUE(pieces.is_convex[0][1]);
  EXPECT_EQ(DecidingPiece(pieces, {0.2, -0.5, 0}), 0);
  EXPECT_EQ(DecidingPiece(pieces, {-0.7, -0.5, 0}), 1);
}

TEST(SmoothPieces, AConcaveEdgeTakesTheSmallerDistance) {
  Patch groove = CornerOfBox(false);
  for (Vec3d& n : groove.normal) n = -n;
  const SmoothPieces pieces = groove.Find();
  ASSERT_EQ(pieces.count, 2);
  EXPECT_FALSE(pieces.is_convex[0][1]);
  EXPECT_EQ(DecidingPiece(pieces, {0.2, -0.5, 0}), 1);
}

TEST(SmoothPieces, ACornerHasThreePieces) {
  const SmoothPieces pieces = CornerOfBox(true).Find();
  ASSERT_EQ(pieces.count, 3);
  EXPECT_EQ(DecidingPiece(pieces, {-0.2, -0.1, -0.3}), 1);
  EXPECT_EQ(DecidingPiece(pieces, {-0.2, -0.1, 0.3}), 2);
}

TEST(SmoothPieces, OneStrayNormalIsNoPiece) {
  Patch plane;
  for (double u = 0; u < 1; u += 0.2) {
    for (double v = 0; v < 1; v += 0.2) plane.Add({u, v, 0}, {0, 0, 1});
  }
  plane.Add({0.5, 0.5, 0}, {1, 0, 0});
  EXPECT_EQ(plane.Find().count, 1);
}

TEST(DecidingPiece, AWallOnAFaceMeetsItBeforeTheRidgeEndsBoth) {
  // Pieces 0 and 1 meet in a groove, piece 2 cuts both off convexly: max(min(d0, d1), d2).
  SmoothPieces pieces;
  pieces.count = 3;
  pieces.is_convex[0][1] = false;
  pieces.is_convex[0][2] = pieces.is_convex[1][2] = true;
  EXPECT_EQ(DecidingPiece(pieces, {0.5, -0.5, -0.9}), 1);
  EXPECT_EQ(DecidingPiece(pieces, {0.5, -0.5, 0.1}), 2);
  EXPECT_EQ(DecidingPiece(pieces, {0.2, 0.5, 0.1}), 0);
}

TEST(ThinCloud, EachCubeAndDirectionKeepsItsMean) {
  PointCloud cloud;
  cloud.points = {{0.1, 0.1, 0.1}, {0.3, 0.1, 0.1}, {0.2, 0.2, 0.2}, {1.1, 0.1, 0.1}};
  cloud.normals = {{0, 0, 1}, {0, 0, 9}, {0, 0, -1}, {0, 0, 1}};
  EXPECT_EQ(ThinCloud(1.0, cloud), 1);
  ASSERT_EQ(cloud.points.size(), 3u);
  ASSERT_EQ(cloud.normals.size(), 3u);
  double x_sum = 0;
  for (const Vec3d& p : cloud.points) x_sum += p.x;
  EXPECT_NEAR(x_sum, 0.2 + 0.2 + 1.1, 1e-12);
}

}  // namespace
}  // namespace amhex
