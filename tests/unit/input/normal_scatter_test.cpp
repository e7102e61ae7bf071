// Whether a cloud's normals or its points are the rougher ones, and rough normals evened out.
#include "input/normal_scatter.h"

#include <gtest/gtest.h>

#include <vector>

#include "fixtures/damage.h"
#include "fixtures/solids.h"
#include "input/cloud_samples.h"
#include "input/even_normals.h"

namespace amhex {
namespace {

// Points are 0.046 from each other.
constexpr size_t kScatteredPoints = 6000;
constexpr double kDistance = 0.046;

PointCloud Sphere() {
  PointCloud cloud = fixtures::SampleSurface(fixtures::MakeSphere(1, 0.05), kScatteredPoints, 1);
  for (size_t i = 0; i < kScatteredPoints; ++i) {
    cloud.normals[i] = cloud.points[i] = Normalized(cloud.points[i]);
  }
  return cloud;
}

PointCloud WithRoughNormals(PointCloud cloud, double roughness) {
  fixtures::Chance chance(7);
  for (Vec3d& n : cloud.normals) n = Normalized(n + chance.Vector() * roughness);
  return cloud;
}

PointCloud WithNoise(PointCloud cloud, double distances) {
  fixtures::Chance chance(9);
  for (Vec3d& p : cloud.points) p += chance.Vector() * (distances * kDistance);
  return cloud;
}

bool ScatterMore(const PointCloud& cloud) {
  RunContext run;
  return NormalsScatterMore(cloud.points, cloud.normals, PointTree(cloud.points), run).value();
}

// Mean distance of the normals to the sphere's.
double Roughness(const std::vector<Vec3d>& normals, const std::vector<Vec3d>& points) {
  double sum = 0;
  for (size_t i = 0; i < normals.size(); ++i) sum += Norm(normals[i] - Normalized(points[i]));
  return sum / static_cast<double>(normals.size());
}

TEST(NormalScatter, TellsWhichOfTheTwoIsTheRougherOne) {
  EXPECT_TRUE(ScatterMore(WithRoughNormals(Sphere(), 0.1)));
  EXPECT_FALSE(ScatterMore(WithNoise(Sphere(), 0.3)));
  EXPECT_FALSE(ScatterMore(WithNoise(WithRoughNormals(Sphere(), 0.1), 0.5)));
  EXPECT_TRUE(ScatterMore(WithNoise(WithRoughNormals(Sphere(), 0.4), 0.1)));
}

TEST(NormalScatter, OfFacetsAsWideAsThePointsAreApartIsTheirTurn) {
  EXPECT_TRUE(
      ScatterMore(fixtures::SampleSurface(fixtures::MakeSphere(1, 0.1), kScatteredPoints, 1)));
}

TEST(NormalScatter, DoesNotDependOnTheUnit) {
  for (const double unit : {1e-9, 1e9}) {
    PointCloud rough = WithRoughNormals(Sphere(), 0.1), noisy = WithNoise(Sphere(), 0.3);
    for (Vec3d& p : rough.points) p *= unit;
    for (Vec3d& p : noisy.points) p *= unit;
    EXPECT_TRUE(ScatterMore(rough)) << unit;
    EXPECT_FALSE(ScatterMore(noisy)) << unit;
  }
}

TEST(NormalScatter, OfFewPointsOrPointsInOnePlaceIsNone) {
  EXPECT_FALSE(ScatterMore({}));
  EXPECT_FALSE(ScatterMore({{{0, 0, 0}, {1, 0, 0}}, {{0, 0, 1}, {1, 0, 0}}}));
  PointCloud one;
  one.points.assign(20, Vec3d{1, 1, 1});
  one.normals.assign(20, Vec3d{0, 0, 1});
  EXPECT_FALSE(ScatterMore(one));
}

TEST(NormalScatter, AStoppedRunEndsWithItsStatus) {
  const PointCloud sphere = Sphere();
  const PointTree tree(sphere.points);
  RunContext run;
  run.RequestStop();
  EXPECT_EQ(NormalsScatterMore(sphere.points, sphere.normals, tree, run).status().code(),
            absl::StatusCode::kCancelled);
  std::vector<Vec3d> normals = sphere.normals;
  EXPECT_EQ(EvenOutNormals(sphere.points, tree, run, normals).code(), absl::StatusCode::kCancelled);
}

TEST(GivenNormals, RoughOnesAreEvenedOut) {
  const PointCloud rough = WithRoughNormals(Sphere(), 0.3);
  RunContext run;
  std::vector<std::string> warnings;
  const CloudSamples samples = PrepareCloud(rough, run, warnings).value();
  ASSERT_EQ(samples.position, rough.points);
  EXPECT_LT(Roughness(samples.normal, rough.points), Roughness(rough.normals, rough.points) / 4);
}

TEST(GivenNormals, GoodOnesOfNoisyPointsStayAsTheyAre) {
  const PointCloud noisy = WithNoise(Sphere(), 0.5);
  RunContext run;
  std::vector<std::string> warnings;
  const CloudSamples samples = PrepareCloud(noisy, run, warnings).value();
  ASSERT_EQ(samples.position, noisy.points);
  for (size_t i = 0; i < kScatteredPoints; ++i) {
    EXPECT_LT(Norm(samples.normal[i] - noisy.normals[i]), 1e-12) << i;
  }
}

}  // namespace
}  // namespace amhex
