#include "formats/draco_encoder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "formats/hull_reader.h"

namespace amhex::client {
namespace {

PointCloud RandomCloud(int count, double size, const Vec3d& origin) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> uniform(0, size);
  PointCloud cloud;
  for (int i = 0; i < count; ++i) {
    cloud.points.push_back(origin + Vec3d{uniform(random), uniform(random), uniform(random)});
  }
  return cloud;
}

// Largest distance from a point to the nearest decoded one. Draco reorders points.
double LargestError(const std::vector<Vec3d>& points, const std::vector<Vec3d>& decoded) {
  double largest = 0;
  for (const Vec3d& p : points) {
    double nearest = 1e300;
    for (const Vec3d& q : decoded) nearest = std::min(nearest, Norm(p - q));
    largest = std::max(largest, nearest);
  }
  return largest;
}

struct Case {
  double size;
  Vec3d origin;
  double tolerance;
};

TEST(DracoEncoder, NoPointMovesByMoreThanTheTolerance) {
  const Case cases[] = {{1, {0, 0, 0}, 1e-2},  {1, {0, 0, 0}, 1e-5},    {1e-6, {0, 0, 0}, 1e-9},
                        {1e6, {0, 0, 0}, 100}, {1, {1000, 0, 0}, 1e-3}, {1, {1e7, -1e7, 0}, 1e-4},
                        {1, {3, 3, 3}, 1e-12}, {1, {0, 0, 0}, 0}};
  for (const Case& c : cases) {
    const PointCloud cloud = RandomCloud(300, c.size, c.origin);
    const auto encoding = EncodeDraco(cloud, c.tolerance);
    ASSERT_TRUE(encoding.ok()) << encoding.status();
    const auto hull = ReadDraco(encoding->bytes);
    ASSERT_TRUE(hull.ok()) << encoding->description << ": " << hull.status();
    const auto& decoded = std::get<PointCloud>(*hull).points;
    ASSERT_EQ(decoded.size(), cloud.points.size());
    EXPECT_LE(LargestError(cloud.points, decoded), c.tolerance) << encoding->description;
    EXPECT_LE(encoding->max_error, c.tolerance) << encoding->description;
    EXPECT_LE(LargestError(cloud.points, decoded), encoding->max_error) << encoding->description;
  }
}

TEST(DracoEncoder, SurfacesKeepTheToleranceToo) {
  const PointCloud cloud = RandomCloud(90, 1, {5, 5, 5});
  TriangleMesh mesh{cloud.points, {}};
  for (int i = 0; i + 2 < 90; i += 3) mesh.triangles.push_back({i, i + 1, i + 2});
  for (double tolerance : {1e-3, 1e-5, 0.0}) {
    const auto encoding = EncodeDraco(mesh, tolerance);
    ASSERT_TRUE(encoding.ok()) << encoding.status();
    const auto hull = ReadDraco(encoding->bytes);
    ASSERT_TRUE(hull.ok()) << hull.status();
    const auto& decoded = std::get<TriangleMesh>(*hull);
    EXPECT_EQ(decoded.triangles.size(), mesh.triangles.size());
    EXPECT_LE(LargestError(mesh.vertices, decoded.vertices), tolerance) << encoding->description;
  }
}

TEST(DracoEncoder, CoarserToleranceTakesFewerBits) {
  const PointCloud cloud = RandomCloud(500, 1, {});
  int previous_bits = 31;
  size_t previous_size = std::numeric_limits<size_t>::max();
  for (double tolerance : {1e-5, 1e-4, 1e-3, 1e-2}) {
    const auto encoding = EncodeDraco(cloud, tolerance);
    ASSERT_TRUE(encoding.ok());
    EXPECT_LT(encoding->quantization_bits, previous_bits);
    EXPECT_LT(encoding->bytes.size(), previous_size);
    previous_bits = encoding->quantization_bits;
    previous_size = encoding->bytes.size();
  }
}

TEST(DracoEncoder, FarFromTheOriginSixtyFourBitsAreKeptAndSaid) {
  const auto encoding = EncodeDraco(RandomCloud(50, 1, {1e8, 0, 0}), 1e-3);
  ASSERT_TRUE(encoding.ok());
  EXPECT_TRUE(encoding->is_double);
  EXPECT_THAT(encoding->description, ::testing::HasSubstr("64-bit"));
}

TEST(DracoEncoder, NormalsSurviveQuantisation) {
  PointCloud cloud = RandomCloud(200, 1, {});
  for (Vec3d& p : cloud.points) {
    p = Normalized(p - Vec3d{0.5, 0.5, 0.5});
    cloud.normals.push_back(p * 7.0);
  }
  const auto encoding = EncodeDraco(cloud, 1e-3);
  ASSERT_TRUE(encoding.ok());
  const auto hull = ReadDraco(encoding->bytes);
  ASSERT_TRUE(hull.ok());
  const auto& decoded = std::get<PointCloud>(*hull);
  ASSERT_EQ(decoded.normals.size(), 200u);
  for (size_t i = 0; i < 200; ++i) {
    EXPECT_LT(Norm(Normalized(decoded.normals[i]) - decoded.points[i]), 5e-3);
  }
}

TEST(DracoEncoder, EqualPointsAreNotMerged) {
  PointCloud cloud;
  cloud.points.assign(20, {1, 2, 3});
  const auto encoding = EncodeDraco(cloud, 1e-3);
  ASSERT_TRUE(encoding.ok()) << encoding.status();
  const auto hull = ReadDraco(encoding->bytes);
  ASSERT_TRUE(hull.ok()) << hull.status();
  EXPECT_EQ(std::get<PointCloud>(*hull).points.size(), 20u);
}

TEST(DracoEncoder, RefusesNothingAndNumbersThatAreNotFinite) {
  EXPECT_FALSE(EncodeDraco(PointCloud{}, 0).ok());
  EXPECT_FALSE(EncodeDraco(PointCloud{{{0, std::nan(""), 0}}, {}}, 0).ok());
}

TEST(EstimatedEdgeLength, OfACloudDoesNotGrowWithAFewStrayPoints) {
  PointCloud cloud;
  for (int i = 0; i < 1000; ++i) {
    cloud.points.push_back({i % 10 / 10.0, i / 10 % 10 / 10.0, i / 100 / 10.0});
  }
  const double clean = EstimatedEdgeLength(cloud, 1000);
  EXPECT_GT(clean, 0);
  for (int i = 0; i < 40; ++i) cloud.points.push_back({1e6 * (i % 3 - 1), 1e6, -1e6 * (i % 2)});
  EXPECT_NEAR(EstimatedEdgeLength(cloud, 1000), clean, 0.2 * clean);
}

TEST(EstimatedEdgeLength, OfACubeIsItsSideOverTheCellsPerSide) {
  TriangleMesh cube;
  for (int i = 0; i < 8; ++i) {
    cube.vertices.push_back({i & 1 ? 2.0 : 0.0, i & 2 ? 2.0 : 0.0, i & 4 ? 2.0 : 0.0});
  }
  cube.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  EXPECT_NEAR(EstimatedEdgeLength(cube, 1000), 0.2, 1e-12);
}

}  // namespace
}  // namespace amhex::client
