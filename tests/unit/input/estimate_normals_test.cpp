// Normals of clouds without: along the true ones, and outward whatever the highest point looks
// like.
#include "input/estimate_normals.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "fixtures/damage.h"
#include "fixtures/solids.h"

namespace amhex {
namespace {

constexpr size_t kEstimatedPoints = 1500;

// Share of the points whose estimated normal looks out of the solid.
double ShareLookingOut(const PointCloud& cloud) {
  RunContext run;
  const auto normals = EstimateNormals(cloud.points, run);
  EXPECT_TRUE(normals.ok());
  double out = 0;
  for (size_t i = 0; i < cloud.points.size(); ++i) {
    EXPECT_NEAR(Norm((*normals)[i]), 1, 1e-9);
    out += Dot((*normals)[i], cloud.normals[i]) > 0 ? 1 : 0;
  }
  return out / static_cast<double>(cloud.points.size());
}

TEST(EstimateNormals, NoPointsHaveNone) {
  RunContext run;
  EXPECT_TRUE(EstimateNormals({}, run).value().empty());
}

TEST(EstimateNormals, LookOutOfEveryBody) {
  const TriangleMesh ball = fixtures::MakeSphere(1, 0.1);
  const TriangleMesh two = fixtures::Joined(ball, fixtures::Translated(ball, {5, 1, 0}));
  EXPECT_EQ(ShareLookingOut(fixtures::SampleSurface(two, kEstimatedPoints, 1)), 1);
}

// Which way the highest points look is chance if they stand upright, as noise may make them.
TEST(EstimateNormals, LookOutOfABallWithAFlagOnTop) {
  for (uint32_t seed = 1; seed <= 20; ++seed) {
    PointCloud ball = fixtures::SampleSurface(fixtures::MakeSphere(1, 0.1), kEstimatedPoints, seed);
    for (int i = 0; i < 25; ++i) {
      ball.points.push_back({0, 0.05 * (i % 5 - 2), 1.05 + 0.05 * (i / 5)});
      ball.normals.push_back({1, 0, 0});
    }
    EXPECT_GT(ShareLookingOut(ball), 0.95) << seed;
  }
}

// Of the estimated normals to the true ones, degrees, of clouds whose points noise moves.
std::vector<double> Errors(const TriangleMesh& surface, double deviation) {
  PointCloud cloud = fixtures::SampleSurface(surface, 4 * kEstimatedPoints, 1);
  fixtures::Chance chance(3);
  for (Vec3d& p : cloud.points) p += (chance.Vector() + chance.Vector()) * deviation;
  RunContext run;
  const auto normals = EstimateNormals(cloud.points, run);
  EXPECT_TRUE(normals.ok());
  std::vector<double> errors;
  for (size_t i = 0; i < cloud.points.size(); ++i) {
    const double cosine = std::clamp(Dot((*normals)[i], cloud.normals[i]), -1.0, 1.0);
    errors.push_back(std::acos(cosine) * 180 / 3.14159265358979);
  }
  std::sort(errors.begin(), errors.end());
  return errors;
}

// The points are 0.046 apart: without averaging half of the normals are off by more than 8.8
// degrees, one in ten by more than 17.
TEST(EstimateNormals, NoiseOfHalfTheDistanceOfThePointsIsEvenedOut) {
  const std::vector<double> errors = Errors(fixtures::MakeSphere(1, 0.1), 0.025);
  EXPECT_LT(errors[errors.size() / 2], 5);
  EXPECT_LT(errors[errors.size() * 9 / 10], 10);
}

TEST(EstimateNormals, FacesOfABoxKeepTheirsUpToItsEdges) {
  const std::vector<double> errors = Errors(fixtures::MakeBox({1, 1, 1}, 0.1), 0);
  EXPECT_LT(errors[errors.size() * 6 / 10], 1e-3);  // a third lies next to an edge
}

TEST(EstimateNormals, AStoppedRunEndsWithItsStatus) {
  RunContext run;
  run.RequestStop();
  EXPECT_EQ(EstimateNormals({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, run).status().code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace amhex
