#include "fields/point_index.h"

#include <gtest/gtest.h>

#include <set>

namespace amhex::fields {
namespace {

TEST(PointIndex, VisitsEveryPointWithinReachOnce) {
  std::vector<Vec3d> points;
  for (int i = 0; i < 2000; ++i) {
    points.push_back({5 * std::sin(1.7 * i), 3 * std::sin(2.3 * i + 1), 4 * std::sin(0.7 * i)});
  }
  const PointIndex index(points, 0.5);
  for (const Vec3d& centre : {Vec3d{0, 0, 0}, Vec3d{4.9, -2.9, 3.9}, Vec3d{9, 9, 9}}) {
    std::multiset<int32_t> visited;
    index.VisitNear(centre, 0.8, [&](int32_t i) { visited.insert(i); });
    for (int32_t i = 0; i < 2000; ++i) {
      const Vec3d d = points[i] - centre;
      const double reach = std::max({std::abs(d.x), std::abs(d.y), std::abs(d.z)});
      EXPECT_LE(visited.count(i), 1U);
      if (reach > 0.8) continue;
      EXPECT_EQ(visited.count(i), 1U);
    }
  }
}

TEST(PointIndex, HoldsNothingWithoutPoints) {
  const std::vector<Vec3d> none;
  int visits = 0;
  PointIndex(none, 1.0).VisitNear({}, 10, [&](int32_t) { ++visits; });
  EXPECT_EQ(visits, 0);
}

}  // namespace
}  // namespace amhex::fields
