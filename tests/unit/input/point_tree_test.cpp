#include "input/point_tree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "base/counter_rng.h"

namespace amhex {
namespace {

// Dense on one side, sparse on the other, some of them equal.
std::vector<Vec3d> UnevenPoints(int count) {
  std::vector<Vec3d> points;
  for (int i = 0; i < count; ++i) {
    const auto number = [i](uint64_t k) {
      return RandomUnit(1, RandomStream::kGridJitter, static_cast<uint64_t>(3 * i) + k);
    };
    const double x = number(0);
    points.push_back({x * x * x * 10, number(1), number(2)});
    if (i % 20 == 0) points.push_back(points.back());
  }
  return points;
}

std::vector<PointTree::Neighbour> BruteForce(const std::vector<Vec3d>& points, const Vec3d& p) {
  std::vector<PointTree::Neighbour> all;
  for (size_t i = 0; i < points.size(); ++i) {
    all.push_back({SquaredNorm(points[i] - p), static_cast<int32_t>(i)});
  }
  std::sort(all.begin(), all.end());
  return all;
}

TEST(PointTree, NearestAgreesWithSortingAllPoints) {
  const std::vector<Vec3d> points = UnevenPoints(700);
  const PointTree tree(points);
  std::vector<PointTree::Neighbour> found;
  for (size_t q = 0; q < points.size(); q += 7) {
    const Vec3d p = points[q] + Vec3d{0.1, q % 3 * 0.1, 0};
    const auto wanted = BruteForce(points, p);
    tree.Nearest(p, 12, found);
    ASSERT_EQ(found.size(), 12u);
    for (size_t k = 0; k < found.size(); ++k) EXPECT_EQ(found[k].index, wanted[k].index);
    EXPECT_EQ(tree.Nearest(p).index, wanted[0].index);
  }
}

TEST(PointTree, WithinFindsExactlyThePointsOfTheBall) {
  const std::vector<Vec3d> points = UnevenPoints(500);
  const PointTree tree(points);
  std::vector<PointTree::Neighbour> found;
  for (const double radius : {0.05, 0.4, 3.0}) {
    tree.Within({0.5, 0.5, 0.5}, radius, found);
    size_t wanted = 0;
    for (const Vec3d& p : points) wanted += Norm(p - Vec3d{0.5, 0.5, 0.5}) <= radius ? 1 : 0;
    EXPECT_EQ(found.size(), wanted);
    EXPECT_TRUE(std::is_sorted(found.begin(), found.end(),
                               [](const auto& a, const auto& b) { return a.index < b.index; }));
  }
}

TEST(PointTree, FewerPointsThanAskedForAreAllGiven) {
  const PointTree tree({{0, 0, 0}, {1, 0, 0}});
  std::vector<PointTree::Neighbour> found;
  tree.Nearest({2, 0, 0}, 5, found);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].index, 1);
}

TEST(PointTree, BeyondTheMaximumDistanceThereIsNone) {
  const PointTree tree({{0, 0, 0}});
  EXPECT_EQ(tree.Nearest({2, 0, 0}, 1.5).index, -1);
  EXPECT_EQ(tree.Nearest({2, 0, 0}, 2.5).index, 0);
}

TEST(PointTree, ManyEqualPointsEndInAnAnswer) {
  const PointTree tree(std::vector<Vec3d>(5000, Vec3d{1, 1, 1}));
  EXPECT_EQ(tree.Nearest({0, 0, 0}).index, 0);
}

}  // namespace
}  // namespace amhex
