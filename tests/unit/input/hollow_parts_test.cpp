// Clouds without normals: a closed part within another one is a cavity, and nothing else is.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "fixtures/damage.h"
#include "fixtures/solids.h"
#include "input/build_hull.h"
#include "input/hull_queries.h"
#include "support/hull_measures.h"

namespace amhex {
namespace {

using testing_support::UserVolume;

using fixtures::Joined;
using fixtures::MakeBox;
using fixtures::MakeSphere;
using fixtures::MakeTorus;
using fixtures::Translated;

constexpr double kSpacing = 0.15;
constexpr double kPi = 3.14159265358979;

double Ball(double radius) { return 4.0 / 3 * kPi * std::pow(radius, 3); }

TriangleMesh CubeAbout(const Vec3d& centre, double side) {
  const double half = side / 2;
  return Translated(MakeBox({side, side, side}, kSpacing), centre - Vec3d{half, half, half});
}

absl::StatusOr<Hull> BuildWithoutNormals(const TriangleMesh& surface) {
  PointCloud cloud = fixtures::SampleCentres(surface);
  cloud.normals.clear();
  MeshingParams params;
  params.sizing.cell_count = 1500;
  RunContext run;
  return BuildHull(cloud, params, run);
}

bool IsSolid(const Hull& hull, const Vec3d& p) {
  return hull.queries->IsInside(hull.frame.ToNormalized(p));
}

bool TellsOfCavities(const Hull& hull, int count) {
  const std::string end = "normals to tell: " + std::to_string(count);
  return std::any_of(hull.warnings.begin(), hull.warnings.end(), [&](const std::string& warning) {
    return warning.find("taken for cavities") != std::string::npos && warning.ends_with(end);
  });
}

TEST(HollowParts, ABallWithinABallIsACavity) {
  const auto hull = BuildWithoutNormals(Joined(MakeSphere(2, kSpacing), MakeSphere(1, kSpacing)));
  ASSERT_TRUE(hull.ok()) << hull.status();
  EXPECT_EQ(hull->component_count, 2);
  EXPECT_FALSE(IsSolid(*hull, {0, 0, 0}));
  EXPECT_TRUE(IsSolid(*hull, {0, 0, 1.5}));
  EXPECT_NEAR(UserVolume(*hull), Ball(2) - Ball(1), 0.03 * Ball(2));
  EXPECT_TRUE(TellsOfCavities(*hull, 1));
}

// Where they touch, nothing tells one ball's points from the other's, whose normals look the other
// way.
TEST(HollowParts, BallsThatTouchAreBothSolid) {
  constexpr size_t kBallPoints = 3000;
  PointCloud cloud = fixtures::SampleSurface(MakeSphere(1, kSpacing), kBallPoints, 1);
  for (const Vec3d& p : fixtures::SampleSurface(MakeSphere(1, kSpacing), kBallPoints, 2).points) {
    cloud.points.push_back(p + Vec3d{2, 0, 0});
  }
  cloud.normals.clear();
  MeshingParams params;
  params.sizing.cell_count = 500;
  RunContext run;
  const auto hull = BuildHull(cloud, params, run);
  ASSERT_TRUE(hull.ok()) << hull.status();
  EXPECT_TRUE(IsSolid(*hull, {0, 0, 0}));
  EXPECT_TRUE(IsSolid(*hull, {2, 0, 0}));
  EXPECT_NEAR(UserVolume(*hull), 2 * Ball(1), 0.05 * Ball(1));
}

TEST(HollowParts, ABoxWithinABoxIsACavityWhereverItLies) {
  const auto hull =
      BuildWithoutNormals(Joined(CubeAbout({0, 0, 0}, 4), CubeAbout({0.6, 0.5, -0.4}, 2)));
  ASSERT_TRUE(hull.ok()) << hull.status();
  EXPECT_EQ(hull->component_count, 2);
  EXPECT_FALSE(IsSolid(*hull, {0.6, 0.5, -0.4}));
  EXPECT_NEAR(UserVolume(*hull), 64 - 8, 1.5);
}

TEST(HollowParts, EveryCavityOfABodyIsOne) {
  const TriangleMesh cavities = Joined(Translated(MakeSphere(0.7, kSpacing), {-1, 0, 0}),
                                       Translated(MakeTorus(0.5, 0.25, 0.08), {0.9, 0, 0.2}));
  const auto hull = BuildWithoutNormals(Joined(cavities, CubeAbout({0, 0, 0}, 4)));
  ASSERT_TRUE(hull.ok()) << hull.status();
  EXPECT_EQ(hull->component_count, 3);
  EXPECT_FALSE(IsSolid(*hull, {-1, 0, 0}));
  EXPECT_FALSE(IsSolid(*hull, {1.4, 0, 0.2}));
  EXPECT_TRUE(IsSolid(*hull, {0.9, 0, 0.2}));  // the hole of the torus
  EXPECT_TRUE(TellsOfCavities(*hull, 2));
}

TEST(HollowParts, AWallOfThreeSpacingsBetweenRandomPointsIsEnough) {
  const TriangleMesh surface = Joined(MakeSphere(2, kSpacing), MakeSphere(1.5, kSpacing));
  PointCloud cloud = fixtures::SampleSurface(surface, 3000, 1);
  cloud.normals.clear();
  MeshingParams params;
  params.sizing.cell_count = 1500;
  RunContext run;
  const auto hull = BuildHull(cloud, params, run);
  ASSERT_TRUE(hull.ok()) << hull.status();
  EXPECT_EQ(hull->component_count, 2);
  EXPECT_NEAR(UserVolume(*hull), Ball(2) - Ball(1.5), 0.05 * Ball(2));
}

TEST(HollowParts, ABodyWithinACavityIsSolid) {
  const auto hull = BuildWithoutNormals(Joined(
      Joined(MakeSphere(0.8, kSpacing), MakeSphere(3, kSpacing)), MakeSphere(1.9, kSpacing)));
  ASSERT_TRUE(hull.ok()) << hull.status();
  EXPECT_EQ(hull->component_count, 3);
  EXPECT_TRUE(IsSolid(*hull, {0, 0, 0}));
  EXPECT_FALSE(IsSolid(*hull, {0, 0, 1.35}));
  EXPECT_TRUE(IsSolid(*hull, {0, 0, 2.45}));
  EXPECT_TRUE(TellsOfCavities(*hull, 1));
}

TEST(HollowParts, BodiesBesideEachOtherStaySolid) {
  // The small one lies in the box around the large one and in its hole, but not in it.
  const auto hull =
      BuildWithoutNormals(Joined(MakeTorus(2, 0.6, kSpacing), MakeSphere(0.5, kSpacing)));
  ASSERT_TRUE(hull.ok()) << hull.status();
  EXPECT_EQ(hull->component_count, 2);
  EXPECT_TRUE(IsSolid(*hull, {0, 0, 0}));
  EXPECT_TRUE(IsSolid(*hull, {2, 0, 0}));
  EXPECT_FALSE(TellsOfCavities(*hull, 1));
}

TEST(HollowParts, AnOpenOuterPartHasItsCavityToo) {
  PointCloud cloud =
      fixtures::SampleCentres(Joined(MakeSphere(2, kSpacing), MakeSphere(0.8, kSpacing)));
  PointCloud open;
  for (const Vec3d& p : cloud.points) {
    if (p.z > -1.85) open.points.push_back(p);
  }
  MeshingParams params;
  params.sizing.cell_count = 1500;
  RunContext run;
  const auto hull = BuildHull(open, params, run);
  ASSERT_TRUE(hull.ok()) << hull.status();
  EXPECT_FALSE(IsSolid(*hull, {0, 0, 0}));
  EXPECT_TRUE(IsSolid(*hull, {0, 0, 1.4}));
}

TEST(HollowParts, ASheetWithinABodyIsNoCavity) {
  TriangleMesh sheet;
  for (const auto& t : CubeAbout({0, 0, 0}, 1.5).triangles) {
    const TriangleMesh cube = CubeAbout({0, 0, 0}, 1.5);
    const auto is_low = [&](int32_t v) { return cube.vertices[static_cast<size_t>(v)].z < -0.7; };
    sheet.vertices = cube.vertices;
    if (is_low(t[0]) && is_low(t[1]) && is_low(t[2])) sheet.triangles.push_back(t);
  }
  const auto hull = BuildWithoutNormals(Joined(MakeSphere(2, kSpacing), sheet));
  ASSERT_TRUE(hull.ok()) << hull.status();
  EXPECT_FALSE(TellsOfCavities(*hull, 1));
  EXPECT_NEAR(UserVolume(*hull), Ball(2), 0.05 * Ball(2));
}

TEST(HollowParts, NormalsThatAreGivenAreKept) {
  const auto inward = fixtures::SampleCentres(
      Joined(MakeSphere(2, kSpacing), MakeSphere(1, kSpacing)));  // both look outward
  MeshingParams params;
  params.sizing.cell_count = 1500;
  RunContext run;
  const auto hull = BuildHull(inward, params, run);
  ASSERT_TRUE(hull.ok()) << hull.status();
  EXPECT_TRUE(IsSolid(*hull, {0, 0, 0}));
  EXPECT_FALSE(TellsOfCavities(*hull, 1));
}

}  // namespace
}  // namespace amhex
