// The point of a face nearest to another one is that of the nearest of its triangles.
#include "optimize/nearest_on_face.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "base/widest_vectors.h"
#include "input/triangle_math.h"

namespace amhex {
namespace {

struct Expected {
  Vec3d point;
  double squared = 1e300;
  int side = 0;
};
Expected OneByOne(const std::vector<Vec3d>& corner, const Vec3d& middle, const Vec3d& p) {
  Expected nearest;
  const int count = static_cast<int>(corner.size());
  for (int side = 0; side < (count == 4 ? 4 : 1); ++side) {
    const Vec3d third = count == 4 ? middle : corner[2];
    const Vec3d q = ClosestPointOnTriangle(p, corner[side], corner[(side + 1) % count], third);
    if (SquaredNorm(q - p) < nearest.squared) nearest = {q, SquaredNorm(q - p), side};
  }
  return nearest;
}

void ExpectTheSame(const std::vector<Vec3d>& corner, const Vec3d& middle, const Vec3d& p) {
  const FaceInLanes face(corner.data(), static_cast<int>(corner.size()), middle);
  NearestOnFace found;
  RunWithWidestVectors([&] { found = face.Nearest(p); });
  const Expected expected = OneByOne(corner, middle, p);
  EXPECT_EQ(found.squared, expected.squared);
  EXPECT_EQ(found.point, expected.point);
  EXPECT_EQ(found.side, expected.side);
}

TEST(FaceInLanes, HasTheBitsOfTheTrianglesOneByOne) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> number(-1, 1);
  const auto any = [&] { return Vec3d{number(random), number(random), number(random)}; };
  for (const int count : {3, 4}) {
    for (int i = 0; i < 20'000; ++i) {
      std::vector<Vec3d> corner;
      Vec3d middle;
      for (int j = 0; j < count; ++j) {
        corner.push_back(any());
        middle += corner.back() / static_cast<double>(count);
      }
      ExpectTheSame(corner, middle, any() * 2.0);
    }
  }
}

// Every region of a triangle and the lines between them: points of a grid about a square of it.
TEST(FaceInLanes, HasThemAtCornersAndEdgesToo) {
  const std::vector<Vec3d> square = {{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}};
  const std::vector<Vec3d> triangle = {{0, 0, 0}, {2, 0, 0}, {0, 2, 0}};
  for (int x = -2; x <= 6; ++x) {
    for (int y = -2; y <= 6; ++y) {
      for (const double z : {-1.0, 0.0, 1.0}) {
        ExpectTheSame(square, {1, 1, 0}, {x / 2.0, y / 2.0, z});
        ExpectTheSame(triangle, {}, {x / 2.0, y / 2.0, z});
      }
    }
  }
}

TEST(FaceInLanes, HasThemWhereTrianglesAreLinesAndPoints) {
  const Vec3d a{0, 0, 0}, b{1, 0, 0}, c{2, 0, 0};
  for (const Vec3d& p : {Vec3d{-1, 1, 0}, Vec3d{0.3, 1, 1}, Vec3d{1.5, 0, 0}, Vec3d{4, 0, 1}}) {
    ExpectTheSame({a, b, c}, {}, p);
    ExpectTheSame({a, a, c}, {}, p);
    ExpectTheSame({a, a, a}, {}, p);
    ExpectTheSame({a, b, c, b}, b, p);
    ExpectTheSame({a, a, b, b}, {0.5, 0, 0}, p);
  }
}

}  // namespace
}  // namespace amhex
