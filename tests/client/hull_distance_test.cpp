#include "distance/hull_distance.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "distance/triangle_tree.h"
#include "formats/boundary_surface.h"
#include "test_cells.h"

namespace amhex::client {
namespace {

using ::testing::HasSubstr;

TriangleMesh RandomTriangles(int count, uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> place(-1, 1), size(-0.1, 0.1);
  TriangleMesh mesh;
  for (int i = 0; i < count; ++i) {
    const Vec3d corner{place(random), place(random), place(random)};
    for (int k = 0; k < 3; ++k) {
      mesh.vertices.push_back(corner + Vec3d{size(random), size(random), size(random)});
    }
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  return mesh;
}

// The surface of Block(n, 0), each vertex moved by `shift`.
TriangleMesh Surface(const AtMostHexaMesh& mesh, const Vec3d& shift) {
  TriangleMesh surface = Triangulated(*BoundarySurface(mesh));
  for (Vec3d& vertex : surface.vertices) vertex += shift;
  return surface;
}

bool TouchesHull(const AtMostHexaMesh& mesh, size_t cell) {
  return std::any_of(mesh.corners[cell].begin(), mesh.corners[cell].end(), [&](int32_t v) {
    const Vec3d& p = mesh.vertices[v];
    return std::min({p.x, p.y, p.z}) == 0 || std::max({p.x, p.y, p.z}) == 1;
  });
}

TEST(SquaredDistanceToTriangle, KnowsInsideEdgesAndCorners) {
  const Vec3d a{0, 0, 0}, b{2, 0, 0}, c{0, 2, 0};
  EXPECT_DOUBLE_EQ(SquaredDistanceToTriangle({0.5, 0.5, 3}, a, b, c), 9);
  EXPECT_DOUBLE_EQ(SquaredDistanceToTriangle({1, -2, 0}, a, b, c), 4);
  EXPECT_DOUBLE_EQ(SquaredDistanceToTriangle({3, -1, 1}, a, b, c), 3);
  EXPECT_NEAR(SquaredDistanceToTriangle({2, 2, 0}, a, b, c), 2, 1e-12);
}

TEST(SquaredDistanceToTriangle, TakesSegmentsAndPoints) {
  const Vec3d a{0, 0, 0}, b{2, 0, 0};
  EXPECT_DOUBLE_EQ(SquaredDistanceToTriangle({1, 1, 0}, a, b, b), 1);
  EXPECT_DOUBLE_EQ(SquaredDistanceToTriangle({3, 4, 0}, a, a, a), 25);
}

TEST(TriangleTree, FindsWhatTryingAllFinds) {
  for (int count : {1, 7, 8, 9, 500}) {
    const TriangleMesh mesh = RandomTriangles(count, static_cast<uint32_t>(count));
    const TriangleTree tree(mesh);
    std::mt19937 random(3);
    std::uniform_real_distribution<double> place(-2, 2);
    for (int i = 0; i < 200; ++i) {
      const Vec3d p{place(random), place(random), place(random)};
      double least = std::numeric_limits<double>::infinity();
      for (const auto& [a, b, c] : mesh.triangles) {
        least = std::min(least, SquaredDistanceToTriangle(p, mesh.vertices[a], mesh.vertices[b],
                                                          mesh.vertices[c]));
      }
      EXPECT_DOUBLE_EQ(tree.Find(p).distance, std::sqrt(least));
    }
  }
}

TEST(DistancesToInput, VanishOnTheSurfaceItselfAndAreNoneInside) {
  const AtMostHexaMesh mesh = Block(5, 4);
  const auto distances = DistancesToInput(mesh, Surface(mesh, {0, 0, 0}));
  ASSERT_TRUE(distances.ok()) << distances.status();
  ASSERT_EQ(distances->size(), mesh.corners.size());
  size_t measured = 0;
  for (size_t cell = 0; cell < distances->size(); ++cell) {
    if (std::isnan((*distances)[cell])) continue;
    ++measured;
    EXPECT_TRUE(TouchesHull(mesh, cell));
    EXPECT_LT((*distances)[cell], 1e-7);
  }
  EXPECT_GT(measured, 60u);
  EXPECT_LT(measured, mesh.corners.size()) << "there are cells inside";
}

TEST(DistancesToInput, OfAMovedSurfaceAreTheWayItWasMoved) {
  const AtMostHexaMesh mesh = Block(4, 0);
  const auto distances = DistancesToInput(mesh, Surface(mesh, {0, 0, 0.25}));
  ASSERT_TRUE(distances.ok()) << distances.status();
  float largest = 0;
  for (float distance : *distances) largest = std::max(largest, distance);
  EXPECT_NEAR(largest, 0.25, 1e-6);
}

// One bump of the surface between the mesh's vertices: only the cell below it knows.
TEST(DistancesToInput, BelongToTheCellThatIsNearest) {
  const AtMostHexaMesh mesh = Block(4, 0);
  TriangleMesh surface = Surface(mesh, {0, 0, 0});
  const auto first = static_cast<int32_t>(surface.vertices.size());
  surface.vertices.insert(surface.vertices.end(),
                          {{0.32, 0.35, 1.1}, {0.42, 0.35, 1.1}, {0.37, 0.43, 1.1}});
  surface.triangles.push_back({first, first + 1, first + 2});
  const auto distances = DistancesToInput(mesh, surface);
  ASSERT_TRUE(distances.ok()) << distances.status();
  for (size_t cell = 0; cell < distances->size(); ++cell) {
    const Vec3d centre = CentreOfCell(mesh.corners[cell], mesh.vertices);
    const bool below =
        centre.z > 0.8 && std::abs(centre.x - 0.375) < 0.01 && std::abs(centre.y - 0.375) < 0.01;
    if (below) {
      EXPECT_NEAR((*distances)[cell], 0.1, 1e-6);
    } else {
      EXPECT_FALSE((*distances)[cell] > 1e-6) << cell;
    }
  }
}

TEST(DistancesToInput, OfACloudAreThoseOfItsPoints) {
  const AtMostHexaMesh mesh = Block(3, 0);
  PointCloud cloud;
  cloud.points = {{0.5, 0.5, 1.125}, {0.5, 0.55, 1.25}, {-0.5, 0.1, 0.1}};
  const auto distances = DistancesToInput(mesh, cloud);
  ASSERT_TRUE(distances.ok()) << distances.status();
  std::vector<float> measured;
  for (float distance : *distances) {
    if (!std::isnan(distance)) measured.push_back(distance);
  }
  EXPECT_THAT(measured, ::testing::UnorderedElementsAre(0.25F, 0.5F));
}

TEST(DistancesToInput, RefuseEmptyBrokenAndForeignInputs) {
  const AtMostHexaMesh mesh = Block(2, 0);
  EXPECT_EQ(DistancesToInput(mesh, PointCloud()).status().code(),
            absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(DistancesToInput(mesh, TriangleMesh()).status().code(),
            absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(DistancesToInput(AtMostHexaMesh(), PointCloud()).status().code(),
            absl::StatusCode::kInvalidArgument);
  for (double bad :
       {std::numeric_limits<double>::quiet_NaN(), 1e300, std::numeric_limits<double>::infinity()}) {
    TriangleMesh surface = Surface(mesh, {0, 0, 0});
    surface.vertices[3].y = bad;
    EXPECT_THAT(std::string(DistancesToInput(mesh, surface).status().message()),
                HasSubstr("point 3"));
  }
  TriangleMesh in_millimetres = Surface(mesh, {0, 0, 0});
  for (Vec3d& vertex : in_millimetres.vertices) vertex *= 1000;
  EXPECT_THAT(std::string(DistancesToInput(mesh, in_millimetres).status().message()),
              HasSubstr("same unit"));
}

TEST(HullOfVolume, HasTheFacesOfOneCellOnly) {
  // Two unit cubes side by side.
  VolumeMesh volume;
  for (int z : {0, 1}) {
    for (int y : {0, 1}) {
      for (int x : {0, 1, 2}) volume.vertices.push_back({double(x), double(y), double(z)});
    }
  }
  for (int x : {0, 1}) {
    const int32_t a = x, b = x + 1, c = x + 4, d = x + 3;
    for (const std::array<int32_t, 4>& face : {std::array<int32_t, 4>{a, d, c, b},
                                               {a + 6, b + 6, c + 6, d + 6},
                                               {a, b, b + 6, a + 6},
                                               {b, c, c + 6, b + 6},
                                               {c, d, d + 6, c + 6},
                                               {d, a, a + 6, d + 6}}) {
      volume.face_corners.push_back(4);
      volume.corners.insert(volume.corners.end(), face.begin(), face.end());
    }
    volume.cell_faces.push_back(6);
  }
  const TriangleMesh hull = HullOfVolume(volume);
  EXPECT_EQ(hull.triangles.size(), 20u);
  double area = 0;
  for (const auto& [a, b, c] : hull.triangles) {
    area += Norm(Cross(hull.vertices[b] - hull.vertices[a], hull.vertices[c] - hull.vertices[a]));
  }
  EXPECT_DOUBLE_EQ(area / 2, 10);
}

}  // namespace
}  // namespace amhex::client
