#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "demo/scanner.h"
#include "demo/shapes.h"
#include "demo/surface.h"

namespace amhex::client {
namespace {

Shape Named(const std::string& name) {
  auto shape = MakeShape(name);
  EXPECT_TRUE(shape.ok()) << shape.status();
  return *shape;
}

TEST(Shapes, UnknownNamesListTheKnownOnes) {
  EXPECT_THAT(std::string(MakeShape("teapot").status().message()),
              ::testing::HasSubstr("bracket, sphere, cube, torus"));
}

TEST(Shapes, DistancesGrowNoFasterThanTheirBound) {
  for (const std::string& name : ShapeNames()) {
    const Shape shape = Named(name);
    const double step = 1e-4 * shape.box.Diagonal();
    const Vec3d extent = shape.box.Extent();
    for (int i = 0; i < 4000; ++i) {
      const Vec3d u = {std::fmod(i * 0.7548, 1.0), std::fmod(i * 0.5698, 1.0),
                       std::fmod(i * 0.3217, 1.0)};
      const Vec3d p = shape.box.low + Vec3d{u.x * extent.x, u.y * extent.y, u.z * extent.z};
      const Vec3d q = p + Normalized(Vec3d{u.y - 0.5, u.z - 0.5, u.x - 0.5}) * step;
      EXPECT_LE(std::abs(shape.distance(p) - shape.distance(q)), 1.4143 * step) << name;
    }
  }
}

TEST(Shapes, TheBracketHasItsHolesAndFillets) {
  const Shape bracket = Named("bracket");
  EXPECT_LT(bracket.distance({0, 20, 6}), 0) << "inside the base plate";
  EXPECT_GT(bracket.distance({30, 16, 6}), 0) << "in a base hole";
  EXPECT_GT(bracket.distance({30, -16, 6}), 0) << "in the other base hole";
  EXPECT_GT(bracket.distance({-44, 17, 42}), 0) << "in a flange hole";
  EXPECT_GT(bracket.distance({-28, 0, 22}), 0) << "in the rib's hole";
  EXPECT_LT(bracket.distance({-20, 0, 15}), 0) << "inside the rib";
  EXPECT_LT(bracket.distance({-36.5, 25, 13.5}), 0) << "inside the fillet of base and flange";
  EXPECT_GT(bracket.distance({-29, 25, 21}), 0) << "above that fillet";
}

TEST(Scan, PointsLieOnTheSurfaceWithinTheNoise) {
  for (const std::string& name : ShapeNames()) {
    const Shape shape = Named(name);
    ScanOptions options;
    options.point_count = 3000;
    const auto scan = ScanShape(shape, options);
    ASSERT_TRUE(scan.ok()) << scan.status();
    // Noise is cut off at three deviations per axis, and distances grow at most by sqrt(2).
    const double bound = std::sqrt(2.0) * std::sqrt(3.0) * 3 * scan->noise;
    double sum = 0;
    for (const Vec3d& p : scan->cloud.points) {
      EXPECT_LE(std::abs(shape.distance(p)), bound + 1e-6);
      sum += std::abs(shape.distance(p));
    }
    EXPECT_GT(sum / 3000, 0.2 * scan->noise) << "there is noise";
  }
}

TEST(Scan, WithoutNoiseTheNormalsAreThoseOfTheSurface) {
  const Shape sphere = Named("sphere");
  ScanOptions options;
  options.point_count = 500;
  options.noise = 0;
  options.normal_noise = 0;
  const auto scan = ScanShape(sphere, options);
  ASSERT_TRUE(scan.ok());
  for (size_t i = 0; i < 500; ++i) {
    EXPECT_LT(Norm(scan->cloud.normals[i] - scan->cloud.points[i] * 2.0), 1e-5);
  }
}

TEST(Scan, EveryScannerContributesItsShare) {
  ScanOptions options;
  options.point_count = 1400;
  const auto scan = ScanShape(Named("bracket"), options);
  ASSERT_TRUE(scan.ok());
  EXPECT_EQ(scan->cloud.points.size(), 1400u);
  for (int scanner = 0; scanner < kScannerCount; ++scanner) {
    EXPECT_EQ(std::count(scan->scanner_of.begin(), scan->scanner_of.end(), scanner), 100);
  }
}

TEST(Scan, TheWallsOfTheHolesAreSeen) {
  ScanOptions options;
  options.point_count = 20000;
  const auto scan = ScanShape(Named("bracket"), options);
  ASSERT_TRUE(scan.ok());
  const auto near_axis = [&](double x, double y, double radius) {
    return std::count_if(scan->cloud.points.begin(), scan->cloud.points.end(), [&](const Vec3d& p) {
      return p.z < 10 && p.z > 2 && std::abs(std::hypot(p.x - x, p.y - y) - radius) < 0.3;
    });
  };
  EXPECT_GT(near_axis(30, 16, 7), 50);
  EXPECT_GT(near_axis(30, -16, 7), 50);
}

TEST(Scan, TheSameSeedGivesTheSameScanAndAnotherADifferentOne) {
  ScanOptions options;
  options.point_count = 500;
  const Shape shape = Named("bracket");
  const auto first = ScanShape(shape, options), second = ScanShape(shape, options);
  options.seed = 2;
  const auto third = ScanShape(shape, options);
  ASSERT_TRUE(first.ok() && second.ok() && third.ok());
  EXPECT_EQ(first->cloud.points, second->cloud.points);
  EXPECT_EQ(first->cloud.normals, second->cloud.normals);
  EXPECT_NE(first->cloud.points, third->cloud.points);
}

TEST(Scan, OptionsOutOfRangeAreNamed) {
  ScanOptions options;
  options.point_count = 5;
  EXPECT_THAT(std::string(ScanShape(Named("cube"), options).status().message()),
              ::testing::HasSubstr("got 5"));
  options.point_count = 500;
  options.noise = -0.5;
  EXPECT_FALSE(ScanShape(Named("cube"), options).ok());
  options.noise = std::nan("");
  EXPECT_FALSE(ScanShape(Named("cube"), options).ok());
}

// Times each directed edge is used; a closed manifold uses each once, and its reverse once.
std::map<std::pair<int, int>, int> EdgeUses(const TriangleMesh& mesh) {
  std::map<std::pair<int, int>, int> uses;
  for (const auto& t : mesh.triangles) {
    for (int i = 0; i < 3; ++i) ++uses[{t[i], t[(i + 1) % 3]}];
  }
  return uses;
}

double Volume(const TriangleMesh& mesh) {
  double sum = 0;
  for (const auto& t : mesh.triangles) {
    sum += Determinant(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]) / 6;
  }
  return sum;
}

TEST(Contour, SurfacesAreClosedManifoldsOrientedOutward) {
  for (const std::string& name : ShapeNames()) {
    const auto mesh = ContourShape(Named(name), kDefaultContourResolution);
    ASSERT_TRUE(mesh.ok());
    const auto uses = EdgeUses(*mesh);
    for (const auto& [edge, count] : uses) {
      ASSERT_EQ(count, 1) << name;
      ASSERT_EQ(uses.count({edge.second, edge.first}), 1u) << name;
    }
    EXPECT_GT(Volume(*mesh), 0) << name;
  }
}

TEST(Contour, VolumesAreThoseOfTheSolids) {
  const auto volume = [](const char* name) { return Volume(*ContourShape(Named(name), 60)); };
  const double pi = std::acos(-1.0);
  EXPECT_NEAR(volume("cube"), 1, 1e-6);
  EXPECT_NEAR(volume("sphere"), pi / 6, 2e-3);
  EXPECT_NEAR(volume("torus"), 2 * pi * pi * 0.5 * 0.04, 3e-3);
}

TEST(Contour, SharpCornersAreKept) {
  const auto mesh = ContourShape(Named("cube"), 20);
  ASSERT_TRUE(mesh.ok());
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3d wanted = {corner & 1 ? 0.5 : -0.5, corner & 2 ? 0.5 : -0.5,
                          corner & 4 ? 0.5 : -0.5};
    double nearest = 1;
    for (const Vec3d& v : mesh->vertices) nearest = std::min(nearest, Norm(v - wanted));
    EXPECT_LT(nearest, 1e-6);
  }
}

TEST(Contour, TheBracketHasOneHandlePerHole) {
  const auto mesh = ContourShape(Named("bracket"), kDefaultContourResolution);
  ASSERT_TRUE(mesh.ok());
  const auto vertices = static_cast<int64_t>(mesh->vertices.size());
  const auto faces = static_cast<int64_t>(mesh->triangles.size());
  const int64_t euler = vertices - faces * 3 / 2 + faces;
  EXPECT_EQ(1 - euler / 2, 5) << "genus";
}

TEST(Contour, RefusesResolutionsOutOfRange) {
  EXPECT_FALSE(ContourShape(Named("cube"), 7).ok());
  EXPECT_FALSE(ContourShape(Named("cube"), 401).ok());
}

}  // namespace
}  // namespace amhex::client
