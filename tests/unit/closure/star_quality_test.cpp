// The law of judging no further than asked: what is judged short is not above what was enough.
#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "base/platform.h"
#include "closure/star_geometry.h"

namespace amhex {
namespace {

TEST(StarQuality, IsWholeWhereItIsAboveWhatIsEnough) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> number(-1, 1);
  const auto near = [&](double x, double y, double z) {
    return Vec3d{x + 0.4 * number(random), y + 0.4 * number(random), z + 0.4 * number(random)};
  };
  int whole_ones = 0, short_ones = 0;
  for (int round = 0; round < 500; ++round) {
    const std::vector<Vec3d> x = {near(0, 0, 0), near(1, 0, 0), near(1, 1, 0), near(0, 1, 0)};
    const Vec3d apex = near(0.5, 0.5, 0.8);
    for (const CellFace& face : {CellFace{4, {0, 1, 2, 3}}, CellFace{3, {0, 1, 2, -1}}}) {
      const double whole = StarQuality(face, apex, x);
      for (const double enough : {-0.3, 0.0, 0.2, 0.5}) {
        const double asked = StarQuality(face, apex, x, enough);
        if (whole > enough) {
          EXPECT_EQ(asked, whole);
          ++whole_ones;
        } else {
          EXPECT_LE(asked, enough);
          EXPECT_GE(asked, whole);
          short_ones += asked > whole ? 1 : 0;
        }
      }
    }
  }
  EXPECT_GT(whole_ones, 500);
  EXPECT_GT(short_ones, 100);
}

// Walls look in. A pyramid on a square: triangles and a quad.
struct Walls {
  std::vector<Vec3d> corners;
  std::vector<CellFace> faces;
};
Walls MakePyramidWalls() {
  return {{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.5, 0.5, 1}},
          {{4, {0, 1, 2, 3}},
           {3, {1, 0, 4, -1}},
           {3, {2, 1, 4, -1}},
           {3, {3, 2, 4, -1}},
           {3, {0, 3, 4, -1}}}};
}
Walls MakeCubeWalls() {
  Walls walls;
  for (int i = 0; i < 8; ++i) {
    walls.corners.push_back({i & 1 ? 1.0 : 0.0, i & 2 ? 1.0 : 0.0, i & 4 ? 1.0 : 0.0});
  }
  walls.faces = {{4, {0, 1, 3, 2}}, {4, {4, 6, 7, 5}}, {4, {0, 4, 5, 1}},
                 {4, {2, 3, 7, 6}}, {4, {0, 2, 6, 4}}, {4, {1, 5, 7, 3}}};
  return walls;
}

// Most places that the search tries are judged by squares alone.
TEST(Star, ApexSearchOverlooksNoBetterPlaceAtTheLengthOfItsLastSteps) {
  constexpr double kFirstStep = 0.25, kLastStep = kFirstStep / 16, kLeastGain = 1e-6;
  const VectorWidth limit = vector_width_limit.load();
  std::mt19937 random(7);
  std::uniform_real_distribution<double> number(-0.35, 0.35);
  int bad_ones = 0, good_ones = 0;
  for (int round = 0; round < 60; ++round) {
    for (Walls walls : {MakePyramidWalls(), MakeCubeWalls()}) {
      for (Vec3d& corner : walls.corners)
        corner += {number(random), number(random), number(random)};
      const Vec3d start =
          Vec3d{0.5, 0.5, 0.4} + Vec3d{number(random), number(random), number(random)};
      Vec3d found;
      for (const VectorWidth width :
           {VectorWidth::kBaseline, VectorWidth::k256, VectorWidth::k512}) {
        vector_width_limit.store(width);
        Vec3d apex = start;
        const double quality = ImproveApex(walls.faces, walls.corners, kFirstStep, &apex);
        EXPECT_TRUE(width == VectorWidth::kBaseline || apex == found);
        found = apex;
        if (quality < -0.9) continue;  // hopeless ones are not judged to the end
        ++(quality > 0 ? good_ones : bad_ones);
        EXPECT_EQ(quality, MinStarQuality(walls.faces, apex, walls.corners));
        for (int i = 0; i < 27; ++i) {
          const Vec3d way{i % 3 - 1.0, i / 3 % 3 - 1.0, i / 9 - 1.0};
          const int axes = static_cast<int>(SquaredNorm(way));
          if (axes != 1 && axes != 3) continue;
          const Vec3d beside = apex + Normalized(way) * kLastStep;
          EXPECT_LE(MinStarQuality(walls.faces, beside, walls.corners), quality + kLeastGain);
        }
      }
    }
  }
  vector_width_limit.store(limit);
  EXPECT_GT(good_ones, 100);
  EXPECT_GT(bad_ones, 10);
}

}  // namespace
}  // namespace amhex
