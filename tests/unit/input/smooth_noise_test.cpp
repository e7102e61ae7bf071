// Noise larger than the distance of a cloud's points is evened out; everything else is left alone.
#include "input/smooth_noise.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "fixtures/damage.h"
#include "fixtures/solids.h"

namespace amhex {
namespace {

constexpr double kPi = 3.14159265358979;
constexpr size_t kSmoothedPoints = 6000;

// Normally distributed in every coordinate.
void AddNoise(double deviation, std::vector<Vec3d>* points) {
  fixtures::Chance chance(5);
  const auto normal = [&] {
    const double radius = std::sqrt(-2 * std::log(1 - chance.Unit()));
    return radius * std::cos(2 * kPi * chance.Unit());
  };
  for (Vec3d& p : *points) p += Vec3d{normal(), normal(), normal()} * deviation;
}

double DeviationFromSphere(const std::vector<Vec3d>& points) {
  double sum = 0;
  for (const Vec3d& p : points) sum += std::pow(Norm(p) - 1, 2);
  return std::sqrt(sum / static_cast<double>(points.size()));
}

// Points are 0.046 from each other.
PointCloud Sphere() {
  return fixtures::SampleSurface(fixtures::MakeSphere(1, 0.05), kSmoothedPoints, 1);
}

TEST(SmoothNoise, NoPointsAndFewAreLeftAsTheyAre) {
  RunContext run;
  std::vector<Vec3d> none, few = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const std::vector<Vec3d> before = few;
  EXPECT_EQ(SmoothNoise({}, run, none).value(), 0);
  EXPECT_EQ(SmoothNoise(std::vector<Vec3d>(4), run, few).value(), 0);
  EXPECT_EQ(few, before);
}

TEST(SmoothNoise, EqualPointsAreLeftAsTheyAre) {
  RunContext run;
  std::vector<Vec3d> points(50, Vec3d{1, 2, 3});
  const std::vector<Vec3d> before = points;
  EXPECT_EQ(SmoothNoise(std::vector<Vec3d>(50), run, points).value(), 0);
  EXPECT_EQ(points, before);
}

TEST(SmoothNoise, MostOfItGoesWhereItIsLargerThanThePointsDistance) {
  for (const bool with_normals : {true, false}) {
    RunContext run;
    PointCloud cloud = Sphere();
    if (!with_normals) cloud.normals.assign(cloud.points.size(), Vec3d{});
    AddNoise(0.06, &cloud.points);
    const double before = DeviationFromSphere(cloud.points);
    EXPECT_GT(SmoothNoise(cloud.normals, run, cloud.points).value(), 0);
    EXPECT_LT(DeviationFromSphere(cloud.points), 0.4 * before);
  }
}

TEST(SmoothNoise, WhereDensityDiffersThirtyfoldItGoesToo) {
  // At every other point 512 neighbours reach less far than the noise does.
  constexpr size_t kDense = 120'000;
  PointCloud cloud = fixtures::SampleSurface(fixtures::MakeSphere(1, 0.05), kDense, 1);
  fixtures::Chance chance(3);
  std::vector<Vec3d> points;
  for (const Vec3d& p : cloud.points) {
    if (chance.Unit() < std::pow(30.0, -(p.x + 1) / 2)) points.push_back(p);
  }
  AddNoise(0.08, &points);
  const double before = DeviationFromSphere(points);
  RunContext run;
  EXPECT_GT(SmoothNoise(std::vector<Vec3d>(points.size()), run, points).value(), 256);
  EXPECT_LT(DeviationFromSphere(points), 0.4 * before);
}

TEST(SmoothNoise, CleanAndSlightlyNoisyCloudsAreLeftAsTheyAre) {
  for (const double deviation : {0.0, 0.005, 0.015}) {
    RunContext run;
    PointCloud cloud = Sphere();
    AddNoise(deviation, &cloud.points);
    const std::vector<Vec3d> before = cloud.points;
    EXPECT_EQ(SmoothNoise(cloud.normals, run, cloud.points).value(), 0);
    EXPECT_EQ(cloud.points, before);
  }
}

TEST(SmoothNoise, TheTwoSidesOfAThinPlateAreNotTakenForNoise) {
  for (const bool with_normals : {true, false}) {
    RunContext run;
    // Points are 0.037 from each other, as far as the plate is thick.
    PointCloud cloud =
        fixtures::SampleSurface(fixtures::MakeBox({2, 2, 0.037}, 0.1), kSmoothedPoints, 1);
    if (!with_normals) cloud.normals.assign(cloud.points.size(), Vec3d{});
    const std::vector<Vec3d> before = cloud.points;
    EXPECT_EQ(SmoothNoise(cloud.normals, run, cloud.points).value(), 0);
    EXPECT_EQ(cloud.points, before);
  }
}

// Three of the points' distances thick, with noise of half a one.
TEST(SmoothNoise, HardlyAPointStaysBetweenTheSidesOfAWall) {
  constexpr double kInnerRadius = 0.83, kNoise = 0.028;
  RunContext run;
  std::vector<Vec3d> points = Sphere().points;
  for (const Vec3d& p :
       fixtures::SampleSurface(fixtures::MakeSphere(kInnerRadius, 0.05), 4 * kSmoothedPoints / 6, 2)
           .points) {
    points.push_back(p);
  }
  AddNoise(kNoise, &points);
  EXPECT_GT(SmoothNoise(std::vector<Vec3d>(points.size()), run, points).value(), 0);
  const double middle = (1 + kInnerRadius) / 2;
  const auto between = std::count_if(points.begin(), points.end(), [&](const Vec3d& p) {
    return std::abs(Norm(p) - middle) < (1 - kInnerRadius) / 4;
  });
  EXPECT_LT(static_cast<double>(between), 0.01 * static_cast<double>(points.size()));
}

TEST(SmoothNoise, RodsAreNotTakenForNoise) {
  RunContext run;
  PointCloud cloud =
      fixtures::SampleSurface(fixtures::MakeCylinder(0.03, 20, 0.03), kSmoothedPoints, 1);
  cloud.normals.assign(cloud.points.size(), Vec3d{});
  EXPECT_EQ(SmoothNoise(cloud.normals, run, cloud.points).value(), 0);
}

TEST(SmoothNoise, PointsThatFillABallAreLeftAsTheyAre) {
  RunContext run;
  fixtures::Chance chance(3);
  std::vector<Vec3d> points;
  while (points.size() < 3000) points.push_back(chance.Vector());
  EXPECT_EQ(SmoothNoise(std::vector<Vec3d>(points.size()), run, points).value(), 0);
}

TEST(SmoothNoise, SparseCloudsOfSlimSolidsAreLeftAsTheyAre) {
  RunContext run;
  PointCloud cloud = fixtures::SampleSurface(fixtures::MakeTorus(0.9, 0.3, 0.1), 250, 1);
  cloud.normals.assign(cloud.points.size(), Vec3d{});
  EXPECT_EQ(SmoothNoise(cloud.normals, run, cloud.points).value(), 0);
}

TEST(SmoothNoise, AStoppedRunEndsWithItsStatus) {
  RunContext run;
  run.RequestStop();
  PointCloud cloud = Sphere();
  EXPECT_EQ(SmoothNoise(cloud.normals, run, cloud.points).status().code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace amhex
