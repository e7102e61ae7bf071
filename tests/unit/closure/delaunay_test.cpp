#include "closure/delaunay.h"

#include <gtest/gtest.h>

#include <random>

namespace amhex {
namespace {

std::vector<Vec3d> RandomPoints(int count, unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> uniform(0, 10);
  std::vector<Vec3d> points(count);
  for (Vec3d& p : points) p = {uniform(generator), uniform(generator), uniform(generator)};
  return points;
}

double Volume(const Tetrahedra& t, const std::vector<Vec3d>& x) {
  double volume = 0;
  for (int i = 0; i < t.count(); ++i) {
    if (!t.IsFinite(i)) continue;
    const auto [a, b, c, d] = t.vertices[i];
    volume += Determinant(x[b] - x[a], x[c] - x[a], x[d] - x[a]) / 6;
  }
  return volume;
}

TEST(Delaunay, FewerThanFourPointsGiveNothing) {
  EXPECT_EQ(DelaunayTetrahedralization({}, 1).count(), 0);
  EXPECT_EQ(DelaunayTetrahedralization(RandomPoints(3, 1), 1).count(), 0);
}

TEST(Delaunay, NeighboursPointAtEachOther) {
  const Tetrahedra t = DelaunayTetrahedralization(RandomPoints(300, 2), 1);
  ASSERT_GT(t.count(), 0);
  for (int i = 0; i < t.count(); ++i) {
    for (const int n : t.neighbours[i]) {
      ASSERT_GE(n, 0);
      const auto& back = t.neighbours[n];
      EXPECT_NE(std::find(back.begin(), back.end(), i), back.end());
    }
  }
}

TEST(Delaunay, NoPointLiesInsideTheSphereOfANeighbour) {
  const auto x = RandomPoints(300, 3);
  const Tetrahedra t = DelaunayTetrahedralization(x, 1);
  for (int i = 0; i < t.count(); ++i) {
    if (!t.IsFinite(i)) continue;
    const auto [a, b, c, d] = t.vertices[i];
    // Circumcentre from the three perpendicular bisector planes.
    const Vec3d u = x[b] - x[a], v = x[c] - x[a], w = x[d] - x[a];
    const double det = 2 * Determinant(u, v, w);
    if (std::abs(det) < 1e-6) continue;
    const Vec3d o = (Cross(v, w) * SquaredNorm(u) + Cross(w, u) * SquaredNorm(v) +
                     Cross(u, v) * SquaredNorm(w)) /
                    det;
    const double radius = Norm(o);
    for (const Vec3d& p : x) EXPECT_GE(Norm(p - x[a] - o), radius * (1 - 1e-3));
  }
}

TEST(Delaunay, CospherePointsOfAGridFillItsBox) {
  std::vector<Vec3d> x;
  for (int k = 0; k < 125; ++k) x.push_back({double(k % 5), double(k / 5 % 5), double(k / 25)});
  EXPECT_NEAR(Volume(DelaunayTetrahedralization(x, 7), x), 64.0, 1e-3);
}

TEST(Delaunay, RepeatedPointsAreTakenOnce) {
  auto x = RandomPoints(50, 4);
  x.insert(x.end(), x.begin(), x.begin() + 50);
  EXPECT_GT(DelaunayTetrahedralization(x, 1).count(), 0);
}

}  // namespace
}  // namespace amhex
