#include "input/merge_needles.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "fixtures/solids.h"
#include "input/build_hull.h"
#include "support/surface_measures.h"

namespace amhex {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

constexpr double kSharpAngle = 40;
constexpr double kLength = 10;

// A closed cylinder of radius 1 whose triangles reach from end to end and from rim to axis.
TriangleMesh NeedleCylinder(int around) {
  TriangleMesh mesh;
  for (const double z : {0.0, kLength}) {
    for (int i = 0; i < around; ++i) {
      const double angle = 2 * std::numbers::pi * i / around;
      mesh.vertices.push_back({std::cos(angle), std::sin(angle), z});
    }
  }
  mesh.vertices.push_back({0, 0, 0});
  mesh.vertices.push_back({0, 0, kLength});
  for (int i = 0; i < around; ++i) {
    const int j = (i + 1) % around;
    mesh.triangles.push_back({i, j, around + j});
    mesh.triangles.push_back({i, around + j, around + i});
    mesh.triangles.push_back({2 * around, j, i});
    mesh.triangles.push_back({2 * around + 1, around + i, around + j});
  }
  return mesh;
}

double FarthestFromVertices(const TriangleMesh& of, const TriangleMesh& from) {
  double farthest = 0;
  for (const Vec3d& p : of.vertices) {
    double least = std::numeric_limits<double>::max();
    for (const Vec3d& q : from.vertices) least = std::min(least, Norm(p - q));
    farthest = std::max(farthest, least);
  }
  return farthest;
}

TEST(MergeNeedles, TheSolidAndItsRimsStay) {
  constexpr double kEdgeLength = 0.4;
  const TriangleMesh given = NeedleCylinder(2000);
  TriangleMesh mesh = given;
  EXPECT_GT(MergeNeedles(kEdgeLength, kSharpAngle, mesh, {}), 0);
  EXPECT_TRUE(testing_support::IsClosedAndOriented(mesh));
  EXPECT_EQ(testing_support::EulerNumber(mesh), 2);
  const double volume = std::numbers::pi * kLength;
  EXPECT_NEAR(testing_support::EnclosedVolume(mesh), volume, 0.002 * volume);
  EXPECT_LT(FarthestFromVertices(mesh, given), 0.1 * kEdgeLength);
  EXPECT_LT(FarthestFromVertices(given, mesh), 0.1 * kEdgeLength);
  for (const Vec3d& p : mesh.vertices) {
    EXPECT_TRUE(p.z == 0 || p.z == kLength) << p.z;
    if (std::hypot(p.x, p.y) > 0) EXPECT_NEAR(std::hypot(p.x, p.y), 1, 1e-3);
  }
}

TEST(MergeNeedles, WhatIsLeftDoesNotGrowWithTheirNumber) {
  const auto left = [](int around) {
    TriangleMesh mesh = NeedleCylinder(around);
    MergeNeedles(0.4, kSharpAngle, mesh, {});
    return static_cast<double>(mesh.triangles.size());
  };
  EXPECT_LT(left(20'000), 1.5 * left(2'000));
}

TEST(MergeNeedles, OtherSurfacesAndFewNeedlesStayAsTheyAre) {
  for (const TriangleMesh& given :
       {NeedleCylinder(40), fixtures::MakeTorus(2, 0.6, 0.02), fixtures::MakeBox({3, 2, 1}, 10)}) {
    TriangleMesh mesh = given;
    EXPECT_EQ(MergeNeedles(0.4, kSharpAngle, mesh, {}), 0);
    EXPECT_EQ(mesh.vertices, given.vertices);
    EXPECT_EQ(mesh.triangles, given.triangles);
  }
}

// The rim of a thin plate is a band of needles between two sharp edges, which must stay two.
TEST(MergeNeedles, APlateKeepsItsThickness) {
  constexpr double kHeight = 0.01;
  TriangleMesh mesh = NeedleCylinder(4000);
  for (Vec3d& p : mesh.vertices) p = {10 * p.x, 10 * p.y, p.z * kHeight / kLength};
  const double volume = 100 * std::numbers::pi * kHeight;
  EXPECT_GT(MergeNeedles(0.4, kSharpAngle, mesh, {}), 0);
  EXPECT_NEAR(testing_support::EnclosedVolume(mesh), volume, 0.01 * volume);
}

TEST(BuildHull, NeedlesAreJoinedAndTold) {
  MeshingParams params;
  params.sizing.cell_count = 500;
  params.run.backend = Backend::kCpu;
  RunContext run;
  const auto hull = BuildHull(NeedleCylinder(5000), params, run);
  ASSERT_TRUE(hull.ok()) << hull.status();
  EXPECT_LT(hull->triangles.size(), 4000u);
  EXPECT_EQ(hull->genus, 0);
  EXPECT_NEAR(hull->volume, 500, 5);
  EXPECT_THAT(hull->warnings, Contains(HasSubstr("joined with neighbours")));
}

}  // namespace
}  // namespace amhex
