#include "relax/split_sites.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <cmath>
#include <numeric>
#include <vector>

#include "fixtures/solids.h"
#include "relax/build_barrier.h"
#include "unit/graph/random_points.h"
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

// Sites in a box with room for `capacity` of them, and what the splitting bodies look at.
struct SplitCase {
  HullBarrier barrier;
  std::vector<int64_t> state = std::vector<int64_t>(kStateSize, 0);
  std::vector<int32_t> claim_count, is_inside, rank;
  std::vector<CellMoments> moments;
  std::vector<Vec3d> position;
  std::vector<Quatf> orientation;
  std::vector<Vec3f> size;

  SplitCase(int32_t claims, const CellMoments& cell, size_t capacity) {
    RunContext run;
    barrier = *BuildHullBarrier(testing_support::HullOfMesh(fixtures::MakeBox({8, 8, 8}, 2)), 108,
                                1.0, run);
    state[kSiteCount] = 2;
    state[kClusterCount] = 1;
    claim_count.assign(capacity, claims);
    is_inside.assign(capacity, 1);
    rank.assign(capacity + 1, -1);
    moments.assign(capacity, cell);
    const Vec3d corner = Vec3d{} - barrier.origin;
    position.assign(capacity, {});
    position[0] = corner + Vec3d{2, 4, 4};
    position[1] = corner + Vec3d{6, 4, 4};
    orientation.resize(capacity);
    size.assign(capacity, {1, 1, 1});
  }

  void Run() {
    const auto count = static_cast<int64_t>(position.size());
    SplitView view;
    view.barrier = barrier.View();
    view.criterion = {10, barrier.lattice.point_volume()};
    view.state = {{state.data(), kStateSize}};
    view.capacity = count;
    view.claim_count = {claim_count.data(), count};
    view.moments = {moments.data(), count};
    view.position = {position.data(), count};
    view.orientation = {orientation.data(), count};
    view.size = {size.data(), count};
    view.is_inside = {is_inside.data(), count};
    view.rank = {rank.data(), count + 1};
    for (int64_t i = 0; i <= count; ++i) FlagSplitsBody{view}(i);
    std::exclusive_scan(rank.begin(), rank.end(), rank.begin(), 0);
    for (int64_t i = 0; i < state[kSiteCount]; ++i) SplitBody{view}(i);
    AdvanceBody{view}(0);
  }
};

TEST(PrincipalDirection, IsTheLongestSideOfABox) {
  const Vec3d d = PrincipalDirection(MomentsOfBox(4, 9, 5));
  EXPECT_NEAR(d.y, 1, 1e-9);
}

TEST(PrincipalDirection, IsTheEigenvectorOfTheLargestEigenvalue) {
  for (uint64_t seed = 1; seed <= 50; ++seed) {
    const std::vector<Vec3f> points = RandomPoints(seed, 12, 40);
    CellMoments m;
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const Vec3f& p : points) {
      const auto a = static_cast<int64_t>(p.x), b = static_cast<int64_t>(p.y),
                 c = static_cast<int64_t>(p.z);
      ++m.count;
      m.x += a, m.y += b, m.z += c;
      m.xx += a * a, m.yy += b * b, m.zz += c * c;
      m.xy += a * b, m.yz += b * c, m.zx += c * a;
      mean +=
          Eigen::Vector3d(static_cast<double>(a), static_cast<double>(b), static_cast<double>(c));
    }
    mean /= static_cast<double>(points.size());
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    for (const Vec3f& p : points) {
      const Eigen::Vector3d d =
          Eigen::Vector3d(std::floor(p.x), std::floor(p.y), std::floor(p.z)) - mean;
      spread += d * d.transpose();
    }
    const Vec3d found = PrincipalDirection(m);
    const Eigen::Vector3d expected =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors().col(2);
    EXPECT_NEAR(std::abs(expected.dot(Eigen::Vector3d(found.x, found.y, found.z))), 1, 1e-9);
  }
}

TEST(SplitSites, ReplaceALargeClusterByTwoSitesAlongItsPrincipalDirection) {
  SplitCase c(10, MomentsOfBox(12, 6, 6), 9);
  c.claim_count[1] = 9;
  const Vec3d before = c.position[0];
  c.Run();
  EXPECT_EQ(c.state[kSiteCount], 3);
  EXPECT_EQ(c.state[kMovedCount], 2);
  EXPECT_EQ(c.state[kSplitCount], 1);
  EXPECT_EQ(c.state[kIteration], 1);
  EXPECT_NEAR(Norm((c.position[0] + c.position[2]) * 0.5 - before), 0, 1e-12);
  EXPECT_NEAR(std::abs(c.position[0].x - c.position[2].x), 0.5, 1e-6);
}

TEST(SplitSites, LeaveCellsWithoutRoomForTwoAndRespectTheCapacity) {
  SplitCase small(20, MomentsOfBox(6, 6, 3), 9);
  small.Run();
  EXPECT_EQ(small.state[kSiteCount], 2);
  SplitCase full(20, MomentsOfBox(12, 6, 6), 3);
  const Vec3d last = full.position[1];
  full.Run();
  EXPECT_EQ(full.state[kSiteCount], 3);
  EXPECT_EQ(full.state[kSplitCount], 1);
  EXPECT_EQ(full.position[1], last);
}

TEST(SplitSites, DoNothingWithoutClustersOrOutside) {
  SplitCase none(20, MomentsOfBox(12, 6, 6), 9);
  none.state[kClusterCount] = 0;
  none.Run();
  EXPECT_EQ(none.state[kSiteCount], 2);
  SplitCase outside(20, MomentsOfBox(12, 6, 6), 9);
  outside.is_inside.assign(9, 0);
  outside.Run();
  EXPECT_EQ(outside.state[kSiteCount], 2);
}

}  // namespace
}  // namespace amhex
