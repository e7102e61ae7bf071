#include "input/drop_strays.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "amhex/params.h"
#include "fixtures/damage.h"
#include "fixtures/solids.h"
#include "input/build_hull.h"

namespace amhex {
namespace {

PointCloud Sphere(size_t count) {
  return fixtures::SampleSurface(fixtures::MakeSphere(1, 0.1), count, 7);
}

// Adds points anywhere in a cube around the origin.
void Strew(int count, double half_side, PointCloud& cloud) {
  fixtures::Chance chance(5);
  for (int i = 0; i < count; ++i) {
    cloud.points.push_back(chance.Vector() * half_side);
    cloud.normals.push_back({0, 0, 1});
  }
}

TEST(DropStrays, NoPointsHaveNone) { EXPECT_FALSE(DropStrays({}).has_value()); }

TEST(DropStrays, PointsAtOnePlaceHaveNone) {
  EXPECT_FALSE(DropStrays({std::vector<Vec3d>(100, Vec3d{1, 2, 3}), {}}).has_value());
}

TEST(DropStrays, BodiesHaveNoneHoweverFewTheirPoints) {
  for (const size_t count : {4, 30, 300, 3000}) {
    EXPECT_FALSE(DropStrays(Sphere(count)).has_value()) << count;
  }
}

TEST(DropStrays, AHalfThatIsScannedThirtyTimesLessDenselyIsKept) {
  PointCloud cloud;
  const PointCloud all = Sphere(12'000);
  for (size_t i = 0; i < all.points.size(); ++i) {
    if (all.points[i].x > 0 && i % 30 != 0) continue;
    cloud.points.push_back(all.points[i]);
    cloud.normals.push_back(all.normals[i]);
  }
  EXPECT_FALSE(DropStrays(cloud).has_value());
}

TEST(DropStrays, AStickThatIsScannedThirtyTimesLessDenselyIsKept) {
  PointCloud cloud = Sphere(6000);
  const TriangleMesh stick = fixtures::MakeBox({6, 0.2, 0.2}, 0.1);
  for (const Vec3d& p : fixtures::SampleSurface(stick, 80, 3).points) {
    cloud.points.push_back(p + Vec3d{0.9, 0, 0});
    cloud.normals.push_back({0, 0, 1});
  }
  EXPECT_FALSE(DropStrays(cloud).has_value());
}

TEST(DropStrays, BodiesFarFromEachOtherAreKept) {
  PointCloud cloud = Sphere(3000);
  const PointCloud other = Sphere(100);
  for (size_t i = 0; i < other.points.size(); ++i) {
    cloud.points.push_back(other.points[i] * 0.2 + Vec3d{50, 0, 0});
    cloud.normals.push_back(other.normals[i]);
  }
  EXPECT_FALSE(DropStrays(cloud).has_value());
}

TEST(DropStrays, FarPointsGoAndAllOthersStayInTheirOrder) {
  const PointCloud body = Sphere(5000);
  for (const double half_side : {10.0, 1e3, 1e6}) {
    PointCloud cloud = body;
    Strew(30, half_side, cloud);
    const auto without = DropStrays(cloud);
    ASSERT_TRUE(without.has_value()) << half_side;
    // One or two of them may lie beside the body by chance.
    ASSERT_GE(without->points.size(), body.points.size());
    EXPECT_LE(without->points.size(), body.points.size() + 2);
    for (size_t i = 0; i < body.points.size(); ++i) {
      ASSERT_EQ(without->points[i], body.points[i]);
      ASSERT_EQ(without->normals[i], body.normals[i]);
    }
  }
}

TEST(DropStrays, OneInTwentyMayGo) {
  for (const double half_side : {20.0, 1e3}) {
    PointCloud cloud = Sphere(570);
    Strew(30, half_side, cloud);
    const auto without = DropStrays(cloud);
    ASSERT_TRUE(without.has_value()) << half_side;
    EXPECT_EQ(without->points.size(), 570u);
  }
}

TEST(DropStrays, ThoseOfSeveralScalesGo) {
  PointCloud cloud = Sphere(5000);
  Strew(10, 1e2, cloud);
  Strew(10, 1e4, cloud);
  cloud.points.push_back({1e7, 1e7, 0});
  cloud.normals.clear();
  const auto without = DropStrays(cloud);
  ASSERT_TRUE(without.has_value());
  EXPECT_EQ(without->points.size(), 5000u);
  EXPECT_TRUE(without->normals.empty());
}

TEST(DropStrays, TheHullIsThatOfTheBodyAndSaysSo) {
  MeshingParams params;
  params.sizing.cell_count = 500;
  PointCloud cloud = Sphere(3000);
  RunContext run;
  const auto clean = BuildHull(cloud, params, run);
  Strew(20, 200, cloud);
  const auto hull = BuildHull(cloud, params, run);
  ASSERT_TRUE(clean.ok() && hull.ok()) << hull.status();
  EXPECT_EQ(hull->vertices.size(), clean->vertices.size());
  EXPECT_EQ(hull->frame.scale, clean->frame.scale);
  EXPECT_THAT(hull->warnings,
              testing::Contains("stray points far out, that made the box at least twice as "
                                "large, left out: 20"));
}

}  // namespace
}  // namespace amhex
