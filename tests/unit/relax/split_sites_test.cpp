#include "relax/split_sites.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fixtures/solids.h"
#include "relax/build_barrier.h"
#include "unit/relax/relax_fixtures.h"

namespace amhex {
namespace {

// Moments of a full box of `x` by `y` by `z` lattice coordinates.
CellMoments MomentsOfBox(int x, int y, int z) {
  CellMoments m;
  for (int i = 0; i < x * y * z; ++i) {
    const int64_t a = i % x, b = i / x % y, c = i / x / y;
    ++m.count;
    m.x += a, m.y += b, m.z += c;
    m.xx += a * a, m.yy += b * b, m.zz += c * c;
    m.xy += a * b, m.yz += b * c, m.zx += c * a;
  }
  return m;
}

RelaxationTask TwoSitesInABox() {
  RunContext run;
  RelaxationTask task;
  task.barrier = *BuildHullBarrier(testing_support::HullOfMesh(fixtures::MakeBox({8, 8, 8}, 2)),
                                   108, 1.0, run);
  const Vec3d corner = Vec3d{} - task.barrier.origin;
  task.position = {corner + Vec3d{2, 4, 4}, corner + Vec3d{6, 4, 4}};
  task.orientation.resize(2);
  task.size.assign(2, {1, 1, 1});
  task.is_inside.assign(2, 1);
  task.split_limit = 10;
  return task;
}

TEST(PrincipalDirection, IsTheLongestSideOfABox) {
  const Vec3d d = PrincipalDirection(MomentsOfBox(4, 9, 5));
  EXPECT_NEAR(d.y, 1, 1e-9);
}

TEST(SplitClusters, ReplacesALargeClusterByTwoSitesAlongItsPrincipalDirection) {
  RelaxationTask task = TwoSitesInABox();
  const Vec3d before = task.position[0];
  EXPECT_EQ(SplitClusters({10, 9}, {MomentsOfBox(12, 6, 6), MomentsOfBox(12, 6, 6)}, 9, task), 1);
  ASSERT_EQ(task.position.size(), 3u);
  EXPECT_NEAR(Norm((task.position[0] + task.position[2]) * 0.5 - before), 0, 1e-12);
  EXPECT_NEAR(std::abs(task.position[0].x - task.position[2].x), 0.5, 1e-6);
  EXPECT_EQ(task.orientation.size(), 3u);
  EXPECT_EQ(task.is_inside, (std::vector<int32_t>{1, 1, 1}));
}

TEST(SplitClusters, LeavesCellsWithoutRoomForTwoAndRespectsTheSiteLimit) {
  RelaxationTask task = TwoSitesInABox();
  EXPECT_EQ(SplitClusters({20, 20}, {MomentsOfBox(6, 6, 3), MomentsOfBox(6, 6, 3)}, 9, task), 0);
  EXPECT_EQ(SplitClusters({20, 20}, {MomentsOfBox(12, 6, 6), MomentsOfBox(12, 6, 6)}, 3, task), 1);
  EXPECT_EQ(task.position.size(), 3u);
}

}  // namespace
}  // namespace amhex
